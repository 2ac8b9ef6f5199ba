// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "distance/triangle_wide/triangle_simd.h"

// Witnesses and their proofs, one pair per lane, as in triangle_pair.h and triangle_facets.cpp.
namespace dyop::distance_internal {
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

}  // namespace DYOP_LANES
}  // namespace dyop::distance_internal
