// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <bit>
#include <cstddef>

#include "distance/triangle/triangle_facets.h"

namespace dyop::distance_internal {
namespace {

inline std::size_t at(int k) {
  return static_cast<std::size_t>(k);
}

/// Collects witnesses and directions: keeps the smallest upper and the largest lower bound, each
/// proven.
class Search {
 public:
  Search(const TrianglePair& pair, const TriangleDistance& found) : pair_(pair), result_(found) {
    if (found.lower > 0) gap_ = found.lower;
  }

  /// Keeps the witness if it is nearer than the best one, and the direction if it separates more;
  /// returns whether the bounds now agree within the noise.
  bool offer(const Witness& w, const Vector3& m) {
    const Bounds bounds = prove(pair_, m, w.D);
    if (bounds.upper < result_.upper) {
      result_.upper = bounds.upper;
      result_.p_a = w.p_a;
      result_.p_b = w.p_b;
      result_.feature_a = feature_of_place(w.place_a);
      result_.feature_b = feature_of_place(w.place_b);
    }
    if (bounds.inverse_norm > 0 && bounds.gap > gap_) {
      gap_ = bounds.gap;
      result_.lower = larger(bounds.lower, result_.lower);
      result_.nhat_AB = m * bounds.inverse_norm;
    }
    return is_done();
  }

  bool offer(const Witness& w) { return offer(w, w.m); }

  bool is_done() const { return result_.upper - result_.lower <= kTriangleNoise * pair_.size; }

  /// The answer. Touching pairs get the normal of the facet with the least depth.
  TriangleDistance finished(const Facets& facets) const {
    TriangleDistance result = result_;
    if (result.lower == 0 && is_done()) {
      result.is_overlapping = true;
      result.nhat_AB = facet_normal(pair_, facets);
    }
    return result;
  }

 private:
  const TrianglePair& pair_;
  TriangleDistance result_;
  Scalar gap_ = -kInfinity;
};

/// Removes from m the components that rounding left along two edges to which it should be
/// perpendicular. Needed if they are nearly parallel: their cross product then errs by u / sin.
Vector3 squared_to(const Vector3& m, const Vector3& e, const Vector3& f) {
  const Scalar ee = dot(e, e);
  const Vector3 level = m - e * (dot(m, e) / ee);
  Vector3 g = f - e * (dot(f, e) / ee);
  g -= e * (dot(g, e) / ee);
  return level - g * (dot(level, f) / dot(g, f));
}

/// Point of the face of A (of B, unless `of_a`) nearest to the point where edge k of the other
/// triangle meets its plane. Solved again for the remainder, because normals of thin triangles are
/// inexact but the remainder is known to rounding.
Witness piercing_witness(const TrianglePair& pair, const Facets& facets, bool of_a, int k) {
  const Vector3 n = of_a ? facets.n.low() : facets.n.high();
  const Triangle& face = of_a ? pair.A : pair.B;
  const Vector3* edge = of_a ? pair.a : pair.b;
  const Vector3& needle = of_a ? pair.b[k] : pair.a[k];
  const Vector3& start = of_a ? pair.B[at(k)] : pair.A[at(k)];
  const Vector3 d = start - face[0];
  const Scalar rise = dot(needle, n);
  const Scalar inverse = 1 / dot(n, n);
  Scalar t = 0, v = 0, w = 0;
  Vector3 D = d;
  for (int step = 0; step < kTrianglePiercingSteps; ++step) {
    const Scalar previous = t;
    t = clamped(t - dot(D, n) / rise, 1);
    const Vector3 x = D + (t - previous) * needle;
    v = clamped(v - dot(x.cross(edge[2]), n) * inverse, 1);
    w = clamped(w + dot(edge[0].cross(x), n) * inverse, 1 - v);
    D = ((d + t * needle) - v * edge[0]) + w * edge[2];
    const Scalar rounding = kTriangleRelativeSlack * pair.size;
    if (dot(D, D) <= rounding * rounding) break;
  }
  const Vector3 on_face = (face[0] + v * edge[0]) - w * edge[2];
  const Vector3 on_edge = start + t * needle;
  const int edge_code = edge_place(k, t > 0, t >= 1);
  Witness result;
  result.D = of_a ? D : Vector3(-D);
  result.m = result.D;
  result.p_a = of_a ? on_face : on_edge;
  result.p_b = of_a ? on_edge : on_face;
  result.place_a = of_a ? kFaceCode : edge_code;
  result.place_b = of_a ? edge_code : kFaceCode;
  return result;
}

/// Signs of vertices or of a column of h as bits: which are positive, which negative. Zero is
/// neither.
struct Signs {
  int positive;
  int negative;

