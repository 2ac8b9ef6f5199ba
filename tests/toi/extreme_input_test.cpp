// SPDX-License-Identifier: BSD-3-Clause

// Extreme speeds, turning rates, sizes and positions: every query ends within its budget, with a
// status that is true. Work is measured in node pairs, never in time.

#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <optional>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/bodies.h"
#include "support/inputs/mesh_generators.h"

namespace dyop {
namespace {

using testing::at;
using testing::box_mesh;
using testing::gear;
using testing::icosphere;
using testing::moving;
using testing::plate_grid;

constexpr std::int64_t kBudget = 20000;

ToiOptions with_tolerance(Scalar tolerance) {
  ToiOptions options;
  options.distance_tolerance = tolerance;
  options.max_node_pairs = kBudget;
  return options;
}

/// The truth of a head-on approach: the gap is closing_speed (t_contact - t), if they meet.
struct Truth {
  std::optional<Scalar> t_contact;
  Scalar closing_speed = 0;
};

// No status may be false; and unless rounding prevents it or the budget is used up, it must decide.
void check(const ToiResult& result, const TimeInterval& interval, const ToiOptions& options,
           const Truth& truth) {
  const Scalar tolerance = options.distance_tolerance.value();
  const Scalar noise = result.rounding_allowance;
  EXPECT_LE(result.statistics.node_pairs, options.max_node_pairs);
  EXPECT_GE(result.t_safe, interval.begin);
  EXPECT_LE(result.t_safe, interval.end);
  const Scalar gap =
      truth.t_contact ? truth.closing_speed * (*truth.t_contact - result.t_safe) : kInfinity;
  if (truth.t_contact) {
    EXPECT_GE(gap, tolerance / 4 - 2 * noise);
  }
  switch (result.status) {
    case ToiStatus::Separated:
      EXPECT_FALSE(truth.t_contact.has_value());
      EXPECT_EQ(result.t_safe, interval.end);
      break;
    case ToiStatus::Impact:
      EXPECT_LE(gap, tolerance + 2 * noise);
      break;
    case ToiStatus::NumericalLimit:
      EXPECT_GT(noise, tolerance / 16);
      break;
    case ToiStatus::BudgetExhausted:
      EXPECT_EQ(result.statistics.node_pairs, options.max_node_pairs);
      EXPECT_LT(result.t_safe, interval.end);
      break;
    default:
      ADD_FAILURE() << "status " << int(result.status);
  }
}

// Shapes that all reach from -1 to 1 along x, with a point of that face on the x axis.
std::vector<std::shared_ptr<const Shape>> unit_shapes(Scalar scale = 1) {
  return {std::make_shared<Sphere>(scale), std::make_shared<Box>(scale * Vector3(1, 1, 1)),
          std::make_shared<TriangleMesh>(box_mesh(scale * Vector3(1, 1, 1)).mesh()),
          std::make_shared<TriangleMesh>(
              gear(2, scale * 0.5, scale, scale * 0.2)
                  .moved(Matrix3(Eigen::AngleAxisd(-std::numbers::pi / 4 * 2.5, Vector3::UnitZ())),
                         Vector3::Zero())
                  .mesh())};
}

// Largest x of a point of the shape.
Scalar reach_along_x(const Shape& shape) {
  return shape.bounding_box().max().x();
}

TEST(ExtremeInput, OfASpeedOf1e9IsAnsweredWhereRoundingAllows) {
  constexpr Scalar kSpeed = 1e9;
  // Over 1e-6 the path is 1e3 long, and rounding of it far below the tolerance; over 1 it is not.
  for (const Scalar length : {1e-6, 1e-3, 1.0}) {
    const TimeInterval interval{0, length};
    const Scalar start = 0.5 * kSpeed * length;
    for (const Scalar tolerance : {1e-6, 1e-2}) {
      const ToiOptions options = with_tolerance(tolerance);
      const Sphere ball(1);
      const Box box({1, 1, 1});
      const TriangleMesh mesh = box_mesh({1, 1, 1}).mesh();
      for (const Shape* shape : {static_cast<const Shape*>(&ball), static_cast<const Shape*>(&box),
                                 static_cast<const Shape*>(&mesh)}) {
        for (const Scalar y : {0.0, 3.0}) {
          Truth truth;
          if (y == 0.0) truth = {(start - 2) / kSpeed, kSpeed};
          const RestMotion rest;
          const Vector3 v(kSpeed, 0, 0);
          const SampledMotion sampled({{0, at(-start, y, 0)}, {length, at(start, y, 0)}});
          const InterpolatedMotion linear(interval, at(-start, y, 0), at(start, y, 0));
          const ConstantTwistMotion straight = moving(at(-start, y, 0), v, Vector3::Zero());
          for (const Motion* motion :
               std::initializer_list<const Motion*>{&straight, &sampled, &linear}) {
            const ToiResult result = time_of_impact(ball, rest, *shape, *motion, interval, options);
            check(result, interval, options, truth);
            EXPECT_LE(result.statistics.node_pairs, 500);
            if (length == 1e-6) {
              EXPECT_EQ(result.status, truth.t_contact ? ToiStatus::Impact : ToiStatus::Separated);
            }
            // A miss by the size of the bodies is far above the rounding of either.
            if (y > 0) {
              EXPECT_EQ(result.status, ToiStatus::Separated);
            }
          }
        }
      }
    }
  }
}

TEST(ExtremeInput, OfARateOf1e6IsAnsweredInTheFirstTurn) {
  // A rod of length 2 about the z axis meets a point at radius 1 and angle φ after φ / rate; the
  // gap is sin(φ - rate t).
  constexpr Scalar kRate = 1e6;
  const TriangleMesh rod({Vector3::Zero(), Vector3(2, 0, 0)}, {{0, 1, 1}});
  const TriangleMesh obstacle({Vector3::Zero()}, {{0, 0, 0}});
  const ConstantTwistMotion turning = moving(RigidPose(), Vector3::Zero(), {0, 0, kRate});
  const ToiOptions options = with_tolerance(1e-6);
  for (const Scalar phi : {0.3, 3.0, 6.0}) {
    const RestMotion place(at(std::cos(phi), std::sin(phi), 0));
    for (const Scalar length : {1e-5, 1.0}) {
      const ToiResult result = time_of_impact(rod, turning, obstacle, place, {0, length}, options);
      ASSERT_EQ(result.status, ToiStatus::Impact);
      const Scalar gap = std::sin(phi - kRate * result.t_safe);
      EXPECT_GT(kRate * result.t_safe, phi - 1e-3);
      EXPECT_GE(gap, 0.25e-6 - result.rounding_allowance);
      EXPECT_LE(gap, 1e-6 + result.rounding_allowance);
      EXPECT_LE(result.statistics.node_pairs, 2000);
    }
  }
}

TEST(ExtremeInput, OfARateOf1e6OutOfReachIsDecidedByTheBalls) {
  constexpr Scalar kRate = 1e6;
  const TriangleMesh wheel = gear(12, 0.8, 1, 0.2).mesh();
  const TriangleMesh ball = icosphere(2).mesh();
  const ToiOptions options = with_tolerance(1e-6);
  const ToiResult result =
      time_of_impact(wheel, moving(RigidPose(), Vector3::Zero(), {0, kRate, kRate}), ball,
                     moving(at(2.1, 0, 0), Vector3::Zero(), {kRate, 0, -kRate}), {0, 1}, options);
  EXPECT_EQ(result.status, ToiStatus::Separated);
  EXPECT_LE(result.statistics.node_pairs, 100);
}

// A wheel that flies fast past another body, turning fast: only the balls see far ahead.
TEST(ExtremeInput, OfARateOf1e6InFlightIsCarriedByTheBallsUntilTheyMeet) {
  const TriangleMesh wheel = gear(12, 0.8, 1, 0.2).mesh();
  const TriangleMesh ball = icosphere(2).mesh();
  const ToiOptions options = with_tolerance(1e-6);
  const Scalar reach = wheel.bounding_radius() + ball.bounding_radius();
  const ToiResult past =
      time_of_impact(ball, RestMotion(), wheel, moving(at(-5, 2.1, 0), {10, 0, 0}, {1e6, 2e5, 0}),
                     {0, 1}, options);
  EXPECT_EQ(past.status, ToiStatus::Separated);
  EXPECT_LE(past.statistics.node_pairs, 10);
  const ToiResult at_it = time_of_impact(
      ball, RestMotion(), wheel, moving(at(-5, 0, 0), {10, 0, 0}, {1e6, 2e5, 0}), {0, 1}, options);
  EXPECT_NE(at_it.status, ToiStatus::Separated);
  EXPECT_LE(at_it.statistics.node_pairs, kBudget);
  EXPECT_GE(at_it.t_safe, (5 - reach) / 10 - 1e-4);
  EXPECT_LT(at_it.t_safe, 0.5);
}

// Fast wheels just beside a plate and a wall, which they never touch: no bound here spans many
// turns of their parts, so that the budget may end the query, at a time that is safe.
TEST(ExtremeInput, OfARateOf1e6JustOutOfReachIsNeverAnImpact) {
  const TriangleMesh wheel = gear(12, 0.8, 1, 0.2).mesh();
  const TriangleMesh plate = plate_grid(4, 4, 8, 8).mesh();
  const TriangleMesh wall = box_mesh({0.5, 3, 3}).mesh();
  const ToiOptions options = with_tolerance(1e-6);
  const TimeInterval interval{0, 1};
  for (const Scalar rate : {1.0, 1e3, 1e6}) {
    const Vector3 w(0, 0, rate);
    const ToiResult above = time_of_impact(
        plate, RestMotion(), wheel, moving(at(0, 0, 0.11), Vector3::Zero(), w), interval, options);
    check(above, interval, options, {});
    const ToiResult beside = time_of_impact(wheel, moving(RigidPose(), Vector3::Zero(), w), wall,
                                            RestMotion(at(1.51, 0, 0)), interval, options);
    check(beside, interval, options, {});
    EXPECT_GT(beside.t_safe, 0);
    // Falling at unit speed the wheel meets the plate after 0.01.
    const ToiResult falling = time_of_impact(
        plate, RestMotion(), wheel, moving(at(0, 0, 0.11), {0, 0, -1}, w), interval, options);
    check(falling, interval, options, {0.01, 1});
    if (rate == 1.0) {
      EXPECT_EQ(above.status, ToiStatus::Separated);
      EXPECT_EQ(beside.status, ToiStatus::Separated);
      EXPECT_EQ(falling.status, ToiStatus::Impact);
    }
  }
}

TEST(ExtremeInput, OfIdenticalPosesIsAnOverlapAtTheStart) {
  const ToiOptions options = with_tolerance(1e-6);
  const ConstantTwistMotion tumbling =
      moving(at(3, -2, 1), Vector3(0.3, 5, -2), Vector3(40, 20, -30));
  const std::vector<TriangleMesh> meshes{box_mesh({1, 1, 1}).mesh(), gear(40, 0.8, 1, 0.2).mesh(),
                                         icosphere(4).mesh(), plate_grid(2, 2, 30, 30).mesh()};
  for (const TriangleMesh& mesh : meshes) {
    const ToiResult result = time_of_impact(mesh, tumbling, mesh, tumbling, {0, 1}, options);
    EXPECT_EQ(result.status, ToiStatus::InitiallyWithinTarget);
    EXPECT_EQ(result.t_safe, 0);
    EXPECT_LE(result.statistics.node_pairs, kBudget / 4);
  }
  for (const auto& shape : unit_shapes()) {
    const ToiResult result = time_of_impact(*shape, tumbling, *shape, tumbling, {0, 1}, options);
    EXPECT_EQ(result.status, ToiStatus::InitiallyWithinTarget);
  }
}

// For meshes the surfaces count: one within the other is apart from it, and stays so.
TEST(ExtremeInput, OfOneMeshWithinAnotherThatMovesWithItIsSeparated) {
  const ToiOptions options = with_tolerance(1e-6);
  const TriangleMesh outer = icosphere(3, 1).mesh();
  const TriangleMesh inner = icosphere(3, 0.5).mesh();
  const ConstantTwistMotion flying = moving(at(3, -2, 1), Vector3(0.3, 5, -2), Vector3::Zero());
  const ToiResult result = time_of_impact(outer, flying, inner, flying, {0, 1}, options);
  EXPECT_EQ(result.status, ToiStatus::Separated);
}

TEST(ExtremeInput, OfZeroMotionIsAnsweredAtItsFirstLook) {
  const ToiOptions options = with_tolerance(1e-6);
  const TimeInterval interval{0, 1e9};
  struct Place {
    Scalar gap;
    ToiStatus status;
  };
  // A gap between ε/4 and ε that does not close is no impact.
  const std::vector<Place> places{{1, ToiStatus::Separated},
                                  {1e-3, ToiStatus::Separated},
                                  {0.6e-6, ToiStatus::Separated},
                                  {0.2e-6, ToiStatus::InitiallyWithinTarget},
                                  {0, ToiStatus::InitiallyWithinTarget}};
  for (const auto& a : unit_shapes()) {
    for (const auto& b : unit_shapes()) {
      for (const Place& place : places) {
        const RestMotion X_WA;
        const RigidPose X_WB0 = at(reach_along_x(*a) + reach_along_x(*b) + place.gap, 0, 0);
        const RestMotion rest(X_WB0);
        const ConstantTwistMotion idle = moving(X_WB0, Vector3::Zero(), Vector3::Zero());
        const InterpolatedMotion still({0, 1e9}, X_WB0, X_WB0);
        for (const Motion* X_WB : std::initializer_list<const Motion*>{&rest, &idle, &still}) {
          const ToiResult result = time_of_impact(*a, X_WA, *b, *X_WB, interval, options);
          EXPECT_EQ(result.status, place.status) << place.gap;
          EXPECT_EQ(result.t_safe, place.status == ToiStatus::Separated ? 1e9 : 0);
          EXPECT_LE(result.statistics.node_pairs, 2000);
        }
      }
    }
  }
}

TEST(ExtremeInput, OfSizes1e12ApartIsAnsweredWhereRoundingAllows) {
  constexpr Scalar kSmall = 1e-6;
  constexpr Scalar kLarge = 1e6;
  const Box large_box(Vector3(kLarge, kLarge, kLarge));
  const TriangleMesh large_mesh = box_mesh({kLarge, kLarge, kLarge}).mesh();
  const RestMotion rest(at(0, 0, -kLarge));  // the top face in z = 0
  const TimeInterval interval{0, 4};
  for (const Shape* large :
       {static_cast<const Shape*>(&large_box), static_cast<const Shape*>(&large_mesh)}) {
    for (const auto& small : unit_shapes(kSmall)) {
      const Scalar bottom = small->bounding_box().min().z();
      // The rounding of coordinates of 1e6 is about 1e-8: the first tolerance may be met, the
      // others not.
      for (const Scalar tolerance : {1e-6, 1e-9, 1e-12}) {
        const ToiOptions options = with_tolerance(tolerance);
        const ToiResult falling =
            time_of_impact(*large, rest, *small, moving(at(1e5, 2e5, 1), {0, 0, -1}, {3, 0, 0}),
                           interval, options);
        EXPECT_LE(falling.statistics.node_pairs, 2000);
        // It turns while it falls: it meets the face when its middle is within its radius of it.
        EXPECT_NE(falling.status, ToiStatus::Separated);
        EXPECT_NEAR(falling.t_safe, 1, 2 * small->bounding_radius() + tolerance + 4e-7);
        if (falling.status == ToiStatus::NumericalLimit) {
          EXPECT_GT(falling.rounding_allowance, tolerance / 16);
        } else {
          EXPECT_EQ(falling.status, ToiStatus::Impact);
        }
        const ToiResult straight =
            time_of_impact(*large, rest, *small, moving(at(1e5, 2e5, 1), {0, 0, -1}, {0, 0, 0}),
                           interval, options);
        check(straight, interval, options, {1 + bottom, 1});
        const ToiResult sliding =
            time_of_impact(*large, rest, *small, moving(at(-1e5, 0, 1e-3), {1e5, 0, 0}, {0, 0, 50}),
                           interval, options);
        check(sliding, interval, options, {});
        EXPECT_EQ(sliding.status, ToiStatus::Separated);
      }
    }
  }
}

TEST(ExtremeInput, FarFromTheOriginIsAnsweredWhereRoundingAllows) {
  const Vector3 far(1e6, -1e6, 1e6);
  const TimeInterval interval{0, 4};
  for (const auto& a : unit_shapes()) {
    for (const auto& b : unit_shapes()) {
      const Scalar start = reach_along_x(*a) + reach_along_x(*b) + 3;
      for (const Scalar tolerance : {1e-3, 1e-6, 1e-9, 1e-12}) {
        const ToiOptions options = with_tolerance(tolerance);
        const RestMotion rest{RigidPose(far)};
        const ConstantTwistMotion coming =
            moving(RigidPose(far + Vector3(start, 0, 0)), {-1, 0, 0}, {0, 0, 0});
        const ToiResult result = time_of_impact(*a, rest, *b, coming, interval, options);
        check(result, interval, options, {3, 1});
        EXPECT_LE(result.statistics.node_pairs, 2000);
        if (tolerance >= 1e-6) {
          EXPECT_EQ(result.status, ToiStatus::Impact);
        }
      }
    }
  }
}

TEST(ExtremeInput, EndsForNumbersAtTheEndOfTheirRange) {
  const RestMotion rest;
  const ToiOptions options = with_tolerance(1e-6);
  for (const auto& a : unit_shapes()) {
    for (const Scalar huge : {1e100, 1e200, 1e308}) {
      for (const ConstantTwistMotion& motion :
           {moving(at(huge, 0, 0), Vector3::Zero(), Vector3::Zero()),
            moving(at(5, 0, 0), Vector3(huge, 0, 0), Vector3::Zero()),
            moving(at(5, 0, 0), Vector3::Zero(), Vector3(0, 0, huge)),
            moving(at(5, 0, 0), Vector3(0, huge, 0), Vector3(huge, 0, huge))}) {
        const ToiResult result = time_of_impact(*a, rest, *a, motion, {0, 1}, options);
        EXPECT_LE(result.statistics.node_pairs, kBudget);
        // None of these ever meet; what is not proven must not be reported as an impact at a known
        // time.
        EXPECT_TRUE(result.status == ToiStatus::Separated ||
                    result.status == ToiStatus::NumericalLimit ||
                    result.status == ToiStatus::BudgetExhausted)
            << int(result.status);
      }
    }
  }
}

}  // namespace
}  // namespace dyop
