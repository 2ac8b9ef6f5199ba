// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "contact/solver/interior_point_solver.h"
#include "support/inputs/random_inputs.h"

namespace dyop::contact_internal {
namespace {

using dyop::testing::random_number;

// Inside the cone, as near to its edge as `margin`, and of any size.
Vector3 random_inside(Scalar margin, std::mt19937_64& random) {
  const Vector3 t(0, random_number(-1, 1, random), random_number(-1, 1, random));
  const Scalar size = std::pow(10, random_number(-3, 3, random));
  return size * (t + Vector3(t.norm() * (1 + margin) + margin, 0, 0));
}

TEST(SecondOrderCone, QuotientUndoesProduct) {
  std::mt19937_64 random(71);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 a = random_inside(0.01, random);
    const Vector3 b(random_number(-1, 1, random), random_number(-1, 1, random), 0.3);
    EXPECT_LE((cone_quotient(a, cone_product(a, b)) - b).norm(), 1e-11 * b.norm());
  }
}

TEST(SecondOrderCone, ScalingTakesBothToTheSamePoint) {
  std::mt19937_64 random(72);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 x = random_inside(1e-3, random);
    const Vector3 z = random_inside(1e-3, random);
    const ConeScaling scaling(z, x);
    EXPECT_LE((scaling.W * scaling.inverse - Matrix3::Identity()).norm(), 1e-9);
    EXPECT_LE((scaling.W * x - scaling.middle).norm(), 1e-9 * scaling.middle.norm());
    EXPECT_LE((scaling.inverse * z - scaling.middle).norm(), 1e-9 * scaling.middle.norm());
    EXPECT_GT(cone_determinant(scaling.W * random_inside(1e-3, random)), 0);
  }
}

// Against steps of a thousandth along the direction.
TEST(SecondOrderCone, FindsTheWayToItsEdge) {
  std::mt19937_64 random(73);
  const auto is_inside = [](const Vector3& x) { return x[0] > x.tail<2>().norm(); };
  int leaving = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vector3 x = random_inside(0.1, random) / 10;
    const Vector3 d = x.norm() * Vector3(random_number(-1, 1, random), random_number(-1, 1, random),
                                         random_number(-1, 1, random));
    const Scalar way = way_to_cone(x, d);
    int k = 0;
    while (k < 5000 && is_inside(x + (k + 1) * 1e-3 * d)) ++k;
    if (k == 5000) {
      EXPECT_GE(way, 5);
      continue;
    }
    ++leaving;
    EXPECT_GE(way, k * 1e-3 - 1e-9);
    EXPECT_LE(way, (k + 1) * 1e-3 + 1e-9);
  }
  EXPECT_GT(leaving, 500);
}

// Without friction the cone is a half line.
TEST(SecondOrderCone, IsAHalfLineWithoutTangents) {
  const ConeScaling scaling(Vector3(8, 0, 0), Vector3(2, 0, 0));
  EXPECT_DOUBLE_EQ(scaling.W(0, 0), 2);
  EXPECT_DOUBLE_EQ(scaling.middle[0], 4);
  EXPECT_DOUBLE_EQ(way_to_cone(Vector3(2, 0, 0), Vector3(-4, 0, 0)), 0.5);
  EXPECT_EQ(way_to_cone(Vector3(2, 0, 0), Vector3(4, 0, 0)), kInfinity);
}

}  // namespace
}  // namespace dyop::contact_internal
