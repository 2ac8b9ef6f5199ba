// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/time_of_impact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/both_orders.h"
#include "support/inputs/bodies.h"
#include "support/inputs/ellipsoid.h"
#include "support/inputs/mesh_generators.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::at;
using testing::both_orders;
using testing::message_of;
using testing::moving;
using testing::point_mesh;
using testing::segment_mesh;

TEST(TimeOfImpact, OfTwoSpheresHeadOnIsGapOverSpeed) {
  const Sphere a(1);
  const Sphere b(0.5);
  const RestMotion rest{RigidPose()};
  ToiOptions options{.distance_tolerance = 1e-6};
  for (const Scalar tolerance : {1e-2, 1e-6, 1e-9}) {
    options.distance_tolerance = tolerance;
    const ToiResult result =
        both_orders(a, rest, b, moving(at(5.5, 0, 0), {-2, 0, 0}, {0, 0, 9}), {0, 10}, options);
    ASSERT_EQ(result.status, ToiStatus::Impact);
    // The gap is 4 - 2 t; it is between tolerance / 2 and tolerance at the impact.
    EXPECT_LE(4 - 2 * result.t_safe, tolerance * (1 + 1e-4));
    EXPECT_GE(4 - 2 * result.t_safe, tolerance / 2 - result.rounding_allowance);
    EXPECT_LT((result.contact->p_WCa - Vector3(1, 0, 0)).norm(), 1e-6);
    EXPECT_LT((result.contact->nhat_AB_W - Vector3(1, 0, 0)).norm(), 1e-6);
    EXPECT_NEAR(result.contact->closing_speed, 2, 1e-9);
    EXPECT_LT(
        (result.contact->pivot_W() - (result.contact->p_WCa + result.contact->p_WCb) / 2).norm(),
        1e-12);
    ASSERT_TRUE(result.t_hit.has_value());
    EXPECT_GT(*result.t_hit, result.t_safe);
    EXPECT_LE(4 - 2 * *result.t_hit, tolerance / 2 + result.rounding_allowance);
  }
}

// Centres move along lines, whatever the spheres' turns: d(t)^2 is a quadratic, here in long double.
// At sizes from 1e-4 to 1e4, up to 1e4 sizes from the origin, half of the paths near to grazing.
TEST(TimeOfImpact, OfTwoSpheresIsTheRootOfAQuadratic) {
  using Number = long double;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<Scalar> uniform(-1, 1);
  const auto vector = [&] { return Vector3(uniform(random), uniform(random), uniform(random)); };
  ToiWorkspace workspace;
  int impacts = 0;
  int node_pairs = 0;
  constexpr int kCases = 50000;
  for (int i = 0; i < kCases; ++i) {
    const Scalar size = std::pow(10.0, 4 * uniform(random));
    const Sphere a(size * (1.1 + uniform(random)));
    const Sphere b(size * (1.1 + uniform(random)));
    const Scalar radii = a.rounding_radius() + b.rounding_radius();
    const Vector3 origin = i % 3 == 0 ? Vector3(1e4 * size * vector()) : Vector3::Zero();
    const Vector3 along = vector().normalized();
    const Scalar aside = i % 2 == 0
                             ? uniform(random) * 2
                             : 1 + uniform(random) * std::pow(10.0, -4 + 4 * uniform(random));
    const Vector3 p =
        radii * ((2.1 + uniform(random)) * along + aside * along.cross(vector()).normalized());
    const Vector3 v = size * 4 * (1.01 + uniform(random)) * -along;
    const auto turning = [&](const Vector3& p_W, const Vector3& v_W) {
      return ConstantTwistMotion(RigidPose(rotation_from_vector(vector()), p_W),
                                 {v_W, i % 4 == 0 ? Vector3::Zero() : Vector3(9 * vector())});
    };
    const Vector3 drift = size * vector();
    const ConstantTwistMotion X_WA = turning(origin, drift);
    const ConstantTwistMotion X_WB = turning(origin + p, drift + v);
    const ToiResult result = time_of_impact(a, X_WA, b, X_WB, {0, 1}, {}, workspace);
    const auto gap = [&](Scalar t) -> Number {
      return (p.cast<Number>() + Number(t) * v.cast<Number>()).norm() - radii;
    };
    const Scalar least = std::clamp(-p.dot(v) / v.squaredNorm(), 0.0, 1.0);
    const Scalar tolerance = 1e-6 * std::min(a.rounding_radius(), b.rounding_radius());
    const Number noise = result.rounding_allowance;
    node_pairs += int(result.statistics.node_pairs);
    if (result.status == ToiStatus::InitiallyWithinTarget) {
      ASSERT_LE(gap(0), tolerance + noise) << i;
    } else if (result.status == ToiStatus::Impact) {
      ++impacts;
      ASSERT_LE(gap(result.t_safe), tolerance + noise) << i;
      ASSERT_GE(gap(std::min(result.t_safe, least)), tolerance / 4 - noise) << i;
      ASSERT_LE(gap(result.t_hit.value_or(least)), tolerance / 2 + noise) << i;
    } else {
      ASSERT_EQ(result.status, ToiStatus::Separated) << i;
      ASSERT_GE(gap(least), tolerance / 4 - noise) << i;
    }
  }
  EXPECT_GT(impacts, kCases / 5);
  EXPECT_LT(impacts, kCases * 4 / 5);
  EXPECT_LT(node_pairs, kCases);
}

