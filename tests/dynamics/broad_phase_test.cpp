// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/broad_phase.h"

#include <gtest/gtest.h>

#include <random>

namespace dyop::dynamics_internal {
namespace {

using Pairs = std::vector<std::pair<std::int32_t, std::int32_t>>;

Pairs all_pairs(const std::vector<AlignedBox>& boxes, const std::vector<bool>& may_move) {
  Pairs pairs;
  for (std::size_t a = 0; a < boxes.size(); ++a) {
    for (std::size_t b = a + 1; b < boxes.size(); ++b) {
      const bool overlap = (boxes[a].min().array() <= boxes[b].max().array()).all() &&
                           (boxes[b].min().array() <= boxes[a].max().array()).all();
      if (overlap && (may_move[a] || may_move[b])) {
        pairs.emplace_back(static_cast<std::int32_t>(a), static_cast<std::int32_t>(b));
      }
    }
  }
  return pairs;
}

TEST(BroadPhase, EqualsAllPairsOverManyStepsAndKindsOfScene) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<Scalar> uniform(0, 1);
  std::normal_distribution<Scalar> normal;
  std::size_t found = 0;
  for (const int count : {1, 2, 10, 300}) {
    for (const Scalar spread : {0.0, 1.0, 10.0}) {
      for (const Vector3& shape : {Vector3(1, 1, 1), Vector3(1, 0, 0.01), Vector3(0, 1, 0)}) {
        BroadPhase broad_phase;
        std::vector<AlignedBox> boxes;
        std::vector<bool> may_move;
        for (int i = 0; i < count; ++i) {
          boxes.emplace_back(Vector3::Zero(), Vector3::Zero());
          EXPECT_EQ(broad_phase.add(boxes.back()), i);
          may_move.push_back(uniform(random) < 0.7);
        }
        std::vector<Vector3> centers(boxes.size());
        for (Vector3& c : centers) {
          c = spread * Vector3(normal(random), normal(random), normal(random)).cwiseProduct(shape);
        }
        for (int step = 0; step < 15; ++step) {
          for (std::size_t i = 0; i < boxes.size(); ++i) {
            centers[i] += 0.1 * Vector3(normal(random), normal(random), normal(random));
            if (uniform(random) < 0.05) centers[i] *= -1;  // a jump
            const Vector3 half = uniform(random) < 0.1
                                     ? Vector3(0, 0, 0)
                                     : Vector3(uniform(random), uniform(random), uniform(random));
            boxes[i] = {centers[i] - half, centers[i] + half};
            if (i == 0 && step % 5 == 4) {
              boxes[i] = {Vector3::Constant(-kInfinity), Vector3::Constant(kInfinity)};
            }
            broad_phase.update(static_cast<std::int32_t>(i), boxes[i]);
          }
          const Pairs expected = all_pairs(boxes, may_move);
          ASSERT_EQ(broad_phase.find_pairs(may_move), expected);
          found += expected.size();
        }
      }
    }
  }
  EXPECT_GT(found, 10000u);
}

TEST(BroadPhase, CountsTouchingBoxesAndSkipsPairsThatCannotMove) {
  BroadPhase broad_phase;
  broad_phase.add({Vector3(0, 0, 0), Vector3(1, 1, 1)});
  broad_phase.add({Vector3(1, 1, 1), Vector3(2, 2, 2)});
  EXPECT_EQ(broad_phase.find_pairs({true, false}), (Pairs{{0, 1}}));
  EXPECT_EQ(broad_phase.find_pairs({false, false}), Pairs{});
}

}  // namespace
}  // namespace dyop::dynamics_internal
