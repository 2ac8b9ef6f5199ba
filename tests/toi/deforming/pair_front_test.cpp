// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/pair_front.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "dyop/distance/distance.h"
#include "dyop/distance/triangle_distance.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using distance_internal::BoxPair;
using distance_internal::PieceDistance;
using toi_internal::PairFront;
using toi_internal::StandingPair;

constexpr std::size_t kFewNodes = 64;  // a tree that is soon crowded
constexpr Scalar kNoise = 1e-9;        // literal: far more than the rounding of numbers of size 10

// A sheet that deforms and a ball that moves beside it, step by step; with slabs for odd seeds.
class Walk {
 public:
  explicit Walk(std::uint64_t seed) : random_(seed), has_slabs_(seed % 2 == 1) {
    const auto arrays = testing::plate_grid(4, 4, 5, 5);
    std::vector<Vector3> end = arrays.vertices;
    for (Vector3& p : end) p += testing::random_vector(0.4, random_);
    sheet = DeformingMesh(arrays.vertices, end, arrays.triangles);
    slabs_.fit(sheet);
  }

  StandingPair standing() const { return {sheet, s, ball, X_WB, has_slabs_ ? &slabs_ : nullptr}; }

  // The displacement of any point relative to any of the other mesh, from their vertices.
  PairFront::Displacement step(Scalar length) {
    const Scalar s_before = s;
    const RigidPose before = X_WB;
    s = std::clamp(s + testing::random_number(-0.1, 0.1, random_), Scalar{0}, Scalar{1});
    const Matrix3 turn = rotation_from_vector(Vector3(0.1 * testing::random_direction(random_)));
    X_WB = RigidPose(Matrix3(turn * X_WB.rotation()),
                     X_WB.translation() + length * testing::random_direction(random_));
    const Vector3 shift_W = X_WB.translation() - before.translation();
    Scalar sheet_step = 0, ball_step = 0, ball_rest = 0;
    for (std::size_t k = 0; k < sheet.begin().size(); ++k) {
      const Vector3 path = sheet.end()[k] - sheet.begin()[k];
      sheet_step = std::max(sheet_step, std::abs(s - s_before) * path.norm());
    }
    for (const Vector3& p : ball.vertices()) {
      const Vector3 moved_W = X_WB * p - before * p;
      ball_step = std::max(ball_step, moved_W.norm());
      ball_rest = std::max(ball_rest, (moved_W - shift_W).norm());
    }
    return {sheet_step + ball_step + kNoise, shift_W, sheet_step + ball_rest + kNoise};
  }
  DistanceResult truth() const {
    return distance(sheet.snapshot(s), RigidPose(), ball, X_WB, DistanceOptions{});
  }
  std::mt19937_64& random() { return random_; }

 private:
  std::mt19937_64 random_;
  bool has_slabs_;
  toi_internal::MeshSlabs slabs_;

 public:
  DeformingMesh sheet{{{0, 0, 0}}, {{0, 0, 0}}, {{0, 0, 0}}};
  TriangleMesh ball = testing::icosphere(1).mesh();
  RigidPose X_WB{Vector3(0.2, 0.1, 2.5)};
  Scalar s = 0;
};

// Pairs of triangles at most `reach` apart, one by one.
std::vector<std::pair<std::int32_t, std::int32_t>> near_pairs(const Walk& walk, Scalar reach) {
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  for (std::int32_t i = 0; i < std::int32_t(walk.sheet.triangles().size()); ++i) {
    const Triangle a = walk.sheet.triangle(i, walk.s);
    for (std::int32_t k = 0; k < std::int32_t(walk.ball.triangles().size()); ++k) {
      Triangle b = walk.ball.triangle(k);
      for (Vector3& p : b) p = walk.X_WB * p;
      if (triangle_distance(a, b).upper < reach - kNoise) pairs.emplace_back(i, k);
    }
  }
  return pairs;
}

