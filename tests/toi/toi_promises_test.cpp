// SPDX-License-Identifier: BSD-3-Clause

// Every status of every kind of query, held to the table at ToiStatus: by its members, and by the
// distance at many times, which distance() measures on shapes put where the motions say.

#include "support/oracles/toi_promises.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>
#include <stop_token>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "dyop/toi/vertex_time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using testing::DistanceBracket;
using testing::MeshArrays;
using testing::PromiseTerms;

constexpr int kPromiseSamples = 200;
constexpr TimeInterval kPromised{2, 3};
constexpr Scalar kTolerance = 1e-6;  // literal: of sides of about one

// B begins `gap` above A and moves up at `speed`.
struct Setting {
  const char* name;
  ToiStatus expected;
  Scalar gap;
  Scalar speed;
  Scalar tolerance = kTolerance;
  std::int64_t budget = 1'000'000;
  bool is_cancelled = false;

  ToiOptions options() const {
    ToiOptions options;
    options.distance_tolerance = tolerance;
    options.max_node_pairs = budget;
    options.with_contacts = true;
    std::stop_source source;
    if (is_cancelled) source.request_stop();
    options.stop = source.get_token();
    return options;
  }
};

const Setting kSettings[] = {
    {"Separated", ToiStatus::Separated, 0.5, 1},
    {"resting", ToiStatus::Separated, 0.5 * kTolerance, 0},
    {"Impact", ToiStatus::Impact, 0.5, -1},
    {"ImpactAtTheStart", ToiStatus::Impact, 0.4 * kTolerance, -1},
    {"InitiallyWithinTarget", ToiStatus::InitiallyWithinTarget, 0.1 * kTolerance, 1},
    {"crossing", ToiStatus::InitiallyWithinTarget, -0.1, -1},
    {"crossing at absurd speed", ToiStatus::InitiallyWithinTarget, -0.1, -1e12},
    {"BudgetExhausted", ToiStatus::BudgetExhausted, 0.5, -1, kTolerance, 1},
    {"Cancelled", ToiStatus::Cancelled, 0.5, -1, kTolerance, 1'000'000, true},
    {"NumericalLimit", ToiStatus::NumericalLimit, 0.5, -1, 1e-17},
};

// The frame of a setting: A's upper side is the plane through the origin of a turned frame.
class ToiPromises : public ::testing::TestWithParam<Setting> {
 protected:
  const Setting& setting() const { return GetParam(); }
  // The first pair of pieces examined need not be the one that crosses, and at such a speed none of
  // the others is proven apart.
  ToiStatus expected_of_meshes() const {
    const bool is_absurd = std::abs(setting().speed) > 1e9;
    return is_absurd ? ToiStatus::NumericalLimit : setting().expected;
  }
  Vector3 up() const { return X_.rotation().col(2); }

  // Where B's origin begins so that its points are `gap` above A.
  Vector3 start_of(const std::vector<Vector3>& points_W) const {
    Scalar lowest = kInfinity;
    for (const Vector3& p : points_W) lowest = std::min(lowest, up().dot(p));
    return X_.translation() + (setting().gap - lowest) * up();
  }
  // Rising, and turning about the normal of A.
  ConstantTwistMotion motion_of_b(const std::vector<Vector3>& points) const {
    std::vector<Vector3> turned = points;
    for (Vector3& p : turned) p = X_.rotation() * p;
    return ConstantTwistMotion(RigidPose(X_.rotation(), start_of(turned)),
                               {setting().speed * up(), up()}, kPromised.begin);
  }

  template <typename Options, typename Result, typename DistanceAt>
  void check(const Options& options, const Result& result, const DistanceAt& distance_at,
             ToiStatus expected) const {
    const PromiseTerms terms(kPromised, options);
    EXPECT_EQ(result.status, expected);
    EXPECT_STREQ(testing::broken_form(terms, result), nullptr);
    EXPECT_STREQ(testing::broken_distance(terms, result, kPromiseSamples, distance_at), nullptr);
  }

