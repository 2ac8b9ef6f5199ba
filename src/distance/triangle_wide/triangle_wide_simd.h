// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/simd.h"
#include "distance/triangle_wide/triangle_wide.h"

// The building blocks of triangle_pair.h, one pair per lane: the same
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

// Witnesses and their proofs, one pair per lane, as in triangle_distance.cpp.

struct WitnessLanes {
  Lanes D[3], m[3], p_a[3], p_b[3];
  Lanes place_a, place_b;
};

DYOP_INLINE void select(Mask mask, const WitnessLanes& x, WitnessLanes& into) {
  select(mask, x.D, into.D, into.D);
  select(mask, x.m, into.m, into.m);
  select(mask, x.p_a, into.p_a, into.p_a);
  select(mask, x.p_b, into.p_b, into.p_b);
  into.place_a = select(mask, x.place_a, into.place_a);
  into.place_b = select(mask, x.place_b, into.place_b);
}

struct BoundsLanes {
  Lanes lower, upper, gap, inverse_norm;
};

DYOP_INLINE Lanes clamped(Lanes x, Lanes limit) {
  return smaller(larger(x, Lanes(0.0)), limit);
}

DYOP_INLINE Mask is_inside_unit(Lanes x) {
  return (x > Lanes(0.0)) & (Lanes(1.0) > x);
}

DYOP_INLINE Lanes edge_place(const Choice& k, Mask leaves_start, Mask reaches_end) {
  const Lanes start = k.of(Lanes(0.0), Lanes(1.0), Lanes(2.0));
  const Lanes end = k.of(Lanes(1.0), Lanes(2.0), Lanes(0.0));
  return select(leaves_start, select(reaches_end, end, start + Lanes(3.0)), start);
}

DYOP_INLINE BoundsLanes prove(const PairLanes& pair, const Lanes* m, const Lanes* D,
                              const TriangleConstants& c) {
  const Lanes zero(0.0);
  const Lanes reach_b = smaller(smaller(dot(m, pair.b[0]), negated(dot(m, pair.b[2]))), zero);
  const Lanes reach_a = smaller(smaller(negated(dot(m, pair.a[0])), dot(m, pair.a[2])), zero);
  const Lanes gap = (dot(m, pair.r) + reach_b) + reach_a;
  const Lanes squared = dot(m, m);
  const Lanes norm = sqrt(squared);
  const Lanes inverse_norm = Lanes(1.0) / norm;
  const Lanes separation = gap * inverse_norm;
  const Lanes length = sqrt(dot(D, D));
  const Lanes slack(c.relative_slack);
  const Lanes size_slack = Lanes(c.size_slack) * pair.size;
  const Mask is_usable = squared > Lanes(c.smallest_squared_direction);
  return {larger(masked(is_usable, separation - (slack * separation + size_slack)), zero),
          length + (slack * length + size_slack), separation, masked(is_usable, inverse_norm)};
}

DYOP_INLINE Mask is_certified(const PairLanes& pair, const BoundsLanes& bounds,
                              const TriangleConstants& c) {
  return (bounds.lower > Lanes(0.0)) & (Lanes(c.noise) * pair.size >= bounds.upper - bounds.lower);
}

