// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <tuple>

#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"

// How a query starts, and what it returns: the table in docs/algorithms/time_of_impact.md, for two
// cubes face to face, each as a box, a hull and a mesh.
namespace dyop {
namespace {

enum class Kind { AsBox, AsHull, AsMesh };

std::shared_ptr<const Shape> cube(Kind kind, Scalar half) {
  const Vector3 h = Vector3::Constant(half);
  switch (kind) {
    case Kind::AsBox:
      return std::make_shared<Box>(h);
    case Kind::AsHull:
      return std::make_shared<ConvexHull>(testing::box_mesh(h).vertices);
    case Kind::AsMesh:
      return std::make_shared<TriangleMesh>(testing::box_mesh(h).mesh());
  }
  return nullptr;
}

struct Setting {
  const char* name;
  Scalar size;
  Scalar target;  ///< in sizes
  Vector3 place;  ///< in sizes
};

const Setting kSettings[] = {
    {"unit", 1, 0, Vector3::Zero()},          {"target", 1, 0.3, Vector3::Zero()},
    {"micro", 1e-4, 0, Vector3::Zero()},      {"macro", 1e4, 0.3, Vector3::Zero()},
    {"far", 1, 0, Vector3(1000, -2000, 500)},
};

class InitialState : public ::testing::TestWithParam<std::tuple<Kind, Kind, Setting>> {
 protected:
  // The face x = size/2 of A against the face x = -size/2 of B, which is smaller and begins `gap`
  // tolerances above the target; B moves at `velocity` sizes per unit of time.
  ToiResult ask(Scalar gap, const Vector3& velocity, const TimeInterval& interval = {0, 1}) const {
    const auto& [kind_a, kind_b, setting] = GetParam();
    const Scalar s = setting.size;
    ToiOptions options;
    options.distance_tolerance = tolerance();
    options.target_distance = setting.target * s;
    const auto a = cube(kind_a, s / 2);
    const auto b = cube(kind_b, s / 4);
    const Scalar x = s / 2 + s / 4 + options.target_distance + gap * tolerance();
    const RigidPose X_WB(Vector3(s * setting.place + Vector3(x, 0.1 * s, 0.05 * s)));
    return time_of_impact(*a, RestMotion(RigidPose(Vector3(s * setting.place))), *b,
                          ConstantTwistMotion(X_WB, Twist{s * velocity, Vector3::Zero()}), interval,
                          options);
  }

