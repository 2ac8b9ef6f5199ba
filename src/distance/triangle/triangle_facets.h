// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstdint>

#include "core/simd_pair.h"
#include "distance/triangle/triangle_pair.h"

namespace dyop::distance_internal {

/// Face normals a_2 x a_0 and b_2 x b_0, not normalised.
inline VectorPair face_normals(const TrianglePair& pair) {
  return highs(pair.a02, pair.b02).cross(lows(pair.a02, pair.b02));
}

/// The facets of the Minkowski difference B - A, as seen from the origin. The distance of the
/// triangles is the distance of the origin to it; its facets are the faces of A and B, each swept
/// by a single vertex, and parallelograms of one edge of each.
///
/// Computed in pairs of lanes. Edge pairs (i, j) are kept in five of them: rows j = 0, 2, 1 with
/// lanes i = 0, 2; then i = 1 with lanes j = 0, 2; then i = j = 1.
struct Facets {
  VectorPair n;        ///< face_normals()
  LanePair height[3];  ///< of vertex k of B over A's plane (low), of A over B's plane (high)
  LanePair h[5];       ///< a_i x b_j . (B_j - A_i)
  Scalar best;         ///< largest signed squared gap of a facet; negative if the origin sees none
  int code;            ///< of that facet: 3 i + j for edges i and j, 9 for A's face, 10 for B's

  /// @param normals face_normals(pair)
  Facets(const TrianglePair& pair, const VectorPair& normals);
};

/// Signed square of a gap over the squared norm, never NaN, with the code of the facet in its
/// lowest bits, so that one maximum finds both.
inline LanePair score(LanePair signed_square, LanePair squared_norm, int low, int high) {
  return tagged(signed_square / larger(squared_norm, LanePair(kSmallestFacetSquare)), low, high);
}

/// The same for a pair of edges. It is a facet if alpha = a_i . nB and beta = b_j . nA have the
/// same sign, which is that of its outer side.
inline LanePair edge_score(LanePair h, LanePair alpha, LanePair beta, LanePair squares, LanePair ab,
                           int low, int high) {
  // The Gram determinant keeps half of its digits, enough to choose.
  const LanePair gram = squares - ab * ab;
  const LanePair is_inner = above(LanePair(0), alpha * beta);
  const LanePair square = flip_sign(h, alpha) * magnitude(h);
  return score(selected(is_inner, LanePair(-kLargestFacetSquare), square), gram, low, high);
}

inline Facets::Facets(const TrianglePair& pair, const VectorPair& normals) : n(normals) {
  const VectorPair& a02 = pair.a02;
  const VectorPair& b02 = pair.b02;
  const VectorPair r(pair.r);
  const LanePair alpha02 = a02.dot(n.highs());
  const LanePair beta02 = b02.dot(n.lows());
  height[0] = high_negated(n.dot(r));
  height[1] = height[0] + lows(beta02, alpha02);
  height[2] = height[0] - highs(beta02, alpha02);
  const LanePair face_low = smaller(smaller(height[0], height[1]), height[2]);
  const LanePair face_high = larger(larger(height[0], height[1]), height[2]);
  const LanePair face_gap = larger(face_low, -face_high);
  const LanePair face_score = score(face_gap * magnitude(face_gap), n.dot(n), 9, 10);

  const VectorPair c = b02.cross(r);
  const LanePair det0 = a02.dot(c.lows());
  const LanePair det2 = a02.dot(c.highs());
  const LanePair det1 = lows(det0, det2) + highs(det0, det2);
  const LanePair ab0 = a02.dot(b02.lows());
  const LanePair ab2 = a02.dot(b02.highs());
  const LanePair ab1 = lows(ab0, ab2) + highs(ab0, ab2);
  const LanePair alpha1 = -(alpha02 + swapped(alpha02));
  const LanePair beta0 = lows(beta02, beta02);
  const LanePair beta2 = highs(beta02, beta02);
  const LanePair beta1 = -(beta0 + beta2);
  // The determinants are a_i x b_j . r; the parallelogram starts at the vertices i and j, and both
  // vertices 0 lie on the edges 0 and 2.
  // vertices 0 lie on the edges 0 and 2.
  h[0] = det0;
  h[1] = det2;
  h[2] = -(det0 + det2) - alpha02;
  h[3] = -det1 - beta02;
  h[4] = ((det1 + swapped(det1)) - alpha1) - beta1;
  // Enlarged, so that the determinants of parallel edges are positive.
  const LanePair enlarged(1 + kTriangleParallelSquare);
  const LanePair aa02 = LanePair(pair.aa[0], pair.aa[2]) * enlarged;
  const LanePair aa1 = LanePair(pair.aa[1]) * enlarged;
  const LanePair bb02(pair.bb[0], pair.bb[2]);
  const LanePair bb1(pair.bb[1]);
  const LanePair score0 = edge_score(h[0], alpha02, beta0, aa02 * lows(bb02, bb02), ab0, 0, 6);
  const LanePair score1 = edge_score(h[1], alpha02, beta2, aa02 * highs(bb02, bb02), ab2, 2, 8);
  const LanePair score2 = edge_score(h[2], alpha02, beta1, aa02 * bb1, ab0 + ab2, 1, 7);
  const LanePair score3 = edge_score(h[3], alpha1, beta02, aa1 * bb02, ab1, 3, 5);
  const LanePair score4 = edge_score(h[4], alpha1, beta1, aa1 * bb1, ab1 + swapped(ab1), 4, 4);
  const LanePair most =
      larger(larger(larger(score0, score1), larger(score2, score3)), larger(score4, face_score));
  best = larger(most, swapped(most)).low();
  code = static_cast<int>(std::bit_cast<std::uint64_t>(best) & 15);
}

/// Unit normal of a facet by its code, from A to B. An arbitrary unit vector if the facet has no
/// normal.
Vector3 facet_normal(const TrianglePair& pair, const Facets& facets);

/// Witness of the face of one triangle (A's if `of_a`) and the other's vertex nearest to its plane.
/// If that vertex lies beyond the face: witness of the edge that it is beyond and the vertex's
/// lower edge.
Witness face_witness(const TrianglePair& pair, const Facets& facets, bool of_a);

/// Witness of two edges, found by dropping from each triangle the vertex that supports least along
/// c, a direction from A to B: the published DyOP with c in place of the pivot.
Witness directed_witness(const TrianglePair& pair, const Vector3& c);

/// Solves pairs that no single candidate certified: touching, crossing, ties, degenerate triangles.
/// `found` is the best answer so far. Always valid; wide bounds are possible.
TriangleDistance resolve_triangle_pair(const TrianglePair& pair, const Facets& facets,
                                       const Vector3& direction, const TriangleDistance& found);

}  // namespace dyop::distance_internal
