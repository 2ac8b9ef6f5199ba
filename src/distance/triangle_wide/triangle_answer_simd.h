// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "distance/triangle_wide/triangle_search_simd.h"

// Answers of all lanes, before they are stored in a block.
namespace dyop::distance_internal {
inline namespace DYOP_LANES {

/// result_of() in all lanes.
DYOP_INLINE void store_result(const WitnessLanes& w, const BoundsLanes& bounds,
                              TriangleDistanceBlock& block, int first) {
  bounds.lower.store(block.lower + first);
  bounds.upper.store(block.upper + first);
  for (int k = 0; k < 3; ++k) {
    w.p_a[k].store(block.p_a[k] + first);
    w.p_b[k].store(block.p_b[k] + first);
    (w.m[k] * bounds.inverse_norm).store(block.nhat_AB[k] + first);
  }
  store_bytes(w.place_a, block.place_a + first);
  store_bytes(w.place_b, block.place_b + first);
  store_bytes(Lanes(0.0), block.is_overlapping + first);
}

/// The answers of all lanes.
struct AnswerLanes {
  WitnessLanes witness;  ///< m is the normal here
  Lanes lower, upper;
  Lanes is_overlapping;
  Mask decided;

  DYOP_INLINE AnswerLanes() : lower(0.0), upper(0.0), is_overlapping(0.0) {
    decided = no_choice().i.is_1;
    for (int k = 0; k < 3; ++k) {
      witness.D[k] = witness.m[k] = witness.p_a[k] = witness.p_b[k] = Lanes(0.0);
    }
    witness.place_a = witness.place_b = Lanes(0.0);
  }

  /// result_of() in some lanes.
  DYOP_INLINE void take(Mask lanes, const WitnessLanes& w, const BoundsLanes& bounds) {
    select(lanes, w, witness);
    for (int k = 0; k < 3; ++k) {
      witness.m[k] = select(lanes, w.m[k] * bounds.inverse_norm, witness.m[k]);
    }
    lower = select(lanes, bounds.lower, lower);
    upper = select(lanes, bounds.upper, upper);
    decided = decided | lanes;
  }

  /// Search::finished() in some lanes.
  DYOP_INLINE void finish(Mask lanes, const SearchLanes& search, const Lanes* touching_normal) {
    const Mask is_touching = lanes & equal(search.lower, Lanes(0.0));
    select(lanes, search.best, witness);
    select(is_touching, touching_normal, witness.m, witness.m);
    is_overlapping = select(is_touching, Lanes(1.0), is_overlapping);
    lower = select(lanes, search.lower, lower);
    upper = select(lanes, search.upper, upper);
    decided = decided | lanes;
  }

  DYOP_INLINE void store(TriangleDistanceBlock& block, int first) const {
    lower.store(block.lower + first);
    upper.store(block.upper + first);
    for (int k = 0; k < 3; ++k) {
      witness.p_a[k].store(block.p_a[k] + first);
      witness.p_b[k].store(block.p_b[k] + first);
      witness.m[k].store(block.nhat_AB[k] + first);
    }
    store_bytes(witness.place_a, block.place_a + first);
    store_bytes(witness.place_b, block.place_b + first);
    store_bytes(is_overlapping, block.is_overlapping + first);
  }
};

}  // namespace DYOP_LANES
}  // namespace dyop::distance_internal
