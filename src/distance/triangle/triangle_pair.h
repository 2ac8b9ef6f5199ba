// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>

#include "core/simd_pair.h"
#include "core/tolerance.h"
#include "dyop/distance/triangle_distance.h"

/// Building blocks of triangle_distance(), private to it. The rounding bounds are proven in
/// docs/algorithms/dyop.md, section "Rounding", for exactly the order of operations here.
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

}  // namespace dyop::distance_internal