DYOP_INLINE WitnessLanes edge_witness(const PairLanes& pair, const Choice& i, const Choice& j) {
  const Lanes one(1.0);
  const Lanes zero(0.0);
  Lanes A[3], B[3], a[3], b[3], d[3], n[3], db[3];
  i.of(pair.A, A);
  j.of(pair.B, B);
  i.of(pair.a, a);
  j.of(pair.b, b);
  for (int k = 0; k < 3; ++k) d[k] = B[k] - A[k];
  cross(a, b, n);
  cross(d, b, db);
  const Lanes inverse_a = one / i.of(pair.aa[0], pair.aa[1], pair.aa[2]);
  const Lanes inverse_b = one / j.of(pair.bb[0], pair.bb[1], pair.bb[2]);
  const Lanes ab = dot(a, b);
  Lanes s = clamped(dot(db, n) / dot(n, n), one);
  const Lanes t = clamped((s * ab - dot(b, d)) * inverse_b, one);
  const Mask is_inside = is_inside_unit(s) & is_inside_unit(t);
  s = select(is_inside, s, clamped((t * ab + dot(a, d)) * inverse_a, one));
  WitnessLanes w;
  Lanes along_a[3], along_b[3];
  for (int k = 0; k < 3; ++k) {
    along_a[k] = a[k] * s;
    along_b[k] = b[k] * t;
    w.D[k] = (d[k] + along_b[k]) - along_a[k];
    w.p_a[k] = A[k] + along_a[k];
    w.p_b[k] = B[k] + along_b[k];
  }
  const Lanes side = dot(n, d);
  const Lanes share_a = masked(is_inside_unit(s), dot(a, w.D) * inverse_a);
  const Lanes share_b = masked(is_inside_unit(t), dot(b, w.D) * inverse_b);
  for (int k = 0; k < 3; ++k) {
    const Lanes level = (w.D[k] - a[k] * share_a) - b[k] * share_b;
    w.m[k] = select(is_inside, flip_sign_by_bit(n[k], side), level);
  }
  w.place_a = edge_place(i, s > zero, inverse(one > s));
  w.place_b = edge_place(j, t > zero, inverse(one > t));
  return w;
}

/// The edges of directed_witness().
struct EdgeChoice {
  Choice i, j;
};

DYOP_INLINE EdgeChoice directed_edges(const PairLanes& pair, const Lanes* direction) {
  const Lanes zero(0.0);
  const OrderLanes on_a =
      order_of(zero, dot(direction, pair.a[0]), negated(dot(direction, pair.a[2])));
  const OrderLanes on_b =
      order_of(zero, dot(direction, pair.b[0]), negated(dot(direction, pair.b[2])));
  return {on_a.lowest.next(), on_b.highest.next()};
}

// Faces in witnesses and as normals, one pair per lane, as in triangle_distance.cpp.

/// Whose face the lanes use: the face of one triangle and the vertices of the other.
struct FaceRoles {
  Mask of_a;
  Lanes n[3], start[3], edge0[3], edge2[3];

  DYOP_INLINE FaceRoles(const PairLanes& pair, const FacetLanes& facets, Mask is_of_a)
      : of_a(is_of_a) {
    select(of_a, facets.n_a, facets.n_b, n);
    select(of_a, pair.A[0], pair.B[0], start);
    select(of_a, pair.a[0], pair.b[0], edge0);
    select(of_a, pair.a[2], pair.b[2], edge2);
  }

  /// The vector from A to B, given that from the face to the other triangle.
  DYOP_INLINE void set_direction(const Lanes* D, Lanes* out) const {
    for (int k = 0; k < 3; ++k) out[k] = select(of_a, D[k], negated(D[k]));
  }
  DYOP_INLINE void set_points(const Lanes* on_face, const Lanes* other, WitnessLanes& w) const {
    select(of_a, on_face, other, w.p_a);
    select(of_a, other, on_face, w.p_b);
  }
  DYOP_INLINE void set_places(Lanes other, WitnessLanes& w) const {
    w.place_a = select(of_a, Lanes(6.0), other);
    w.place_b = select(of_a, other, Lanes(6.0));
  }
};

/// face_witness(): the witness where the vertex is above the face; elsewhere the edges to use.
struct FaceWitnessLanes {
  WitnessLanes witness;
  Mask is_above_face;
  Choice i, j;

