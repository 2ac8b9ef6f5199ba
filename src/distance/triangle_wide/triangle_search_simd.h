// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "distance/triangle_wide/triangle_face_simd.h"

// The first stages of triangle_resolve.cpp, one pair per lane.
namespace dyop::distance_internal {
inline namespace DYOP_LANES {

DYOP_INLINE EdgeChoice no_choice() {
  const Mask none = Lanes(0.0) > Lanes(0.0);
  return {{none, none}, {none, none}};
}

DYOP_INLINE Choice longest_of(const Lanes* squares) {
  const Mask is_1 = squares[1] > squares[0];
  const Mask is_2 = squares[2] > select(is_1, squares[1], squares[0]);
  return {without(is_1, is_2), is_2};
}

/// The search of triangle_resolve.cpp: points, bounds and normal so far.
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

}  // namespace DYOP_LANES
}  // namespace dyop::distance_internal
