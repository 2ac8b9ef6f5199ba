// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "distance/triangle_wide/triangle_batch.h"
#include "dyop/core/error.h"
#include "dyop/distance/triangle_block.h"
#include "dyop/distance/triangle_distance.h"
#include "support/inputs/random_inputs.h"
#include "support/runnable_sets.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using core_internal::InstructionSet;
using testing::has_same_bits;
using testing::runnable_sets;
using testing::TriangleFamily;

struct Pairs {
  TriangleBlocks a;
  TriangleBlocks b;

  explicit Pairs(std::size_t count) : a(count), b(count) {}
};

// Edges that are parallel but for rounding, one of them so short that the sum of the other two is
// as inexact as its length: Gram determinants below zero.
Pairs pairs_with_short_edges(std::size_t count, std::mt19937_64& random) {
  Pairs pairs(count);
  for (std::size_t n = 0; n < count; ++n) {
    auto [a, b] = testing::random_triangle_pair(TriangleFamily::Near, random);
    const Scalar length = std::exp2(-testing::random_number(8, 60, random));
    b[2] = b[1] + length * (a[1] - a[0]);
    if (testing::random_index(2, random) == 0) a[2] = a[1] + length * (a[1] - a[0]);
    const Scalar scale = std::exp2(testing::random_number(-62, 62, random));
    for (Triangle* triangle : {&a, &b}) {
      for (Vector3& vertex : *triangle) vertex *= scale;
    }
    pairs.a.set(n, a);
    pairs.b.set(n, b);
  }
  return pairs;
}

// As generated, scaled, far from the origin, or both; one in twenty out of the range that is solved
// as it is.
Pairs random_pairs(TriangleFamily family, std::size_t count, std::mt19937_64& random) {
  Pairs pairs(count);
  for (std::size_t n = 0; n < count; ++n) {
    auto [a, b] = testing::random_triangle_pair(family, random);
    const int place = testing::random_index(4, random);
    Scalar scale = place & 1 ? testing::random_magnitude(-6, 6, random) : 1;
    if (testing::random_index(20, random) == 0) scale = testing::random_magnitude(-60, 50, random);
    const Scalar distance = place & 2 ? testing::random_magnitude(0, 6, random) : 0;
    const Vector3 offset = testing::random_direction(random) * (scale * distance);
    for (Triangle* triangle : {&a, &b}) {
      for (Vector3& vertex : *triangle) vertex = scale * vertex + offset;
    }
    pairs.a.set(n, a);
    pairs.b.set(n, b);
  }
  return pairs;
}

// Found among 1e8 pairs of the soak.
Pairs pair_with_a_negative_gram_determinant() {
  Pairs pair(1);
  pair.a.set(0, {Vector3(0x1.3063275081d8dp-7, 0x1.b8e78d6676e13p-8, -0x1.2a0e02d68756p-7),
                 Vector3(-0x1.0c6f83b72a70ap-7, 0x1.8fb3754cecb9bp-8, 0x1.322b95df299aep-8),
                 Vector3(0x1.b76415a6049b8p-8, 0x1.48c3a7b0de04bp-9, -0x1.cb6a06d8e2031p-8)});
  pair.b.set(0, {Vector3(0x1.bc9e39b19ff44p-7, -0x1.b05b8a377111ap-10, 0x1.a12334d6ccd84p-8),
                 Vector3(0x1.466f1888aced2p-6, 0x1.12b6dcb5d10a4p-7, 0x1.2c38b7576e3bap-10),
                 Vector3(0x1.466bec23450c5p-6, 0x1.12ac80340c29ap-7, 0x1.2c61b1345de9fp-10)});
  return pair;
}

void expect_same_bits(const Pairs& pairs, InstructionSet set) {
  TriangleDistanceBlocks answers;
  distance_internal::triangle_distances(pairs.a, pairs.b, set, answers);
  ASSERT_EQ(answers.size(), pairs.a.size());
  for (std::size_t n = 0; n < answers.size(); ++n) {
    ASSERT_TRUE(has_same_bits(answers[n], triangle_distance(pairs.a[n], pairs.b[n]))) << n;
  }
}

