// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/cone.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/cylinder.h"
#include "dyop/geometry/ellipsoid.h"
#include "dyop/geometry/rounded_box.h"
#include "dyop/geometry/sphere.h"
#include "geometry/all_shapes.h"

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

TEST(CurvedShapes, RefuseBadSizes) {
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  EXPECT_THROW(Cylinder(0, 1), InvalidArgument);
  EXPECT_THROW(Cylinder(1, nan), InvalidArgument);
  EXPECT_THROW(Cone(1, -1), InvalidArgument);
  EXPECT_THROW(Ellipsoid(Vector3(1, 0, 1)), InvalidArgument);
  EXPECT_THROW(RoundedBox(Vector3(1, 1, 1), 0), InvalidArgument);
  EXPECT_THROW(RoundedBox(Vector3(1, -1, 1), 1), InvalidArgument);
}

}  // namespace
}  // namespace dyop
