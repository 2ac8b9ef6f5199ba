// SPDX-License-Identifier: BSD-3-Clause

// Impacts on half-spaces, against closed forms and against the height of the lowest vertex at many
// times.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "dyop/core/error.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/impact_derivatives.h"
#include "dyop/toi/least_distance.h"
#include "dyop/toi/obstacle_set.h"
#include "dyop/toi/separating_translation.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using namespace testing;

TEST(HalfSpaceImpact, OfAFallingSphereIsWhenItsLowestPointIsThere) {
  for (const Scalar size : {1e-4, 1e-1, 1e1, 1e4}) {
    const HalfSpace plane(Vector3(0, 1, 2), 0.5 * size);
    const RigidPose X_WA(rotation_from_vector(Vector3(0.3, 0.2, 0.1)), size * Vector3(5, 6, 7));
    const Vector3 n_W = X_WA.rotation() * plane.normal();
    const Vector3 across = n_W.unitOrthogonal();
    const Vector3 start = X_WA.translation() + 3 * size * n_W + 40 * size * across;
    // 3 - 0.5 - 1 above the plane, at speed 2.
    const ConstantTwistMotion falling(RigidPose(start),
                                      {-2 * size * n_W + 9 * size * across, {0, 5, 1}});
    const ToiResult hit = time_of_impact(plane, RestMotion(X_WA), Sphere(size), falling, {0, 10});
    ASSERT_EQ(hit.status, ToiStatus::Impact);
    EXPECT_LE(hit.t_safe, 0.75);
    EXPECT_NEAR(hit.t_safe, 0.75, 1e-5);
    EXPECT_LE((hit.contact->nhat_AB_W - n_W).norm(), 1e-12);
    const ConstantTwistMotion rising(RigidPose(start), {2 * size * n_W, {0, 5, 1}});
    EXPECT_EQ(time_of_impact(Sphere(size), rising, plane, RestMotion(X_WA), {0, 1e6}).status,
              ToiStatus::Separated);
    const ConstantTwistMotion along(RigidPose(start), {7 * size * across, {0, 5, 1}});
    EXPECT_EQ(time_of_impact(Sphere(size), along, plane, RestMotion(X_WA), {0, 1e3}).status,
              ToiStatus::Separated);
  }
}

TEST(HalfSpaceImpact, WhatIsBelowBeginsWithinTheTarget) {
  const ConstantTwistMotion moving(RigidPose(Vector3(0, 0, -50)), {Vector3(0, 0, 1), {1, 2, 3}});
  const TriangleMesh mesh = icosphere(2).mesh();
  for (const Shape* shape : {static_cast<const Shape*>(&mesh)}) {
    EXPECT_EQ(time_of_impact(*shape, moving, HalfSpace(), RestMotion(), {0, 1}).status,
              ToiStatus::InitiallyWithinTarget);
  }
}

// The height of the lowest vertex, rounded shapes by their radius.
struct Body {
  std::shared_ptr<const Shape> shape;
  std::vector<Vector3> vertices;
  Scalar radius = 0;

  Scalar height(const RigidPose& X_WB, const HalfSpace& plane, const RigidPose& X_WA) const {
    const RigidPose X_AB = X_WA.inverse() * X_WB;
    Scalar least = kInfinity;
    for (const Vector3& v : vertices) least = std::min(least, plane.height(X_AB * v) - radius);
    return least;
  }
};

std::vector<Body> bodies(Scalar size) {
  const Vector3 half(size, 0.5 * size, 0.2 * size);
  const MeshArrays corners = box_mesh(half);
  const MeshArrays wheel = gear(9, 0.8 * size, size, 0.3 * size);
  const MeshArrays sheet = plate_grid(size, size, 4, 4);
  return {{std::make_shared<Box>(half), corners.vertices},
          {std::make_shared<RoundedBox>(half, 0.1 * size), corners.vertices, 0.1 * size},
          {std::make_shared<TriangleMesh>(wheel.vertices, wheel.triangles), wheel.vertices},
          {std::make_shared<TriangleMesh>(sheet.vertices, sheet.triangles), sheet.vertices}};
}

