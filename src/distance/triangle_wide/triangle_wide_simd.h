// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "distance/triangle_wide/triangle_shared_simd.h"

// The kernels of triangle_wide.h for the instruction set that the including file is compiled for.
// The stages are those of triangle_distance(), in the same order.
namespace dyop::distance_internal {
inline namespace DYOP_LANES {

/// First candidates of pairs that are not far.
struct NearCandidate {
  WitnessLanes witness;
  Mask is_flat;   ///< of these, the longest edges are tried
  Mask is_tried;  ///< there is a candidate

  /// @param edges Edges of lanes that have their candidate already.
  /// @param rest  The other lanes.
  DYOP_INLINE NearCandidate(const PairLanes& pair, const FacetLanes& f, EdgeChoice edges, Mask rest,
                            const TriangleConstants& c) {
    const Lanes flat_square(c.flat_square);
    const Mask has_area = (dot(f.n_a, f.n_a) > flat_square * (pair.aa[0] * pair.aa[2])) |
                          (dot(f.n_b, f.n_b) > flat_square * (pair.bb[0] * pair.bb[2]));
    is_flat = without(rest, has_area);
    const Lanes contact = Lanes(c.contact_gap) * pair.size;
    const Mask by_facet = without(rest, is_flat) & (f.best > contact * contact);
    is_tried = is_flat | by_facet;
    edges.i = select(by_facet, f.i, edges.i);
    edges.j = select(by_facet, f.j, edges.j);
    if (any(is_flat)) {
      edges.i = select(is_flat, longest_of(pair.aa), edges.i);
      edges.j = select(is_flat, longest_of(pair.bb), edges.j);
    }
    const Mask by_face = by_facet & (f.is_face_a | f.is_face_b);
    if (!any(by_face)) {
      witness = edge_witness(pair, edges.i, edges.j);
      return;
    }
    const FaceWitnessLanes face(pair, f);
    witness =
        edge_witness(pair, select(by_face, face.i, edges.i), select(by_face, face.j, edges.j));
    select(by_face & face.is_above_face, face.witness, witness);
  }
};

/// Runs some of the lanes through triangle_distance(), as far as these kernels go.
/// @return The lanes whose answers are in the rows.
template <bool is_thorough>
DYOP_INLINE Mask decide_lanes(const TriangleBlock& a, const TriangleBlock& b,
                              TriangleDistanceBlock& answers, int first,
                              const TriangleConstants& c) {
  const PairLanes pair(a, b, first);
  const Mask in_range =
      (pair.size >= Lanes(c.smallest_size)) & (Lanes(c.largest_size) >= pair.size);
  Mask pending = in_range;
  AnswerLanes answer;
  const SharedLanes shared(pair);
  Mask corner = without(in_range, in_range);
  if (any(shared.lanes)) {
    Lanes normal[3];
    const Mask hinged = hinge_normal(pair, shared, c, normal);
    touch(hinged, shared, normal, answer);
    corner = without(shared.lanes & in_range, hinged);
    pending = without(pending, shared.lanes);
    if (!any(pending)) {
      if (any(corner)) {
        facet_normal(pair, FacetLanes(pair, c), c, normal);
        touch(corner, shared, normal, answer);
      }
      answer.store(answers, first);
      return answer.decided;
    }
  }
  Lanes direction[3];
  for (int k = 0; k < 3; ++k) {
    direction[k] = pair.r[k] +
                   ((pair.b[0][k] - pair.a[0][k]) - (pair.b[2][k] - pair.a[2][k])) * Lanes(1.0 / 3);
  }
  const Mask far = pending & (dot(direction, direction) > Lanes(c.far_ratio) * pair.edges);
  EdgeChoice edges = no_choice();
  if (any(far)) edges = directed_edges(pair, direction);
  const Mask rest = without(pending, far);
  if (!any(rest | corner)) {
    const WitnessLanes w = edge_witness(pair, edges.i, edges.j);
    const BoundsLanes bounds = prove(pair, w.m, w.D, c);
    const Mask certified = pending & is_certified(pair, bounds, c);
    if (!any(shared.lanes)) {
      store_result(w, bounds, answers, first);
      return certified;
    }
    answer.take(certified, w, bounds);
    answer.store(answers, first);
    return answer.decided;
  }
  const FacetLanes facets(pair, c);
  const NearCandidate near(pair, facets, edges, rest, c);
  const BoundsLanes bounds = prove(pair, near.witness.m, near.witness.D, c);
  const Mask tried = far | near.is_tried;
  const Mask certified = tried & is_certified(pair, bounds, c);
  if (!is_thorough && !any(shared.lanes)) {
    store_result(near.witness, bounds, answers, first);
    return certified;
  }
  answer.take(certified, near.witness, bounds);
  if (!is_thorough && any(corner)) {
    Lanes normal[3];
    facet_normal(pair, facets, c, normal);
    touch(corner, shared, normal, answer);
  }
  if constexpr (is_thorough) {
    const Mask open = without(rest, answer.decided);
    SearchLanes search(near.witness, bounds, near.is_tried, direction);
    if (any(open)) search.resolve(pair, facets, open, c);
    Lanes normal[3];
    facet_normal(pair, facets, c, normal);
    answer.finish(open & search.is_done, search, normal);
    if (any(corner)) touch(corner, shared, normal, answer);
  }
  answer.store(answers, first);
  return answer.decided;
}

template <bool is_thorough>
static void decide_triangles(const TriangleBlock* a, const TriangleBlock* b,
                             TriangleDistanceBlock* answers, int block_count,
                             const TriangleConstants& c, unsigned char* decided) {
  for (int n = 0; n < block_count; ++n) {
    unsigned bits = 0;
    for (int first = 0; first < kTriangleBlockWidth; first += Lanes::kCount) {
      bits |= decide_lanes<is_thorough>(a[n], b[n], answers[n], first, c).bits() << first;
    }
    decided[n] = static_cast<unsigned char>(bits);
  }
}

/// Ignores NaN: such a triangle is below no cutoff.
static unsigned triangles_within(const TriangleBlock& block, const TriangleSlab& slab) {
  unsigned bits = 0;
  for (int first = 0; first < kTriangleBlockWidth; first += Lanes::kCount) {
    Lanes reach[3];
    Lanes largest(slab.largest);
    for (int v = 0; v < 3; ++v) {
      Lanes n[3], x[3];
      for (int k = 0; k < 3; ++k) {
        n[k] = Lanes(slab.direction[k]);
        x[k] = loaded(block.at[3 * v + k] + first) - Lanes(slab.origin[k]);
        largest = larger(largest, magnitude(x[k]));
      }
      reach[v] = dot(n, x);
    }
    const Lanes gap = smaller(smaller(reach[0], reach[1]), reach[2]) - Lanes(slab.start);
    // Twice the largest, for both triangles.
    const Lanes noise = Lanes(slab.noise) * (largest + largest);
    bits |= inverse(gap - noise > Lanes(slab.limit)).bits() << first;
  }
  return bits;
}

}  // namespace DYOP_LANES
}  // namespace dyop::distance_internal
