// SPDX-License-Identifier: BSD-3-Clause

// Soak of the triangle kernel against the exact oracle: triangle_distance_soak [pairs of every
// family] [seed]. Every family of random_inputs.h, at scales 1e-6 to 1e6 and up to 1e6 sizes from
// the origin. Every pair goes through triangle_distance(), through warm_triangle_distance() from
// features of the right kind and from any, and through triangle_distances() on every instruction
// set, which must give the same bits. Prints one line a family; the exit code is 1 if any bound was
// wrong.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "distance/triangle_wide/triangle_batch.h"
#include "dyop/distance/triangle_distance.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/triangle_oracle.h"
#include "support/runnable_sets.h"
#include "support/same_bits.h"

namespace {

using dyop::Scalar;
using dyop::Triangle;
using dyop::TriangleDistance;
using dyop::Vector3;
using dyop::testing::has_same_bits;
using dyop::testing::OracleDistance;
using dyop::testing::Quad;

struct Tally {
  std::int64_t pairs = 0;
  std::int64_t lower_above = 0;      // lower > d
  std::int64_t upper_below = 0;      // upper < d
  std::int64_t bad_normal = 0;       // not unit, or its exact slab gap does not prove lower
  std::int64_t bad_witness = 0;      // points farther apart than upper allows
  std::int64_t uncertified = 0;      // upper - lower > triangle_noise
  std::int64_t missed_crossing = 0;  // d = 0, lower = 0, but not reported as touching
  std::int64_t other_bits = 0;       // answers of wide kernels that differ from the scalar one
  double widest = 0;                 // (upper - lower) / triangle_noise of certified pairs
  double widest_uncertified = 0;     // (upper - lower) / size of the others
};

// Whether the slab gap along the normal, in quad precision, is at least `lower`.
bool proves(const Vector3& normal, Scalar lower, const Triangle& a, const Triangle& b) {
  const auto along = [&](const Vector3& p) {
    return Quad(normal.x()) * Quad(p.x()) + Quad(normal.y()) * Quad(p.y()) +
           Quad(normal.z()) * Quad(p.z());
  };
  const Quad gap = std::min({along(b[0]), along(b[1]), along(b[2])}) -
                   std::max({along(a[0]), along(a[1]), along(a[2])});
  const Quad squared = along(normal);
  return lower == 0 || (gap > 0 && gap * gap >= Quad(lower) * Quad(lower) * squared);
}

Scalar largest_coordinate(const Triangle& a, const Triangle& b) {
  Scalar largest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    largest = std::max({largest, a[k].cwiseAbs().maxCoeff(), b[k].cwiseAbs().maxCoeff()});
  }
  return largest;
}

bool has_common_vertex(const Triangle& a, const Triangle& b) {
  for (const Vector3& p : a) {
    for (const Vector3& q : b) {
      if (p == q) return true;
    }
  }
  return false;
}

// The distance in quad precision with its proven error; by exact rational arithmetic, which takes a
// millisecond, if that error leaves open whether the answer is right.
OracleDistance true_distance(const Triangle& a, const Triangle& b, const TriangleDistance& r) {
  if (has_common_vertex(a, b)) return {};
  using dyop::testing::to_points;
  const OracleDistance quad =
      dyop::testing::oracle_triangle_distance(to_points<Quad>(a), to_points<Quad>(b));
  const bool is_decided = static_cast<long double>(r.lower) <= quad.lower() &&
                          static_cast<long double>(r.upper) >= quad.upper() &&
                          (r.is_overlapping || quad.lower() > 0);
  return is_decided ? quad : dyop::testing::oracle_triangle_distance(a, b);
}

void check(const Triangle& a, const Triangle& b, const TriangleDistance& r, Tally& tally) {
  const OracleDistance d = true_distance(a, b, r);
  const Scalar noise = dyop::triangle_noise(a, b);
  // Negated, so that NaN counts as wrong.
  if (!(static_cast<long double>(r.lower) <= d.upper())) ++tally.lower_above;
  if (!(static_cast<long double>(r.upper) >= d.lower())) ++tally.upper_below;
  const bool is_unit = std::abs(r.nhat_AB.norm() - 1) <= 8 * dyop::kUnitRoundoff;
  if (!is_unit || !proves(r.nhat_AB, r.lower, a, b)) ++tally.bad_normal;
  const Scalar coordinate = largest_coordinate(a, b);
  if (!((r.p_b - r.p_a).norm() <= r.upper + 16 * dyop::kUnitRoundoff * coordinate)) {
    ++tally.bad_witness;
  }
  const Scalar width = r.upper - r.lower;
  if (width <= noise) {
    tally.widest = std::max(tally.widest, noise > 0 ? width / noise : 0);
  } else {
    ++tally.uncertified;
    const Scalar size = noise / dyop::kTriangleNoise;
    tally.widest_uncertified = std::max(tally.widest_uncertified, width / size);
  }
  if (d.lower() == 0 && !r.is_overlapping) ++tally.missed_crossing;
}

