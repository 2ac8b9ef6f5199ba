// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/contact_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "support/inputs/random_inputs.h"

namespace dyop::contact_internal {
namespace {

using dyop::testing::random_magnitude;
using dyop::testing::random_number;
using dyop::testing::random_vector;

// A mobility with eigenvalues over several powers of ten, coupling all directions.
Matrix3 random_mobility(std::mt19937_64& random) {
  const Matrix3 R = dyop::testing::random_rotation(random).toRotationMatrix();
  const Vector3 values(random_magnitude(-3, 0, random), random_magnitude(-3, 0, random), 1);
  return random_magnitude(-4, 4, random) * R * values.asDiagonal() * R.transpose();
}

// The mobility of a contact whose line goes through both centres of mass, but for rounding.
Matrix3 random_uncoupled_mobility(std::mt19937_64& random) {
  const Scalar size = random_magnitude(-4, 4, random);
  const Scalar tangential =
      random_number(0, 1, random) < 0.05 ? 0 : random_magnitude(-3, 1, random);
  Matrix3 W = size * Vector3(1, tangential, tangential).asDiagonal().toDenseMatrix();
  W(0, 1) = W(1, 0) = random_number(-1, 1, random) * 1e-15 * size;
  return W;
}

// Signorini and Coulomb, word by word, on one contact.
void expect_laws(const std::function<Matrix3(std::mt19937_64&)>& random_W) {
  std::mt19937_64 random(41);
  int separates = 0;
  int sticks = 0;
  int slides = 0;
  constexpr int kCases = 20000;
  for (int i = 0; i < kCases; ++i) {
    const Matrix3 W = random_W(random);
    const Vector3 q = random_vector(1, random);
    const Scalar friction = random_magnitude(-2, 1, random);
    Scalar slip = random_number(0, 1, random);
    const Vector3 lambda = LocalContact(W).solve(q, friction, slip);
    const Vector3 u = W * lambda + q;
    const Scalar noise = 1e-11 * (q.norm() + W.norm() * lambda.norm());
    const Scalar bound = friction * lambda[0];
    const Scalar tangential = lambda.tail<2>().norm();
    ASSERT_GE(lambda[0], 0);
    ASSERT_LE(tangential, bound * (1 + 1e-14));
    ASSERT_GE(u[0], -noise);
    if (lambda[0] == 0) {
      ++separates;
    } else if (tangential < bound * (1 - 1e-9)) {
      ++sticks;
      EXPECT_LE(u.norm(), noise) << "case " << i;
    } else {
      ++slides;
      EXPECT_LE(std::abs(u[0]), noise) << "case " << i;
      // Opposite to the sliding velocity.
      const Scalar missed = tangential * u.tail<2>().norm() + lambda.tail<2>().dot(u.tail<2>());
      EXPECT_LE(missed, tangential * noise) << "case " << i;
    }
  }
  EXPECT_GT(separates, kCases / 10);
  EXPECT_GT(sticks, kCases / 20);
  EXPECT_GT(slides, kCases / 10);
}

TEST(SolveContact, ObeysTheLaws) {
  expect_laws(random_mobility);
}

TEST(SolveContact, ObeysTheLawsWhereNothingIsCoupled) {
  expect_laws(random_uncoupled_mobility);
}

TEST(SolveDisc, OpposesTheVelocityWithinItsBound) {
  std::mt19937_64 random(42);
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Matrix2d W = random_mobility(random).topLeftCorner<2, 2>();
    const Vector2 q = random_vector(1, random).head<2>();
    const Scalar radius = random_magnitude(-6, 4, random);
    Scalar slip = 0;
    const Vector2 lambda = solve_disc(W, q, radius, slip);
    const Vector2 u = W * lambda + q;
    const Scalar noise = 1e-11 * (q.norm() + W.norm() * lambda.norm());
    ASSERT_LE(lambda.norm(), radius * (1 + 1e-14));
    if (lambda.norm() < radius * (1 - 1e-9)) {
      EXPECT_LE(u.norm(), noise);
    } else {
      EXPECT_LE(lambda.norm() * u.norm() + lambda.dot(u), lambda.norm() * noise);
    }
  }
}

Block random_block(int kind, std::mt19937_64& random) {
  Block block;
  block.kind = BlockKind(kind);
  block.friction = random_magnitude(-2, 1, random);
  block.lower = random_number(-1, 0, random);
  block.upper = random_number(0, 1, random);
  return block;
}

// The nearest point: no point of the set, tried at random, is nearer.
TEST(Project, FindsTheNearestPoint) {
  std::mt19937_64 random(43);
  for (int i = 0; i < 4000; ++i) {
    const Block block = random_block(i % 4, random);
    const Scalar normal = random_number(0, 1, random);
    Vector3 x = random_vector(2, random);
    if (block.kind != BlockKind::Contact) x[2] = 0;
    if (block.kind == BlockKind::Row || block.kind == BlockKind::Torsion) x[1] = 0;
    const Vector3 p = project(block, x, normal);
    EXPECT_LE((project(block, p, normal) - p).norm(), 1e-14 * (1 + p.norm()));
    for (int k = 0; k < 20; ++k) {
      const Vector3 other = project(block, random_vector(2, random), normal);
      EXPECT_LE((p - x).dot(p - other), 1e-13 * (1 + x.squaredNorm() + other.squaredNorm()));
    }
  }
}

TEST(Project, HasTheDerivativeItSays) {
  std::mt19937_64 random(44);
  int compared = 0;
  for (int i = 0; i < 4000; ++i) {
    const Block block = random_block(i % 4, random);
    const Scalar normal = random_number(0.1, 1, random);
    Vector3 x = random_vector(2, random);
    if (block.kind != BlockKind::Contact) x[2] = 0;
    if (block.kind == BlockKind::Row || block.kind == BlockKind::Torsion) x[1] = 0;
    const Matrix3 D = project_derivative(block, x, normal);
    EXPECT_LE((D - D.transpose()).norm(), 1e-15);
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (k >= 1 && (block.kind == BlockKind::Row || block.kind == BlockKind::Torsion)) continue;
      if (k == 2 && block.kind == BlockKind::Rolling) continue;
      constexpr Scalar kStep = 1e-6;
      const Vector3 step = kStep * Vector3::Unit(k);
      const Vector3 ahead = project(block, x + step, normal) - project(block, x, normal);
      const Vector3 behind = project(block, x, normal) - project(block, x - step, normal);
      if ((ahead - behind).norm() > 1e-4 * kStep) continue;  // a corner in between
      EXPECT_LE(((ahead + behind) / 2 / kStep - D.col(k)).norm(), 1e-4) << "case " << i;
      ++compared;
    }
  }
  EXPECT_GT(compared, 4000);
}

}  // namespace
}  // namespace dyop::contact_internal
