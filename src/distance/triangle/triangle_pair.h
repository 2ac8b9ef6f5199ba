// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/simd_pair.h"
#include "core/tolerance.h"
#include "dyop/distance/triangle_distance.h"

/// Building blocks of triangle_distance(), private to it. The proof of its rounding bounds, for
/// exactly the order of operations here (edges a_i, b_j, r = B_0 - A_0, p and q the witness points,
/// D = q - p, m a direction with the slab gap g(m) = min_j m.B_j - max_i m.A_i):
///
/// u = 2^-53, round to nearest, no fused operations. |fl(x.y) - x.y| <= 3u |x||y| for three
/// components in any order [JeannerodRump2013]. Size in [2^-64, 2^64]. Products underflow by at
/// most 2^-1075 each, far less than all slacks, because directions with |m|^2 < 2^-900 prove
/// nothing.
///
/// Size. E = |r| + max |a_i| + max |b_j|. The longest edge e of a triangle has e^2 <= 2/3 of the sum
/// of the squared edges (e <= f + g gives e^2 <= 2 f^2 + 2 g^2), and (x + y + z)^2 <= 3 (x^2 + y^2 +
/// z^2), so E <= sqrt(3 r.r + 2 sum of squared edges) =: size, computed to 6u relative. Every
/// |B_j - A_i| <= E.
///
/// Lower. For the computed m, taken as exact: g(m) = m.r + min_j m.(B_j - B_0) - max_i m.(A_i - A_0).
///     five dot products with rounded differences (3u + u each)        4.01 u |m| E
///     first sum                                                       1.01 u |m| E
///     second sum                                                      u gap
///     m.m, square root, reciprocal, product x = gap (1 / |m|)         4.5 u x
///     the returned normal n is m scaled, rounded:
///         g(n)/|n| >= g(m)/|m| - u E, and |n| to u                    u x + u E
///     together, with E <= size (1 + 6u)                               6.6 u x + 6.1 u size
/// The result is fl(x - (8u x + 7u size)), whose own operations take another u x: below the truth,
/// and below the slab gap along the returned normal as an exact vector, divided by its exact length.
/// Negative values and NaN become 0.
///
/// Upper. The parameters s, t (or v, w) are computed but then taken as exact; they are in [0, 1],
/// and v + w <= 1 + u/2. So p and q are points of the triangles, or within u/2 of an edge length of
/// one. Rounding of D, first order, by norms:
///     two edges           (d + t b) - s a            u(|d| + 2|b| + 2|a| + |d + t b| + |D|)
///                                                    <= u(3|D| + 4 E)
///     vertex and face     (x - v e) - w f            u(3|D| + 4 E) + u/2 E
///     edge through face   ((d + t b) - v e) - w f    u(4|D| + 5 E) + u/2 E
///     combination of two witnesses, |D| < size / 8,
///         at most 3 times c D_1 + (1 - c) D_2        u(2.5|D| + 5.4 E)
/// With 2.5 u |D| for the length itself: 6.5 u |D| + 5.5 u size. The result is fl(|D| + (8u |D| + 7u
/// size)), whose own operations take another u |D|.
///
/// Scaling is exact except where numbers fall below 2^-1022 and are rounded by at most 2^-1075;
/// 4 * 2^-1074, in the scale of the result, is subtracted from lower and added to upper. Shared
/// vertices are checked before scaling, so that merging two of them cannot look like contact.
///
/// Noise. The slacks make upper - lower at least 14 u size + 16 u d; the rest of triangle_noise
/// covers the rounding of s, t and m.
namespace dyop::distance_internal {

/// Number of the corner (or edge) after k.
inline constexpr int kNext[3] = {1, 2, 0};

// Both return y if x is NaN. Ternaries, because they compile to one instruction without a branch.
inline Scalar larger(Scalar x, Scalar y) {
  return x > y ? x : y;
}
inline Scalar smaller(Scalar x, Scalar y) {
  return x < y ? x : y;
}

/// x limited to [0, limit]; NaN gives 0.
inline Scalar clamped(Scalar x, Scalar limit) {
  x = x > 0 ? x : 0;
  return x < limit ? x : limit;
}

/// Differences of the vertices of two triangles. Edge k of a triangle runs from vertex k to vertex
/// k+1. Every vector is the rounded difference of two input points, so each component has a
/// relative error of at most u, however far away the origin is.
struct TrianglePair {
  const Triangle& A;
  const Triangle& B;
  VectorPair a02;  ///< edges 0 and 2 of A, the ones at vertex 0
  VectorPair b02;
  Vector3 a[3];
  Vector3 b[3];
  Vector3 r;     ///< from vertex 0 of A to vertex 0 of B
  Scalar aa[3];  ///< squared lengths of the edges of A
  Scalar bb[3];  ///< squared lengths of the edges of B
  Scalar edges;  ///< sum of the squared lengths of all edges
  Scalar size;   ///< at least |r| + longest edge of A + longest edge of B, up to 6u relative