TEST(TimeOfImpact, OfARotatingRodIsItsAngleOverItsRate) {
  // A rod from the origin to (2, 0, 0) turns about z at rate w and meets a point at radius 1 and
  // angle phi when w t = phi, up to the gap: the distance of the point is sin(phi - w t).
  const TriangleMesh rod = segment_mesh({0, 0, 0}, {2, 0, 0});
  const TriangleMesh obstacle = point_mesh(Vector3::Zero());
  for (const Scalar phi : {0.3, 1.2, 3.0, 6.0}) {
    for (const Scalar rate : {0.1, 1.0, 50.0}) {
      const ToiResult result = both_orders(
          rod, moving(RigidPose(), Vector3::Zero(), {0, 0, rate}), obstacle,
          RestMotion(at(std::cos(phi), std::sin(phi), 0)), {0, 100}, {.distance_tolerance = 1e-6});
      ASSERT_EQ(result.status, ToiStatus::Impact) << phi << " " << rate;
      const Scalar gap = std::sin(phi - rate * result.t_safe);
      EXPECT_LE(gap, 1e-6 * (1 + 1e-4));
      EXPECT_GE(gap, 0.5e-6 - result.rounding_allowance);
      EXPECT_LT(rate * result.t_safe, phi);
      EXPECT_GT(rate * result.t_safe, phi - 2e-6);
    }
  }
}

TEST(TimeOfImpact, FindsEvenContactsThatASignChangeCannotSee) {
  // A point passes a sphere of radius 1 at height 1: the gap sqrt(x^2 + 1) - 1 touches zero once.
  const Sphere sphere(1);
  const TriangleMesh grazing = point_mesh(Vector3::Zero());
  const ToiResult hit = both_orders(sphere, RestMotion(RigidPose()), grazing,
                                    moving(at(-3, 1, 0), {1, 0, 0}, {0, 0, 0}), {0, 6});
  EXPECT_EQ(hit.status, ToiStatus::Impact);
  const ToiResult miss = both_orders(sphere, RestMotion(RigidPose()), grazing,
                                     moving(at(-3, 1 + 2e-6, 0), {1, 0, 0}, {0, 0, 0}), {0, 6});
  EXPECT_EQ(miss.status, ToiStatus::Separated);
  EXPECT_EQ(miss.t_safe, 6);
}

TEST(TimeOfImpact, KeepsTheTargetDistance) {
  ToiOptions options{.distance_tolerance = 1e-6};
  options.target_distance = 0.75;
  const ToiResult result =
      both_orders(Box({1, 1, 1}), RestMotion(RigidPose()), Box({1, 1, 1}),
                  moving(at(0.2, 0.1, 6), {0, 0, -1}, {0, 0, 0}), {0, 10}, options);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_NEAR(result.t_safe, 3.25, 1e-6);
  EXPECT_LT(result.t_safe, 3.25);
}