TEST(PairFront, CarriesTrueBoundsAlongAWalk) {
  int separated = 0;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    Walk walk(seed);
    PairFront front(seed <= 2 ? kFewNodes : PairFront::kMostNodes);
    BoxPair nothing{};
    distance_internal::BoxPairStack stack;
    for (int k = 0; k < 60; ++k) {
      front.move(walk.step(testing::random_number(0, 0.4, walk.random())));
      if (k % 10 == 9) {
        // Nothing is known: the first search is stopped too.
        front.restart();
        front.seed({0, -1, -1});
      }
      const DistanceResult truth = walk.truth();
      EXPECT_LE(front.lower(), truth.upper + kNoise) << k;
      const StandingPair sides = walk.standing();
      const Scalar allowed = testing::random_number(0, 0.3, walk.random());
      PieceDistance best;
      // A search that is stopped keeps what it found.
      int left = testing::random_index(40, walk.random());
      front.find_nearest(
          sides, {kInfinity, allowed, allowed}, [&] { return left-- <= 0; }, stack, best);
      EXPECT_LE(front.lower(), truth.upper + kNoise) << k;
      EXPECT_GE(best.upper, truth.lower - kNoise) << k;
      EXPECT_TRUE(front.find_nearest(
          sides, {kInfinity, allowed, allowed}, [] { return false; }, stack, best));
      EXPECT_LE(front.lower(), truth.upper + kNoise) << k;
      EXPECT_GE(best.upper, truth.lower - kNoise) << k;
      EXPECT_LE(best.upper - front.lower(), allowed + kNoise) << k;
      separated += truth.lower > 0;
      nothing = front.nearest();
    }
    EXPECT_GE(nothing.a, 0);
    EXPECT_GT(front.size(), 1u);
  }
  EXPECT_GT(separated, 60);
}

// Whatever a question has opened.
TEST(PairFront, IsNoLargerThanItMayBeAfterAMotion) {
  Walk walk(5);
  PairFront front(kFewNodes);
  for (int k = 0; k < 3; ++k) {
    const StandingPair sides(walk.sheet, walk.s, walk.ball, walk.X_WB);
    const auto visit = [](const PieceDistance&, std::int32_t, std::int32_t) { return Scalar{10}; };
    EXPECT_TRUE(front.refine(
        sides, 10, [] { return false; }, visit));
    EXPECT_GT(front.size(), kFewNodes);
    front.move(walk.step(0.1));
    EXPECT_LE(front.size(), kFewNodes);
  }
}

void expect_true_bounds(const StandingPair& sides, std::int32_t a, std::int32_t b,
                        const PieceDistance& piece) {
  const auto truth = triangle_distance(sides.a.triangle_W(a), sides.b.triangle_W(b));
  EXPECT_LE(piece.lower, truth.upper + kNoise);
  EXPECT_GE(piece.upper, truth.lower - kNoise);
  EXPECT_LE(piece.upper - piece.lower, kNoise);
}

TEST(PairFront, HandsOutEveryPairWithinReach) {
  std::size_t most = 0;
  for (const std::uint64_t seed : {5U, 6U}) {
    Walk walk(seed);
    PairFront front(seed == 5 ? kFewNodes : PairFront::kMostNodes);
    for (int k = 0; k < 40; ++k) {
      front.move(walk.step(0.3));
      const StandingPair sides = walk.standing();
      const Scalar reach = testing::random_number(0.1, 1.5, walk.random());
      std::vector<std::pair<std::int32_t, std::int32_t>> found;
      EXPECT_TRUE(front.refine(
          sides, reach, [] { return false; },
          [&](const PieceDistance& piece, std::int32_t a, std::int32_t b) {
            EXPECT_LE(piece.lower, reach);
            expect_true_bounds(sides, a, b, piece);
            found.emplace_back(sides.a.triangle(a), sides.b.triangle(b));
            return reach;
          }));
      std::sort(found.begin(), found.end());
      EXPECT_TRUE(std::adjacent_find(found.begin(), found.end()) == found.end());
      const auto wanted = near_pairs(walk, reach);
      EXPECT_TRUE(std::includes(found.begin(), found.end(), wanted.begin(), wanted.end())) << k;
      most = std::max(most, wanted.size());
      if (k % 10 == 9) front.restart();
    }
  }
  EXPECT_GT(most, 100u);
}

// A cone without a base, its apex at the origin.
testing::MeshArrays fan(int sides, Scalar rise) {
  testing::MeshArrays arrays;
  arrays.vertices.emplace_back(0, 0, 0);
  for (int k = 0; k < sides; ++k) {
    const Scalar angle = 2 * std::acos(Scalar{-1}) * k / sides;
    arrays.vertices.emplace_back(std::cos(angle), std::sin(angle), rise);
    arrays.triangles.push_back({0, 1 + k, 1 + (k + 1) % sides});
  }
  return arrays;
}

// All pairs of triangles of two cones, tip to tip, share their nearest points, or those on an edge.
TEST(PairFront, MeasuresTrianglesAroundSharedVertices) {
  std::mt19937_64 random(10);
  const auto below = fan(40, -0.5), above = fan(12, 0.5);
  const TriangleMesh tip(above.vertices, above.triangles);
  for (int k = 0; k < 40; ++k) {
    const DeformingMesh mesh(below.vertices, below.vertices, below.triangles);
    const Vector3 aside =
        testing::random_number(0, 0.5, random) * testing::random_direction(random);
    const Matrix3 turn = rotation_from_vector(Vector3(0.3 * testing::random_direction(random)));
    const StandingPair sides(mesh, 0, tip, RigidPose(turn, Vector3(aside.x(), aside.y(), 0.4)));
    PairFront front;
    std::size_t visited = 0;
    front.refine(
        sides, 10, [] { return false; },
        [&](const PieceDistance& piece, std::int32_t a, std::int32_t b) {
          expect_true_bounds(sides, a, b, piece);
          ++visited;
          return Scalar{10};
        });
    EXPECT_EQ(visited, below.triangles.size() * above.triangles.size());
  }
}

