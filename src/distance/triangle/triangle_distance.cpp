// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/triangle_distance.h"

#include <array>
#include <bit>
#include <cstddef>
#include <optional>

#include "distance/triangle/triangle_pair.h"

namespace dyop {
namespace distance_internal {
namespace {

/// Largest absolute difference of coordinates of the two triangles; NaN or infinite if one is.
Scalar largest_difference(const Triangle& a, const Triangle& b) {
  Scalar largest = 0;
  Scalar sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    for (const Vector3& x : {Vector3(a[k] - a[0]), Vector3(b[k] - a[0])}) {
      largest = std::max(largest, x.cwiseAbs().maxCoeff());
      sum += x.sum();
    }
  }
  return std::isfinite(sum) ? largest : sum;
}

Triangle scaled(const Triangle& triangle, int exponent) {
  Triangle result = triangle;
  for (Vector3& vertex : result) {
    for (Scalar& x : vertex) x = std::ldexp(x, exponent);
  }
  return result;
}

/// What scaling by a power of two may lose, in the scale of the result: coordinates scaled into the
/// smallest numbers are off by half of the least one, and so is a result scaled back into them.
Scalar scaling_loss(int exponent) {
  constexpr Scalar kStep = std::numeric_limits<Scalar>::denorm_min();
  return 4 * (kStep + std::ldexp(kStep, exponent));
}

/// How to scale a pair by 2^-exponent so that its largest difference is in [1, 2).
struct Scaling {
  Scalar largest;  ///< NaN or infinite if a coordinate is, or if differences overflow
  int exponent;

  Scaling(const Triangle& a, const Triangle& b)
      : largest(largest_difference(a, b)),
        exponent(std::isfinite(largest) && largest > 0 ? std::ilogb(largest) : 0) {}
};

/// triangle_distance() for sizes whose powers leave the range of double.
TriangleDistance extreme_triangle_distance(const Triangle& a, const Triangle& b) {
  TriangleDistance result;
  result.upper = kInfinity;
  result.feature_a = result.feature_b = feature_of_place(kFaceCode);
  result.p_a = a[0];
  result.p_b = b[0];
  const Scaling scaling(a, b);
  if (!std::isfinite(scaling.largest)) return result;  // proves nothing
  // Before scaling, which may merge vertices.
  if (const unsigned equal = equal_vertices(a, b); equal != 0) {
    const auto i = static_cast<std::size_t>(std::countr_zero(equal));
    result.upper = 0;
    result.p_a = result.p_b = a[i / 3];
    result.feature_a = feature_of_place(static_cast<int>(i / 3));
    result.feature_b = feature_of_place(static_cast<int>(i % 3));
    result.is_overlapping = true;
    return result;
  }
  const int exponent = scaling.exponent;
  result = triangle_distance(scaled(a, -exponent), scaled(b, -exponent));
  const Scalar loss = scaling_loss(exponent);
  result.lower = std::max(Scalar{0}, std::ldexp(result.lower, exponent) - loss);
  result.upper = std::ldexp(result.upper, exponent) + loss;
  for (Vector3* p : {&result.p_a, &result.p_b}) {
    for (Scalar& x : *p) x = std::ldexp(x, exponent);
  }
  return result;
}

/// Whether both triangles are segments or points up to rounding.
bool are_segments(const TrianglePair& pair, const VectorPair& n) {
  const LanePair squares = LanePair(pair.aa[0], pair.bb[0]) * LanePair(pair.aa[2], pair.bb[2]);
  return bits(above(n.dot(n), LanePair(kTriangleFlatSquare) * squares)) == 0;
}

int longest_of(const Scalar* squares) {
  const int longer = squares[1] > squares[0] ? 1 : 0;
  return squares[2] > squares[longer] ? 2 : longer;
}

}  // namespace

}  // namespace distance_internal