TEST(TimeOfImpact, ReportsTheFeaturesAndTriangles) {
  // The vertex 2 of a triangle falls on the face of another.
  const TriangleMesh floor({{-5, -5, 0}, {5, -5, 0}, {0, 5, 0}}, {{0, 1, 2}});
  const TriangleMesh falling({{-1, 0, 1}, {1, 0, 1}, {0, 0, 0}}, {{0, 1, 2}});
  const ToiResult result = time_of_impact(floor, RestMotion(RigidPose()), falling,
                                          moving(at(0, 0, 2), {0, 0, -1}, {0, 0, 0}), {0, 10});
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_EQ(result.contact->feature_a.kind, FeatureKind::Face);
  EXPECT_EQ(result.contact->feature_b.kind, FeatureKind::Vertex);
  EXPECT_EQ(result.contact->feature_b.vertices[0], 2);
  EXPECT_EQ(result.contact->triangle_a, 0);
  EXPECT_EQ(result.contact->triangle_b, 0);
  EXPECT_LT((result.contact->nhat_AB_W - Vector3(0, 0, 1)).norm(), 1e-9);
}

TEST(TimeOfImpact, SaysInitiallyWithinTargetForOverlapAndTouch) {
  const Sphere sphere(1);
  for (const Scalar x : {0.0, 1.0, 2.0}) {
    const ToiResult result =
        both_orders(sphere, RestMotion(RigidPose()), sphere,
                    ConstantTwistMotion(at(x, 0, 0), Twist{{1, 0, 0}, {0, 0, 0}}, 3), {3, 4});
    EXPECT_EQ(result.status, ToiStatus::InitiallyWithinTarget) << x;
    EXPECT_EQ(result.t_safe, 3);
  }
}

TEST(TimeOfImpact, LetsABodyLeaveAContactAndSeesTheNextOne) {
  // Between two walls 4 apart; starts within the tolerance of the left one, moving right.
  const Box wall({0.5, 5, 5});
  const Sphere ball(0.5);
  const Scalar gap = 0.6e-6;
  const auto leaving = moving(at(1 + gap, 0, 0), {1, 0, 0}, {0, 0, 0});
  const ToiOptions options{.distance_tolerance = 1e-6};
  const ToiResult left =
      both_orders(wall, RestMotion(RigidPose()), ball, leaving, {0, 10}, options);
  EXPECT_EQ(left.status, ToiStatus::Separated);
  const ToiResult right =
      both_orders(wall, RestMotion(at(5, 0, 0)), ball, leaving, {0, 10}, options);
  ASSERT_EQ(right.status, ToiStatus::Impact);
  EXPECT_NEAR(right.t_safe, 3, 2e-6);
  // Closing from the same place is an impact at once.
  const ToiResult closing =
      both_orders(wall, RestMotion(RigidPose()), ball,
                  moving(at(1 + gap, 0, 0), {-1, 0, 0}, {0, 0, 0}), {0, 10}, options);
  EXPECT_EQ(closing.status, ToiStatus::Impact);
  EXPECT_EQ(closing.t_safe, 0);
}

TEST(TimeOfImpact, OfTwoBodiesWithoutRelativeMotionIsNever) {
  const Box box({1, 1, 1});
  const auto drift = moving(at(0, 0, 0), {3, -4, 5}, {0, 0, 0});
  const auto beside = moving(at(2.5, 0, 0), {3, -4, 5}, {0, 0, 0});
  EXPECT_EQ(both_orders(box, drift, box, beside, {0, 1000}).status, ToiStatus::Separated);
}

TEST(TimeOfImpact, AnswersAZeroLengthInterval) {
  const Sphere sphere(1);
  const RestMotion rest{RigidPose()};
  EXPECT_EQ(both_orders(sphere, rest, sphere, RestMotion(at(3, 0, 0)), {2, 2}).status,
            ToiStatus::Separated);
  EXPECT_EQ(both_orders(sphere, rest, sphere, RestMotion(at(1, 0, 0)), {2, 2}).status,
            ToiStatus::InitiallyWithinTarget);
}

