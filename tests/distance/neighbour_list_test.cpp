// SPDX-License-Identifier: BSD-3-Clause
#include "distance/neighbour_list.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "distance/pivot_seed.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::distance_internal {
namespace {

using namespace testing;

using ShapePtr = std::shared_ptr<const Shape>;

// Radius about s. With the pieces as shapes of their own.
struct Pieces {
  ShapePtr shape;
  std::vector<ShapePtr> pieces;
};

std::vector<Pieces> shapes(Scalar s) {
  std::vector<Pieces> all;
  for (const MeshArrays& arrays : {torus(0.7, 0.25, 7, 5), icosphere(0), random_soup(24, 0.4, 3)}) {
    const auto mesh = std::make_shared<TriangleMesh>(
        arrays.moved(Matrix3::Identity(), Vector3::Zero(), s).mesh());
    all.push_back({mesh, {}});
    for (std::size_t k = 0; k < mesh->triangles().size(); ++k) {
      const Triangle t = mesh->triangle(std::int32_t(k));
      all.back().pieces.push_back(std::make_shared<TriangleMesh>(
          std::vector<Vector3>{t[0], t[1], t[2]}, std::vector<TriangleIndices>{{0, 1, 2}}));
    }
  }
  const auto ball = std::make_shared<Sphere>(0.8 * s);
  const auto capsule = std::make_shared<Capsule>(0.2 * s, 0.6 * s);
  all.push_back({ball, {ball}});
  all.push_back({capsule, {capsule}});
  return all;
}

// The largest distance of a triangle's points from p, in its frame.
Scalar farthest(const Shape& piece, const Vector3& p) {
  Scalar largest = 0;
  for (const Vector3& corner : static_cast<const TriangleMesh&>(piece).triangle(0)) {
    largest = std::max(largest, (corner - p).norm());
  }
  return largest;
}

std::size_t piece_number(const Shape& shape, std::int32_t leaf) {
  const ShapeTree tree(shape);
  return std::size_t(tree.mesh() ? tree.triangle(leaf) : 0);
}

// One list, and another pair of poses at which it is asked.
struct Case {
  ShapePtr a, b;
  RigidPose X_WA, X_WB;
  NearBound built;
  NeighbourList list;

