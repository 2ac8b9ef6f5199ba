// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "distance/triangle_wide/triangle_answer_simd.h"

// Pairs with vertices in common, as in triangle_shared.cpp, one pair per lane.
namespace dyop::distance_internal {
inline namespace DYOP_LANES {

struct SharedLanes {
  Mask lanes;       ///< with a vertex in common
  Mask has_edge;    ///< of these: with two
  Lanes common[3];  ///< the first common vertex
  Lanes own_a[3];   ///< the vertices outside of the common edge
  Lanes own_b[3];
  Lanes place_a, place_b;

  DYOP_INLINE explicit SharedLanes(const PairLanes& pair) {
    Mask is_equal[9];
    for (int q = 0; q < 9; ++q) is_equal[q] = equal(pair.A[q / 3][0], pair.B[q % 3][0]);
    lanes = any_of(is_equal);
    has_edge = without(lanes, lanes);
    if (!any(lanes)) return;
    for (int q = 0; q < 9; ++q) {
      is_equal[q] = is_equal[q] & (equal(pair.A[q / 3][1], pair.B[q % 3][1]) &
                                   equal(pair.A[q / 3][2], pair.B[q % 3][2]));
    }
    lanes = any_of(is_equal);
    if (any(lanes)) find_vertices(pair, is_equal);
  }

 private:
  static DYOP_INLINE Mask any_of(const Mask* x) {
    return ((x[0] | x[1]) | (x[2] | x[3])) | ((x[4] | x[5]) | ((x[6] | x[7]) | x[8]));
  }

  /// The first pair of equal vertices, and the first one that contains neither of them.
  DYOP_INLINE void find_vertices(const PairLanes& pair, const Mask* is_equal) {
    const Mask none = without(lanes, lanes);
    Mask row[3] = {none, none, none}, column[3] = {none, none, none};
    Mask is_found = none;
    for (int q = 0; q < 9; ++q) {
      const Mask is_first = without(is_equal[q], is_found);
      is_found = is_found | is_equal[q];
      row[q / 3] = row[q / 3] | is_first;
      column[q % 3] = column[q % 3] | is_first;
    }
    const Choice i{row[1], row[2]};
    const Choice j{column[1], column[2]};
    i.of(pair.A, common);
    place_a = i.of(Lanes(0.0), Lanes(1.0), Lanes(2.0));
    place_b = j.of(Lanes(0.0), Lanes(1.0), Lanes(2.0));
    Mask used_row[3] = {row[0], row[1], row[2]};
    Mask used_column[3] = {column[0], column[1], column[2]};
    for (int q = 0; q < 9; ++q) {
      const Mask is_other = without(is_equal[q], row[q / 3] | column[q % 3]);
      const Mask is_second = without(is_other, has_edge);
      has_edge = has_edge | is_other;
      used_row[q / 3] = used_row[q / 3] | is_second;
      used_column[q % 3] = used_column[q % 3] | is_second;
    }
    const Choice own_i{inverse(used_row[1]), inverse(used_row[2])};
    const Choice own_j{inverse(used_column[1]), inverse(used_column[2])};
    own_i.of(pair.A, own_a);
    own_j.of(pair.B, own_b);
  }
};

/// hinge_normal(); returns the lanes that have one.
DYOP_INLINE Mask hinge_normal(const PairLanes& pair, const SharedLanes& shared,
                              const TriangleConstants& c, Lanes* normal) {
  Lanes n_a[3], n_b[3], n[3], out[3];
  cross(pair.a[2], pair.a[0], n_a);
  cross(pair.b[2], pair.b[0], n_b);
  const Lanes square_a = dot(n_a, n_a), square_b = dot(n_b, n_b);
  const Lanes length_a = pair.aa[0] + pair.aa[2], length_b = pair.bb[0] + pair.bb[2];
  const Mask of_a = square_a >= square_b;
  const Lanes squared = select(of_a, square_a, square_b);
  const Lanes length = select(of_a, length_a, length_b);
  const Lanes fourth(c.largest_size * c.largest_size);
  const Mask is_in_range = (fourth >= length_a + length_b) & (length * fourth >= Lanes(1.0));
  select(of_a, n_a, n_b, n);
  for (int k = 0; k < 3; ++k) {
    out[k] = select(of_a, shared.own_b[k], shared.common[k]) -
             select(of_a, shared.common[k], shared.own_a[k]);
  }
  const Lanes inverse_norm = Lanes(1.0) / sqrt(squared);
  const Mask is_turned = Lanes(0.0) > dot(n, out);
  const Lanes factor = select(is_turned, negated(inverse_norm), inverse_norm);
  for (int k = 0; k < 3; ++k) normal[k] = n[k] * factor;
  return shared.has_edge & is_in_range & (squared >= Lanes(c.parallel_square) * (length * length));
}

/// touching_distance() in some lanes.
DYOP_INLINE void touch(Mask lanes, const SharedLanes& shared, const Lanes* normal,
                       AnswerLanes& answer) {
  WitnessLanes& w = answer.witness;
  select(lanes, shared.common, w.p_a, w.p_a);
  select(lanes, shared.common, w.p_b, w.p_b);
  select(lanes, normal, w.m, w.m);
  w.place_a = select(lanes, shared.place_a, w.place_a);
  w.place_b = select(lanes, shared.place_b, w.place_b);
  answer.lower = select(lanes, Lanes(0.0), answer.lower);
  answer.upper = select(lanes, Lanes(0.0), answer.upper);
  answer.is_overlapping = select(lanes, Lanes(1.0), answer.is_overlapping);
  answer.decided = answer.decided | lanes;
}

}  // namespace DYOP_LANES
}  // namespace dyop::distance_internal
