// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/page_encoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "dyop/core/error.h"
#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/sphere.h"
#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/motion/sequence_motion.h"
#include "view/page_block.h"

namespace dyop {
namespace {

using testing::PageBlock;

PageScene scene_with(const std::shared_ptr<const Shape>& shape) {
  PageScene scene;
  scene.title = "A <scene> & more";
  scene.bodies.push_back({"body", BodyKind::Kinematic, shape, "", {}});
  return scene;
}

constexpr int kLevels = 1 << 24;

struct Surface {
  std::vector<Vector3> vertices;
  std::vector<std::size_t> corners;
};

// The steps of docs/player.md, one after another.
Surface surface_in(const PageBlock& block, std::size_t shape) {
  const nlohmann::json& facts = block.header().at("shapes").at(shape);
  const std::string name = "shape" + std::to_string(shape);
  const auto count = facts.at("vertices").get<std::size_t>();
  const std::vector<double> differences = block.numbers(name + ".vertices");
  Surface surface;
  surface.vertices.resize(count);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto low = facts.at("low").at(axis).get<double>();
    const auto high = facts.at("high").at(axis).get<double>();
    int level = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const int coded = int(differences[axis * count + k]);
      level = (level + (coded % 2 == 0 ? coded / 2 : -(coded + 1) / 2) + kLevels) % kLevels;
      surface.vertices[k][Eigen::Index(axis)] = low + (high - low) * level / (kLevels - 1);
    }
  }
  std::size_t next = 0;
  for (const double back : block.numbers(name + ".triangles")) {
    surface.corners.push_back(back == 0 ? next++ : next - std::size_t(back));
  }
  EXPECT_EQ(next, count);
  return surface;
}

TEST(PageEncoder, RoundsVerticesToTheirBox) {
  std::mt19937 random(3);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    std::uniform_real_distribution<Scalar> any(-size, size);
    std::vector<Vector3> vertices;
    std::vector<TriangleIndices> triangles;
    for (std::int32_t k = 0; k < 300; ++k) {
      vertices.push_back(Vector3(any(random), any(random), any(random)) + Vector3(7, 8, 9) * size);
      if (k >= 2) triangles.push_back({k, (k * 7) % k, k - 1});
    }
    const TriangleMesh mesh(vertices, triangles);
    const PageBlock block(PageEncoder(scene_with(std::make_shared<TriangleMesh>(mesh))).head());
    const Surface surface = surface_in(block, 0);
    ASSERT_EQ(surface.corners.size(), 3 * triangles.size());
    for (std::size_t k = 0; k < surface.corners.size(); ++k) {
      const auto vertex = std::size_t(triangles[k / 3][k % 3]);
      const Vector3 off = surface.vertices[surface.corners[k]] - vertices[vertex];
      EXPECT_LE(off.cwiseAbs().maxCoeff(), 2 * size / (kLevels - 1) * 0.51 + 1e-15 * size);
    }
  }
}

TEST(PageEncoder, DrawsRoundShapesOnTheirSurface) {
  const PageBlock block(PageEncoder(scene_with(std::make_shared<Capsule>(0.5, 2))).head());
  const Surface surface = surface_in(block, 0);
  EXPECT_EQ(surface.corners.size(), 3u * 8 * 256);
  for (const Vector3& p : surface.vertices) {
    const Vector3 on_axis(0, 0, std::clamp<Scalar>(p.z(), -2, 2));
    EXPECT_NEAR((p - on_axis).norm(), 0.5, 1e-4);
  }
}

TEST(PageEncoder, StoresASharedShapeOnceAndCompoundsWhole) {
  const auto box = std::make_shared<Box>(Vector3(1, 1, 1));
  PageScene scene = scene_with(box);
  scene.bodies.push_back({"twin", BodyKind::Dynamic, box, "", MassProperties{2, Vector3(1, 2, 3)}});
  const auto pair = std::make_shared<CompoundShape>(
      std::vector<CompoundChild>{{box, RigidPose(Vector3(5, 0, 0))}, {box, RigidPose()}});
  scene.bodies.push_back({"pair", BodyKind::Static, pair, "", {}});
  const PageBlock block(PageEncoder(scene).head());
  ASSERT_EQ(block.header().at("shapes").size(), 2u);
  EXPECT_EQ(block.header().at("bodies").at(1).at("shape"), 0);
  EXPECT_EQ(block.header().at("bodies").at(1).at("center"), nlohmann::json({1.0, 2.0, 3.0}));
  EXPECT_EQ(surface_in(block, 0).corners.size(), 36u);
  EXPECT_EQ(surface_in(block, 1).corners.size(), 72u);
  EXPECT_EQ(block.header().at("shapes").at(1).at("high"), nlohmann::json({6.0, 1.0, 1.0}));
}