TriangleDistance triangle_distance(const Triangle& a, const Triangle& b) {
  using namespace distance_internal;
  if (may_share_vertex(a, b)) {
    if (const unsigned equal = equal_vertices(a, b); equal != 0) {
      const Vector3 normal = touching_normal(a, b, equal);
      const int first = std::countr_zero(equal);
      const Vector3& p = a[static_cast<std::size_t>(first / 3)];
      if (normal != Vector3::Zero()) {
        return {0, 0, p, p, normal, feature_of_place(first / 3), feature_of_place(first % 3), true};
      }
    }
  }
  const TrianglePair pair(a, b);
  if (!(pair.size >= kSmallestTriangleSize && pair.size <= kLargestTriangleSize)) {
    return extreme_triangle_distance(a, b);
  }
  // From centroid to centroid.
  const VectorPair spread = pair.b02 - pair.a02;
  const Vector3 direction = pair.r + (spread.low() - spread.high()) * (Scalar{1} / 3);
  if (dot(direction, direction) > kTriangleFarRatio * pair.edges) {
    const Witness w = directed_witness(pair, direction);
    const Bounds bounds = prove(pair, w.m, w.D);
    if (is_certified(pair, bounds.lower, bounds.upper)) return result_of(w, bounds);
  }
  const VectorPair n = face_normals(pair);
  if (are_segments(pair, n)) {
    const Witness w = edge_witness(pair, longest_of(pair.aa), longest_of(pair.bb));
    const Bounds bounds = prove(pair, w.m, w.D);
    if (is_certified(pair, bounds.lower, bounds.upper)) return result_of(w, bounds);
    return resolve_triangle_pair(pair, Facets(pair, n), w.D, result_of(w, bounds));
  }
  const Facets facets(pair, n);
  const Scalar contact = kTriangleContactGap * pair.size;
  if (facets.best > contact * contact) {
    const Witness w = facets.code < 9 ? edge_witness(pair, facets.code / 3, facets.code % 3)
                                      : face_witness(pair, facets, facets.code == 9);
    const Bounds bounds = prove(pair, w.m, w.D);
    if (is_certified(pair, bounds.lower, bounds.upper)) return result_of(w, bounds);
    return resolve_triangle_pair(pair, facets, w.D, result_of(w, bounds));
  }
  TriangleDistance found;
  found.upper = kInfinity;
  return resolve_triangle_pair(pair, facets, direction, found);
}

Scalar triangle_noise(const Triangle& a, const Triangle& b) {
  using namespace distance_internal;
  const Scalar size = TrianglePair(a, b).size;
  if (size >= kSmallestTriangleSize && size <= kLargestTriangleSize) return kTriangleNoise * size;
  const Scaling scaling(a, b);
  if (!(scaling.largest > 0)) return scaling.largest;
  const int exponent = scaling.exponent;
  const Triangle small_a = scaled(a, -exponent);
  const Triangle small_b = scaled(b, -exponent);
  const Scalar scaled_size = TrianglePair(small_a, small_b).size;
  return std::ldexp(kTriangleNoise * scaled_size, exponent) + 2 * scaling_loss(exponent);
}

}  // namespace dyop

