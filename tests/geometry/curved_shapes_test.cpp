// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "geometry/all_shapes.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

// Farthest points of a shape along directions spread over a sphere.
std::vector<Vector3> surface_points(const ConvexShape& shape) {
  std::vector<Vector3> points;
  for (const Vector3& n : testing::icosphere(4).vertices) points.push_back(shape.support(n));
  return points;
}

// The mass of the hull of many of its points is a little less.
void expect_mass_of_hull(const ConvexShape& shape) {
  const MassProperties exact = shape.compute_mass_properties(2);
  const MassProperties hull = ConvexHull(surface_points(shape)).compute_mass_properties(2);
  EXPECT_LE(hull.mass, exact.mass * (1 + 1e-12));
  EXPECT_GE(hull.mass, 0.985 * exact.mass);
  EXPECT_LE((hull.p_BoBcm - exact.p_BoBcm).norm(), 0.01 * shape.bounding_radius());
  EXPECT_LE((hull.I_BBcm - exact.I_BBcm).norm(), 0.03 * exact.I_BBcm.norm());
}

TEST(CurvedShapes, HaveTheMassOfTheHullOfTheirPoints) {
  expect_mass_of_hull(Cylinder(0.5, 0.8));
  expect_mass_of_hull(Cone(0.5, 0.8));
  expect_mass_of_hull(Ellipsoid(Vector3(1, 0.7, 0.4)));
  expect_mass_of_hull(RoundedBox(Vector3(0.5, 0.3, 0.2), 0.3));
  expect_mass_of_hull(RoundedCylinder(0.4, 0.5, 0.3));
  expect_mass_of_hull(TaperedCapsule(0.5, 0.2, 0.6));
}

TEST(Cylinder, HasTheMomentsOfTheTextbook) {
  const MassProperties properties = Cylinder(2, 3).compute_mass_properties(1);
  EXPECT_NEAR(properties.mass, 24 * std::numbers::pi, 1e-12);
  EXPECT_NEAR(properties.I_BBcm(2, 2) / properties.mass, 2, 1e-12);
  EXPECT_NEAR(properties.I_BBcm(0, 0) / properties.mass, 1 + 3, 1e-12);
}

TEST(RoundedBox, WithoutExtentsIsASphereAndWithoutRadiusABox) {
  const MassProperties sphere = Sphere(2).compute_mass_properties(3);
  const MassProperties nearly = RoundedBox(Vector3::Constant(1e-9), 2).compute_mass_properties(3);
  EXPECT_NEAR(nearly.mass, sphere.mass, 1e-6);
  EXPECT_NEAR(nearly.I_BBcm(0, 0), sphere.I_BBcm(0, 0), 1e-6);
  const MassProperties box = Box(Vector3(1, 2, 3)).compute_mass_properties(3);
  const MassProperties sharp = RoundedBox(Vector3(1, 2, 3), 1e-9).compute_mass_properties(3);
  EXPECT_NEAR(sharp.mass, box.mass, 1e-5);
  EXPECT_NEAR(sharp.I_BBcm(1, 1), box.I_BBcm(1, 1), 1e-4);
}

TEST(CurvedShapes, SupportPointsAreWhereTheyShouldBe) {
  const Cylinder cylinder(2, 3);
  EXPECT_TRUE(cylinder.core_support(Vector3(3, 4, 1)).point.isApprox(Vector3(1.2, 1.6, 3), 1e-15));
  EXPECT_EQ(cylinder.core_support(Vector3(0, 0, -1)).point, Vector3(0, 0, -3));
  EXPECT_FALSE(cylinder.core_support(Vector3(1, 0, 0)).vertex.has_value());
  const Cone cone(2, 3);
  EXPECT_EQ(cone.core_support(Vector3(0.1, 0, 1)).point, Vector3(0, 0, 3));
  EXPECT_EQ(cone.core_support(Vector3(1, 0, 0)).point, Vector3(2, 0, -3));
  const Ellipsoid ellipsoid(Vector3(1, 2, 3));
  EXPECT_EQ(ellipsoid.core_support(Vector3(0, -5, 0)).point, Vector3(0, -2, 0));
  const RoundedBox box(Vector3(1, 2, 3), 0.5);
  EXPECT_EQ(box.support(Vector3::UnitX()).x(), 1.5);
  EXPECT_EQ(box.bounding_box().sizes().maxCoeff() >= 7, true);
}

