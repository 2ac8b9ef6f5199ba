// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <numbers>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"
#include "support/message_of.h"

namespace dyop {
namespace {

const Scalar kNotANumber = std::nan("");

template <typename Make>
void expect_refusal(const Make& make, const std::string& part) {
  const std::string message = testing::message_of(make);
  EXPECT_NE(message.find(part), std::string::npos) << message << ", expected: " << part;
}

TEST(Sphere, RefusesBadRadius) {
  expect_refusal([] { Sphere(-1.5); }, "radius must be > 0 and at most 1e+60, not -1.5");
  expect_refusal([] { Sphere(0); }, "not 0");
  expect_refusal([] { Sphere{kNotANumber}; }, "not nan");
  expect_refusal([] { Sphere(2 * kLargestCoordinate); }, "not 2e+60");
}

// Solid ball: m = 4/3 pi r^3 rho, I = 2/5 m r^2.
TEST(Sphere, HasTheMassOfASolidBall) {
  const MassProperties properties = Sphere(2).compute_mass_properties(3);
  EXPECT_NEAR(properties.mass, 32 * std::numbers::pi, 1e-12);
  EXPECT_NEAR(properties.I_BBcm(0, 0), 0.4 * 4 * 32 * std::numbers::pi, 1e-11);
  EXPECT_EQ(properties.I_BBcm(0, 1), 0);
}

TEST(Sphere, CoreIsItsCenter) {
  const Sphere sphere(2);
  EXPECT_EQ(sphere.core_support(Vector3(1, 2, 3)).point, Vector3::Zero());
  ASSERT_NE(sphere.core_surface(), nullptr);
  EXPECT_EQ(sphere.core_surface()->triangle(0)[2], Vector3::Zero());
}

TEST(Box, RefusesBadHalfExtents) {
  expect_refusal([] { Box(Vector3(1, -2, 3)); }, "half extent of a box must be > 0");
  expect_refusal([] { Box(Vector3(1, 2, 0)); }, "not 0");
  expect_refusal([] { Box(Vector3(kNotANumber, 2, 1)); }, "not nan");
}

TEST(Box, NumbersItsVerticesByTheSignsOfTheCoordinates) {
  const Box box(Vector3(1, 2, 3));
  const SupportPoint support = box.core_support(Vector3(1, -1, 1));
  EXPECT_EQ(support.vertex, 5);
  EXPECT_EQ(support.point, Vector3(1, -2, 3));
}

// m = 8 abc rho; I_xx = m (b^2 + c^2) / 3. Surface and formula are independent.
TEST(Box, MassAgreesWithItsSurface) {
  const Box box(Vector3(1, 2, 3));
  const MassProperties properties = box.compute_mass_properties(0.5);
  EXPECT_DOUBLE_EQ(properties.mass, 24);
  EXPECT_DOUBLE_EQ(properties.I_BBcm(0, 0), 24 * 13 / 3.0);
  EXPECT_DOUBLE_EQ(properties.I_BBcm(1, 1), 24 * 10 / 3.0);
  EXPECT_DOUBLE_EQ(properties.I_BBcm(2, 2), 24 * 5 / 3.0);
  const MassProperties surface = box.core_surface()->compute_mass_properties(0.5);
  EXPECT_DOUBLE_EQ(surface.mass, 24);
  EXPECT_LE((surface.I_BBcm - properties.I_BBcm).norm(), 1e-12);
}

TEST(Capsule, RefusesBadSizes) {
  expect_refusal([] { Capsule(0, 1); }, "radius must be > 0");
  expect_refusal([] { Capsule(1, -2); }, "half length of a capsule must be >= 0");
  expect_refusal([] { Capsule(1, kNotANumber); }, "not nan");
}

TEST(Capsule, WithoutLengthIsASphere) {
  const MassProperties capsule = Capsule(2, 0).compute_mass_properties(3);
  const MassProperties sphere = Sphere(2).compute_mass_properties(3);
  EXPECT_DOUBLE_EQ(capsule.mass, sphere.mass);
  EXPECT_LE((capsule.I_BBcm - sphere.I_BBcm).norm(), 1e-12 * sphere.I_BBcm.norm());
}

// r = 1, h = 1, rho = 1: cylinder 2 pi, ball 4 pi / 3. Axial: 2 pi / 2 + 2/5 * 4 pi / 3.
// Transverse: 2 pi (1/4 + 1/3) + 4 pi / 3 (2/5 + 1 + 3/4).
TEST(Capsule, HasTheMassOfACylinderAndABall) {
  const MassProperties properties = Capsule(1, 1).compute_mass_properties(1);
  const Scalar pi = std::numbers::pi;
  EXPECT_NEAR(properties.mass, 10 * pi / 3, 1e-14);
  EXPECT_NEAR(properties.I_BBcm(2, 2), pi + 8 * pi / 15, 1e-14);
  EXPECT_NEAR(properties.I_BBcm(0, 0), 7 * pi / 6 + 4 * pi / 3 * 2.15, 1e-14);
}

TEST(Capsule, CoreIsASegmentOnTheZAxis) {
  const Capsule capsule(0.5, 2);
  EXPECT_EQ(capsule.core_support(Vector3(1, 0, -1)).vertex, 0);
  EXPECT_EQ(capsule.core_support(Vector3(1, 0, 1)).point, Vector3(0, 0, 2));
  EXPECT_LE((capsule.support(Vector3::UnitZ()) - Vector3(0, 0, 2.5)).norm(), 0);
}

TEST(SimpleShapes, RefuseMassBeyondTheRangeOfDouble) {
  expect_refusal([] { Sphere(1e-110).compute_mass_properties(1e-10); }, "out of the range");
}

}  // namespace
}  // namespace dyop