// Until t_safe nothing is nearer than the target, and at an impact the distance is there.
void expect_promises(const Body& body, const Motion& X_WB, const HalfSpace& plane,
                     const Motion& X_WA, Scalar size, int& impacts) {
  const TimeInterval interval{0, 2};
  ToiOptions options;
  options.target_distance = 1e-3 * size;
  options.distance_tolerance = 1e-6 * size;
  const auto height = [&](Scalar t) { return body.height(X_WB.pose(t), plane, X_WA.pose(t)); };
  for (const bool is_first : {true, false}) {
    const ToiResult found = is_first
                                ? time_of_impact(plane, X_WA, *body.shape, X_WB, interval, options)
                                : time_of_impact(*body.shape, X_WB, plane, X_WA, interval, options);
    const Scalar begin = height(0);
    const Scalar noise = 1e-9 * size;
    if (begin > options.target_distance + noise) {
      const Scalar end = found.status == ToiStatus::Separated ? 2 : found.t_safe;
      for (int k = 0; k <= 400; ++k) {
        EXPECT_GE(height(end * k / 400), options.target_distance - noise);
      }
    }
    if (found.status == ToiStatus::Impact) {
      ++impacts;
      EXPECT_LE(height(found.t_safe), options.target_distance + 1.01e-6 * size);
    } else if (found.status == ToiStatus::InitiallyWithinTarget) {
      EXPECT_LE(begin, options.target_distance + noise);
    } else {
      EXPECT_EQ(found.status, ToiStatus::Separated);
    }
  }
}

TEST(HalfSpaceImpact, KeepsItsPromisesForTurningBodies) {
  std::mt19937_64 random(11);
  int impacts = 0;
  for (const Scalar size : {1e-4, 1e-1, 1e1, 1e4}) {
    for (const Body& body : bodies(size)) {
      for (int k = 0; k < 12; ++k) {
        const HalfSpace plane(random_direction(random), random_number(-size, size, random));
        const RigidPose X_WA = random_pose(k % 4 == 3 ? 1e4 * size : size, random);
        const Vector3 n_W = X_WA.rotation() * plane.normal();
        const Vector3 start = X_WA.translation() + plane.offset() * n_W +
                              random_number(0.5, 3, random) * size * n_W +
                              random_vector(3 * size, random).cross(n_W);
        Twist twist = random_twist(3 * size, 6, random);
        if (k % 2 == 0) twist.v_WB -= 2 * size * n_W;
        const ConstantTwistMotion moving(RigidPose(random_rotation(random), start), twist);
        expect_promises(body, moving, plane, RestMotion(X_WA), size, impacts);
      }
    }
  }
  EXPECT_GT(impacts, 100);
}

// The plane itself turns, steadily or with an acceleration.
TEST(HalfSpaceImpact, KeepsItsPromisesForTurningPlanes) {
  std::mt19937_64 random(12);
  int impacts = 0;
  for (const Scalar size : {1e-2, 1e2}) {
    for (const Body& body : bodies(size)) {
      for (int k = 0; k < 6; ++k) {
        const HalfSpace plane(Vector3::UnitZ(), 0);
        const Vector3 start = size * Vector3(random_number(-4, 4, random), 0, 3);
        const ConstantTwistMotion moving(RigidPose(random_rotation(random), start),
                                         random_twist(size, 3, random));
        const ConstantTwistMotion tilting(RigidPose(), random_twist(size, 1, random));
        expect_promises(body, moving, plane, tilting, size, impacts);
        HermiteNode first;
        HermiteNode last;
        first.p_WB = last.p_WB = Vector3::Zero();
        first.theta_rate = random_vector(0.5, random);
        last.theta = random_vector(0.5, random);
        const HermiteMotion swaying =
            HermiteMotion::from_chart({0, 2}, Matrix3::Identity(), first, last);
        expect_promises(body, moving, plane, swaying, size, impacts);
      }
    }
  }
  EXPECT_GT(impacts, 10);
}

TEST(HalfSpaceImpact, LeastDistanceIsThatOfTheLowestTime) {
  const HalfSpace floor;
  // A parabola, lowest at t = 1: height 2 above the floor, less the radius.
  HermiteNode first;
  first.p_WB = Vector3(-5, 0, 3);
  first.v_WB = Vector3(5, 0, -2);
  HermiteNode last;
  last.p_WB = Vector3(5, 0, 3);
  last.v_WB = Vector3(5, 0, 2);
  const HermiteMotion swing = HermiteMotion::from_chart({0, 2}, Matrix3::Identity(), first, last);
  const LeastDistanceResult found = least_distance(floor, RestMotion(), Sphere(0.5), swing, {0, 2});
  EXPECT_EQ(found.status, LeastDistanceStatus::Bounded);
  EXPECT_LE(found.lower, 1.5);
  EXPECT_GE(found.upper, 1.5);
  EXPECT_NEAR(found.upper, 1.5, 1e-5);
}

