// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/simd_bits.h"
#include "distance/triangle_wide/triangle_wide.h"

// The building blocks of triangle_pair.h and triangle_facets.h, one pair per lane: the same
// operations in the same order, so that every lane has the same bits. They are documented there.
namespace dyop::distance_internal {
inline namespace DYOP_LANES {

using Mask = Lanes::Mask;

DYOP_INLINE Mask inverse(Mask x) {
  return without(equal(Lanes(0.0), Lanes(0.0)), x);
}

DYOP_INLINE bool any(Mask x) {
  return x.bits() != 0;
}

DYOP_INLINE Lanes masked(Mask m, Lanes x) {
  return select(m, x, Lanes(0.0));
}

/// Selects one of three per lane: number 1, number 2, or else number 0.
struct Choice {
  Mask is_1;
  Mask is_2;

  DYOP_INLINE Lanes of(Lanes x0, Lanes x1, Lanes x2) const {
    return select(is_2, x2, select(is_1, x1, x0));
  }
  DYOP_INLINE void of(const Lanes (*x)[3], Lanes* out) const {
    for (int k = 0; k < 3; ++k) out[k] = of(x[0][k], x[1][k], x[2][k]);
  }
  DYOP_INLINE Choice next() const { return {inverse(is_1 | is_2), is_1}; }
};

DYOP_INLINE Choice select(Mask m, Choice x, Choice y) {
  return {(m & x.is_1) | without(y.is_1, m), (m & x.is_2) | without(y.is_2, m)};
}

DYOP_INLINE void select(Mask m, const Lanes* x, const Lanes* y, Lanes* out) {
  for (int k = 0; k < 3; ++k) out[k] = select(m, x[k], y[k]);
}

struct OrderLanes {
  Choice lowest;
  Choice highest;
};

DYOP_INLINE OrderLanes order_of(Lanes x0, Lanes x1, Lanes x2) {
  const Mask p = x1 > x0;
  const Mask q = x2 > x1;
  const Mask r = x2 > x0;
  const Mask lowest_1 = without(q, p);
  const Mask lowest_0 = p & (q | r);
  return {{lowest_1, inverse(lowest_0 | lowest_1)}, {without(p, q), q & r}};
}

/// TrianglePair.
struct PairLanes {
  Lanes A[3][3], B[3][3];
  Lanes a[3][3], b[3][3];
  Lanes r[3];
  Lanes aa[3], bb[3];
  Lanes edges, size;

  DYOP_INLINE PairLanes(const TriangleBlock& block_a, const TriangleBlock& block_b, int first) {
    for (int v = 0; v < 3; ++v) {
      for (int k = 0; k < 3; ++k) {
        A[v][k] = loaded(block_a.at[3 * v + k] + first);
        B[v][k] = loaded(block_b.at[3 * v + k] + first);
      }
    }
    for (int k = 0; k < 3; ++k) {
      for (int v = 0; v < 3; ++v) {
        a[v][k] = A[(v + 1) % 3][k] - A[v][k];
        b[v][k] = B[(v + 1) % 3][k] - B[v][k];
      }
      r[k] = B[0][k] - A[0][k];
    }
    for (int v = 0; v < 3; ++v) {
      aa[v] = dot(a[v], a[v]);
      bb[v] = dot(b[v], b[v]);
    }
    edges = ((aa[0] + aa[1]) + aa[2]) + ((bb[0] + bb[1]) + bb[2]);
    size = sqrt(Lanes(3.0) * dot(r, r) + Lanes(2.0) * edges);
  }
};

/// Facets, and face_normals().
struct FacetLanes {
  Lanes n_a[3], n_b[3];
  Lanes height_b[3], height_a[3];  ///< of B's vertices over A's plane, of A's over B's
  Lanes h[3][3];
  Lanes alpha[3], beta[3];
  Lanes best;
  Choice i, j;  ///< edges of the best facet
  Mask is_face_a, is_face_b;

  DYOP_INLINE FacetLanes(const PairLanes& pair, const TriangleConstants& c) {
    cross(pair.a[2], pair.a[0], n_a);
    cross(pair.b[2], pair.b[0], n_b);
    for (int v = 0; v < 3; v += 2) {
      alpha[v] = dot(pair.a[v], n_b);
      beta[v] = dot(pair.b[v], n_a);
    }
    alpha[1] = negated(alpha[0] + alpha[2]);
    beta[1] = negated(beta[0] + beta[2]);
    height_b[0] = dot(n_a, pair.r);
    height_b[1] = height_b[0] + beta[0];
    height_b[2] = height_b[0] - beta[2];
    height_a[0] = negated(dot(n_b, pair.r));
    height_a[1] = height_a[0] + alpha[0];
    height_a[2] = height_a[0] - alpha[2];
    Lanes scores[11];
    scores[9] = face_score(height_b, n_a, 9, c);
    scores[10] = face_score(height_a, n_b, 10, c);
    score_edges(pair, c, scores);
    // No score is NaN and no two are equal, so the order does not matter.
    best = larger(larger(larger(larger(scores[0], scores[1]), larger(scores[2], scores[3])),
                         larger(larger(scores[4], scores[5]), larger(scores[6], scores[7]))),
                  larger(scores[8], larger(scores[9], scores[10])));
    is_face_a = equal(best, scores[9]);
    is_face_b = equal(best, scores[10]);
    const auto is = [&](int k) { return equal(best, scores[k]); };
    const Mask is_1 = is(1), is_2 = is(2), is_3 = is(3), is_4 = is(4), is_5 = is(5), is_6 = is(6),
               is_7 = is(7), is_8 = is(8);
    i = {is_3 | (is_4 | is_5), is_6 | (is_7 | is_8)};
    j = {is_1 | (is_4 | is_7), is_2 | (is_5 | is_8)};
  }

 private:
  static DYOP_INLINE Lanes score(Lanes signed_square, Lanes squared_norm, int code,
                                 const TriangleConstants& c) {
    return tagged(signed_square / larger(squared_norm, Lanes(c.smallest_facet_square)), code);
  }

  static DYOP_INLINE Lanes face_score(const Lanes* height, const Lanes* n, int code,
                                      const TriangleConstants& c) {
    const Lanes low = smaller(smaller(height[0], height[1]), height[2]);
    const Lanes high = larger(larger(height[0], height[1]), height[2]);
    const Lanes gap = larger(low, negated(high));
    return score(gap * magnitude(gap), dot(n, n), code, c);
  }

  DYOP_INLINE void score_edges(const PairLanes& pair, const TriangleConstants& c, Lanes* scores) {
    Lanes c0[3], c2[3];
    cross(pair.b[0], pair.r, c0);
    cross(pair.b[2], pair.r, c2);
    const Lanes det00 = dot(pair.a[0], c0), det20 = dot(pair.a[2], c0);
    const Lanes det02 = dot(pair.a[0], c2), det22 = dot(pair.a[2], c2);
    const Lanes det10 = det00 + det20, det12 = det02 + det22;
    h[0][0] = det00;
    h[2][0] = det20;
    h[0][2] = det02;
    h[2][2] = det22;
    h[0][1] = negated(det00 + det02) - alpha[0];
    h[2][1] = negated(det20 + det22) - alpha[2];
    h[1][0] = negated(det10) - beta[0];
    h[1][2] = negated(det12) - beta[2];
    h[1][1] = ((det10 + det12) - alpha[1]) - beta[1];
    Lanes ab[3][3];
    for (int v = 0; v < 3; v += 2) {
      for (int w = 0; w < 3; w += 2) ab[v][w] = dot(pair.a[v], pair.b[w]);
    }
    ab[0][1] = ab[0][0] + ab[0][2];
    ab[2][1] = ab[2][0] + ab[2][2];
    ab[1][0] = ab[0][0] + ab[2][0];
    ab[1][2] = ab[0][2] + ab[2][2];
    ab[1][1] = ab[1][0] + ab[1][2];
    // Enlarged, so that the determinants of parallel edges are positive.
    const Lanes enlarged(1 + c.parallel_square);
    for (int v = 0; v < 3; ++v) {
      const Lanes aa = pair.aa[v] * enlarged;
      for (int w = 0; w < 3; ++w) {
        const Lanes gram = aa * pair.bb[w] - ab[v][w] * ab[v][w];
        const Mask is_inner = Lanes(0.0) > alpha[v] * beta[w];
        const Lanes square = flip_sign_by_bit(h[v][w], alpha[v]) * magnitude(h[v][w]);
        scores[3 * v + w] =
            score(select(is_inner, Lanes(-c.largest_facet_square), square), gram, 3 * v + w, c);
      }
    }
  }
};

}  // namespace DYOP_LANES
}  // namespace dyop::distance_internal
