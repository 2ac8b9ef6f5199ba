// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/distance/gjk.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/polytope_oracle.h"

namespace dyop {
namespace {

using testing::make_box;
using testing::make_capsule;
using testing::make_sphere;
using testing::PointHull;

Scalar noise_of(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB) {
  return 4 * kPoseNoise * (X_AB.translation().norm() + a.bounding_radius() + b.bounding_radius());
}

RigidPose moved(const RigidPose& X_WB, const Vector3& step_W) {
  return {X_WB.rotation(), X_WB.translation() + step_W};
}

// Moving B by depth along the normal leaves the shapes touching; a little less leaves an overlap.
void expect_separates(const ConvexShape& a, const RigidPose& X_WA, const ConvexShape& b,
                      const RigidPose& X_WB, const Penetration& penetration) {
  const Scalar noise = noise_of(a, b, X_WA.inverse() * X_WB);
  EXPECT_NEAR(penetration.nhat_AB_W.norm(), 1, 8 * kUnitRoundoff);
  const Vector3 step = penetration.depth * penetration.nhat_AB_W;
  const Scalar margin = 1 + 8 * noise / penetration.depth;
  const GjkResult apart = gjk_distance(a, b, X_WA.inverse() * moved(X_WB, step * margin));
  EXPECT_GT(apart.lower, 0);
  EXPECT_LT(apart.upper, 16 * noise);
}

// Depth and, where it is unique, the direction; for (a, b) and (b, a).
void expect_penetration(const ConvexShape& a, const RigidPose& X_WA, const ConvexShape& b,
                        const RigidPose& X_WB, Scalar depth, const Vector3& nhat_AB_W) {
  const Scalar noise = noise_of(a, b, X_WA.inverse() * X_WB);
  const auto ab = find_penetration(a, X_WA, b, X_WB);
  ASSERT_TRUE(ab.has_value());
  EXPECT_NEAR(ab->depth, depth, noise);
  EXPECT_LT((ab->nhat_AB_W - nhat_AB_W).norm(), 1e-7);
  expect_separates(a, X_WA, b, X_WB, *ab);
  const auto ba = find_penetration(b, X_WB, a, X_WA);
  ASSERT_TRUE(ba.has_value());
  EXPECT_NEAR(ba->depth, depth, noise);
  EXPECT_LT((ba->nhat_AB_W + nhat_AB_W).norm(), 1e-7);
}

TEST(Penetration, OfSpheresIsRadiiMinusCenters) {
  for (const Scalar s : {1e-4, 1.0, 1e4}) {
    // |(1, 2, 2)| = 3, radii 2 + 5.
    expect_penetration(make_sphere(2 * s), RigidPose(), make_sphere(5 * s),
                       RigidPose(s * Vector3(1, 2, 2)), 4 * s, Vector3(1, 2, 2) / 3);
  }
}

TEST(Penetration, OfBoxesIsTheThinnestSlab) {
  for (const Scalar s : {1e-4, 1.0, 1e4}) {
    const PointHull a = make_box(s * Vector3(1, 2, 3));
    const PointHull b = make_box(s * Vector3(1, 1, 1));
    // Slab overlaps: x 2 - 1.7 = 0.3, y 3 - 0.5 = 2.5, z 4 - 1 = 3.
    expect_penetration(a, RigidPose(), b, RigidPose(s * Vector3(1.7, 0.5, 1)), 0.3 * s,
                       Vector3::UnitX());
    expect_penetration(a, RigidPose(), b, RigidPose(s * Vector3(0.1, -2.9, 1)), 0.1 * s,
                       -Vector3::UnitY());
  }
}

// The least depth of two boxes over the normals of the faces of their difference.
Scalar depth_of_boxes(const Vector3& a, const Vector3& b, const RigidPose& X_AB) {
  Scalar least = kInfinity;
  const auto measure = [&](const Vector3& direction) {
    if (!(direction.norm() > 1e-8)) return;
    const Vector3 n = direction.normalized();
    const Vector3 n_B = X_AB.rotation().transpose() * n;
    least = std::min(
        least, n.cwiseAbs().dot(a) + n_B.cwiseAbs().dot(b) - std::abs(n.dot(X_AB.translation())));
  };
  for (int i = 0; i < 3; ++i) {
    measure(Vector3::Unit(i));
    measure(X_AB.rotation().col(i));
    for (int j = 0; j < 3; ++j) measure(Vector3::Unit(i).cross(X_AB.rotation().col(j)));
  }
  return least;
}

// Aligned, turned by a quarter, or at random; concentric or not.
TEST(Penetration, OfBoxesIsTheLeastUpToRounding) {
  std::mt19937_64 random(8);
  for (const Scalar s : {1e-4, 1.0, 1e4}) {
    for (int k = 0; k < 2000; ++k) {
      const auto part = [&] { return s * testing::random_magnitude(-1, 0, random); };
      const Vector3 a(part(), part(), part());
      const Vector3 b(part(), part(), part());
      Matrix3 R = RigidPose(testing::random_rotation(random), Vector3::Zero()).rotation();
      if (k % 3 == 0) R.setIdentity();
      if (k % 3 == 1) R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
      const Vector3 away = k % 2 == 0 ? Vector3(Vector3::Zero())
                                      : Vector3(0.8 * s * testing::random_vector(0.5, random));
      const RigidPose X_AB(R, away);
      const Scalar expected = depth_of_boxes(a, b, X_AB);
      if (expected < 1e-9 * s) continue;
      const auto sharp = find_penetration(Box(a), RigidPose(), Box(b), X_AB);
      ASSERT_TRUE(sharp);
      EXPECT_NEAR(sharp->depth, expected, 1e-13 * s);
      const Scalar r = 0.1 * s;
      const auto rounded =
          find_penetration(RoundedBox(a, r), RigidPose(), RoundedBox(b, 2 * r), X_AB);
      ASSERT_TRUE(rounded);
      EXPECT_NEAR(rounded->depth, expected + 3 * r, 1e-13 * s);
    }
  }
}

TEST(Penetration, FollowsTheFramesOfTheWorld) {
  const Matrix3 R = rotation_from_vector(Vector3(0.3, -1.1, 0.7));
  const RigidPose X_WA(R, Vector3(10, -20, 30));
  const RigidPose X_WB(R, Vector3(10, -20, 30) + R * Vector3(1.7, 0.5, 0.3));
  expect_penetration(make_box({1, 2, 3}), X_WA, make_box({1, 1, 1}), X_WB, 0.3,
                     R * Vector3::UnitX());
}

TEST(Penetration, OfAnEdgeIntoAFaceIsAlongTheFaceNormal) {
  // b shows an edge, sqrt(2) from its centre, to the face x = 1 of a: depth 1 + sqrt(2) - 2.2.
  const RigidPose X_WB(rotation_from_vector(Vector3(0, 0, std::numbers::pi / 4)),
                       Vector3(2.2, 0, 0));
  expect_penetration(make_box({1, 1, 1}), RigidPose(), make_box({1, 1, 1}), X_WB,
                     1 + std::numbers::sqrt2 - 2.2, Vector3::UnitX());
}

TEST(Penetration, OfASphereIntoABoxAddsTheRadius) {
  const PointHull box = make_box({1, 2, 3});
  // Centre outside: distance to the face 0.2, radius 0.5.
  expect_penetration(box, RigidPose(), make_sphere(0.5), RigidPose(Vector3(1.2, 0, 0)), 0.3,
                     Vector3::UnitX());
  // Centre inside, 0.3 below the face x = 1.
  expect_penetration(box, RigidPose(), make_sphere(0.5), RigidPose(Vector3(0.7, 0.1, 0.2)), 0.8,
                     Vector3::UnitX());
}

TEST(Penetration, OfCrossingCapsulesIsTheirRadii) {
  // Cores along z and along y through one point: the common perpendicular is x.
  const RigidPose X_WB(rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0)), Vector3::Zero());
  const auto found =
      find_penetration(make_capsule(2, 0.25), RigidPose(), make_capsule(2, 0.5), X_WB);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->depth, 0.75, 1e-7);
  EXPECT_NEAR(std::abs(found->nhat_AB_W.x()), 1, 1e-7);
}