namespace dyop::distance_internal {
namespace {

struct VertexOrder {
  int lowest;
  int highest;
};

/// Numbers of the smallest and the largest of three values, by a table and without branches.
VertexOrder order_of(Scalar x0, Scalar x1, Scalar x2) {
  static constexpr VertexOrder kOrders[8] = {{2, 0}, {2, 1}, {1, 0}, {0, 0},
                                             {2, 0}, {0, 1}, {1, 2}, {0, 2}};
  return kOrders[static_cast<int>(x0 < x1) + 2 * static_cast<int>(x1 < x2) +
                 4 * static_cast<int>(x0 < x2)];
}

}  // namespace

Witness face_witness(const TrianglePair& pair, const Facets& facets, bool of_a) {
  const Vector3 n = of_a ? facets.n.low() : facets.n.high();
  const auto height = [&](int k) {
    return of_a ? facets.height[k].low() : facets.height[k].high();
  };
  const bool is_above = smaller(smaller(height(0), height(1)), height(2)) > 0;
  const Scalar sign = is_above ? 1 : -1;
  const VertexOrder order = order_of(sign * height(0), sign * height(1), sign * height(2));
  const int nearest = order.lowest;
  const Triangle& face = of_a ? pair.A : pair.B;
  const auto at = [](int k) { return static_cast<std::size_t>(k); };
  const Vector3& vertex = of_a ? pair.B[at(nearest)] : pair.A[at(nearest)];
  const Vector3* edge = of_a ? pair.a : pair.b;
  const Vector3 x = vertex - face[0];
  const Scalar inverse = 1 / dot(n, n);
  const Scalar v = -(dot(x.cross(edge[2]), n) * inverse);
  const Scalar w = dot(edge[0].cross(x), n) * inverse;
  const Scalar rest = (1 - v) - w;
  if (!(v >= 0 && w >= 0 && rest >= 0)) {
    int beyond = v < rest ? 2 : 1;  // the edge opposite to vertex k is k + 1
    if (w < smaller(v, rest)) beyond = 0;
    return of_a ? edge_witness(pair, beyond, kNext[order.highest])
                : edge_witness(pair, kNext[order.highest], beyond);
  }
  Witness result;
  const Vector3 ve = v * edge[0];
  const Vector3 we = w * edge[2];
  const Vector3 D = (x - ve) + we;
  const Vector3 foot = (face[0] + ve) - we;
  result.m = is_above == of_a ? n : Vector3(-n);
  result.D = of_a ? D : Vector3(-D);
  result.p_a = of_a ? foot : vertex;
  result.p_b = of_a ? vertex : foot;
  result.place_a = of_a ? kFaceCode : nearest;
  result.place_b = of_a ? nearest : kFaceCode;
  return result;
}

Vector3 facet_normal(const TrianglePair& pair, const Facets& facets) {
  Vector3 normal;
  if (facets.code >= 9) {
    const bool of_a = facets.code == 9;
    normal = of_a ? facets.n.low() : facets.n.high();
    // The side with the smaller depth.
    Scalar sum = 0, most = 0;
    for (const LanePair& height : facets.height) {
      const Scalar value = of_a ? height.low() : -height.high();
      sum = std::abs(value) > std::abs(most) ? value : sum;
      most = sum;
    }
    if (most < 0) normal = -normal;
  } else {
    const int i = facets.code / 3;
    const int j = facets.code % 3;
    normal = pair.a[i].cross(pair.b[j]);
    if (dot(pair.a[i], facets.n.high()) + dot(pair.b[j], facets.n.low()) < 0) normal = -normal;
  }
  const Scalar squared = dot(normal, normal);
  if (!(squared >= kSmallestSquaredDirection)) return Vector3::UnitX();
  return normal * (1 / std::sqrt(squared));
}

Witness directed_witness(const TrianglePair& pair, const Vector3& c) {
  // The edge opposite to a vertex has the number of the next one.
  const int i = kNext[order_of(0, dot(c, pair.a[0]), -dot(c, pair.a[2])).lowest];
  const int j = kNext[order_of(0, dot(c, pair.b[0]), -dot(c, pair.b[2])).highest];
  return edge_witness(pair, i, j);
}

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

namespace {

constexpr int kRowOf[9] = {0, 0, 0, 1, 1, 1, 2, 2, 2};
constexpr int kColumnOf[9] = {0, 1, 2, 0, 1, 2, 0, 1, 2};
/// Pairs of vertices that contain neither vertex of the given pair.
constexpr unsigned kOthers[9] = {0b110110000, 0b101101000, 0b011011000, 0b110000110, 0b101000101,
                                 0b011000011, 0b000110110, 0b000101101, 0b000011011};

/// Unit normal from a to b for triangles with a common edge. Either face's normal separates them,
/// and that of the larger face is more accurate. Zero if both faces are too thin, or not in range.
Vector3 hinge_normal(const Triangle& a, const Triangle& b, int first, int second) {
  const auto at = [](int k) { return static_cast<std::size_t>(k); };
  const VectorPair edge02[2] = {VectorPair(a[1], b[1]) - VectorPair(a[0], b[0]),
                                VectorPair(a[0], b[0]) - VectorPair(a[2], b[2])};
  const VectorPair n = edge02[1].cross(edge02[0]);
  const LanePair squares = n.dot(n);
  const LanePair lengths = edge02[0].dot(edge02[0]) + edge02[1].dot(edge02[1]);
  const bool of_a = squares.low() >= squares.high();
  const Scalar squared = of_a ? squares.low() : squares.high();
  const Scalar length = of_a ? lengths.low() : lengths.high();
  constexpr Scalar kFourth = kLargestTriangleSize * kLargestTriangleSize;
  // A sum, so that NaN in either triangle is rejected.
  const bool is_in_range = lengths.low() + lengths.high() <= kFourth && length * kFourth >= 1;
  if (!is_in_range || !(squared >= kTriangleParallelSquare * (length * length))) {
    return Vector3::Zero();
  }
  // From the common edge to the other triangle's own vertex.
  const int i = 3 - kRowOf[first] - kRowOf[second];
  const int j = 3 - kColumnOf[first] - kColumnOf[second];
  const Vector3& common = a[at(kRowOf[first])];
  const Vector3 out = of_a ? Vector3(b[at(j)] - common) : Vector3(common - a[at(i)]);
  const Vector3 normal = of_a ? n.low() : n.high();
  const Scalar inverse = 1 / std::sqrt(squared);
  return normal * (dot(normal, out) < 0 ? -inverse : inverse);
}

}  // namespace

Vector3 touching_normal(const Triangle& a, const Triangle& b, unsigned equal_mask) {
  const int first = std::countr_zero(equal_mask);
  if (const unsigned others = equal_mask & kOthers[first]; others != 0) {
    const Vector3 normal = hinge_normal(a, b, first, std::countr_zero(others));
    if (normal != Vector3::Zero()) return normal;
  }
  const TrianglePair pair(a, b);
  if (!(pair.size >= kSmallestTriangleSize && pair.size <= kLargestTriangleSize)) {
    return Vector3::Zero();
  }
  return facet_normal(pair, Facets(pair, face_normals(pair)));
}

}  // namespace dyop::distance_internal

