// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/ray_cast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"
#include "support/same_bits.h"

// Random rays against exact oracles: tests/property/ray_cast_soak.cpp.
namespace dyop::testing {
namespace {

constexpr Scalar kNoise = 2e-12;

TEST(RayCast, MeetsASphereWhereTheQuadraticSays) {
  const Sphere sphere(1);
  const RigidPose X_WS(Vector3(5, 0, 0));
  const RayHit ahead = ray_cast(sphere, X_WS, {.direction_W = Vector3(3, 0, 0)});
  EXPECT_EQ(ahead.status, RayStatus::Hit);
  EXPECT_LE(ahead.distance, 4);
  EXPECT_NEAR(ahead.distance, 4, kNoise);
  EXPECT_TRUE(ahead.p_WC.isApprox(Vector3(4, 0, 0), kNoise));
  EXPECT_TRUE(ahead.nhat_W.isApprox(Vector3(-1, 0, 0), kNoise));
  // Off the centre by 0.6 the sphere ends 0.8 before it.
  const RayHit beside = ray_cast(sphere, X_WS, {.p_W = Vector3(0, 0.6, 0)});
  EXPECT_NEAR(beside.distance, 4.2, kNoise);
  EXPECT_TRUE(beside.nhat_W.isApprox(Vector3(-0.8, 0.6, 0), 1e-7));
  // A ball of radius 0.5 meets it like a point meets a sphere of 1.5.
  const RayHit thick = ray_cast(sphere, X_WS, {.p_W = Vector3(0, 0.9, 0), .radius = 0.5});
  EXPECT_NEAR(thick.distance, 3.8, kNoise);
  EXPECT_LE(thick.gap, kNoise);
  EXPECT_EQ(ray_cast(sphere, X_WS, {.p_W = Vector3(0, 1.01, 0)}).status, RayStatus::Miss);
  EXPECT_EQ(ray_cast(sphere, X_WS, {.direction_W = -Vector3::UnitX()}).status, RayStatus::Miss);
}

TEST(RayCast, ThinRaysMeetTrianglesAndNameThem) {
  const TriangleMesh box = box_mesh({1, 1, 1}).mesh();
  const RigidPose X_WS(Vector3(0, 0, 10));
  const RayHit hit = ray_cast(box, X_WS, {.p_W = Vector3(0.2, 0.3, 0), .direction_W = {0, 0, 1}});
  EXPECT_EQ(hit.status, RayStatus::Hit);
  EXPECT_NEAR(hit.distance, 9, kNoise);
  EXPECT_TRUE(hit.p_WC.isApprox(Vector3(0.2, 0.3, 9), kNoise));
  EXPECT_TRUE(hit.nhat_W.isApprox(Vector3(0, 0, -1), kNoise));
  EXPECT_EQ(hit.feature.kind, FeatureKind::Face);
  ASSERT_TRUE(hit.triangle);
  for (const Vector3& corner : box.triangle(*hit.triangle)) EXPECT_EQ(corner.z(), -1);
  // From within, a closed mesh is met from behind.
  const RayHit within = ray_cast(box, X_WS, {.p_W = Vector3(0, 0.1, 10)});
  EXPECT_NEAR(within.distance, 1, kNoise);
  EXPECT_TRUE(within.nhat_W.isApprox(Vector3(-1, 0, 0), kNoise));
}

TEST(RayCast, EndsAtItsLength) {
  const Box box({1, 1, 1});
  const RigidPose X_WS(Vector3(10, 0, 0));
  const RayHit just_short = ray_cast(box, X_WS, {.length = 9 - 1e-9});
  EXPECT_EQ(just_short.status, RayStatus::Miss);
  EXPECT_EQ(just_short.distance, 9 - 1e-9);
  EXPECT_EQ(ray_cast(box, X_WS, {.length = 9 + 1e-9}).status, RayStatus::Hit);
  EXPECT_EQ(ray_cast(box, X_WS, {.p_W = Vector3(0, 5, 0)}).distance, kInfinity);
  EXPECT_EQ(ray_cast(box, X_WS, {.p_W = Vector3(9, 0, 0), .length = 0}).status,
            RayStatus::InitiallyTouching);
}

TEST(RayCast, StartsInsideASolid) {
  const RayHit hit = ray_cast(Box({1, 1, 1}), RigidPose(), {.p_W = Vector3(0.5, 0, 0)});
  EXPECT_EQ(hit.status, RayStatus::InitiallyTouching);
  EXPECT_EQ(hit.distance, 0);
}

// No ray from within leaves a closed mesh: aimed at vertices, at points of edges, and along them.
TEST(RayCast, NeverPassesThroughEdgesOrVertices) {
  std::mt19937_64 random(3);
  for (const MeshArrays& arrays :
       {icosphere(2), torus(1, 0.4, 16, 8), box_mesh({1, 0.5, 0.2}), gear(9, 0.8, 1, 0.2)}) {
    const TriangleMesh mesh = arrays.mesh();
    for (const Scalar far : {0.0, 1e4}) {
      const RigidPose X_WS(random_rotation(random), far * random_direction(random));
      for (int k = 0; k < 300; ++k) {
        const Triangle t = mesh.triangle(random_index(int(mesh.triangles().size()), random));
        const Scalar weight = k % 3 == 0 ? 0 : random_number(0, 1, random);
        const Vector3 target = X_WS * Vector3(t[0] + weight * (t[1] - t[0]));
        const Vector3 start = target + random_magnitude(-3, 1, random) * random_direction(random);
        const Ray ray{.p_W = start, .direction_W = target - start};
        const RayHit hit = ray_cast(mesh, X_WS, ray);
        ASSERT_NE(hit.status, RayStatus::Miss);
        ASSERT_LE(hit.distance, (target - start).norm() * (1 + 4 * kUnitRoundoff));
      }
    }
  }
}

TEST(RayCast, ThickRaysMeetEdgesAndVertices) {
  const TriangleMesh sheet({{0, 0, 0}, {0, 4, 0}, {0, 0, 4}}, {{0, 1, 2}});
  // 0.3 below the edge from 0 to 1 the ball of radius 0.5 touches it 0.4 before.
  const RayHit edge = ray_cast(sheet, RigidPose(), {.p_W = {-2, 1, -0.3}, .radius = 0.5});
  EXPECT_NEAR(edge.distance, 1.6, kNoise);
  EXPECT_EQ(edge.feature.kind, FeatureKind::Edge);
  EXPECT_TRUE(edge.nhat_W.isApprox(Vector3(-0.8, 0, -0.6), 1e-9));
  const RayHit vertex = ray_cast(sheet, RigidPose(), {.p_W = {-2, -0.3, 0}, .radius = 0.5});
  EXPECT_NEAR(vertex.distance, 1.6, kNoise);
  EXPECT_EQ(vertex.feature.kind, FeatureKind::Vertex);
  const RayHit face = ray_cast(sheet, RigidPose(), {.p_W = {-2, 1, 1}, .radius = 0.5});
  EXPECT_NEAR(face.distance, 1.5, kNoise);
  EXPECT_EQ(ray_cast(sheet, RigidPose(), {.p_W = {-2, 1, -0.51}, .radius = 0.5}).status,
            RayStatus::Miss);
}

TEST(RayCast, NamesTheChildOfACompound) {
  const auto ball = std::make_shared<Sphere>(1);
  const auto mesh = std::make_shared<TriangleMesh>(box_mesh({1, 1, 1}).mesh());
  const CompoundShape compound({{ball, RigidPose(Vector3(9, 0, 0))}, {mesh, RigidPose()}});
  const RayHit first = ray_cast(compound, RigidPose(), {.p_W = {-5, 0.1, 0.2}});
  EXPECT_EQ(first.child, 1);
  EXPECT_TRUE(first.triangle);
  EXPECT_NEAR(first.distance, 4, kNoise);
  const RayHit second = ray_cast(compound, RigidPose(), {.p_W = {3, 0, 0}});
  EXPECT_EQ(second.child, 0);
  EXPECT_FALSE(second.triangle);
  EXPECT_NEAR(second.distance, 5, kNoise);
}

// A shape whose support function knows nothing.
class Broken final : public ConvexShape {
 public:
  SupportPoint core_support(const Vector3&) const override {
    return {Vector3::Constant(std::numeric_limits<Scalar>::quiet_NaN()), std::nullopt};
  }
  Vector3 core_center() const override { return Vector3::Zero(); }
  AlignedBox bounding_box() const override { return {-Vector3::Ones(), Vector3::Ones()}; }
  Scalar bounding_radius() const override { return 2; }
  MassProperties compute_mass_properties(Scalar) const override { return {}; }
};

TEST(RayCast, IsUndecidedWhereNothingIsKnown) {
  const RayHit hit = ray_cast(Broken(), RigidPose(), {.p_W = {-5, 0, 0}});
  EXPECT_EQ(hit.status, RayStatus::NumericalLimit);
  EXPECT_LE(hit.distance, 4);
  EXPECT_GT(hit.distance, 3.9);
}

TEST(RayCast, BatchesGiveTheSameBits) {
  std::mt19937_64 random(5);
  const TriangleMesh mesh = torus(1, 0.4, 16, 8).mesh();
  const RigidPose X_WS = random_pose(1, random);
  std::vector<Ray> rays(700);
  for (Ray& ray : rays) {
    ray = {.p_W = random_vector(3, random), .direction_W = random_direction(random)};
    ray.radius = random_number(-0.3, 0.3, random);
    if (ray.radius < 0) ray.radius = 0;
  }
  std::vector<RayHit> hits(rays.size());
  std::size_t last = 0;
  BatchOptions options;
  options.progress = [&](std::size_t done, std::size_t) { last = done; };
  ray_cast_batch(mesh, X_WS, rays, hits, options);
  EXPECT_EQ(last, rays.size());
  int hit_count = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const RayHit alone = ray_cast(mesh, X_WS, rays[i]);
    EXPECT_EQ(hits[i].status, alone.status);
    EXPECT_EQ(hits[i].distance, alone.distance);
    EXPECT_EQ(hits[i].p_WC, alone.p_WC);
    hit_count += alone.status == RayStatus::Hit;
  }
  EXPECT_GT(hit_count, 20);
  EXPECT_LT(hit_count, 600);
}

TEST(RayCast, RefusesRaysThatAreNone) {
  const Sphere sphere(1);
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  const auto message = [&](const Ray& ray) {
    return message_of<InvalidArgument>([&] { ray_cast(sphere, RigidPose(), ray); });
  };
  EXPECT_NE(message({.p_W = {nan, 0, 0}}).find("p_W must be finite"), std::string::npos);
  EXPECT_NE(message({.direction_W = {0, 0, 0}}).find("not zero"), std::string::npos);
  EXPECT_NE(message({.direction_W = {kInfinity, 0, 0}}).find("finite"), std::string::npos);
  EXPECT_NE(message({.length = -1}).find("-1"), std::string::npos);
  EXPECT_NE(message({.length = nan}).find("nan"), std::string::npos);
  EXPECT_NE(message({.radius = kInfinity}).find("inf"), std::string::npos);
  std::vector<Ray> rays(3);
  rays[1].length = -2;
  std::vector<RayHit> hits(3);
  const std::string batch =
      message_of<InvalidArgument>([&] { ray_cast_batch(sphere, RigidPose(), rays, hits); });
  EXPECT_NE(batch.find("ray 1"), std::string::npos) << batch;
  hits.resize(2);
  EXPECT_THROW(ray_cast_batch(sphere, RigidPose(), rays, hits), InvalidArgument);
}

TEST(RayCast, DirectionsOfAnyLengthMeanTheSame) {
  const Sphere sphere(1);
  for (const Scalar length : {1e-300, 1e-5, 1e5, 1e300}) {
    const RayHit hit = ray_cast(sphere, RigidPose(),
                                {.p_W = {-5, 0, 0}, .direction_W = length * Vector3::UnitX()});
    EXPECT_NEAR(hit.distance, 4, kNoise);
  }
}

TEST(RayCast, ResultsHaveAText) {
  std::ostringstream out;
  out << ray_cast(Sphere(1), RigidPose(Vector3(3, 0, 0)), {});
  EXPECT_EQ(out.str().substr(0, 8), "Hit at 2") << out.str();
  EXPECT_EQ(name_of(RayStatus::NumericalLimit), "NumericalLimit");
}

}  // namespace
}  // namespace dyop::testing