  DYOP_INLINE FaceWitnessLanes(const PairLanes& pair, const FacetLanes& facets) {
    const FaceRoles face(pair, facets, facets.is_face_a);
    const Lanes zero(0.0);
    Lanes height[3];
    select(face.of_a, facets.height_b, facets.height_a, height);
    const Mask is_above = smaller(smaller(height[0], height[1]), height[2]) > zero;
    const Lanes sign = select(is_above, Lanes(1.0), Lanes(-1.0));
    const OrderLanes order = order_of(sign * height[0], sign * height[1], sign * height[2]);
    Lanes of_a[3], of_b[3], vertex[3], x[3], c[3];
    order.lowest.of(pair.A, of_a);
    order.lowest.of(pair.B, of_b);
    select(face.of_a, of_b, of_a, vertex);
    for (int k = 0; k < 3; ++k) x[k] = vertex[k] - face.start[k];
    const Lanes inverse_square = Lanes(1.0) / dot(face.n, face.n);
    cross(x, face.edge2, c);
    const Lanes v = negated(dot(c, face.n) * inverse_square);
    cross(face.edge0, x, c);
    const Lanes w = dot(c, face.n) * inverse_square;
    const Lanes rest = (Lanes(1.0) - v) - w;
    is_above_face = (v >= zero) & ((w >= zero) & (rest >= zero));
    const Mask is_beyond_0 = smaller(v, rest) > w;
    const Mask is_beyond_2 = without(rest > v, is_beyond_0);
    const Choice beyond{inverse(is_beyond_0 | is_beyond_2), is_beyond_2};
    const Choice lower_edge = order.highest.next();
    i = select(face.of_a, beyond, lower_edge);
    j = select(face.of_a, lower_edge, beyond);
    Lanes D[3], foot[3];
    const Lanes flip = select(face.of_a, sign, negated(sign));
    for (int k = 0; k < 3; ++k) {
      const Lanes ve = face.edge0[k] * v;
      const Lanes we = face.edge2[k] * w;
      D[k] = (x[k] - ve) + we;
      foot[k] = (face.start[k] + ve) - we;
      witness.m[k] = flip_sign_by_bit(face.n[k], flip);
    }
    face.set_direction(D, witness.D);
    face.set_points(foot, vertex, witness);
    face.set_places(order.lowest.of(Lanes(0.0), Lanes(1.0), Lanes(2.0)), witness);
  }
};

/// facet_normal().
DYOP_INLINE void facet_normal(const PairLanes& pair, const FacetLanes& facets,
                              const TriangleConstants& c, Lanes* normal) {
  const Lanes zero(0.0);
  Lanes most = facets.height_b[0];
  Lanes a[3], b[3], n[3];
  for (int k = 0; k < 3; ++k) {
    const Lanes value = select(facets.is_face_a, facets.height_b[k], negated(facets.height_a[k]));
    most = k == 0 ? select(magnitude(value) > zero, value, zero)
                  : select(magnitude(value) > magnitude(most), value, most);
  }
  facets.i.of(pair.a, a);
  facets.j.of(pair.b, b);
  cross(a, b, n);
  const Mask is_face = facets.is_face_a | facets.is_face_b;
  select(facets.is_face_b, facets.n_b, n, n);
  select(facets.is_face_a, facets.n_a, n, n);
  const Lanes side = select(is_face, most, dot(a, facets.n_b) + dot(b, facets.n_a));
  const Mask is_turned = zero > side;
  for (int k = 0; k < 3; ++k) n[k] = select(is_turned, negated(n[k]), n[k]);
  const Lanes squared = dot(n, n);
  const Mask is_usable = squared >= Lanes(c.smallest_squared_direction);
  const Lanes inverse_norm = Lanes(1.0) / sqrt(squared);
  for (int k = 0; k < 3; ++k) {
    normal[k] = select(is_usable, n[k] * inverse_norm, Lanes(k == 0 ? 1.0 : 0.0));
  }
}

// The first stages of triangle_distance.cpp, one pair per lane.

DYOP_INLINE EdgeChoice no_choice() {
  const Mask none = Lanes(0.0) > Lanes(0.0);
  return {{none, none}, {none, none}};
}

DYOP_INLINE Choice longest_of(const Lanes* squares) {
  const Mask is_1 = squares[1] > squares[0];
  const Mask is_2 = squares[2] > select(is_1, squares[1], squares[0]);
  return {without(is_1, is_2), is_2};
}

/// The search of triangle_distance.cpp: points, bounds and normal so far.
struct SearchLanes {
  WitnessLanes best;  ///< m is the normal here
  Lanes lower, upper, gap;
  Lanes point[3];  ///< of B - A, from which the walk continues
  Mask is_done;
  Mask is_unresolved;  ///< needs more than these stages