  TrianglePair(const Triangle& A_in, const Triangle& B_in)
      : A(A_in),
        B(B_in),
        a02(VectorPair(A[1], A[0]) - VectorPair(A[0], A[2])),
        b02(VectorPair(B[1], B[0]) - VectorPair(B[0], B[2])),
        a{a02.low(), A[2] - A[1], a02.high()},
        b{b02.low(), B[2] - B[1], b02.high()},
        r(B[0] - A[0]) {
    const LanePair aa02 = a02.dot(a02);
    const LanePair bb02 = b02.dot(b02);
    aa[0] = aa02.low();
    aa[1] = dot(a[1], a[1]);
    aa[2] = aa02.high();
    bb[0] = bb02.low();
    bb[1] = dot(b[1], b[1]);
    bb[2] = bb02.high();
    edges = (aa[0] + aa[1] + aa[2]) + (bb[0] + bb[1] + bb[2]);
    // The longest edge e of a triangle has e^2 <= 2/3 of the sum of squares, and
    // x + y + z <= sqrt(3 (x^2 + y^2 + z^2)). A sum, not a maximum, so that NaN survives.
    size = sqrt(LanePair(3 * dot(r, r) + 2 * edges)).low();
  }
};

/// While computing, features are numbered: 0..2 vertices, 3..5 edges, 6 face.
inline constexpr int kFaceCode = 6;

/// The feature with that number, by local vertex numbers.
inline const Feature& feature_of_place(int place) {
  static constexpr Feature kFeatures[7] = {
      {FeatureKind::Vertex, {0}},    {FeatureKind::Vertex, {1}},  {FeatureKind::Vertex, {2}},
      {FeatureKind::Edge, {0, 1}},   {FeatureKind::Edge, {1, 2}}, {FeatureKind::Edge, {0, 2}},
      {FeatureKind::Face, {0, 1, 2}}};
  return kFeatures[place];
}

/// Number of the place on edge k: its first end, the edge, or its other end.
inline int edge_place(int k, bool leaves_start, bool reaches_end) {
  static constexpr int kPlace[3][3] = {{0, 3, 1}, {1, 4, 2}, {2, 5, 0}};
  return kPlace[k][static_cast<int>(leaves_start) + static_cast<int>(reaches_end)];
}

/// A point of A, a point of B, and the direction that should prove them closest.
struct Witness {
  Vector3 D;  ///< from the point of A to the point of B
  Vector3 m;  ///< direction of the certificate, any length
  Vector3 p_a;
  Vector3 p_b;
  int place_a = 0;
  int place_b = 0;
};

/// What one direction and one witness vector prove.
struct Bounds {
  Scalar lower = 0;         ///< of the distance, from the slab gap along the direction
  Scalar upper = 0;         ///< of the distance, from the length of the witness vector
  Scalar gap = 0;           ///< the computed slab gap itself, may be negative
  Scalar inverse_norm = 0;  ///< of the direction; 0 if the direction is useless
};

/// Returns bounds proven by direction m and witness vector D, for any m: NaN and tiny m give lower
/// = 0.
inline Bounds prove(const TrianglePair& pair, const Vector3& m, const Vector3& D) {
  const VectorPair mm(m);
  // m times the vertices 1 and 2, relative to vertex 0; negated for A, so that both need minima.
  const LanePair on_a = low_negated(mm.dot(pair.a02));
  const LanePair on_b = high_negated(mm.dot(pair.b02));
  const LanePair reach = smaller(smaller(lows(on_b, on_a), highs(on_b, on_a)), LanePair(0));
  const Scalar gap = (dot(m, pair.r) + reach.low()) + reach.high();
  const VectorPair mD(m, D);
  const LanePair squares = mD.dot(mD);
  const LanePair norms = sqrt(squares);
  const LanePair inverse_norm = LanePair(1) / lows(norms, norms);
  const LanePair middle = lows(LanePair(gap) * inverse_norm, swapped(norms));
  const LanePair slack =
      LanePair(kTriangleRelativeSlack) * middle + LanePair(kTriangleSizeSlack * pair.size);
  const LanePair outward = middle + low_negated(slack);
  // Safe: a comparison with NaN is false, and larger() then returns 0.
  const LanePair is_usable = above(lows(squares, squares), LanePair(kSmallestSquaredDirection));
  Bounds bounds;
  bounds.lower = larger(masked(is_usable, outward), LanePair(0)).low();
  bounds.upper = outward.high();
  bounds.gap = middle.low();
  bounds.inverse_norm = masked(is_usable, inverse_norm).low();
  return bounds;
}

/// Witness of edge i of A and edge j of B: their closest points, by [Ericson2005] 5.1.9 with cross
/// products in place of the Gram determinant, which would lose half of the digits for nearly
/// parallel edges.
inline Witness edge_witness(const TrianglePair& pair, int i, int j) {
  const Vector3& A = pair.A[static_cast<std::size_t>(i)];
  const Vector3& B = pair.B[static_cast<std::size_t>(j)];
  const Vector3 d = B - A;
  const VectorPair edges(pair.a[i], pair.b[j]);
  const VectorPair crosses = VectorPair(pair.a[i], d).cross(edges.highs());
  const VectorPair n = crosses.lows();
  const LanePair solution = crosses.dot(n);
  const LanePair inverse = LanePair(1) / LanePair(pair.aa[i], pair.bb[j]);
  const LanePair ab(dot(pair.a[i], pair.b[j]));
  const LanePair on_d = edges.dot(VectorPair(d));
  // Parameters in both lanes: s of the lines, t for that s.
  LanePair s = clamped(highs(solution, solution) / lows(solution, solution));
  const LanePair t = clamped((s * ab - highs(on_d, on_d)) * highs(inverse, inverse));
  LanePair st = lows(s, t);
  const bool is_inside = bits(is_inside_unit(st)) == 3;
  if (!is_inside) {
    s = clamped((t * ab + lows(on_d, on_d)) * lows(inverse, inverse));
    st = lows(s, t);
  }

  Witness w;
  const VectorPair along = edges * st;
  w.D = (d + along.high()) - along.low();
  const VectorPair points = VectorPair(A, B) + along;
  w.p_a = points.low();
  w.p_b = points.high();
  if (is_inside) {
    const LanePair side = n.dot(VectorPair(d));
    w.m = {flip_sign(n.x, side).low(), flip_sign(n.y, side).low(), flip_sign(n.z, side).low()};
    w.place_a = 3 + i;
    w.place_b = 3 + j;
    return w;
  }
  // The closest direction is perpendicular to an edge whose point is inside; this removes rounding
  // along it. Both points may be inside here if the first s was outside only by rounding.
  const LanePair share = masked(is_inside_unit(st), edges.dot(VectorPair(w.D)) * inverse);
  const VectorPair level = edges * share;
  w.m = (w.D - level.low()) - level.high();
  const int left_start = bits(above(st, LanePair(0)));
  const int before_end = bits(above(LanePair(1), st));
  w.place_a = edge_place(i, left_start & 1, ~before_end & 1);
  w.place_b = edge_place(j, left_start & 2, ~before_end & 2);
  return w;
}

/// True if the bounds agree within the noise of the pair. False for NaN.
inline bool is_certified(const TrianglePair& pair, Scalar lower, Scalar upper) {
  return lower > 0 && upper - lower <= kTriangleNoise * pair.size;
}

inline TriangleDistance result_of(const Witness& w, const Bounds& bounds) {
  return {bounds.lower,
          bounds.upper,
          w.p_a,
          w.p_b,
          w.m * bounds.inverse_norm,
          feature_of_place(w.place_a),
          feature_of_place(w.place_b),
          false};
}

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

// Triangles with common vertices, such as neighbours in a mesh: found by comparing coordinates, so
// that the distance is zero without rounding.

/// Which vertices are equal: bit 3 i + j for vertex i of a and j of b.
inline unsigned equal_vertices(const Triangle& a, const Triangle& b) {
  LanePair row[3];
  LanePair column;
  LanePair corner;
  for (int k = 0; k < 3; ++k) {
    const LanePair b01(b[0][k], b[1][k]);
    const LanePair b22(b[2][k]);
    const LanePair next[5] = {equal(LanePair(a[0][k]), b01), equal(LanePair(a[1][k]), b01),
                              equal(LanePair(a[2][k]), b01), equal(LanePair(a[0][k], a[1][k]), b22),
                              equal(LanePair(a[2][k]), b22)};
    for (int i = 0; i < 3; ++i) row[i] = k == 0 ? next[i] : both(row[i], next[i]);
    column = k == 0 ? next[3] : both(column, next[3]);
    corner = k == 0 ? next[4] : both(corner, next[4]);
  }
  const auto mask = [](LanePair lanes) { return static_cast<unsigned>(bits(lanes)); };
  const unsigned of_b2 = mask(column);
  return mask(row[0]) | mask(row[1]) << 3 | mask(row[2]) << 6 | (of_b2 & 1) << 2 |
         (of_b2 & 2) << 4 | (mask(corner) & 1) << 8;
}

/// False only if no vertex is shared; a quick test of one coordinate.
inline bool may_share_vertex(const Triangle& a, const Triangle& b) {
  const LanePair b01(b[0].x(), b[1].x());
  const LanePair of_a0 = equal(LanePair(a[0].x()), b01);
  const LanePair of_a1 = equal(LanePair(a[1].x()), b01);
  const LanePair of_a2 = equal(LanePair(a[2].x()), b01);
  const LanePair of_b2 = equal(LanePair(b[2].x()), LanePair(a[0].x(), a[1].x()));
  const LanePair rest = equal(LanePair(b[2].x()), LanePair(a[2].x()));
  return bits(either(either(either(of_a0, of_a1), either(of_a2, of_b2)), rest)) != 0;
}

/// Unit normal of triangles that have a vertex in common, for a nonzero mask of equal_vertices():
/// that of the larger face at a common edge, else of the facet with the least depth. Zero if their
/// size is out of range or a coordinate is not finite.
Vector3 touching_normal(const Triangle& a, const Triangle& b, unsigned equal_mask);

}  // namespace dyop::distance_internal