TEST(Penetration, OfConcentricSpheresHasSomeDirection) {
  const auto found = find_penetration(make_sphere(1), RigidPose(), make_sphere(2), RigidPose());
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->depth, 3, 1e-12);
  EXPECT_NEAR(found->nhat_AB_W.norm(), 1, 1e-15);
}

TEST(Penetration, IsNothingForSeparatedShapes) {
  const PointHull box = make_box({1, 1, 1});
  EXPECT_FALSE(find_penetration(box, RigidPose(), box, RigidPose(Vector3(2.1, 0, 0))).has_value());
  EXPECT_FALSE(
      find_penetration(make_sphere(1), RigidPose(), box, RigidPose(Vector3(9, 0, 0))).has_value());
}

// Smallest slab overlap over all face normals and edge pairs of two boxes: the exact depth, because
// every face of their Minkowski difference has one of these normals.
Scalar slab_depth(const PointHull& a, const PointHull& b, const RigidPose& X_AB) {
  std::vector<Vector3> axes;
  for (int i = 0; i < 3; ++i) {
    axes.push_back(Vector3::Unit(i));
    axes.push_back(X_AB.rotation().col(i));
    for (int j = 0; j < 3; ++j) {
      const Vector3 n = Vector3::Unit(i).cross(X_AB.rotation().col(j));
      if (n.norm() > 1e-6) axes.push_back(n.normalized());
    }
  }
  Scalar depth = kInfinity;
  for (const Vector3& axis : axes) {
    for (const Vector3& n : {axis, Vector3(-axis)}) {
      const Vector3 p_ACb = X_AB * b.support(-(X_AB.rotation().transpose() * n));
      depth = std::min(depth, n.dot(a.support(n)) - n.dot(p_ACb));
    }
  }
  return depth;
}