// Pairs of triangles within reach that come nearer than `least`, give or take the slack, when the
// ball moves as expected: at some time of many.
std::vector<std::pair<std::int32_t, std::int32_t>> mattering_pairs(
    const Walk& walk, const toi_internal::ExpectedApproach& approach) {
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  for (const auto& [i, k] : near_pairs(walk, approach.reach)) {
    Scalar least = kInfinity;
    for (int step = 0; step <= 10; ++step) {
      Triangle b = walk.ball.triangle(k);
      for (Vector3& p : b) {
        p = walk.X_WB * p;
        p += step / 10.0 * (approach.v_W + approach.w_W.cross(p - approach.origin_W));
      }
      least = std::min(least, triangle_distance(walk.sheet.triangle(i, walk.s), b).upper);
    }
    if (least < approach.least + approach.slack - kNoise) pairs.emplace_back(i, k);
  }
  return pairs;
}

TEST(PairFront, HandsOutWhatMattersForAnExpectedMotion) {
  std::size_t found_in_all = 0, within_reach = 0, wanted_in_all = 0;
  for (const std::uint64_t seed : {11U, 12U, 13U}) {
    Walk walk(seed);
    PairFront front;
    for (int k = 0; k < 40; ++k) {
      walk.X_WB = RigidPose(walk.X_WB.rotation(), Vector3(0.2, 0.1, 1.4));
      walk.step(0.3);
      front.move(2);
      const StandingPair sides = walk.standing();
      toi_internal::ExpectedApproach approach{
          .least = testing::random_number(0, 0.2, walk.random()),
          .reach = 1,
          .slack = testing::random_number(0, 0.1, walk.random())};
      approach.v_W = testing::random_vector(0.4, walk.random());
      approach.w_W = testing::random_vector(0.2, walk.random());
      approach.origin_W = walk.X_WB.translation() + testing::random_vector(1, walk.random());
      std::vector<std::pair<std::int32_t, std::int32_t>> found;
      EXPECT_TRUE(front.refine(
          sides, approach, [] { return false; },
          [&](const PieceDistance&, std::int32_t a, std::int32_t b) {
            found.emplace_back(sides.a.triangle(a), sides.b.triangle(b));
          }));
      std::sort(found.begin(), found.end());
      const auto wanted = mattering_pairs(walk, approach);
      EXPECT_TRUE(std::includes(found.begin(), found.end(), wanted.begin(), wanted.end())) << k;
      EXPECT_LE(front.lower(), walk.truth().upper + kNoise) << k;
      found_in_all += found.size();
      wanted_in_all += wanted.size();
      within_reach += near_pairs(walk, approach.reach).size();
    }
  }
  EXPECT_GT(wanted_in_all, 100u);
  EXPECT_LT(2 * found_in_all, within_reach);
}

// Where the pair that was nearest last time leaves all that is allowed to be used up, tick after
// tick, a search after a long one begins with a promising pair: compared with a front that is asked
// everything twice, so that its last search was always short.
TEST(PairFront, TriesAPromisingPairAfterALongSearch) {
  constexpr Scalar kAllowed = 0.1, kStep = 0.03;
  std::mt19937_64 random(14);
  auto arrays = testing::plate_grid(10, 10, 60, 60);
  for (Vector3& p : arrays.vertices) p.z() = testing::random_number(0, 0.02, random);
  const DeformingMesh sheet(arrays.vertices, arrays.vertices, arrays.triangles);
  const TriangleMesh rigid = sheet.snapshot(0), ball = testing::icosphere(2).mesh();
  distance_internal::BoxPairStack stack;
  const auto search = [&](PairFront& front, const RigidPose& X_WB) {
    const StandingPair sides(sheet, 0, ball, X_WB);
    std::int64_t asked = 0;
    PieceDistance best;
    EXPECT_TRUE(front.find_nearest(
        sides, {kInfinity, kAllowed, kAllowed}, [&] { return ++asked < 0; }, stack, best));
    const Scalar truth = distance(rigid, RigidPose(), ball, X_WB).upper;
    EXPECT_NEAR(best.upper, truth, kAllowed + kNoise);
    EXPECT_NEAR(front.lower(), truth, kAllowed + kNoise);
    return asked;
  };
  PairFront front, asked_twice;
  std::int64_t with = 0, without = 0;
  for (int k = 0; k < 30; ++k) {
    const RigidPose X_WB(Vector3(-1 + kStep * k, 0.1, 1.2));
    with += search(front, X_WB);
    without += search(asked_twice, X_WB);
    search(asked_twice, X_WB);
    front.move(kStep + kNoise);
    asked_twice.move(kStep + kNoise);
  }
  EXPECT_LT(10 * with, 8 * without);
}