TEST(TimeOfImpact, EndsWithinItsBudgetForExtremeInput) {
  const TriangleMesh rod = segment_mesh({-1, 0, 0}, {1, 0, 0});
  ToiOptions options{.distance_tolerance = 1e-6};
  options.max_node_pairs = 20000;
  // Fast spin out of reach: the balls about the origins decide at once.
  const ToiResult spinning =
      time_of_impact(rod, moving(RigidPose(), Vector3::Zero(), {0, 0, 1e6}), rod,
                     moving(at(0, 3, 0), Vector3::Zero(), {0, 1e6, 0}), {0, 1}, options);
  EXPECT_EQ(spinning.status, ToiStatus::Separated);
  // Fast flight past, and into, a small obstacle.
  const Sphere ball(1e-3);
  const ToiResult past =
      time_of_impact(ball, RestMotion(RigidPose()), ball,
                     moving(at(-1e8, 1, 0), {1e9, 0, 0}, {0, 0, 0}), {0, 1}, options);
  EXPECT_EQ(past.status, ToiStatus::Separated);
  const ToiResult into =
      time_of_impact(ball, RestMotion(RigidPose()), ball,
                     moving(at(-1e8, 0, 0), {1e9, 0, 0}, {0, 0, 0}), {0, 1}, options);
  EXPECT_NE(into.status, ToiStatus::Separated);
  EXPECT_LE(into.t_safe, 0.1);
}

TEST(TimeOfImpact, AdmitsWhenRoundingForbidsTheTolerance) {
  ToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 1e-12;  // far below the rounding of coordinates near 1e6
  const Box box({1, 1, 1});
  const ToiResult result =
      time_of_impact(box, RestMotion(at(1e6, 1e6, 0)), box,
                     moving(at(1e6, 1e6 + 0.2, 5), {0, 0, -1}, {0.1, 0, 0}), {0, 10}, options);
  EXPECT_TRUE(result.status == ToiStatus::NumericalLimit || result.status == ToiStatus::Impact);
  EXPECT_GT(result.rounding_allowance, options.distance_tolerance.value());
  EXPECT_LT(result.t_safe, 3);
}

// A shape that is not the library's falls onto a mesh while it turns about x: its lowest point is
// at the height z - sqrt((0.5 cos)^2 + (2 sin)^2), z that of its centre.
TEST(TimeOfImpact, OfAUsersShapeIsFound) {
  const testing::UserEllipsoid egg({1, 2, 0.5});
  const TriangleMesh plate = testing::plate_grid(8, 8, 4, 4).mesh();
  const Scalar rate = 0.4;
  const ToiResult result =
      both_orders(egg, moving(at(0.3, 0.1, 3), Vector3(0, 0, -1), Vector3(rate, 0, 0)), plate,
                  RestMotion(), {0, 3});
  ASSERT_EQ(result.status, ToiStatus::Impact);
  const auto height = [&](Scalar t) {
    return 3 - t - std::hypot(0.5 * std::cos(rate * t), 2 * std::sin(rate * t));
  };
  EXPECT_GT(height(result.t_safe), 0);
  EXPECT_LT(height(result.t_safe), 1e-5);
}

// The pair starts between a quarter and a half of the tolerance from the target: below the distance
// that t_hit is about, which is still reached after the start.
TEST(TimeOfImpact, HitsAfterTheStartWhateverTheGapThere) {
  ToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 1;
  for (const Scalar gap : {0.26, 0.3, 0.49, 0.51, 0.6}) {
    const ToiResult result = time_of_impact(
        Sphere(1), RestMotion(), Sphere(1),
        moving(at(2 + gap, 0, 0), Vector3(-1, 0, 0), Vector3::Zero()), {0, 1}, options);
    ASSERT_EQ(result.status, ToiStatus::Impact) << gap;
    EXPECT_NEAR(result.t_safe, std::max(0.0, gap - 0.5), 1e-12) << gap;
    ASSERT_TRUE(result.t_hit.has_value()) << gap;
    EXPECT_GT(*result.t_hit, std::max(0.0, gap - 0.5)) << gap;
    EXPECT_LT(*result.t_hit, 0.5) << gap;
  }
}