  static DistanceBracket bracket(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                 const RigidPose& X_WB) {
    const DistanceResult result = distance(a, X_WA, b, X_WB);
    return {result.lower, result.upper};
  }

  void check_rigid(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                   ToiStatus expected) const {
    const auto distance_at = [&](Scalar t) { return bracket(a, X_WA.pose(t), b, X_WB.pose(t)); };
    const ToiOptions options = setting().options();
    const ToiResult result = time_of_impact(a, X_WA, b, X_WB, kPromised, options);
    check(options, result, distance_at, expected);
    EXPECT_EQ(result.X_WA.translation(), X_WA.pose(result.t_safe).translation());
    EXPECT_EQ(result.X_WB.translation(), X_WB.pose(result.t_safe).translation());
    // In a batch, and in one that is stopped before it begins.
    const std::vector<ToiQuery> queries(1, {&a, &X_WA, &b, &X_WB, kPromised, options});
    std::vector<ToiResult> results(1);
    time_of_impact_batch(queries, results);
    check(options, results[0], distance_at, expected);
    BatchOptions stopped;
    std::stop_source source;
    source.request_stop();
    stopped.stop = source.get_token();
    time_of_impact_batch(queries, results, stopped);
    check(options, results[0], distance_at, ToiStatus::NotRun);
  }

  const RigidPose X_{Matrix3(Eigen::AngleAxisd(1.1, Vector3(1, -2, 0.5).normalized())),
                     Vector3(0.7, -0.3, 0.4)};
};

TEST_P(ToiPromises, HoldBetweenConvexShapes) {
  const std::vector<Vector3> points = testing::icosphere(1).vertices;
  const RestMotion X_WA(RigidPose(X_.rotation(), X_.translation() - 0.5 * up()));
  check_rigid(Box(Vector3(2, 2, 0.5)), X_WA, ConvexHull(points), motion_of_b(points),
              setting().expected);
}

TEST_P(ToiPromises, HoldBetweenRigidMeshes) {
  const MeshArrays sphere = testing::icosphere(2);
  const TriangleMesh plate = testing::plate_grid(4, 4, 6, 6).mesh();
  check_rigid(plate, RestMotion(X_), sphere.mesh(), motion_of_b(sphere.vertices),
              expected_of_meshes());
}

// A plate that stretches in its own plane, world frame.
DeformingMesh stretching_plate(const RigidPose& X) {
  const MeshArrays plate = testing::plate_grid(4, 4, 6, 6);
  std::vector<Vector3> begin;
  std::vector<Vector3> end;
  for (const Vector3& p : plate.vertices) {
    begin.push_back(X * p);
    end.push_back(X * Vector3(1.1 * p.x() + 0.1 * p.y(), 0.9 * p.y(), p.z()));
  }
  return DeformingMesh(begin, end, plate.triangles);
}

// By the definition of DeformingMesh.
TriangleMesh placed(const DeformingMesh& mesh, Scalar t) {
  const Scalar s = (t - kPromised.begin) / kPromised.length();
  std::vector<Vector3> places;
  for (std::size_t i = 0; i < mesh.begin().size(); ++i) {
    places.push_back((1 - s) * mesh.begin()[i] + s * mesh.end()[i]);
  }
  return TriangleMesh(places, {mesh.triangles().begin(), mesh.triangles().end()});
}