namespace dyop {
namespace {

using namespace distance_internal;

bool is_corner(std::int32_t number) {
  return number >= 0 && number < 3;
}

// Number of an edge that contains the feature; nothing for other features. Edge k runs from vertex
// k to vertex k + 1, and the feature may list them in either order.
std::optional<int> edge_with(const Feature& feature) {
  const auto [first, second, unused] = feature.vertices;
  if (!is_corner(first)) return std::nullopt;
  if (feature.kind == FeatureKind::Vertex) return first;
  if (feature.kind != FeatureKind::Edge || !is_corner(second)) return std::nullopt;
  return kNext[first] == second ? first : second;
}

// Witness of a vertex above the interior of the other triangle's face; nothing if it is beyond it.
std::optional<Witness> vertex_above_face(const TrianglePair& pair, bool is_face_of_a, int vertex) {
  const Triangle& face = is_face_of_a ? pair.A : pair.B;
  const Vector3& p = (is_face_of_a ? pair.B : pair.A)[static_cast<std::size_t>(vertex)];
  const Vector3* edge = is_face_of_a ? pair.a : pair.b;
  const Vector3 n = edge[2].cross(edge[0]);
  const Vector3 x = p - face[0];
  const Scalar inverse = 1 / dot(n, n);
  // Coordinates of the foot along the edges at vertex 0. False for NaN, of a face without area.
  const Scalar v = -(dot(x.cross(edge[2]), n) * inverse);
  const Scalar w = dot(edge[0].cross(x), n) * inverse;
  if (!(v >= 0 && w >= 0 && v + w <= 1)) return std::nullopt;
  const Vector3 ve = v * edge[0];
  const Vector3 we = w * edge[2];
  const Vector3 D = (x - ve) + we;
  const Vector3 foot = (face[0] + ve) - we;
  Witness result;
  result.D = is_face_of_a ? D : Vector3(-D);
  result.m = dot(n, result.D) < 0 ? Vector3(-n) : n;
  result.p_a = is_face_of_a ? foot : p;
  result.p_b = is_face_of_a ? p : foot;
  result.place_a = is_face_of_a ? kFaceCode : vertex;
  result.place_b = is_face_of_a ? vertex : kFaceCode;
  return result;
}

std::optional<Witness> witness_of(const TrianglePair& pair, const Feature& a, const Feature& b) {
  const bool is_face_of_a = a.kind == FeatureKind::Face;
  if (is_face_of_a || b.kind == FeatureKind::Face) {
    const Feature& other = is_face_of_a ? b : a;
    if (other.kind != FeatureKind::Vertex || !is_corner(other.vertices[0])) return std::nullopt;
    return vertex_above_face(pair, is_face_of_a, other.vertices[0]);
  }
  const std::optional<int> edge_a = edge_with(a);
  const std::optional<int> edge_b = edge_with(b);
  if (!edge_a || !edge_b) return std::nullopt;
  return edge_witness(pair, *edge_a, *edge_b);
}

}  // namespace

TriangleDistance warm_triangle_distance(const Triangle& a, const Triangle& b, const Feature& last_a,
                                        const Feature& last_b) {
  const TrianglePair pair(a, b);
  if (pair.size >= kSmallestTriangleSize && pair.size <= kLargestTriangleSize) {
    if (const std::optional<Witness> witness = witness_of(pair, last_a, last_b)) {
      const Bounds bounds = prove(pair, witness->m, witness->D);
      if (is_certified(pair, bounds.lower, bounds.upper)) return result_of(*witness, bounds);
    }
  }
  return triangle_distance(a, b);
}

}  // namespace dyop