// The triangle numbers below a node or box.
template <typename Side>
void add_leaves(const Side& side, std::int32_t node, std::vector<std::int32_t>& triangles) {
  if (side.is_leaf(node)) return triangles.push_back(side.triangle(node));
  for (int k = 0; k < side.part_count(node); ++k) add_leaves(side, side.part(node, k), triangles);
}

void expect_all_between(PairFront front) {
  std::size_t most = 0;
  Walk walk(7);
  for (int k = 0; k < 30; ++k) {
    front.move(walk.step(0.3));
    const StandingPair sides = walk.standing();
    const Scalar near = testing::random_number(0.1, 1, walk.random());
    const Scalar far = near + testing::random_number(0, 1, walk.random());
    std::vector<std::pair<std::int32_t, std::int32_t>> found;
    const auto never = [] { return false; };
    front.refine(sides, near, never, [&](const PieceDistance&, std::int32_t a, std::int32_t b) {
      found.emplace_back(sides.a.triangle(a), sides.b.triangle(b));
      return near;
    });
    EXPECT_TRUE(front.for_each_between(near, far, never,
                                       [&](std::int32_t a, std::int32_t b, const Vector3& n_W) {
                                         EXPECT_NEAR(n_W.norm(), 1, 1e-9);  // literal: rounding
                                         std::vector<std::int32_t> of_a, of_b;
                                         add_leaves(sides.a, a, of_a);
                                         add_leaves(sides.b, b, of_b);
                                         for (const std::int32_t i : of_a) {
                                           for (const std::int32_t j : of_b)
                                             found.emplace_back(i, j);
                                         }
                                       }));
    std::sort(found.begin(), found.end());
    EXPECT_TRUE(std::adjacent_find(found.begin(), found.end()) == found.end());
    const auto wanted = near_pairs(walk, far);
    EXPECT_TRUE(std::includes(found.begin(), found.end(), wanted.begin(), wanted.end())) << k;
    most = std::max(most, wanted.size());
  }
  EXPECT_GT(most, 100u);
}

TEST(PairFront, PairsBetweenTwoReachesAreAllThatAreLeft) {
  expect_all_between(PairFront());
  expect_all_between(PairFront(kFewNodes));
}

// However far it goes in a step, and whatever it passes.
TEST(PairFront, KeepsLittleOfWhatIsNotNear) {
  Walk walk(9);
  PairFront crowded(kFewNodes), roomy;
  std::size_t most_crowded = 0, most_roomy = 0;
  for (int k = 0; k < 100; ++k) {
    walk.X_WB = RigidPose(Vector3(testing::random_number(-2, 2, walk.random()), 0, 1.15));
    const Scalar moved = walk.step(0.1).largest + 4;
    const StandingPair sides = walk.standing();
    for (PairFront* front : {&crowded, &roomy}) {
      front->move(moved);
      front->refine(
          sides, 0.01, [] { return false; },
          [](const PieceDistance&, std::int32_t, std::int32_t) { return 0.01; });
      EXPECT_LE(front->lower(), walk.truth().upper + kNoise) << k;
    }
    most_crowded = std::max(most_crowded, crowded.size());
    most_roomy = std::max(most_roomy, roomy.size());
  }
  EXPECT_GT(most_roomy, 3 * kFewNodes);
  EXPECT_LE(most_crowded, 2 * kFewNodes);
}

// Otherwise a tool that goes past much tissue would carry all of it along.
TEST(PairFront, ClosesWhatHasBecomeFar) {
  Walk walk(8);
  PairFront front;
  const auto query = [&] {
    const StandingPair sides = walk.standing();
    front.refine(
        sides, 0.3, [] { return false; },
        [](const PieceDistance&, std::int32_t, std::int32_t) { return 0.3; });
  };
  walk.X_WB = RigidPose(Vector3(0, 0, 1.2));
  query();
  const std::size_t near = front.size();
  for (int k = 0; k < 40; ++k) {
    walk.X_WB = RigidPose(Vector3(0, 0, walk.X_WB.translation().z() + 0.1));
    front.move(0.1 + kNoise);
    query();
    EXPECT_LE(front.lower(), walk.truth().upper + kNoise) << k;
  }
  EXPECT_GT(near, 50u);
  EXPECT_LT(front.size(), near / 2);
}

}  // namespace
}  // namespace dyop