TEST_P(ToiPromises, HoldBetweenDeformingMeshes) {
  const MeshArrays sphere = testing::icosphere(2);
  const DeformingMesh a = stretching_plate(X_);
  std::vector<Vector3> begin;
  for (const Vector3& p : sphere.vertices) begin.push_back(p + start_of(sphere.vertices));
  std::vector<Vector3> end = begin;
  for (Vector3& p : end) p += setting().speed * up();
  const DeformingMesh b(begin, end, sphere.triangles);
  const ToiOptions options = setting().options();
  const ToiResult result = time_of_impact(a, b, kPromised, options);
  check(
      options, result,
      [&](Scalar t) { return bracket(placed(a, t), RigidPose(), placed(b, t), RigidPose()); },
      expected_of_meshes());
  EXPECT_EQ(result.X_WA.translation(), Vector3::Zero());
  EXPECT_EQ(result.X_WB.translation(), Vector3::Zero());
}

TEST_P(ToiPromises, HoldBetweenADeformingAndARigidMesh) {
  const MeshArrays sphere = testing::icosphere(2);
  const DeformingMesh a = stretching_plate(X_);
  const TriangleMesh b = sphere.mesh();
  const ConstantTwistMotion X_WB = motion_of_b(sphere.vertices);
  const ToiOptions options = setting().options();
  const ToiResult result = time_of_impact(a, b, X_WB, kPromised, options);
  check(
      options, result,
      [&](Scalar t) { return bracket(placed(a, t), RigidPose(), b, X_WB.pose(t)); },
      expected_of_meshes());
  EXPECT_EQ(result.X_WA.translation(), Vector3::Zero());
  EXPECT_EQ(result.X_WB.translation(), X_WB.pose(result.t_safe).translation());
}

Vector3 at(const VertexPath& path, Scalar t) {
  const Scalar s = (t - kPromised.begin) / kPromised.length();
  return (1 - s) * path.begin + s * path.end;
}

// A vertex below and a face that moves; two crossing edges. Elements have no stop, and cross at an
// instant only.
TEST_P(ToiPromises, HoldOfVertexPaths) {
  if (setting().is_cancelled || setting().gap < 0) return;
  const auto moving = [&](const Vector3& p) {
    const Vector3 begin = X_ * p + setting().gap * up();
    return VertexPath{begin, begin + setting().speed * up()};
  };
  const auto resting = [&](const Vector3& p) { return VertexPath{X_ * p, X_ * p}; };
  const auto mesh_of = [](const Vector3& p, const Vector3& q, const Vector3& r) {
    return TriangleMesh({p, q, r}, {{0, 1, 2}});
  };
  VertexToiOptions options;
  options.distance_tolerance = setting().tolerance;
  if (setting().budget == 1) options.max_steps = 1;
  const VertexFacePaths face{resting({0.1, 0.2, 0}),
                             {moving({-1, -1, 0}), moving({1, -1, 0}), moving({0, 1, 0})}};
  const EdgeEdgePaths edges{{resting({-1, 0, 0}), resting({1, 0.2, 0})},
                            {moving({0, -1, 0}), moving({0.1, 1, 0})}};
  const auto face_distance = [&](Scalar t) {
    const Vector3 p = at(face.vertex, t);
    return bracket(mesh_of(p, p, p), RigidPose(),
                   mesh_of(at(face.face[0], t), at(face.face[1], t), at(face.face[2], t)),
                   RigidPose());
  };
  const auto edge_distance = [&](Scalar t) {
    const Vector3 p = at(edges.edge_a[0], t);
    const Vector3 q = at(edges.edge_b[0], t);
    return bracket(mesh_of(p, p, at(edges.edge_a[1], t)), RigidPose(),
                   mesh_of(q, q, at(edges.edge_b[1], t)), RigidPose());
  };
  check(options, time_of_impact(face, kPromised, options), face_distance, setting().expected);
  check(options, time_of_impact(edges, kPromised, options), edge_distance, setting().expected);
}

std::string test_name(const ::testing::TestParamInfo<Setting>& info) {
  std::string name = info.param.name;
  std::erase(name, ' ');
  return name;
}

INSTANTIATE_TEST_SUITE_P(AllStatuses, ToiPromises, ::testing::ValuesIn(kSettings), test_name);

}  // namespace
}  // namespace dyop