  bool build(std::mt19937_64& random, Scalar s, Scalar far) {
    X_WA = RigidPose(random_rotation(random).toRotationMatrix(), random_vector(far, random));
    X_WB = RigidPose(
        random_rotation(random).toRotationMatrix(),
        X_WA.translation() + random_number(1.3, 2, random) * s * random_direction(random));
    const Vector3 pivot = (X_WA.translation() + X_WB.translation()) / 2;
    built = {random_number(0.1, 0.6, random) * s, random_number(0, 0.5, random)};
    return list.build(*a, X_WA, *b, X_WB, pivot, built);
  }
  void move(std::mt19937_64& random, Scalar s) {
    const auto moved = [&](const RigidPose& X) {
      const Scalar size = random_magnitude(-3, -0.5, random);
      return RigidPose(rotation_from_vector(random_vector(size, random)) * X.rotation(),
                       X.translation() + random_vector(size * s, random));
    };
    X_WA = moved(X_WA);
    X_WB = moved(X_WB);
  }
  NeighbourList::Placement place() const { return list.place(*a, X_WA, *b, X_WB); }
};

// By the definition: every pair of pieces is measured. The bounds asked for are about as large as
// the list admits, or larger.
TEST(NeighbourList, HoldsEveryPairThatIsNear) {
  std::mt19937_64 random(31);
  int asked = 0, covered = 0, near = 0;
  const auto check = [&](const Pieces& a, const Pieces& b, Scalar s, Scalar far) {
    Case test{a.shape, b.shape, {}, {}, {}, {}};
    ASSERT_TRUE(test.build(random, s, far));
    BoxPairStack pairs;
    // Some slabs are known from an earlier question.
    if (asked % 2 == 0) test.list.collect(*a.shape, *b.shape, test.place(), {0.2 * s}, pairs);
    test.move(random, s);
    const auto placement = test.place();
    const NearBound bound{
        random_number(0.3, 1.3, random) * std::max(0.01 * s, test.built.reach - placement.way),
        random_number(0, 1.3, random) * std::max(0.0, test.built.slope - placement.turning)};
    ++asked;
    if (!test.list.covers(placement, bound)) return;
    ++covered;
    test.list.collect(*a.shape, *b.shape, placement, bound, pairs);
    std::map<std::pair<std::size_t, std::size_t>, Scalar> gaps;
    for (const BoxPair& pair : pairs) {
      gaps[{piece_number(*a.shape, pair.a), piece_number(*b.shape, pair.b)}] = pair.gap;
    }
    ASSERT_EQ(gaps.size(), pairs.size());
    const bool moves_a = test.list.moves_a();
    const RigidPose X_MF = moves_a ? test.X_WA.inverse() * test.X_WB  //
                                   : test.X_WB.inverse() * test.X_WA;
    const Vector3 pivot_M = X_MF * test.list.pivot_F();
    for (std::size_t i = 0; i < a.pieces.size(); ++i) {
      for (std::size_t j = 0; j < b.pieces.size(); ++j) {
        const DistanceResult d = distance(*a.pieces[i], test.X_WA, *b.pieces[j], test.X_WB);
        const auto found = gaps.find({i, j});
        if (found != gaps.end()) {
          EXPECT_LE(found->second, d.upper);
        }
        const Scalar l = farthest(moves_a ? *a.pieces[i] : *b.pieces[j], pivot_M);
        if (d.upper > bound.reach + bound.slope * l) continue;
        ++near;
        EXPECT_NE(found, gaps.end()) << i << ' ' << j << ' ' << d.upper;
      }
    }
  };
  for (const auto& [s, far] : {std::pair(1e-4, 1e-3), std::pair(1.0, 1e6), std::pair(1e4, 1e4)}) {
    const std::vector<Pieces> all = shapes(s);
    for (const Pieces& a : all) {
      for (const Pieces& b : all) {
        if (a.pieces.size() == 1 && b.pieces.size() == 1) continue;
        for (int k = 0; k < 60; ++k) check(a, b, s, far);
      }
    }
  }
  EXPECT_GT(covered, asked / 5);
  EXPECT_LT(covered, asked);
  EXPECT_GT(near, 10 * covered);
}

TEST(NeighbourList, MeasuresTheDistanceThatTheTreesDo) {
  std::mt19937_64 random(8);
  int compared = 0, beyond = 0;
  for (const Scalar s : {1e-4, 1.0, 1e4}) {
    const std::vector<Pieces> all = shapes(s);
    for (const Pieces& a_pieces : all) {
      for (const Pieces& b_pieces : all) {
        if (a_pieces.pieces.size() == 1 && b_pieces.pieces.size() == 1) continue;
        const ShapePtr& a = a_pieces.shape;
        const ShapePtr& b = b_pieces.shape;
        Case test{a, b, {}, {}, {}, {}};
        for (int k = 0; k < 10; ++k) {
          ASSERT_TRUE(test.build(random, s, 10 * s));
          test.move(random, s);
          DistanceOptions options;
          options.max_distance = random_number(0, 0.4, random) * s;
          const auto placement = test.place();
          if (!test.list.covers(placement, {options.max_distance})) continue;
          BoxPairStack pairs;
          test.list.collect(*a, *b, placement, {options.max_distance}, pairs);
          PairSeed seed;
          const DistanceResult by_list =
              listed_distance(*a, test.X_WA, *b, test.X_WB, options, pairs, seed);
          const DistanceResult by_tree = distance(*a, test.X_WA, *b, test.X_WB, options);
          EXPECT_EQ(by_list.status, by_tree.status);
          ++compared;
          if (by_tree.status == DistanceStatus::FartherThanMaxDistance) {
            ++beyond;
            EXPECT_GT(by_list.lower, options.max_distance);
            continue;
          }
          EXPECT_LE(by_list.lower, by_tree.upper);
          EXPECT_LE(by_tree.lower, by_list.upper);
          EXPECT_NEAR(by_list.upper, by_tree.upper, 1e-12 * s);
        }
      }
    }
  }
  EXPECT_GT(compared, 200);
  EXPECT_GT(beyond, 20);
  EXPECT_LT(beyond, compared - 20);
}

// Nothing is near when the lists are made.
TEST(NeighbourList, DoesNotCoverWhatHasComeNear) {
  const TriangleMesh ball = icosphere(2).mesh();
  NeighbourList list;
  ASSERT_TRUE(list.build(ball, {}, ball, RigidPose(Vector3(2.2, 0, 0)), {1.1, 0, 0}, {0.1, 0.5}));
  const auto nearer = list.place(ball, {}, ball, RigidPose(Vector3(2.05, 0, 0)));
  EXPECT_NEAR(nearer.way, 0.15, 1e-12);
  EXPECT_FALSE(list.covers(nearer, {0.06}));

  // Turned about the pivot between them, so that their ends meet.
  const TriangleMesh plate = plate_grid(4, 0.4, 8, 2).mesh();
  const Vector3 pivot(0, 0, 0.25);
  ASSERT_TRUE(list.build(plate, {}, plate, RigidPose(2 * pivot), pivot, {0.2, 0.1}));
  const Matrix3 turn = rotation_from_vector(Vector3(0, 0.24, 0));
  const auto turned = list.place(plate, {}, plate, RigidPose(turn, pivot + turn * pivot));
  EXPECT_NEAR(turned.way, 0, 1e-12);
  EXPECT_FALSE(list.covers(turned, {0.05}));
  EXPECT_FALSE(list.covers(list.place(plate, {}, plate, RigidPose(2 * pivot)), {0.05, 0.11}));
}

TEST(NeighbourList, RefusesToHoldTooMany) {
  const TriangleMesh ball = icosphere(3).mesh();
  NeighbourList list;
  EXPECT_FALSE(list.build(ball, {}, ball, RigidPose(Vector3(2.1, 0, 0)), {1.05, 0, 0}, {10}));
  EXPECT_FALSE(list.is_built());
  EXPECT_FALSE(list.covers(list.place(ball, {}, ball, {}), {0}));
}

}  // namespace
}  // namespace dyop::distance_internal
