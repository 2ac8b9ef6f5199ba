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
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/cone.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/cylinder.h"
#include "dyop/geometry/ellipsoid.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/rounded_box.h"
#include "dyop/geometry/sphere.h"
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
      if (part.height(q) <= 0) EXPECT_LE(d.dot(q), part.core_reach(d) + noise);
    }
    EXPECT_NEAR(part.core_reach(part.normal()), offset, noise / 4);
    EXPECT_TRUE(std::isnan(part.core_reach(Vector3(1, std::nan(""), 1))));
  }
}

}  // namespace
}  // namespace dyop