TEST(PageEncoder, KeepsParametersOfExactMotions) {
  const PageEncoder encoder(scene_with(std::make_shared<Sphere>(1)));
  const RigidPose X(rotation_from_vector({0.3, -2, 1}), {4, 5, 6});
  const Twist twist{{1, 2, 3}, {0.1, 0.2, 0.3}};
  const ConstantTwistMotion turning(X, twist, 0.25);
  const MotionState begin = turning.state(1);
  const MotionState end = turning.state(2);
  PageSpan span;
  const BodyId body(0);
  span.segments = {
      {body, {0, 0.5}, std::make_shared<RestMotion>(X)},
      {body, {0.5, 1}, std::make_shared<ConstantTwistMotion>(turning)},
      {body, {1, 1.5}, std::make_shared<HermiteMotion>(TimeInterval{1, 2}, begin, end)},
      {body, {2, 3}, nullptr}};
  const PageBlock block(encoder.span(span));
  EXPECT_EQ(block.vector("rest.p", 0), X.translation());
  EXPECT_EQ(block.numbers("twist.t0"), std::vector<double>{0.25});
  EXPECT_EQ(block.vector("twist.v", 0), twist.v_WB);
  EXPECT_EQ(block.vector("twist.w", 0), twist.w_WB);
  EXPECT_EQ(block.numbers("cubic.begin"), std::vector<double>{1});
  EXPECT_EQ(block.numbers("cubic.end"), std::vector<double>{1.5});
  EXPECT_EQ(block.numbers("cubic.domain_end"), std::vector<double>{2});
  EXPECT_EQ(block.vector("cubic.v1", 0), end.twist.v_WB);
  EXPECT_EQ(block.numbers("absent.begin"), std::vector<double>{2});
}

TEST(PageEncoder, TakesSequencesApartWhereTheirVelocityJumps) {
  const RigidPose X;
  const auto out = std::make_shared<ConstantTwistMotion>(X, Twist{{1, 0, 0}, {0, 0, 0}}, 0);
  const auto back = std::make_shared<ConstantTwistMotion>(RigidPose(Vector3(1, 0, 0)),
                                                          Twist{{-1, 0, 0}, {0, 0, 0}}, 1);
  const auto both = std::make_shared<SequenceMotion>(
      std::vector<SequenceMotion::Part>{{{0, 1}, out}, {{1, 2}, back}});
  PageSpan span;
  span.segments = {{BodyId(0), {0.25, 1.5}, both}};
  const PageBlock block(PageEncoder(scene_with(std::make_shared<Sphere>(1))).span(span));
  EXPECT_EQ(block.numbers("twist.begin"), (std::vector<double>{0.25, 1}));
  EXPECT_EQ(block.numbers("twist.end"), (std::vector<double>{1, 1.5}));
}

// Cubics through the states at the ends of each row, as the page evaluates them, against the
// motion.
TEST(PageEncoder, FollowsOtherMotionsByCubics) {
  for (const Scalar far : {0.0, 1e4}) {
    std::vector<ControlPoint> points;
    for (int k = 0; k <= 7; ++k) {
      points.push_back({Vector3(std::cos(3 * k) + far, std::exp(k / 5.0), -far),
                        Vector3(std::sin(2 * k), k / 3.0, std::cos(k))});
    }
    const auto motion =
        std::make_shared<BezierMotion>(TimeInterval{0, 1}, Matrix3(Matrix3::Identity()), points);
    PageSpan span;
    span.segments = {{BodyId(0), {0, 1}, motion}};
    const PageBlock block(PageEncoder(scene_with(std::make_shared<Sphere>(1))).span(span));
    const std::vector<double> begins = block.numbers("cubic.begin");
    const std::vector<double> ends = block.numbers("cubic.end");
    const std::vector<double> qw = block.numbers("cubic.qw");
    ASSERT_FALSE(begins.empty());
    for (std::size_t k = 0; k < begins.size(); ++k) {
      const Vector3 q = block.vector("cubic.q", k);
      const HermiteMotion cubic = HermiteMotion::from_chart(
          {begins[k], ends[k]}, Quaternion(qw[k], q.x(), q.y(), q.z()).toRotationMatrix(),
          {block.vector("cubic.p0", k), block.vector("cubic.v0", k),
           block.vector("cubic.theta0", k), block.vector("cubic.theta_rate0", k)},
          {block.vector("cubic.p1", k), block.vector("cubic.v1", k),
           block.vector("cubic.theta1", k), block.vector("cubic.theta_rate1", k)});
      for (const Scalar part : {0.0, 0.21, 0.5, 0.83}) {
        const Scalar t = begins[k] + part * (ends[k] - begins[k]);
        const RigidPose wanted = motion->pose(t);
        const RigidPose found = cubic.pose(t);
        EXPECT_LE((wanted.translation() - found.translation()).norm(),
                  1e-9 * (1 + wanted.translation().norm()));
        EXPECT_LE((wanted.rotation() - found.rotation()).norm(), 1e-9);
      }
    }
  }
}

TEST(PageEncoder, RefusesBodiesWithoutShapeAndUnknownBodies) {
  EXPECT_THROW(PageEncoder(scene_with(nullptr)), InvalidArgument);
  const PageEncoder encoder(scene_with(std::make_shared<Sphere>(1)));
  PageSpan span;
  span.segments = {{BodyId(1), {0, 1}, std::make_shared<RestMotion>()}};
  EXPECT_THROW(encoder.span(span), InvalidArgument);
}

}  // namespace
}  // namespace dyop