// Numbers so large that nothing is known about the gap: no claim that the shapes start too close.
TEST(TimeOfImpact, DoesNotCallOverflowAnOverlap) {
  const Sphere sphere(1);
  const RestMotion rest;
  const std::array far{moving(at(1e200, 0, 0), Vector3::Zero(), Vector3::Zero()),
                       moving(at(1e308, 0, 0), Vector3::Zero(), Vector3::Zero()),
                       moving(at(5, 0, 0), Vector3(1e308, 0, 0), Vector3::Zero()),
                       moving(at(5, 0, 0), Vector3::Zero(), Vector3(0, 0, 1e200))};
  for (const ConstantTwistMotion& motion : far) {
    EXPECT_EQ(time_of_impact(sphere, motion, sphere, rest, {0, 1}).status,
              ToiStatus::NumericalLimit);
  }
}

TEST(TimeOfImpact, CrossesTheCornersOfASampledPath) {
  // The path jumps in velocity at every stamp; the hit is in the third piece, at x = 2 - 1 = 1.
  const SampledMotion path(
      {{0, at(-3, 0, 0)}, {1, at(-3, 5, 0)}, {2, at(-2, 0, 0)}, {3, at(2, 0, 0)}});
  const Sphere sphere(0.5);
  const ToiResult result = both_orders(sphere, RestMotion(RigidPose()), sphere, path, {0, 3});
  ASSERT_EQ(result.status, ToiStatus::Impact);
  // From (-2, 0, 0) at t = 2 with speed 4: gap 1 - 4 (t - 2).
  EXPECT_NEAR(result.t_safe, 2.25, 1e-6);
  EXPECT_LT(result.t_safe, 2.25);
}

// A refitted mesh has the triangles of a new one and only another tree over them.
TEST(TimeOfImpact, AndDistanceOfRefittedMeshesAreThoseOfNewOnes) {
  const testing::MeshArrays sphere = testing::icosphere(3);
  const TriangleMesh mesh = sphere.mesh();
  for (const Scalar bend : {0.0, 0.3, 3.0}) {
    testing::MeshArrays bent = sphere;
    for (Vector3& p : bent.vertices) p += bend * Vector3(p.y() * p.z(), 0, std::sin(4 * p.x()));
    const TriangleMesh refitted = mesh.with_vertices(bent.vertices);
    const TriangleMesh fresh = bent.mesh();
    const RestMotion rest(at(0, 0, 0));
    for (int k = 0; k < 10; ++k) {
      const Vector3 away = 9 * Vector3(std::cos(k), std::sin(k), std::cos(3 * k)).normalized();
      const RigidPose X_WB(away);
      const DistanceResult a = distance(refitted, at(0, 0, 0), mesh, X_WB);
      const DistanceResult b = distance(fresh, at(0, 0, 0), mesh, X_WB);
      EXPECT_LE(a.lower, b.upper);
      EXPECT_LE(b.lower, a.upper);
      EXPECT_NEAR(a.upper, b.upper, 1e-12);
      const ConstantTwistMotion moving(X_WB, {-away, Vector3(0.3, 2, 1)}, 0);
      const ToiResult c = time_of_impact(refitted, rest, mesh, moving, {0, 1});
      const ToiResult d = time_of_impact(fresh, rest, mesh, moving, {0, 1});
      EXPECT_EQ(c.status, ToiStatus::Impact);
      EXPECT_EQ(d.status, ToiStatus::Impact);
      // Both lie within the tolerance of 1e-6 before the impact, at a speed of about 9.
      EXPECT_NEAR(c.t_safe, d.t_safe, 1e-5);
    }
  }
}

