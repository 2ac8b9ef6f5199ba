// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "distance/triangle_wide/triangle_witness_simd.h"

// Faces in witnesses and as normals, one pair per lane, as in triangle_facets.cpp.
namespace dyop::distance_internal {
inline namespace DYOP_LANES {

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

}  // namespace DYOP_LANES
}  // namespace dyop::distance_internal