dyop::Feature random_feature(std::mt19937_64& random) {
  const int first = dyop::testing::random_index(3, random);
  switch (dyop::testing::random_index(3, random)) {
    case 0:
      return {dyop::FeatureKind::Vertex, {first}};
    case 1:
      return {dyop::FeatureKind::Edge, {first, (first + 1) % 3}};
    default:
      return {dyop::FeatureKind::Face, {0, 1, 2}};
  }
}

// As generated, scaled, moved away, or both.
dyop::testing::TrianglePair random_pair(dyop::testing::TriangleFamily family,
                                        std::mt19937_64& random) {
  auto pair = dyop::testing::random_triangle_pair(family, random);
  const int place = dyop::testing::random_index(4, random);
  const Scalar scale = place & 1 ? dyop::testing::random_magnitude(-6, 6, random) : 1;
  Vector3 offset = Vector3::Zero();
  if (place & 2) {
    offset = dyop::testing::random_direction(random) *
             (scale * dyop::testing::random_magnitude(0, 6, random));
  }
  for (Triangle* triangle : {&pair.a, &pair.b}) {
    for (Vector3& vertex : *triangle) vertex = scale * vertex + offset;
  }
  return pair;
}

// Takes some pairs through every path.
void check_all_paths(const std::vector<dyop::testing::TrianglePair>& pairs, std::mt19937_64& random,
                     Tally& tally) {
  dyop::TriangleBlocks a(pairs.size());
  dyop::TriangleBlocks b(pairs.size());
  std::vector<TriangleDistance> answers;
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    const auto& pair = pairs[n];
    a.set(n, pair.a);
    b.set(n, pair.b);
    const TriangleDistance r = dyop::triangle_distance(pair.a, pair.b);
    check(pair.a, pair.b, r, tally);
    answers.push_back(r);
    // The right features repeat the answer or prove it differently; others mislead.
    const bool is_right = dyop::testing::random_index(2, random) == 0;
    const dyop::Feature feature_a = is_right ? r.feature_a : random_feature(random);
    const dyop::Feature feature_b = is_right ? r.feature_b : random_feature(random);
    const auto warm = dyop::warm_triangle_distance(pair.a, pair.b, feature_a, feature_b);
    if (!has_same_bits(warm, r)) check(pair.a, pair.b, warm, tally);
  }
  for (const auto set : dyop::testing::runnable_sets()) {
    dyop::TriangleDistanceBlocks wide;
    dyop::distance_internal::triangle_distances(a, b, set, wide);
    for (std::size_t n = 0; n < pairs.size(); ++n) {
      if (!has_same_bits(wide[n], answers[n])) ++tally.other_bits;
    }
  }
  tally.pairs += static_cast<std::int64_t>(pairs.size());
}

}  // namespace

int main(int argc, char** argv) {
  const std::int64_t count = argc > 1 ? std::atoll(argv[1]) : 1000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  std::mt19937_64 random(seed);
  const auto& families = dyop::testing::kAllTriangleFamilies;
  std::printf("seed %llu\n%-16s %10s %7s %7s %7s %7s %7s %11s %9s %12s %14s\n",
              static_cast<unsigned long long>(seed), "family", "pairs", "low>d", "up<d", "normal",
              "witness", "bits", "uncertified", "no touch", "width/noise", "open width/size");
  bool is_right = true;
  for (std::size_t f = 0; f < families.size(); ++f) {
    Tally tally;
    constexpr std::int64_t kChunk = 1000;
    for (std::int64_t k = 0; k < count; k += kChunk) {
      std::vector<dyop::testing::TrianglePair> pairs;
      const std::int64_t end = std::min(count, k + kChunk);
      for (std::int64_t n = k; n < end; ++n) pairs.push_back(random_pair(families[f], random));
      check_all_paths(pairs, random, tally);
    }
    is_right = is_right && tally.lower_above + tally.upper_below + tally.bad_normal +
                                   tally.bad_witness + tally.other_bits ==
                               0;
    std::printf(
        "%-16s %10lld %7lld %7lld %7lld %7lld %7lld %11lld %9lld %12.3f %14.2e\n",
        dyop::testing::name_of(families[f]), static_cast<long long>(tally.pairs),
        static_cast<long long>(tally.lower_above), static_cast<long long>(tally.upper_below),
        static_cast<long long>(tally.bad_normal), static_cast<long long>(tally.bad_witness),
        static_cast<long long>(tally.other_bits), static_cast<long long>(tally.uncertified),
        static_cast<long long>(tally.missed_crossing), tally.widest, tally.widest_uncertified);
    std::fflush(stdout);
  }
  return is_right ? 0 : 1;
}