TEST(TimeOfImpact, RefusesBadInputNamingTheValue) {
  const Sphere sphere(1);
  const RestMotion rest{RigidPose()};
  const auto query = [&](const TimeInterval& interval, const ToiOptions& options) {
    return message_of([&] { time_of_impact(sphere, rest, sphere, rest, interval, options); });
  };
  EXPECT_NE(query({2, 1}, {}).find("begin 2 > end 1"), std::string::npos);
  EXPECT_NE(query({0, kInfinity}, {}).find("inf"), std::string::npos);
  ToiOptions negative;
  negative.target_distance = -0.5;
  EXPECT_NE(query({0, 1}, negative).find("-0.5"), std::string::npos);
  ToiOptions zero;
  zero.distance_tolerance = 0;
  EXPECT_NE(query({0, 1}, zero).find("distance_tolerance"), std::string::npos);
  ToiOptions nan;
  nan.distance_tolerance = std::nan("");
  EXPECT_NE(query({0, 1}, nan).find("nan"), std::string::npos);
  ToiOptions idle;
  idle.max_node_pairs = 0;
  EXPECT_NE(query({0, 1}, idle).find("max_node_pairs"), std::string::npos);
  const SampledMotion short_path({{0, at(0, 0, 0)}, {1, at(1, 0, 0)}});
  EXPECT_NE(message_of([&] {
              time_of_impact(sphere, short_path, sphere, rest, {0, 2});
            }).find("motion of A is defined only on [0, 1]"),
            std::string::npos);
}

TEST(TimeOfImpact, NeedsNoDistanceWhileBallsOfConvexShapesStayApart) {
  const Box box(Vector3(1, 1, 1));
  const RestMotion rest{RigidPose()};
  // Corners reach sqrt(3): at x = 10 - 6 t the balls are 10 - 6 t - 2 sqrt(3) apart.
  const ConstantTwistMotion X_WB = moving(at(10, 0, 0), {-6, 0, 0}, {50, -20, 30});
  const ToiResult apart = time_of_impact(box, rest, box, X_WB, {0, 1.08});
  EXPECT_EQ(apart.status, ToiStatus::Separated);
  EXPECT_EQ(apart.t_safe, 1.08);
  EXPECT_EQ(apart.statistics.leaf_tests, 0);
  const ToiResult impact = time_of_impact(box, rest, box, X_WB, {0, 2});
  EXPECT_EQ(impact.status, ToiStatus::Impact);
  EXPECT_GT(impact.t_safe, 1.0893);
}

// A needle that starts inside an organ is reported if the organ is a solid, and moves inside it if
// not.
TEST(TimeOfImpact, ABodyThatBeginsInsideASolidIsWithinTheTarget) {
  const TriangleMesh organ = testing::icosphere(3, 2).mesh();
  const TriangleMesh needle = segment_mesh(Vector3::Zero(), Vector3(0, 0, 0.5));
  const RestMotion rest{RigidPose()};
  const ConstantTwistMotion slow = moving(at(0.3, 0, 0), {0.1, 0, 0}, Vector3::Zero());
  ToiOptions options{.distance_tolerance = 1e-6};
  EXPECT_EQ(time_of_impact(needle, slow, organ, rest, {0, 1}, options).status,
            ToiStatus::Separated);
  options.solid_b = true;
  const ToiResult inside = time_of_impact(needle, slow, organ, rest, {0, 1}, options);
  EXPECT_EQ(inside.status, ToiStatus::InitiallyWithinTarget);
  EXPECT_EQ(inside.t_safe, 0);
  EXPECT_EQ(inside.contact->p_WCa, Vector3(0.3, 0, 0));
  EXPECT_EQ(inside.contact->p_WCb, Vector3(0.3, 0, 0));
  // From outside a solid is a surface.
  const ConstantTwistMotion fast = moving(at(3, 0, 0), {-2, 0, 0}, Vector3::Zero());
  EXPECT_EQ(time_of_impact(needle, fast, organ, rest, {0, 1}, options).status, ToiStatus::Impact);
  options.solid_a = true;
  EXPECT_THROW(time_of_impact(needle, slow, organ, rest, {0, 1}, options), InvalidArgument);
}

}  // namespace
}  // namespace dyop