  DYOP_INLINE SearchLanes(const WitnessLanes& w, const BoundsLanes& bounds, Mask is_tried,
                          const Lanes* centroids)
      : best(w) {
    lower = masked(is_tried, bounds.lower);
    upper = select(is_tried, bounds.upper, Lanes(__builtin_inf()));
    gap = select(lower > Lanes(0.0), lower, Lanes(-__builtin_inf()));
    select(is_tried, w.D, centroids, point);
    for (int k = 0; k < 3; ++k) best.m[k] = w.m[k] * bounds.inverse_norm;
    is_done = is_unresolved = no_choice().i.is_1;
  }

  /// Search::offer() in some lanes.
  DYOP_INLINE void offer(Mask lanes, const PairLanes& pair, const WitnessLanes& w,
                         const TriangleConstants& c) {
    const BoundsLanes bounds = prove(pair, w.m, w.D, c);
    const Mask is_nearer = lanes & (upper > bounds.upper);
    const Mask is_wider = lanes & (bounds.inverse_norm > Lanes(0.0)) & (bounds.gap > gap);
    upper = select(is_nearer, bounds.upper, upper);
    select(is_nearer, w.p_a, best.p_a, best.p_a);
    select(is_nearer, w.p_b, best.p_b, best.p_b);
    best.place_a = select(is_nearer, w.place_a, best.place_a);
    best.place_b = select(is_nearer, w.place_b, best.place_b);
    gap = select(is_wider, bounds.gap, gap);
    lower = select(is_wider, larger(bounds.lower, lower), lower);
    for (int k = 0; k < 3; ++k) {
      best.m[k] = select(is_wider, w.m[k] * bounds.inverse_norm, best.m[k]);
    }
    set_done(lanes, pair, c);
  }

  DYOP_INLINE void set_done(Mask lanes, const PairLanes& pair, const TriangleConstants& c) {
    is_done = is_done | (lanes & (Lanes(c.noise) * pair.size >= upper - lower));
  }

  /// resolve_triangle_pair() up to the end of its walk.
  DYOP_INLINE void resolve(const PairLanes& pair, const FacetLanes& facets, Mask open,
                           const TriangleConstants& c) {
    set_done(open, pair, c);
    const Mask may_cross = without(without(open, is_done), lower > Lanes(0.0));
    if (any(may_cross)) pierce(pair, facets, may_cross, c);
    // literal: kTriangleWalkLimit.
    for (int step = 0; step < 3; ++step) {
      const Mask walking = without(open, is_done | is_unresolved);
      if (!any(walking)) return;
      const EdgeChoice edges = directed_edges(pair, point);
      const WitnessLanes w = edge_witness(pair, edges.i, edges.j);
      offer(walking, pair, w, c);
      Lanes to_witness[3];
      for (int k = 0; k < 3; ++k) to_witness[k] = w.D[k] - point[k];
      const Lanes share =
          clamped(negated(dot(point, to_witness)) / dot(to_witness, to_witness), Lanes(1.0));
      for (int k = 0; k < 3; ++k) {
        point[k] = select(walking, point[k] + to_witness[k] * share, point[k]);
      }
    }
  }