// All points of a flat part are as far along its normal as the support point, up to rounding.
void expect_flat(const ConvexShape& shape, const FlatPart& part, const Vector3& n) {
  const Scalar reach = n.dot(shape.core_support(n).point);
  const Scalar noise = 1e-14 * shape.bounding_radius();
  EXPECT_NEAR(n.dot(part.center), reach, noise);
  if (part.kind == FlatPart::Kind::Segment) {
    EXPECT_NEAR(n.dot(part.center + part.axis), reach, noise);
    EXPECT_NEAR(n.dot(part.center - part.axis), reach, noise);
  } else {
    const Vector3 rim = part.center + part.radius * part.axis.unitOrthogonal();
    EXPECT_NEAR(n.dot(rim), reach, noise);
  }
}

TEST(CurvedShapes, HaveTheFlatPartThatFacesADirection) {
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    const Cylinder cylinder(2 * size, 3 * size);
    const FlatPart cap = cylinder.flat_part(Vector3(0.01, 0, -1).normalized(), 0.02);
    ASSERT_EQ(cap.kind, FlatPart::Kind::Disc);
    EXPECT_EQ(cap.axis, -Vector3::UnitZ());
    EXPECT_EQ(cap.radius, 2 * size);
    expect_flat(cylinder, cap, cap.axis);
    const FlatPart side = cylinder.flat_part(Vector3(0.6, 0.8, 0.01).normalized(), 0.02);
    ASSERT_EQ(side.kind, FlatPart::Kind::Segment);
    EXPECT_NEAR(side.axis.norm(), 3 * size, 1e-14 * size);
    expect_flat(cylinder, side, Vector3(0.6, 0.8, 0));
    const Cone cone(2 * size, 3 * size);
    const FlatPart base = cone.flat_part(-Vector3::UnitZ(), 0.02);
    ASSERT_EQ(base.kind, FlatPart::Kind::Disc);
    expect_flat(cone, base, -Vector3::UnitZ());
    const Vector3 n = Vector3(0.6 * 6, 0.8 * 6, 2).normalized();  // across a side from base to tip
    const FlatPart slope = cone.flat_part(n, 0.02);
    ASSERT_EQ(slope.kind, FlatPart::Kind::Segment);
    EXPECT_TRUE((slope.center + slope.axis).isApprox(Vector3(0, 0, 3 * size), 1e-14));
    expect_flat(cone, slope, n);
  }
}

TEST(CurvedShapes, HaveNoFlatPartBeyondTheAngle) {
  const Cylinder cylinder(2, 3);
  EXPECT_EQ(cylinder.flat_part(Vector3(0.03, 0, 1).normalized(), 0.02).kind, FlatPart::Kind::None);
  EXPECT_EQ(cylinder.flat_part(Vector3(1, 0, 0.03).normalized(), 0.02).kind, FlatPart::Kind::None);
  const Cone cone(2, 3);
  EXPECT_EQ(cone.flat_part(Vector3::UnitZ(), 0.02).kind, FlatPart::Kind::None);
  EXPECT_EQ(cone.flat_part(Vector3::UnitX(), 0.02).kind, FlatPart::Kind::None);
  EXPECT_EQ(Ellipsoid(Vector3(1, 2, 3)).flat_part(Vector3::UnitX(), 0.5).kind,
            FlatPart::Kind::None);
  EXPECT_EQ(Box(Vector3(1, 2, 3)).flat_part(Vector3::UnitX(), 0.5).kind, FlatPart::Kind::None);
}

TEST(CurvedShapes, RefuseBadSizes) {
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  EXPECT_THROW(Cylinder(0, 1), InvalidArgument);
  EXPECT_THROW(Cylinder(1, nan), InvalidArgument);
  EXPECT_THROW(Cone(1, -1), InvalidArgument);
  EXPECT_THROW(Ellipsoid(Vector3(1, 0, 1)), InvalidArgument);
  EXPECT_THROW(RoundedBox(Vector3(1, 1, 1), 0), InvalidArgument);
  EXPECT_THROW(RoundedBox(Vector3(1, -1, 1), 1), InvalidArgument);
}