  // literal: wide enough for the rounding of places 2000 sizes from the origin.
  static Scalar tolerance() { return 1e-6 * std::get<2>(GetParam()).size; }
};

const Vector3 kApart(1, 0, 0);
const Vector3 kTogether(-1, 0, 0);
const Vector3 kAlong(0, 0.7, -0.3);
const Vector3 kNone(0, 0, 0);

TEST_P(InitialState, OverlappingOrTouchingIsWithinTheTargetWhateverTheVelocity) {
  for (const Scalar gap : {-1e5, -1.0, 0.0, 0.1}) {
    // Deeper than the target, the meshes' surfaces cross.
    for (const Vector3& velocity : {kApart, kTogether, kAlong, kNone}) {
      const ToiResult result = ask(gap, velocity);
      EXPECT_EQ(result.status, ToiStatus::InitiallyWithinTarget) << gap;
      EXPECT_EQ(result.t_safe, 0);
      ASSERT_TRUE(result.contact);
    }
  }
}

// Steps stop half a tolerance above the target.
TEST_P(InitialState, InContactAndClosingIsAnImpactAtOnce) {
  for (const Scalar gap : {0.5, 0.6, 0.9}) {
    const ToiResult result = ask(gap, kTogether);
    ASSERT_EQ(result.status, ToiStatus::Impact) << gap;
    EXPECT_LE(result.t_safe, 1e-6 * (gap - 0.499));
    EXPECT_LT((result.contact->nhat_AB_W - Vector3::UnitX()).norm(), 1e-6);
    EXPECT_NEAR(result.contact->closing_speed, std::get<2>(GetParam()).size,
                1e-6 * std::get<2>(GetParam()).size);
  }
}

TEST_P(InitialState, InContactAndLeavingIsNoImpact) {
  for (const Scalar gap : {0.4, 0.6, 0.9, 2.0}) {
    const ToiResult result = ask(gap, kApart);
    EXPECT_EQ(result.status, ToiStatus::Separated) << gap;
    EXPECT_EQ(result.t_safe, 1);
  }
}

TEST_P(InitialState, InContactAndSlidingAlongIsNoImpact) {
  for (const Scalar gap : {0.5, 0.9, 2.0}) {
    const ToiResult result = ask(gap, kAlong);
    EXPECT_EQ(result.status, ToiStatus::Separated) << gap;
    EXPECT_EQ(result.t_safe, 1);
  }
}

TEST_P(InitialState, InContactWithoutRelativeMotionIsNoImpact) {
  for (const Scalar gap : {0.5, 0.9, 2.0}) {
    EXPECT_EQ(ask(gap, kNone).status, ToiStatus::Separated) << gap;
  }
}

TEST_P(InitialState, AnIntervalOfNoLengthTellsTheStateAlone) {
  EXPECT_EQ(ask(0, kTogether, {0, 0}).status, ToiStatus::InitiallyWithinTarget);
  EXPECT_EQ(ask(2, kTogether, {0, 0}).status, ToiStatus::Separated);
  EXPECT_EQ(ask(0.6, kApart, {0, 0}).status, ToiStatus::Separated);
  EXPECT_EQ(ask(0.5, kTogether, {0, 0}).status, ToiStatus::Impact) << "in contact, and closing";
}

// B starts in contact on its left and moves to the right, where a second A stops it.
TEST_P(InitialState, ABodyThatLeavesAContactFindsTheNextOne) {
  const auto& [kind_a, kind_b, setting] = GetParam();
  const Scalar s = setting.size;
  const Scalar gap = setting.target * s + 0.6 * tolerance();
  ToiOptions options;
  options.distance_tolerance = tolerance();
  options.target_distance = setting.target * s;
  // Two cubes in one mesh, 3 sizes apart, or the second one alone for convex shapes.
  const Vector3 second(3 * s, 0, 0);
  auto walls = testing::box_mesh(Vector3::Constant(s / 2));
  if (kind_a == Kind::AsMesh) {
    const auto right = walls.moved(Matrix3::Identity(), second);
    const auto offset = std::int32_t(walls.vertices.size());
    walls.vertices.insert(walls.vertices.end(), right.vertices.begin(), right.vertices.end());
    for (const TriangleIndices& t : right.triangles) {
      walls.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    }
  }
  const TriangleMesh both = walls.mesh();
  const auto convex = cube(kind_a, s / 2);
  const bool is_mesh = kind_a == Kind::AsMesh;
  const Shape& a = is_mesh ? static_cast<const Shape&>(both) : *convex;
  const Vector3 place = s * setting.place;
  const RestMotion X_WA{RigidPose(is_mesh ? place : Vector3(place + second))};
  const auto b = cube(kind_b, s / 4);
  const RigidPose X_WB(Vector3(place + Vector3(0.75 * s + gap, 0, 0)));
  const ToiResult result =
      time_of_impact(a, X_WA, *b, ConstantTwistMotion(X_WB, {Vector3(s, 0, 0), Vector3::Zero()}),
                     {0, 10}, options);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  // From 0.75 s + target to 3 s - 0.75 s - target.
  EXPECT_NEAR(result.t_safe, 1.5 - 2 * setting.target, 3e-6);
}

// The edge x = y of a turning cube passes the face of A at its nearest once, where the gap has its
// least value `gap`: a double root of the gap less that value.
TEST_P(InitialState, GrazingIsAnImpactBelowTheBandAndNoneAboveIt) {
  const auto& [kind_a, kind_b, setting] = GetParam();
  const Scalar s = setting.size;
  ToiOptions options;
  options.distance_tolerance = tolerance();
  options.target_distance = setting.target * s;
  const auto a = cube(kind_a, s / 2);
  const auto b = cube(kind_b, s / 4);
  const Scalar reach = std::numbers::sqrt2 * s / 4;  // of the edge from the axis of turning
  for (const Scalar gap : {0.1, 1.5}) {
    const Scalar x = s / 2 + reach + options.target_distance + gap * tolerance();
    const RigidPose X_WB(Vector3(s * setting.place + Vector3(x, 0, 0)));
    const ToiResult result = time_of_impact(
        *a, RestMotion(RigidPose(Vector3(s * setting.place))), *b,
        ConstantTwistMotion(X_WB, {Vector3::Zero(), Vector3(0, 0, 1)}), {0, 1.5}, options);
    EXPECT_EQ(result.status, gap < 1 ? ToiStatus::Impact : ToiStatus::Separated) << gap;
  }
}

std::string name_of(const ::testing::TestParamInfo<std::tuple<Kind, Kind, Setting>>& info) {
  const char* names[] = {"Box", "Hull", "Mesh"};
  const auto& [a, b, setting] = info.param;
  return std::string(names[int(a)]) + names[int(b)] + "_" + setting.name;
}

INSTANTIATE_TEST_SUITE_P(
    Cubes, InitialState,
    ::testing::Combine(::testing::Values(Kind::AsBox, Kind::AsHull, Kind::AsMesh),
                       ::testing::Values(Kind::AsBox, Kind::AsHull, Kind::AsMesh),
                       ::testing::ValuesIn(kSettings)),
    name_of);

}  // namespace
}  // namespace dyop
