// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/gjk.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numbers>

#include "core/tolerance.h"
#include "distance/gjk/triangle_core.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/ellipsoid.h"
#include "support/oracles/polytope_oracle.h"

namespace dyop {
namespace {

using testing::make_box;
using testing::make_capsule;
using testing::make_sphere;
using testing::PointHull;

Scalar query_size(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB) {
  return X_AB.translation().norm() + a.bounding_radius() + b.bounding_radius();
}

// Both bounds, the certificate and the witness points, for (a, b) and for (b, a).
void expect_distance(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                     Scalar expected) {
  const Scalar noise = 4 * kPoseNoise * query_size(a, b, X_AB);
  const RigidPose X_BA = X_AB.inverse();
  for (const bool is_swapped : {false, true}) {
    const GjkResult r = is_swapped ? gjk_distance(b, a, X_BA) : gjk_distance(a, b, X_AB);
    EXPECT_NEAR(r.lower, expected, noise);
    EXPECT_NEAR(r.upper, expected, noise);
    EXPECT_LE(r.lower, r.upper);
    EXPECT_FALSE(r.is_overlapping);
    EXPECT_NEAR((r.p_b - r.p_a).norm(), expected, noise);
    EXPECT_NEAR(r.nhat_AB.norm(), 1, 4 * kUnitRoundoff);
    EXPECT_GE(r.nhat_AB.dot(r.p_b - r.p_a), expected - noise);
  }
}

void expect_overlap(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB) {
  const Scalar noise = 2 * kPoseNoise * query_size(a, b, X_AB);
  for (const GjkResult& r : {gjk_distance(a, b, X_AB), gjk_distance(b, a, X_AB.inverse())}) {
    EXPECT_TRUE(r.is_overlapping);
    EXPECT_EQ(r.lower, 0);
    EXPECT_LE(r.upper, noise);
    EXPECT_LE((r.p_b - r.p_a).norm(), noise);
    EXPECT_NEAR(r.nhat_AB.norm(), 1, 4 * kUnitRoundoff);
  }
}

Matrix3 turn(const Vector3& axis, Scalar angle) {
  return rotation_from_vector(axis.normalized() * angle);
}

const Scalar kQuarter = std::numbers::pi / 4;

TEST(Gjk, SpheresAreApartByCentersMinusRadii) {
  for (const Scalar s : {1e-4, 1.0, 1e4}) {
    // |(3, 4, 12)| = 13.
    expect_distance(make_sphere(2 * s), make_sphere(5 * s), RigidPose(s * Vector3(3, 4, 12)),
                    6 * s);
  }
}

TEST(Gjk, SphereMeetsFaceEdgeAndCornerOfBox) {
  const PointHull box = make_box({1, 2, 3});
  const PointHull sphere = make_sphere(0.5);
  expect_distance(box, sphere, RigidPose(Vector3(4, 0.3, -0.2)), 4 - 1 - 0.5);
  expect_distance(box, sphere, RigidPose(Vector3(4, 6, 0.7)), 5 - 0.5);  // (3, 4) to the edge
  expect_distance(box, sphere, RigidPose(Vector3(4, 6, 15)), 13 - 0.5);  // (3, 4, 12)
}

TEST(Gjk, NamesFeaturesByVertexNumbers) {
  const PointHull box = make_box({1, 2, 3});
  const PointHull sphere = make_sphere(0.5);
  const GjkResult corner = gjk_distance(box, sphere, RigidPose(Vector3(4, 6, 15)));
  EXPECT_EQ(corner.feature_a, (Feature{FeatureKind::Vertex, {7}}));
  EXPECT_EQ(corner.feature_b, (Feature{FeatureKind::Vertex, {0}}));
  const GjkResult edge = gjk_distance(box, sphere, RigidPose(Vector3(4, 6, 0.7)));
  EXPECT_EQ(edge.feature_a, (Feature{FeatureKind::Edge, {3, 7}}));
  const GjkResult face = gjk_distance(box, sphere, RigidPose(Vector3(4, 0.3, -0.2)));
  EXPECT_EQ(face.feature_a.kind, FeatureKind::Face);
  for (const std::int32_t vertex : face.feature_a.vertices) EXPECT_EQ(vertex & 1, 1);  // x = +1
}

TEST(Gjk, PlacesWitnessPointsOnTheRoundedSurfaces) {
  const GjkResult r =
      gjk_distance(make_box({1, 2, 3}), make_sphere(0.5), RigidPose(Vector3(4, 0.3, -0.2)));
  EXPECT_LT((r.p_a - Vector3(1, 0.3, -0.2)).norm(), 1e-14);
  EXPECT_LT((r.p_b - Vector3(3.5, 0.3, -0.2)).norm(), 1e-14);
  EXPECT_LT((r.nhat_AB - Vector3::UnitX()).norm(), 1e-14);
}

TEST(Gjk, CapsulesParallelAndCrossed) {
  const PointHull a = make_capsule(2, 0.25);
  const PointHull b = make_capsule(1, 0.5);
  expect_distance(a, b, RigidPose(Vector3(3, 4, 0.5)), 5 - 0.75);
  // Segments [-2, 2] and [6, 8] along z: ends 4 apart in z and 3 in x.
  expect_distance(a, b, RigidPose(Vector3(3, 0, 7)), 5 - 0.75);
  // Crossed at right angles, a along z, b along y.
  expect_distance(a, b, RigidPose(turn(Vector3::UnitX(), 2 * kQuarter), Vector3(2, 0.3, -0.4)),
                  2 - 0.75);
}

TEST(Gjk, BoxesFaceToFaceEdgeToEdgeAndCornerToFace) {
  const PointHull cube = make_box({1, 1, 1});
  expect_distance(cube, cube, RigidPose(Vector3(2.5, 0, 0)), 0.5);
  expect_distance(cube, cube, RigidPose(Vector3(2.5, 0.7, -1.1)), 0.5);
  // Parallel edges: (3, 4) between them.
  expect_distance(cube, cube, RigidPose(Vector3(5, 6, 0.5)), 5);
  // Corner to corner: (3, 4, 12).
  expect_distance(cube, cube, RigidPose(Vector3(5, 6, 14)), 13);
  // b turned by 45 degrees about z shows an edge to a's face: it reaches sqrt(2) from its centre.
  expect_distance(cube, cube, RigidPose(turn(Vector3::UnitZ(), kQuarter), Vector3(4, 0.2, 0.1)),
                  4 - 1 - std::numbers::sqrt2);
  // b's diagonal along x: a corner, sqrt(3) from its centre, to a's face.
  const Matrix3 R_diagonal =
      rotation_between(Vector3(1, 1, 1), Vector3::UnitX()).toRotationMatrix();
  expect_distance(cube, cube, RigidPose(R_diagonal, Vector3(4, 0.2, 0.1)),
                  4 - 1 - std::numbers::sqrt3);
  // Crossed edges: a turned 45 degrees about z, b about y; both show an edge along x.
  const RigidPose X_WA(turn(Vector3::UnitZ(), kQuarter), Vector3::Zero());
  const RigidPose X_WB(turn(Vector3::UnitY(), kQuarter), Vector3(5, 0.1, 0.2));
  expect_distance(cube, cube, X_WA.inverse() * X_WB, 5 - 2 * std::numbers::sqrt2);
}

TEST(Gjk, OverlapIsProvenAtEveryDepth) {
  const PointHull cube = make_box({1, 1, 1});
  expect_overlap(cube, cube, RigidPose());
  expect_overlap(cube, cube, RigidPose(Vector3(1.9, 0.1, 0.2)));
  expect_overlap(cube, cube, RigidPose(turn({1, 2, 3}, 1), Vector3(0.5, 0.1, 0.2)));
  expect_overlap(cube, make_box({1e-3, 1e-3, 1e-3}), RigidPose(Vector3(0.3, 0.4, 0.5)));
  expect_overlap(make_sphere(1), make_sphere(2), RigidPose(Vector3(2.5, 0, 0)));
  expect_overlap(make_sphere(1), make_sphere(1), RigidPose());
  expect_overlap(make_capsule(1, 0.1), make_capsule(1, 0.1),
                 RigidPose(turn(Vector3::UnitX(), 1), Vector3::Zero()));
  expect_overlap(cube, make_sphere(0.1), RigidPose(Vector3(0.2, 0.1, 0)));
}

TEST(Gjk, TouchingIsOverlapUpToNoise) {
  const PointHull cube = make_box({1, 1, 1});
  expect_overlap(cube, cube, RigidPose(Vector3(2, 0, 0)));
  expect_overlap(cube, cube, RigidPose(Vector3(2, 2, 2)));
  expect_overlap(make_sphere(1), cube, RigidPose(Vector3(0, 0, 2)));
}

TEST(Gjk, OverlapOfRoundingsGivesACommonPoint) {
  // Spheres of radius 1 and 2 with centres 2 apart: the point 2/3 from the first is in both.
  const GjkResult r = gjk_distance(make_sphere(1), make_sphere(2), RigidPose(Vector3(2, 0, 0)));
  EXPECT_EQ(r.upper, 0);
  EXPECT_LT((r.p_a - Vector3(2.0 / 3, 0, 0)).norm(), 1e-15);
  EXPECT_LT((r.p_b - r.p_a).norm(), 1e-15);
}

TEST(Gjk, ShapesOfTheLibraryGiveTheSameAnswers) {
  const RigidPose X_AB(turn({1, 2, 3}, 1), Vector3(3, 4, -2));
  const Scalar noise = 4 * kPoseNoise * 20;
  const auto expect_same = [&](const GjkResult& r, const GjkResult& expected) {
    EXPECT_GT(expected.lower, 0);
    EXPECT_NEAR(r.lower, expected.lower, noise);
    EXPECT_NEAR(r.upper, expected.upper, noise);
    EXPECT_LT((r.nhat_AB - expected.nhat_AB).norm(), 1e-12);
  };
  const Vector3 half_extents(1, 2, 3);
  const PointHull hull = make_box(half_extents);
  const Box box(half_extents);
  expect_same(gjk_distance(box, Capsule(0.5, 1), X_AB),
              gjk_distance(hull, make_capsule(1, 0.5), X_AB));
  expect_same(gjk_distance(Sphere(0.25), box, X_AB), gjk_distance(make_sphere(0.25), hull, X_AB));
  expect_same(gjk_distance(ConvexHull(hull.points()), Sphere(0.25), X_AB),
              gjk_distance(hull, make_sphere(0.25), X_AB));
}

TEST(Gjk, DegenerateTrianglesAreLegal) {
  const Vector3 p(1, 2, 3);
  const distance_internal::TriangleCore point({p, p, p});
  const distance_internal::TriangleCore segment({p, p, p + Vector3(2, 0, 0)});
  const distance_internal::TriangleCore triangle(
      {Vector3(0, 0, 0), Vector3(9, 0, 0), Vector3(0, 9, 0)});
  expect_distance(triangle, point, RigidPose(), 3);
  expect_distance(triangle, segment, RigidPose(), 3);
  expect_distance(point, segment, RigidPose(Vector3(0, 0.5, 0)), 0.5);
  expect_overlap(point, segment, RigidPose(Vector3(-1, 0, 0)));
  EXPECT_EQ(gjk_distance(point, triangle, RigidPose()).feature_a,
            (Feature{FeatureKind::Vertex, {0}}));
}

// What a triangle's core has of a shape beside its support points.
TEST(TriangleCore, IsAShapeWithoutAVolume) {
  const distance_internal::TriangleCore core(
      {Vector3(1, 0, 0), Vector3(0, 2, 0), Vector3(0, 0, 3)});
  EXPECT_LT((core.core_center() - Vector3(1, 2, 3) / 3).norm(), 1e-15);
  EXPECT_EQ(core.bounding_box().min(), Vector3::Zero());
  EXPECT_EQ(core.bounding_box().max(), Vector3(1, 2, 3));
  EXPECT_GE(core.bounding_radius(), 3);
  EXPECT_THROW(core.compute_mass_properties(1), InvalidArgument);
}

TEST(Gjk, SmoothCoresConvergeRelatively) {
  using testing::UserEllipsoid;
  const UserEllipsoid ball({1, 1, 1});
  const GjkResult balls = gjk_distance(ball, ball, RigidPose(Vector3(3, 4, 12)));
  EXPECT_LE(balls.lower, 11);
  EXPECT_GE(balls.upper, 11);
  EXPECT_LT(balls.upper - balls.lower, 1e-8);
  const UserEllipsoid egg({1, 2, 0.5});
  const PointHull cube = make_box({1, 1, 1});
  const GjkResult r = gjk_distance(egg, cube, RigidPose(turn({1, 2, 3}, 1), Vector3(1, 3, 2)));
  EXPECT_GT(r.lower, 0);
  EXPECT_LT(r.upper - r.lower, 1e-8);
  EXPECT_EQ(r.feature_a.kind, FeatureKind::Smooth);
  EXPECT_LE(r.iterations, 2 * kGjkIterationLimit);
}

// A support function that breaks its promise.
class BrokenShape final : public ConvexShape {
 public:
  SupportPoint core_support(const Vector3&) const override {
    return {Vector3::Constant(std::numeric_limits<Scalar>::quiet_NaN()), 0};
  }
  Vector3 core_center() const override { return Vector3::Zero(); }
  AlignedBox bounding_box() const override { return {}; }
  Scalar bounding_radius() const override { return 1; }
  MassProperties compute_mass_properties(Scalar) const override { return {}; }
};

TEST(Gjk, NanEndsOnTheSafeSide) {
  const PointHull cube = make_box({1, 1, 1});
  for (const GjkResult& r : {gjk_distance(BrokenShape(), cube, RigidPose(Vector3(9, 0, 0))),
                             gjk_distance(cube, BrokenShape(), RigidPose(Vector3(9, 0, 0)))}) {
    EXPECT_EQ(r.lower, 0);
    EXPECT_EQ(r.upper, kInfinity);
    EXPECT_FALSE(r.is_overlapping);
  }
}

}  // namespace
}  // namespace dyop