TEST(TriangleDistanceBatch, HasTheBitsOfOneByOneInEveryFamilyOnEveryInstructionSet) {
  for (const TriangleFamily family : testing::kAllTriangleFamilies) {
    SCOPED_TRACE(testing::name_of(family));
    std::mt19937_64 random(static_cast<std::uint64_t>(family) + 400);
    const Pairs pairs = random_pairs(family, 20011, random);
    for (const InstructionSet set : runnable_sets()) {
      SCOPED_TRACE(static_cast<int>(set));
      expect_same_bits(pairs, set);
    }
  }
}

// Lanes of one vector then take different ways, and blocks are packed.
TEST(TriangleDistanceBatch, HasTheBitsOfOneByOneWhereEdgesAreShort) {
  std::mt19937_64 random(31);
  const Pairs pairs = pairs_with_short_edges(200000, random);
  for (const InstructionSet set : runnable_sets()) {
    SCOPED_TRACE(static_cast<int>(set));
    expect_same_bits(pair_with_a_negative_gram_determinant(), set);
    expect_same_bits(pairs, set);
  }
}

TEST(TriangleDistanceBatch, HasTheBitsOfOneByOneWhereFamiliesAreMixed) {
  std::mt19937_64 random(500);
  constexpr std::size_t kCount = 40000;
  Pairs mixed(kCount);
  for (std::size_t n = 0; n < kCount; ++n) {
    const auto& families = testing::kAllTriangleFamilies;
    const auto family = static_cast<std::size_t>(testing::random_index(families.size(), random));
    const Pairs one = random_pairs(families[family], 1, random);
    mixed.a.set(n, one.a[0]);
    mixed.b.set(n, one.b[0]);
  }
  for (const InstructionSet set : runnable_sets()) expect_same_bits(mixed, set);
}

TEST(TriangleDistanceBatch, TakesAnyNumberOfPairs) {
  std::mt19937_64 random(501);
  for (std::size_t count = 0; count < 150; ++count) {
    const Pairs pairs = random_pairs(TriangleFamily::Near, count, random);
    for (const InstructionSet set : runnable_sets()) expect_same_bits(pairs, set);
  }
}

TEST(TriangleDistanceBatch, ProvesNothingForNaNAndInfinityAndSparesTheNeighbours) {
  std::mt19937_64 random(502);
  for (const TriangleFamily family :
       {TriangleFamily::Near, TriangleFamily::Far, TriangleFamily::Crossing,
        TriangleFamily::SharedEdge, TriangleFamily::SharedVertex, TriangleFamily::ZeroArea}) {
    Pairs pairs = random_pairs(family, 64, random);
    for (std::size_t place = 0; place < 18; ++place) {
      TriangleBlocks& blocks = place < 9 ? pairs.a : pairs.b;
      Triangle broken = blocks[3 * place];
      broken[place % 9 / 3][static_cast<Eigen::Index>(place % 3)] =
          place % 2 == 0 ? std::nan("") : kInfinity;
      blocks.set(3 * place, broken);
    }
    for (const InstructionSet set : runnable_sets()) {
      TriangleDistanceBlocks answers;
      distance_internal::triangle_distances(pairs.a, pairs.b, set, answers);
      for (std::size_t n = 0; n < 64; ++n) {
        if (n % 3 == 0 && n < 54) {
          EXPECT_EQ(answers[n].lower, 0);
          EXPECT_EQ(answers[n].upper, kInfinity);
        } else {
          EXPECT_TRUE(has_same_bits(answers[n], triangle_distance(pairs.a[n], pairs.b[n])));
        }
      }
    }
  }
}

TEST(TriangleDistanceBatch, RefusesDifferentNumbersOfTriangles) {
  TriangleDistanceBlocks answers;
  EXPECT_THROW(triangle_distances(TriangleBlocks(3), TriangleBlocks(4), answers), InvalidArgument);
}

TEST(TriangleBlocks, GiveBackWhatWasPutIn) {
  const Triangle triangle{Vector3(1, 2, 3), Vector3(4, 5, 6), Vector3(7, 8, 9)};
  TriangleBlocks blocks(10);
  blocks.set(9, triangle);
  EXPECT_EQ(blocks[9], triangle);
  EXPECT_EQ(blocks.blocks()[1].at[5][1], 6);
  EXPECT_EQ(blocks[8][2], Vector3(0, 0, 0));
}

}  // namespace
}  // namespace dyop