  bool agree() const { return positive == 0 || negative == 0; }

  /// Bits of the edges k whose ends, vertices k and k + 1, are neither strictly on one side nor
  /// both in the plane.
  int straddling() const {
    const auto rotated = [](int x) { return (x >> 1) | (x & 1) << 2; };
    const int any = positive | negative;
    return (any | rotated(any)) &
           ~((positive & rotated(positive)) | (negative & rotated(negative)));
  }
};

/// The signs of the numbers 0 (x low), 2 (x high) and 1 (y low).
Signs signs_of(LanePair x, LanePair y) {
  const auto arranged = [](int x_bits, int y_bits) {
    return (x_bits & 1) | (y_bits & 1) << 1 | (x_bits & 2) << 1;
  };
  const LanePair zero(0);
  return {arranged(bits(above(x, zero)), bits(above(y, zero))),
          arranged(bits(above(zero, x)), bits(above(zero, y)))};
}

/// Searches for an edge of one triangle through the face of the other. An edge k of B passes
/// through A's face if its ends lie on both sides of A's plane and it passes A's three edges on the
/// same side: h_0k, h_1k, h_2k have one sign.
bool find_piercing(const TrianglePair& pair, const Facets& f, Search& search) {
  const auto& y = f.height;
  const Signs of_b = signs_of(lows(y[0], y[2]), y[1]);
  const Signs of_a = signs_of(highs(y[0], y[2]), swapped(y[1]));
  const Signs column[3] = {signs_of(f.h[0], f.h[3]), signs_of(f.h[2], f.h[4]),
                           signs_of(f.h[1], swapped(f.h[3]))};
  const int same_column = static_cast<int>(column[0].agree()) |
                          static_cast<int>(column[1].agree()) << 1 |
                          static_cast<int>(column[2].agree()) << 2;
  const int any_positive = column[0].positive | column[1].positive | column[2].positive;
  const int any_negative = column[0].negative | column[1].negative | column[2].negative;
  // Bits 0..2 for edges of B, 3..5 for edges of A.
  unsigned found = static_cast<unsigned>((of_b.straddling() & same_column) |
                                         (of_a.straddling() & ~(any_positive & any_negative)) << 3);
  for (; found != 0; found &= found - 1) {
    const int k = std::countr_zero(found);
    if (search.offer(piercing_witness(pair, f, k < 3, k % 3))) return true;
  }
  return false;
}

/// The nearest points of all pairs of edges, [3 i + j].
using EdgeWitnesses = std::array<Witness, 9>;

int nearest_of(const EdgeWitnesses& all) {
  int nearest = 0;
  for (int k = 1; k < 9; ++k) {
    if (dot(all[at(k)].D, all[at(k)].D) < dot(all[at(nearest)].D, all[at(nearest)].D)) nearest = k;
  }
  return nearest;
}

/// Both faces, and all 9 pairs of edges.
bool try_everything(const TrianglePair& pair, const Facets& facets, EdgeWitnesses& all,
                    Search& search) {
  if (search.offer(face_witness(pair, facets, true)) ||
      search.offer(face_witness(pair, facets, false))) {
    return true;
  }
  const Scalar touching = kTriangleSizeSlack * pair.size;
  for (int k = 0; k < 9; ++k) {
    Witness& w = all[at(k)];
    w = edge_witness(pair, k / 3, k % 3);
    // Then there is no lower bound to find.
    if (dot(w.D, w.D) <= touching * touching && search.offer(w)) return true;
  }
  return search.offer(all[at(nearest_of(all))]);
}

/// The same with directions cleaned of what rounding left along the edges.
bool try_cleaned(const TrianglePair& pair, const Facets& facets, const EdgeWitnesses& all,
                 Search& search) {
  const int k = nearest_of(all);
  const Witness& best = all[at(k)];
  if (search.offer(best, best.D)) return true;
  if (search.offer(best, squared_to(best.m, pair.a[k / 3], pair.b[k % 3]))) return true;
  for (const bool of_a : {true, false}) {
    const Witness w = face_witness(pair, facets, of_a);
    const Vector3* e = of_a ? pair.a : pair.b;
    if (search.offer(w, squared_to(w.m, e[0], e[1]))) return true;
  }
  return false;
}

/// Where on the line from one vector to another the point nearest to the origin is.
Scalar blend_share(const Vector3& from, const Vector3& to) {
  const Vector3 step = to - from;
  return clamped(-dot(from, step) / dot(step, step), 1);
}

/// The point nearest to the origin on the line between two points of B - A. Its witness points lie
/// in A and B because both are convex.
Witness blended(const Witness& w1, const Witness& w2) {
  const Scalar second = blend_share(w1.D, w2.D);
  const Scalar first = 1 - second;
  Witness w;
  w.D = first * w1.D + second * w2.D;
  w.m = w.D;
  w.p_a = first * w1.p_a + second * w2.p_a;
  w.p_b = first * w1.p_b + second * w2.p_b;
  w.place_a = w1.place_a == w2.place_a ? w1.place_a : kFaceCode;
  w.place_b = w1.place_b == w2.place_b ? w1.place_b : kFaceCode;
  return w;
}

/// For thin triangles, whose normals are inexact: where edges pass a point on both sides, the
/// nearest point lies between them, and its direction is perpendicular to the edges. Rounding
/// allows kTriangleBlendLimit blends of points that are close compared with the size.
bool try_blends(const TrianglePair& pair, const EdgeWitnesses& all, Search& search) {
  int nearest = nearest_of(all);
  Witness best = all[at(nearest)];
  const Scalar limit = pair.size / 8;
  if (!(dot(best.D, best.D) < limit * limit)) return false;
  for (int step = 0; step < kTriangleBlendLimit; ++step) {
    int partner = -1;
    Scalar least = dot(best.D, best.D);
    for (int k = 0; k < 9; ++k) {
      const Vector3& other = all[at(k)].D;
      if (!(dot(other, other) < limit * limit)) continue;
      const Scalar share = blend_share(best.D, other);
      const Vector3 between = (1 - share) * best.D + share * other;
      const Scalar squared = dot(between, between);
      if (!(squared < least)) continue;
      least = squared;
      partner = k;
    }
    if (partner >= 0) {
      best = blended(best, all[at(partner)]);
      nearest = partner;
    } else if (step > 0) {
      return false;
    }
    const Vector3& a = pair.a[nearest / 3];
    const Vector3& b = pair.b[nearest % 3];
    const Vector3 off_a = best.D - a * (dot(best.D, a) / dot(a, a));
    const Vector3 off_b = best.D - b * (dot(best.D, b) / dot(b, b));
    if (search.offer(best) || search.offer(best, off_a) || search.offer(best, off_b)) return true;
  }
  return false;
}

/// Tries every axis that can separate polytopes that nearly touch.
bool try_all_axes(const TrianglePair& pair, const EdgeWitnesses& all, Search& search) {
  for (int k = 0; k < 9; ++k) {
    const Vector3& a = pair.a[k / 3];
    const Vector3& b = pair.b[k % 3];
    const Vector3 m = squared_to(a.cross(b), a, b);
    if (search.offer(all[at(k)], m) || search.offer(all[at(k)], -m)) return true;
  }
  return false;
}

/// Steps from a point of B - A to the edges that support along it, and on to the point nearest to
/// the origin between it and their witness, as in [GilbertJohnsonKeerthi1988].
bool walk(const TrianglePair& pair, Vector3 point, Search& search) {
  for (int step = 0; step < kTriangleWalkLimit; ++step) {
    const Witness w = directed_witness(pair, point);
    if (search.offer(w)) return true;
    point += blend_share(point, w.D) * (w.D - point);
  }
  return false;
}

}  // namespace

TriangleDistance resolve_triangle_pair(const TrianglePair& pair, const Facets& facets,
                                       const Vector3& direction, const TriangleDistance& found) {
  Search search(pair, found);
  if (search.is_done() || (!(found.lower > 0) && find_piercing(pair, facets, search))) {
    return search.finished(facets);
  }
  EdgeWitnesses all;
  if (!walk(pair, direction, search) && !try_everything(pair, facets, all, search) &&
      !try_blends(pair, all, search) && !try_cleaned(pair, facets, all, search)) {
    try_all_axes(pair, all, search);
  }
  return search.finished(facets);
}

}  // namespace dyop::distance_internal
