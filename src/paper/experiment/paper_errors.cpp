// SPDX-License-Identifier: BSD-3-Clause
#include "paper/experiment/paper_errors.h"

#include <algorithm>
#include <random>

#include "dyop/distance/triangle_distance.h"
#include "dyop/paper/planar_distance.h"
#include "dyop/paper/published_dyop.h"
#include "paper/experiment/paper_experiment.h"

namespace dyop::cli {
namespace {

PlanarDistance certified(const PaperPair<2>& pair) {
  return planar_triangle_distance(pair.a, pair.b);
}
TriangleDistance certified(const PaperPair<3>& pair) {
  return triangle_distance(pair.a, pair.b);
}

// Moving b along the normal changes the distance by exactly that amount: so do both the slab that
// proves it and the segment that attains it.
template <int dimension>
PaperPair<dimension> pair_at(Scalar gap, std::mt19937_64& random) {
  for (;;) {
    PaperPair<dimension> pair{random_paper_triangle<dimension>(random),
                              random_paper_triangle<dimension>(random)};
    const auto d = certified(pair);
    if (!(d.lower > 0)) continue;
    for (auto& p : pair.b) p += (gap - d.upper) * d.nhat_AB;
    return pair;
  }
}

template <int dimension>
GapErrors measure(Scalar gap, int pairs, std::mt19937_64& random) {
  GapErrors errors{dimension, gap, pairs};
  Scalar sum = 0;
  for (int k = 0; k < pairs; ++k) {
    const PaperPair<dimension> pair = pair_at<dimension>(gap, random);
    const Scalar value = published_dyop(pair.a, pair.b).distance;
    const Scalar truth = certified(pair).upper;
    if (value <= truth + kWrongBy) continue;
    ++errors.wrong;
    sum += value / truth;
    errors.worst_factor = std::max(errors.worst_factor, value / truth);
  }
  if (errors.wrong > 0) errors.mean_factor = sum / errors.wrong;
  return errors;
}

}  // namespace

std::vector<GapErrors> measure_gap_errors(std::uint64_t seed, int pairs) {
  std::mt19937_64 random(seed);
  constexpr Scalar kGaps[] = {10, 1, 0.3, 0.1, 0.01, 0.001};
  std::vector<GapErrors> rows;
  for (const Scalar gap : kGaps) rows.push_back(measure<2>(gap, pairs, random));
  for (const Scalar gap : kGaps) rows.push_back(measure<3>(gap, pairs, random));
  return rows;
}

}  // namespace dyop::cli