TEST(Penetration, OfRandomBoxesIsExactAndSeparates) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<Scalar> uniform(-1, 1);
  const auto vector = [&] { return Vector3(uniform(rng), uniform(rng), uniform(rng)); };
  int overlapping = 0;
  int inexact = 0;
  const int count = 2000;
  for (int i = 0; i < count; ++i) {
    const Scalar s = std::pow(10, 4 * uniform(rng));
    const PointHull a = make_box(s * (vector().cwiseAbs() + Vector3::Constant(0.1)));
    const PointHull b = make_box(s * (vector().cwiseAbs() + Vector3::Constant(0.1)));
    const RigidPose X_WA(rotation_from_vector(3 * vector()), s * 10 * vector());
    const RigidPose X_WB(rotation_from_vector(3 * vector()), X_WA.translation() + s * vector());
    const RigidPose X_AB = X_WA.inverse() * X_WB;
    const auto found = find_penetration(a, X_WA, b, X_WB);
    const Scalar depth = slab_depth(a, b, X_AB);
    ASSERT_EQ(found.has_value(), depth > 0) << "pair " << i;
    if (!found) continue;
    ++overlapping;
    expect_separates(a, X_WA, b, X_WB, *found);
    ASSERT_GE(found->depth, depth) << "pair " << i;
    if (found->depth > depth + 1e-9 * s) ++inexact;
    // The point is in both boxes.
    for (const auto& [box, X_WS] : {std::pair(&a, &X_WA), std::pair(&b, &X_WB)}) {
      const Vector3 p = X_WS->inverse() * found->p_W;
      ASSERT_LE((p.cwiseAbs() - box->points()[7]).maxCoeff(), noise_of(a, b, X_AB));
    }
  }
  EXPECT_GT(overlapping, count * 0.3);
  EXPECT_LT(overlapping, count * 0.9);
  EXPECT_EQ(inexact, 0);
}

// A smooth core: libccd's polytope never ends exactly.
class Ball final : public ConvexShape {
 public:
  SupportPoint core_support(const Vector3& d) const override {
    return {d.norm() > 0 ? d.normalized() : Vector3::Zero(), {}};
  }
  Vector3 core_center() const override { return Vector3::Zero(); }
  AlignedBox bounding_box() const override { return {}; }
  Scalar bounding_radius() const override { return 1; }
  MassProperties compute_mass_properties(Scalar) const override { return {}; }
};

TEST(Penetration, OfSmoothCoresIsBoundedAndNearlyRight) {
  const Ball ball;
  for (const Scalar distance : {0.01, 0.5, 1.5, 1.99}) {
    const auto found =
        find_penetration(ball, RigidPose(), ball, RigidPose(Vector3(1, 2, 2) * (distance / 3)));
    ASSERT_TRUE(found.has_value());
    EXPECT_GE(found->depth, 2 - distance);
    EXPECT_LT(found->depth, 2 - distance + 0.02);
  }
}

}  // namespace
}  // namespace dyop
