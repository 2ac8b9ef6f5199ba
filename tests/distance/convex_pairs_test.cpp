// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "geometry/all_shapes.h"
#include "support/inputs/random_inputs.h"

// Every convex shape against every other. A result carries its own proof, which is checked with the
// support functions alone: no point of the shapes is nearer than the slab gap along the normal, and
// the witness points are points of the shapes.
namespace dyop {
namespace {

using testing::all_shapes;
using testing::random_direction;
using testing::random_magnitude;
using testing::random_number;
using testing::random_rotation;
using testing::ShapeMaker;

struct Placed {
  const ConvexShape& shape;
  RigidPose X_WS;

  Scalar reach(const Vector3& n_W) const {
    const Vector3 n_S = X_WS.rotation().transpose() * n_W;
    return n_W.dot(X_WS * shape.support(n_S));
  }
};

// Beyond no supporting plane of many.
bool contains(const Placed& body, const Vector3& p_W, Scalar noise, const Vector3& normal_W,
              std::mt19937_64& random) {
  if (normal_W.dot(p_W) > body.reach(normal_W) + noise) return false;
  for (int k = 0; k < 40; ++k) {
    const Vector3 n_W = random_direction(random);
    if (n_W.dot(p_W) > body.reach(n_W) + noise) return false;
  }
  return true;
}

void expect_proven(const Placed& a, const Placed& b, DistanceCache* cache,
                   std::mt19937_64& random) {
  const DistanceResult result = cache ? distance(a.shape, a.X_WS, b.shape, b.X_WS, {}, *cache)
                                      : distance(a.shape, a.X_WS, b.shape, b.X_WS);
  const Scalar noise = kPoseNoise * (a.X_WS.translation().norm() + b.X_WS.translation().norm() +
                                     2 * a.shape.bounding_radius() + 2 * b.shape.bounding_radius());
  const Vector3& n = result.nhat_AB_W;
  EXPECT_NEAR(n.norm(), 1, 1e-14);
  EXPECT_LE(result.lower, result.upper);
  if (result.status == DistanceStatus::Separated) {
    EXPECT_LE(result.lower, -b.reach(-n) - a.reach(n) + noise);
  }
  EXPECT_GE(result.upper, (result.p_WCb - result.p_WCa).norm() - noise);
  EXPECT_TRUE(contains(a, result.p_WCa, noise, n, random));
  EXPECT_TRUE(contains(b, result.p_WCb, noise, -n, random));
  EXPECT_NE(result.status, DistanceStatus::NotRun);
  if (result.status == DistanceStatus::Separated && result.lower > 1e6 * noise) {
    // literal: smooth cores converge to this part of their distance (kGjkSmoothConvergence).
    const Scalar cores = result.upper + a.shape.rounding_radius() + b.shape.rounding_radius();
    EXPECT_LE(result.upper - result.lower, 1e-7 * cores + 4 * noise);
  }
}

TEST(ConvexPairs, EveryPairProvesItsBounds) {
  std::mt19937_64 random(20260728);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    for (const ShapeMaker& maker_a : all_shapes()) {
      for (const ShapeMaker& maker_b : all_shapes()) {
        SCOPED_TRACE(maker_a.name + " " + maker_b.name);
        const auto a = maker_a.make(size);
        const auto b = maker_b.make(size);
        const Scalar radii = a->bounding_radius() + b->bounding_radius();
        DistanceCache cache;
        for (int k = 0; k < 24; ++k) {
          const Vector3 place =
              k % 4 == 0 ? Vector3(1e4 * size * random_direction(random)) : Vector3::Zero();
          const RigidPose X_WA(random_rotation(random), place);
          const Scalar away = radii * (k % 3 == 0 ? random_magnitude(-3, 1, random)
                                                  : random_number(0.3, 1.2, random));
          const RigidPose X_WB(random_rotation(random), place + away * random_direction(random));
          expect_proven({*a, X_WA}, {*b, X_WB}, k % 2 == 0 ? nullptr : &cache, random);
        }
      }
    }
  }
}

// A cache that belongs to other shapes, or holds nonsense, costs time only.
TEST(ConvexPairs, AnyCacheWillDo) {
  std::mt19937_64 random(5);
  const auto shapes = all_shapes();
  DistanceCache cache;
  for (int k = 0; k < 2000; ++k) {
    const auto a = shapes[std::size_t(testing::random_index(int(shapes.size()), random))].make(1);
    const auto b = shapes[std::size_t(testing::random_index(int(shapes.size()), random))].make(1);
    if (k % 5 == 0) {
      cache.vertices = {3, {-7, 100000, 2}, {0, 1, 5}};
      if (k % 2 == 0) cache.vertices.count = 1000;
    }
    const RigidPose X_WA(random_rotation(random), Vector3::Zero());
    const RigidPose X_WB(random_rotation(random),
                         random_number(0, 4, random) * random_direction(random));
    expect_proven({*a, X_WA}, {*b, X_WB}, &cache, random);
  }
}

// Null if rounding to so small a size leaves nothing of it.
std::unique_ptr<ConvexShape> made(const ShapeMaker& maker, Scalar size) {
  try {
    return maker.make(size);
  } catch (const InvalidArgument&) {
    return nullptr;
  }
}

// Of shapes of a few times the smallest number, too, also where they overlap.
TEST(ConvexPairs, WitnessesOfTheSmallestShapesAreFinite) {
  constexpr Scalar kTiny = std::numeric_limits<Scalar>::denorm_min();
  for (const ShapeMaker& small : all_shapes()) {
    for (const Scalar size : {kTiny, 3 * kTiny, 1e-310, 1e-300}) {
      const auto a = made(small, size);
      if (!a) continue;
      for (const ShapeMaker& other : all_shapes()) {
        for (const Scalar size_b : {size, Scalar(1)}) {
          const auto b = made(other, size_b);
          if (!b) continue;
          for (const Scalar x : {0.0, kTiny, size, 0.1}) {
            const RigidPose X_WB(Vector3(x, 0, 0));
            for (const bool is_turned : {false, true}) {
              const DistanceResult result = is_turned ? distance(*b, X_WB, *a, RigidPose())
                                                      : distance(*a, RigidPose(), *b, X_WB);
              ASSERT_LE(result.lower, result.upper) << small.name << ' ' << other.name;
              ASSERT_TRUE(result.p_WCa.allFinite() && result.p_WCb.allFinite())
                  << small.name << ' ' << size << ' ' << other.name << ' ' << size_b << ' ' << x;
              ASSERT_NEAR(result.nhat_AB_W.norm(), 1, 1e-14);
            }
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace dyop