 private:
  /// Lanes where the other triangle's plane cuts edge k, given the heights of the vertices.
  static DYOP_INLINE void straddling(const Lanes* x, Mask* edge) {
    const Lanes zero(0.0);
    Mask positive[3], negative[3];
    for (int k = 0; k < 3; ++k) {
      positive[k] = x[k] > zero;
      negative[k] = zero > x[k];
    }
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const Mask same = (positive[k] & positive[next]) | (negative[k] & negative[next]);
      edge[k] = without((positive[k] | negative[k]) | (positive[next] | negative[next]), same);
    }
  }

  static DYOP_INLINE Mask agree(Lanes x, Lanes y, Lanes z) {
    const Lanes zero(0.0);
    const Mask positive = (x > zero) | ((y > zero) | (z > zero));
    const Mask negative = (zero > x) | ((zero > y) | (zero > z));
    return inverse(positive & negative);
  }

  /// find_piercing() for the first edge found; lanes where that does not suffice are given up.
  DYOP_INLINE void pierce(const PairLanes& pair, const FacetLanes& f, Mask lanes,
                          const TriangleConstants& c) {
    Mask of_b[3], of_a[3];
    straddling(f.height_b, of_b);
    straddling(f.height_a, of_a);
    for (int k = 0; k < 3; ++k) {
      of_b[k] = of_b[k] & agree(f.h[0][k], f.h[1][k], f.h[2][k]);
      of_a[k] = of_a[k] & agree(f.h[k][0], f.h[k][1], f.h[k][2]);
    }
    const Mask is_b = of_b[0] | (of_b[1] | of_b[2]);
    const Mask is_a = of_a[0] | (of_a[1] | of_a[2]);
    const Mask found = lanes & (is_a | is_b);
    if (!any(found)) return;
    const Choice edge_b{without(of_b[1], of_b[0]), without(of_b[2], of_b[0] | of_b[1])};
    const Choice edge_a{without(of_a[1], of_a[0]), without(of_a[2], of_a[0] | of_a[1])};
    WitnessLanes w;
    pierce_face(pair, FaceRoles(pair, f, is_b), select(is_b, edge_b, edge_a), c, w);
    offer(found, pair, w, c);
    is_unresolved = is_unresolved | without(found, is_done);
  }

  /// piercing_witness().
  static DYOP_INLINE void pierce_face(const PairLanes& pair, const FaceRoles& face,
                                      const Choice& edge, const TriangleConstants& c,
                                      WitnessLanes& w) {
    const Lanes one(1.0);
    Lanes of_a[3], of_b[3], needle[3], start[3], d[3], D[3];
    edge.of(pair.a, of_a);
    edge.of(pair.b, of_b);
    select(face.of_a, of_b, of_a, needle);
    edge.of(pair.A, of_a);
    edge.of(pair.B, of_b);
    select(face.of_a, of_b, of_a, start);
    for (int k = 0; k < 3; ++k) D[k] = d[k] = start[k] - face.start[k];
    const Lanes rise = dot(needle, face.n);
    const Lanes inverse_square = one / dot(face.n, face.n);
    const Lanes rounding = Lanes(c.relative_slack) * pair.size;
    Lanes t(0.0), u(0.0), v(0.0);
    Mask is_open = equal(one, one);
    // literal: kTrianglePiercingSteps.
    for (int step = 0; step < 2; ++step) {
      const Lanes next = clamped(t - dot(D, face.n) / rise, one);
      Lanes x[3], normal[3];
      for (int k = 0; k < 3; ++k) x[k] = D[k] + needle[k] * (next - t);
      t = select(is_open, next, t);
      cross(x, face.edge2, normal);
      u = select(is_open, clamped(u - dot(normal, face.n) * inverse_square, one), u);
      cross(face.edge0, x, normal);
      v = select(is_open, clamped(v + dot(normal, face.n) * inverse_square, one - u), v);
      for (int k = 0; k < 3; ++k) {
        D[k] = ((d[k] + needle[k] * t) - face.edge0[k] * u) + face.edge2[k] * v;
      }
      is_open = without(is_open, rounding * rounding >= dot(D, D));
      if (!any(is_open)) break;
    }
    Lanes on_face[3], on_edge[3];
    for (int k = 0; k < 3; ++k) {
      on_face[k] = (face.start[k] + face.edge0[k] * u) - face.edge2[k] * v;
      on_edge[k] = start[k] + needle[k] * t;
    }
    face.set_direction(D, w.D);
    for (int k = 0; k < 3; ++k) w.m[k] = w.D[k];
    face.set_points(on_face, on_edge, w);
    face.set_places(edge_place(edge, t > Lanes(0.0), t >= one), w);
  }
};

// Answers of all lanes, before they are stored in a block.

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

// Pairs with vertices in common, as in triangle_distance.cpp, one pair per lane.

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

// The kernels of triangle_wide.h for the instruction set that this file is compiled for.
// The stages are those of triangle_distance(), in the same order.

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

extern const TriangleWideKernels DYOP_KERNEL(triangle_wide);
const TriangleWideKernels DYOP_KERNEL(triangle_wide){decide_triangles<false>,
                                                     decide_triangles<true>, triangles_within};

}  // namespace dyop::distance_internal
