#pragma once

#include <bit>
#include <cstdint>

#include "distance/lane_pair.h"
#include "distance/triangle_pair.h"

namespace dyop::internal {

/// The facets of the Minkowski difference B - A, judged from the origin. The distance of the
/// triangles is that of the origin to it; its facets are the faces of A and B swept by nothing more
/// than a vertex, and parallelograms of one edge of each.
///
/// Computed in pairs of lanes. Edge pairs (i, j) are kept in five of them: rows j = 0, 1, 2 with
/// lanes i = 0, 1; then i = 2 with lanes j = 0, 1; then i = j = 2.
struct Facets {
  VectorPair n;        ///< face normals a_0 x a_1 and b_0 x b_1, not normalised
  LanePair height[3];  ///< of vertex k of B over A's plane (low), of A over B's plane (high)
  LanePair h[5];       ///< a_i x b_j . (B_j - A_i)
  Scalar best;         ///< largest signed squared gap of a facet; negative if the origin sees none
  int code;            ///< of that facet: 3 i + j for edges i and j, 9 for A's face, 10 for B's

  explicit Facets(const TrianglePair& pair);
};

/// Signed square of a gap over the squared norm, never NaN, with the code of the facet in its
/// lowest bits, so that one maximum finds both.
inline LanePair score(LanePair signed_square, LanePair squared_norm, int low, int high) {
  return tagged(signed_square / larger(squared_norm, LanePair(kSmallestSquaredDirection)), low,
                high);
}

/// The same for a pair of edges. It is a facet if alpha = a_i . (b_0 x b_1) and beta = b_j . (a_0 x
/// a_1) have one sign, which is that of its outer side.
inline LanePair edge_score(LanePair h, LanePair alpha, LanePair beta, LanePair squares, LanePair ab,
                           int low, int high) {
  // The Gram determinant keeps half of its digits, enough for a choice.
  const LanePair gram = larger(squares - ab * ab, LanePair(kTriangleParallelSquare) * squares);
  const LanePair is_inner = above(LanePair(0), alpha * beta);
  const LanePair square = turned(h, alpha) * magnitude(h);
  return score(selected(is_inner, LanePair(-kLargestScore), square), gram, low, high);
}

inline Facets::Facets(const TrianglePair& pair)
    : n(VectorPair(pair.a[0], pair.b[0]).cross(VectorPair(pair.a[1], pair.b[1]))) {
  const VectorPair a01(pair.a[0], pair.a[1]);
  const VectorPair b01(pair.b[0], pair.b[1]);
  const VectorPair r(pair.r);
  const LanePair alpha01 = a01.dot(n.highs());
  const LanePair beta01 = b01.dot(n.lows());
  const LanePair rise0 = lows(beta01, alpha01);
  const LanePair rise1 = highs(beta01, alpha01);
  height[0] = n.dot(r) * LanePair(1, -1);
  height[1] = height[0] + rise0;
  height[2] = height[0] + (rise0 + rise1);
  const LanePair face_low = smaller(smaller(height[0], height[1]), height[2]);
  const LanePair face_high = larger(larger(height[0], height[1]), height[2]);
  const LanePair face_gap = larger(face_low, -face_high);
  const LanePair face_score = score(face_gap * magnitude(face_gap), n.dot(n), 9, 10);

  const VectorPair c = b01.cross(r);
  const LanePair det0 = a01.dot(c.lows());
  const LanePair det1 = a01.dot(c.highs());
  const LanePair det2 = -(lows(det0, det1) + highs(det0, det1));
  const LanePair ab0 = a01.dot(b01.lows());
  const LanePair ab1 = a01.dot(b01.highs());
  const LanePair ab2 = lows(ab0, ab1) + highs(ab0, ab1);
  const LanePair zero(0);
  const LanePair alpha2 = -(lows(alpha01, alpha01) + highs(alpha01, alpha01));
  const LanePair beta0 = lows(beta01, beta01);
  const LanePair beta1 = highs(beta01, beta01);
  const LanePair beta2 = -(beta0 + beta1);
  // The determinants are a_i x b_j . r; the parallelogram begins at the vertices i and j.
  h[0] = det0 - lows(zero, beta0);
  h[1] = (det1 - alpha01) - lows(zero, beta1);
  h[2] = -(det0 + det1) - lows(zero, beta2);
  h[3] = det2 - lows(zero, alpha2);
  h[4] = -(det2 + swapped(det2));
  const LanePair aa01(pair.aa[0], pair.aa[1]);
  const LanePair bb01(pair.bb[0], pair.bb[1]);
  const LanePair aa2(pair.aa[2]);
  const LanePair bb2(pair.bb[2]);
  const LanePair score0 = edge_score(h[0], alpha01, beta0, aa01 * lows(bb01, bb01), ab0, 0, 3);
  const LanePair score1 = edge_score(h[1], alpha01, beta1, aa01 * highs(bb01, bb01), ab1, 1, 4);
  const LanePair score2 = edge_score(h[2], alpha01, beta2, aa01 * bb2, ab0 + ab1, 2, 5);
  const LanePair score3 = edge_score(h[3], alpha2, beta01, aa2 * bb01, ab2, 6, 7);
  const LanePair score4 = edge_score(h[4], alpha2, beta2, aa2 * bb2, ab2 + swapped(ab2), 8, 8);
  const LanePair most =
      larger(larger(larger(score0, score1), larger(score2, score3)), larger(score4, face_score));
  best = larger(most, swapped(most)).low();
  code = static_cast<int>(std::bit_cast<std::uint64_t>(best) & 15);
}

/// Unit normal of a facet by its code, from A to B. Any unit vector if the facet has no normal.
Vector3 facet_normal(const TrianglePair& pair, const Facets& facets);

/// Witness of the face of one triangle (A's if `of_a`) and the other's vertex nearest to its plane.
/// If that vertex lies beyond the face: of the edge that it is beyond and of the vertex's lower
/// edge.
Witness face_witness(const TrianglePair& pair, const Facets& facets, bool of_a);

/// Witness of two edges, found by dropping of each triangle the vertex that supports least along c,
/// a direction from A to B: the published DyOP with c in place of the pivot.
Witness directed_witness(const TrianglePair& pair, const Vector3& c);

/// Answer for pairs that no single candidate certified: touching, crossing, ties, degenerate
/// triangles. `found` is the best answer so far. Always valid; wide bounds are possible.
TriangleDistance resolve_triangle_pair(const TrianglePair& pair, const Facets& facets,
                                       const Vector3& direction, const TriangleDistance& found);

}  // namespace dyop::internal