TEST(HalfSpace, HasANormalOfLengthOneAndAnOffset) {
  const HalfSpace plane(Vector3(0, 0, 5), 2);
  EXPECT_EQ(plane.normal(), Vector3::UnitZ());
  EXPECT_EQ(plane.offset(), 2);
  EXPECT_EQ(plane.height(Vector3(7, 8, 3)), 1);
  EXPECT_EQ(plane.bounding_box().max().z(), 2);
  EXPECT_GE(plane.bounding_box().max().x(), 1e59);
  EXPECT_THROW(HalfSpace(Vector3(0, 0, 0)), InvalidArgument);
  EXPECT_THROW(HalfSpace(Vector3(0, std::nan(""), 1)), InvalidArgument);
  EXPECT_THROW(HalfSpace(Vector3::UnitX(), kInfinity), InvalidArgument);
  EXPECT_THROW(HalfSpace(Vector3::UnitX(), std::nan("")), InvalidArgument);
  EXPECT_THROW(plane.compute_mass_properties(1), InvalidArgument);
  EXPECT_THROW(CompoundShape({{std::make_shared<HalfSpace>(), RigidPose()}}), InvalidArgument);
}

TEST(HalfSpace, ItsPartWithinARadiusIsInItsBoundsAndNotBeatenByAnyOfItsPoints) {
  std::mt19937_64 random(1);
  for (int k = 0; k < 300; ++k) {
    const Scalar size = testing::random_magnitude(-4, 4, random);
    const Scalar offset = testing::random_number(-size, size, random);
    const HalfSpace part = HalfSpace(testing::random_direction(random), offset).within(size);
    const Scalar radius = part.bounding_radius();
    ASSERT_GE(radius, size);
    const Scalar noise = 8 * kUnitRoundoff * radius;
    for (int i = 0; i < 20; ++i) {
      const Vector3 d = i == 0 ? part.normal() : testing::random_direction(random);
      const Vector3 p = part.core_support(d).point;
      EXPECT_NEAR(part.core_reach(d), d.dot(p), noise);
      EXPECT_LE(part.height(p), noise);
      EXPECT_LE(p.norm(), radius + noise);
      EXPECT_TRUE(part.bounding_box().contains(p));
      const Vector3 q = radius * std::cbrt(testing::random_number(0, 1, random)) *
                        testing::random_direction(random);
      if (part.height(q) <= 0) {
        EXPECT_LE(d.dot(q), part.core_reach(d) + noise);
      }
    }
    EXPECT_NEAR(part.core_reach(part.normal()), offset, noise / 4);
    EXPECT_TRUE(std::isnan(part.core_reach(Vector3(1, std::nan(""), 1))));
  }
}

void expect_same_mass(const MassProperties& x, const MassProperties& y, Scalar size) {
  EXPECT_NEAR(x.mass / y.mass, 1, 1e-11);
  EXPECT_LE((x.p_BoBcm - y.p_BoBcm).norm(), 1e-11 * size);
  EXPECT_LE((x.I_BBcm - y.I_BBcm).norm(), 1e-10 * y.I_BBcm.norm());
}

// The corners of a box, turned and far away, with one point inside and one in a face.
TEST(ConvexHull, RoundedHasTheMassOfARoundedBox) {
  const Vector3 half(0.5, 0.3, 0.2);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    for (const Scalar radius : {1e-3, 0.2, 5.0}) {
      const RigidPose X(rotation_from_vector(Vector3(0.3, -1, 0.7)), size * Vector3(3, -2, 5));
      std::vector<Vector3> points{X * Vector3(0, 0, 0), X * (size * Vector3(0.5, 0, 0))};
      for (const Vector3& v : testing::box_mesh(size * half).vertices) points.push_back(X * v);
      const ConvexHull hull(points, size * radius);
      MassProperties expected = RoundedBox(size * half, size * radius).compute_mass_properties(2.5);
      expected.p_BoBcm = X * expected.p_BoBcm;
      expected.I_BBcm = X.rotation() * expected.I_BBcm * X.rotation().transpose();
      expect_same_mass(hull.compute_mass_properties(2.5), expected, size * (10 + radius));
    }
  }
}