TEST(HalfSpaceImpact, TheWayOutIsAsLongAsTheLowestPointIsDeep) {
  std::mt19937_64 random(8);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    for (const Scalar far : {0.0, 1e4}) {
      for (const Body& body : bodies(size)) {
        const HalfSpace plane(random_direction(random), random_number(-size, size, random));
        const Vector3 place = far * size * random_direction(random);
        const RigidPose X_WA(random_rotation(random), place);
        const Vector3 on_plane = X_WA * (plane.offset() * plane.normal());
        const RigidPose X_WB(random_rotation(random), on_plane + random_vector(0.3 * size, random));
        const Scalar depth = -body.height(X_WB, plane, X_WA);
        if (!(depth > 1e-6 * size)) continue;
        const Scalar noise = 1e-12 * size * (1 + far);
        for (const bool is_first : {true, false}) {
          const auto way = is_first ? separating_translation(plane, X_WA, *body.shape, X_WB)
                                    : separating_translation(*body.shape, X_WB, plane, X_WA);
          ASSERT_TRUE(way.has_value());
          EXPECT_GE(way->depth, depth - noise);
          EXPECT_LE(way->depth, depth + 1e-5 * size + noise);
          const Vector3 step = (is_first ? 1 : -1) * way->depth * way->nhat_AB_W;
          const RigidPose moved(X_WB.rotation(), X_WB.translation() + step);
          EXPECT_GT(body.height(moved, plane, X_WA), -noise);
          EXPECT_NEAR(plane.height(X_WA.inverse() * way->p_W), -depth, 1e-5 * size + noise);
        }
      }
    }
  }
  EXPECT_FALSE(separating_translation(HalfSpace(), {}, HalfSpace(Vector3(1, 0, 0)), {}));
}

TEST(HalfSpaceImpact, IsFoundAmongObstacles) {
  ObstacleSet set;
  Obstacle floor;
  floor.shape = std::make_shared<HalfSpace>();
  floor.X_WO = std::make_shared<RestMotion>();
  const ObstacleId floor_id = set.add(std::move(floor));
  for (int k = 0; k < 50; ++k) {
    Obstacle ball;
    ball.shape = std::make_shared<Sphere>(0.2);
    ball.X_WO = std::make_shared<RestMotion>(RigidPose(Vector3(k, 3, 1)));
    set.add(std::move(ball));
  }
  const Box box(Vector3(0.1, 0.2, 0.3));
  const ConstantTwistMotion falling(RigidPose(Vector3(20, 0, 2)), {Vector3(0, 0, -1), {1, 2, 0}});
  const ObstacleImpact impact = set.first_impact(box, falling, {0, 5});
  ASSERT_EQ(impact.toi.status, ToiStatus::Impact);
  EXPECT_EQ(impact.obstacle, floor_id);
  const ToiResult alone = time_of_impact(box, falling, HalfSpace(), RestMotion(), {0, 5});
  EXPECT_NEAR(impact.toi.t_safe, alone.t_safe, 1e-6);
  const NearestObstacle nearest = set.nearest(box, RigidPose(Vector3(20, -9, 1)));
  EXPECT_EQ(nearest.obstacle, floor_id);
  EXPECT_NEAR(nearest.distance.upper, 0.7, 1e-9);
}

TEST(HalfSpaceImpact, ATimeOfImpactHasADerivative) {
  const ConstantTwistMotion falling(RigidPose(Vector3(0, 0, 3)), {Vector3(1, 0, -2), {0, 0, 0}});
  const Sphere ball(1);
  const HalfSpace floor;
  ToiOptions options;
  options.target_distance = 0.1;  // at a tiny gap nothing is proven
  const ToiResult hit = time_of_impact(floor, RestMotion(), ball, falling, {0, 4}, options);
  ASSERT_EQ(hit.status, ToiStatus::Impact);
  const ImpactDerivatives found = impact_derivatives(floor, RestMotion(), ball, falling, hit);
  EXPECT_EQ(found.status, DerivativeStatus::Proven);
  EXPECT_NEAR(found.closing_speed, 2, 1e-9);
}

}  // namespace
}  // namespace dyop
