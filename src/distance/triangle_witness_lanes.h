#pragma once

#include "distance/triangle_lanes.h"

// Witnesses and their proofs with one pair a lane, as in triangle_pair.h and triangle_facets.cpp.
namespace dyop::internal {
inline namespace DYOP_LANES {

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
  const Lanes norm = root(squared);
  const Lanes inverse_norm = Lanes(1.0) / norm;
  const Lanes separation = gap * inverse_norm;
  const Lanes length = root(dot(D, D));
  const Lanes slack(c.relative_slack);
  const Lanes room = Lanes(c.size_slack) * pair.size;
  const Mask is_usable = squared > Lanes(c.smallest_squared_direction);
  return {larger(masked(is_usable, separation - (slack * separation + room)), zero),
          length + (slack * length + room), separation, masked(is_usable, inverse_norm)};
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
    w.m[k] = select(is_inside, turned_by_bit(n[k], side), level);
  }
  w.place_a = edge_place(i, s > zero, inverse(one > s));
  w.place_b = edge_place(j, t > zero, inverse(one > t));
  return w;
}

/// Where the lanes' faces are used: a face of one triangle and the vertices of the other.
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

/// face_witness(): where the vertex is above the face, its witness; elsewhere the edges to take.
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
      witness.m[k] = turned_by_bit(face.n[k], flip);
    }
    face.set_direction(D, witness.D);
    face.set_points(foot, vertex, witness);
    face.set_places(order.lowest.of(Lanes(0.0), Lanes(1.0), Lanes(2.0)), witness);
  }
};

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
  const Lanes inverse_norm = Lanes(1.0) / root(squared);
  for (int k = 0; k < 3; ++k) {
    normal[k] = select(is_usable, n[k] * inverse_norm, Lanes(k == 0 ? 1.0 : 0.0));
  }
}

}  // namespace DYOP_LANES
}  // namespace dyop::internal