TEST(ConvexHull, RoundedSegmentsAndPointsAreCapsulesAndBalls) {
  const Vector3 from(1, 2, 3);
  const Vector3 along(0, 0, 2);
  const Capsule capsule(0.5, 1);
  MassProperties expected = capsule.compute_mass_properties(3);
  expected.p_BoBcm = from + along / 2;
  expect_same_mass(
      ConvexHull({from, from + along / 3, from + along}, 0.5).compute_mass_properties(3), expected,
      1);
  MassProperties ball = Sphere(0.5).compute_mass_properties(3);
  ball.p_BoBcm = from;
  expect_same_mass(ConvexHull({from, from}, 0.5).compute_mass_properties(3), ball, 1);
  const ConvexHull polygon({Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)}, 0.5);
  EXPECT_THROW(polygon.compute_mass_properties(1), InvalidArgument);
  EXPECT_THROW(ConvexHull({from}, -1), InvalidArgument);
  EXPECT_THROW(ConvexHull({from}, std::nan("")), InvalidArgument);
}

TEST(TaperedCapsule, OfEqualRadiiIsACapsule) {
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    expect_same_mass(TaperedCapsule(0.3 * size, 0.3 * size, size).compute_mass_properties(2),
                     Capsule(0.3 * size, size).compute_mass_properties(2), size);
    const TaperedCapsule one(0.5 * size, 0.2 * size, 0.6 * size);
    MassProperties turned =
        TaperedCapsule(0.2 * size, 0.5 * size, 0.6 * size).compute_mass_properties(2);
    turned.p_BoBcm = -turned.p_BoBcm;
    expect_same_mass(one.compute_mass_properties(2), turned, size);
  }
  EXPECT_THROW(TaperedCapsule(3, 1, 1), InvalidArgument);
  EXPECT_THROW(TaperedCapsule(1, 0, 2), InvalidArgument);
  EXPECT_THROW(TaperedCapsule(1, 1, std::nan("")), InvalidArgument);
}

// Both balls are equally far along the normal of the side, which is perpendicular to its line.
TEST(TaperedCapsule, HasALineOnItsSide) {
  const TaperedCapsule shape(0.5, 0.2, 0.6);
  const Scalar lean = 0.3 / 1.2;
  const Vector3 normal(std::sqrt(1 - lean * lean), 0, lean);
  const FlatPart part = shape.flat_part(normal, 1e-6);
  ASSERT_EQ(part.kind, FlatPart::Kind::Segment);
  EXPECT_NEAR(part.axis.dot(normal), 0, 1e-15);
  for (const Scalar t : {-1.0, 0.0, 1.0}) {
    EXPECT_NEAR(normal.dot(part.center + t * part.axis), normal.dot(shape.support(normal)), 1e-15);
  }
  EXPECT_EQ(shape.flat_part(Vector3::UnitX(), 1e-6).kind, FlatPart::Kind::None);
  EXPECT_EQ(shape.flat_part(-Vector3::UnitZ(), 0.1).kind, FlatPart::Kind::None);
}

TEST(RoundedCylinder, IsACapsuleOrACylinderAtItsLimits) {
  const MassProperties thin = RoundedCylinder(1e-9, 2, 0.5).compute_mass_properties(3);
  const MassProperties capsule = Capsule(0.5, 2).compute_mass_properties(3);
  EXPECT_NEAR(thin.mass / capsule.mass, 1, 1e-7);
  EXPECT_LE((thin.I_BBcm - capsule.I_BBcm).norm(), 1e-7 * capsule.I_BBcm.norm());
  const MassProperties sharp = RoundedCylinder(0.5, 2, 1e-9).compute_mass_properties(3);
  const MassProperties cylinder = Cylinder(0.5, 2).compute_mass_properties(3);
  EXPECT_NEAR(sharp.mass / cylinder.mass, 1, 1e-7);
  EXPECT_LE((sharp.I_BBcm - cylinder.I_BBcm).norm(), 1e-7 * cylinder.I_BBcm.norm());
  EXPECT_THROW(RoundedCylinder(1, 1, 0), InvalidArgument);
  EXPECT_THROW(RoundedCylinder(1, -1, 1), InvalidArgument);
}

}  // namespace
}  // namespace dyop
