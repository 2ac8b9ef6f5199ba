// SPDX-License-Identifier: BSD-3-Clause
#include "distance/core_distance.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/simd_pair.h"
#include "core/tolerance.h"
#include "distance/point_search.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/geometry/half_space.h"

// Each closed form proposes the nearest points of two cores and a direction. Neither is trusted:
// the upper bound is the length between the points, which lie on the cores, and the lower bound is
// the slab gap along the direction, which never exceeds the distance. Where the two do not meet up
// to rounding the form returns false.
//
// Rounding. All vectors are relative to A's origin; sizes below are |p_AB| + both bounding radii.
// Turning a vector by a rotation matrix errs by gamma_3 per coordinate, less than 6u of its length,
// and by as much again because the matrix is orthonormal only up to rounding; a difference of
// points adds u of the size per coordinate. A slab gap is a sum of at most three scalar products of
// such vectors with a unit vector that is one up to 3u, 4u of the size each. A length adds 3u of
// itself. All this stays below 40u of the size, and kPoseNoise allows 64u.
namespace dyop::distance_internal {
namespace {

// A core in the common frame.
struct PlacedCore {
  const SimpleCore& core;
  const Matrix3& R;
  Vector3 center;
  bool is_turned;  // R is not the identity

  Vector3 half() const { return R * core.half_extents; }  // of a segment
};

// Nearest points of two cores; `gap` is their slab gap along nhat, from the first to the second.
struct CorePoints {
  Vector3 p_a;
  Vector3 p_b;
  Vector3 nhat;
  Scalar gap;
  Scalar length;  // between the points
  Feature feature_a;
  Feature feature_b;
};

// Squared sine between two segments above which the normal of both is their cross product. Speed
// only: the certificate decides.
constexpr Scalar kCrossingSquare = 0.01;

// Where a point of a segment lies: -1 at vertex 0, 1 at vertex 1.
Feature segment_feature(Scalar s) {
  if (s <= -1) return {FeatureKind::Vertex, {0}};
  if (s >= 1) return {FeatureKind::Vertex, {1}};
  return {FeatureKind::Edge, {0, 1}};
}

bool is_inside(Scalar s) {
  return s > -1 && s < 1;
}

// The place on a segment that is `along` / `length_sq` half lengths from its centre; a segment
// without length is a point.
Scalar clamped_ratio(Scalar along, Scalar length_sq) {
  if (!(length_sq > 0)) return 0;
  return std::clamp(along / length_sq, Scalar(-1), Scalar(1));
}

// The unit vector along d, or along x if it has no length.
Vector3 unit_or_x(const Vector3& d) {
  const Scalar length = d.norm();
  return length > 0 ? Vector3(d / length) : Vector3::UnitX();
}

// d without its part along a direction, which rounding left there.
Vector3 across(const Vector3& d, const Vector3& direction, Scalar length_sq) {
  return length_sq > 0 ? Vector3(d - direction * (direction.dot(d) / length_sq)) : d;
}

bool point_point(const PlacedCore& a, const PlacedCore& b, CorePoints& points) {
  points.p_a = a.center;
  points.p_b = b.center;
  const Vector3 v = b.center - a.center;
  points.length = points.gap = v.norm();
  points.nhat = points.length > 0 ? Vector3(v / points.length) : Vector3::UnitX();
  points.feature_a = points.feature_b = {FeatureKind::Vertex, {0}};
  return true;
}

bool point_segment(const PlacedCore& a, const PlacedCore& b, CorePoints& points) {
  const Vector3 half = b.half();
  const Vector3 to_center = b.center - a.center;
  const Scalar half_sq = half.squaredNorm();
  const Scalar s = clamped_ratio(-to_center.dot(half), half_sq);
  const Vector3 v = to_center + s * half;
  points.p_a = a.center;
  points.p_b = b.center + s * half;
  points.length = v.norm();
  points.nhat = unit_or_x(is_inside(s) ? across(v, half, half_sq) : v);
  points.gap = points.nhat.dot(to_center) - std::abs(points.nhat.dot(half));
  points.feature_a = {FeatureKind::Vertex, {0}};
  points.feature_b = segment_feature(s);
  return true;
}

// The places s and t on two segments with centres d apart at which they are nearest: the least of
// a convex quadratic over a square ([Ericson2005] 5.1.9).
std::pair<Scalar, Scalar> nearest_places(const Vector3& d, const Vector3& half_a, Scalar a_sq,
                                         const Vector3& half_b, Scalar b_sq) {
  const Scalar ab = half_a.dot(half_b);
  const Scalar ad = half_a.dot(d);
  const Scalar bd = half_b.dot(d);
  Scalar s = clamped_ratio(ad * b_sq - ab * bd, a_sq * b_sq - ab * ab);
  const Scalar t = b_sq > 0 ? (ab * s - bd) / b_sq : 0;
  if (t >= -1 && t <= 1 && b_sq > 0) return {s, t};
  const Scalar end = b_sq > 0 ? std::clamp(t, Scalar(-1), Scalar(1)) : 0;
  s = clamped_ratio(ad + ab * end, a_sq);
  return {s, end};
}

bool segment_segment(const PlacedCore& a, const PlacedCore& b, CorePoints& points) {
  const Vector3 half_a = a.half();
  const Vector3 half_b = b.half();
  const Vector3 d = b.center - a.center;
  const Scalar a_sq = half_a.squaredNorm();
  const Scalar b_sq = half_b.squaredNorm();
  const auto [s, t] = nearest_places(d, half_a, a_sq, half_b, b_sq);
  points.p_a = a.center + s * half_a;
  points.p_b = b.center + t * half_b;
  const Vector3 v = d + (t * half_b - s * half_a);
  points.length = v.norm();
  Vector3 direction = v;
  if (is_inside(s) && is_inside(t)) {
    const Vector3 normal = half_a.cross(half_b);
    if (normal.squaredNorm() > kCrossingSquare * a_sq * b_sq) {
      direction = normal.dot(d) >= 0 ? normal : Vector3(-normal);
    } else {
      direction = a_sq > b_sq ? across(v, half_a, a_sq) : across(v, half_b, b_sq);
    }
  } else if (is_inside(s)) {
    direction = across(v, half_a, a_sq);
  } else if (is_inside(t)) {
    direction = across(v, half_b, b_sq);
  }
  points.nhat = unit_or_x(direction);
  points.gap =
      points.nhat.dot(d) - std::abs(points.nhat.dot(half_a)) - std::abs(points.nhat.dot(half_b));
  points.feature_a = segment_feature(s);
  points.feature_b = segment_feature(t);
  return true;
}

// --- boxes --------------------------------------------------------------------------------------

// The corner nearest to a point in the box's frame.
std::int32_t corner_towards(const Vector3& q) {
  std::int32_t number = 0;
  for (int k = 0; k < 3; ++k) number |= static_cast<std::int32_t>(!std::signbit(q[k])) << k;
  return number;
}

// The feature of a box on the side of a corner. `beyond`: one bit per axis along which what it
// faces lies outside.
constexpr Feature facing_feature(std::int32_t corner, unsigned beyond) {
  if (beyond == 7) return {FeatureKind::Vertex, {corner}};
  std::int32_t others[2] = {0, 0};
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    if ((beyond >> k & 1U) == 0 && count < 2) others[count++] = corner ^ (1 << k);
  }
  if (count == 1) {
    return {FeatureKind::Edge, {std::min(corner, others[0]), std::max(corner, others[0])}};
  }
  // Half of the face: the corner and its two neighbours.
  Feature feature{FeatureKind::Face, {corner, others[0], others[1]}};
  std::sort(feature.vertices.begin(), feature.vertices.end());
  return feature;
}

constexpr auto kFacingFeatures = [] {
  std::array<std::array<Feature, 8>, 8> table{};
  for (std::int32_t corner = 0; corner < 8; ++corner) {
    for (unsigned beyond = 0; beyond < 8; ++beyond) {
      table[static_cast<std::size_t>(corner)][beyond] = facing_feature(corner, beyond);
    }
  }
  return table;
}();

// The feature of a box that faces a point q in its frame.
const Feature& box_feature(const Vector3& q, unsigned beyond) {
  return kFacingFeatures[static_cast<std::size_t>(corner_towards(q))][beyond];
}

unsigned bits_beyond(const Vector3& v) {
  return static_cast<unsigned>(v[0] != 0) | static_cast<unsigned>(v[1] != 0) << 1 |
         static_cast<unsigned>(v[2] != 0) << 2;
}

// From the box to a point q in its frame.
Vector3 beyond_box(const Vector3& q, const Vector3& half) {
  return q - q.cwiseMax(-half).cwiseMin(half);
}

// The axis along which a body with this centre and these extents in the box's frame stands out
// farthest; used where the two overlap.
struct OutwardAxis {
  int axis = 0;
  Scalar gap = -kInfinity;

  OutwardAxis(const Vector3& center, const Vector3& extents, const Vector3& half) {
    for (int k = 0; k < 3; ++k) {
      const Scalar along = std::abs(center[k]) - extents[k] - half[k];
      if (along > gap) {
        gap = along;
        axis = k;
      }
    }
  }
  Vector3 direction(const Vector3& center) const {
    Vector3 n = Vector3::Zero();
    n[axis] = std::signbit(center[axis]) ? -1 : 1;
    return n;
  }
};

// The box is the second core, so directions from the box to the other are turned around.
void finish_box(const PlacedCore& box, const Vector3& q, const Vector3& v, const Vector3& outwards,
                CorePoints& points) {
  points.p_a = box.center + box.R * q;
  points.p_b = box.center + box.R * (q - v);
  points.nhat = -(box.R * outwards);
}

bool point_box(const PlacedCore& a, const PlacedCore& b, CorePoints& points) {
  const Vector3& half = b.core.half_extents;
  const Vector3 q = b.R.transpose() * (a.center - b.center);
  const Vector3 v = beyond_box(q, half);
  points.length = points.gap = v.norm();
  points.feature_a = {FeatureKind::Vertex, {0}};
  unsigned beyond = bits_beyond(v);
  if (points.length > 0) {
    finish_box(b, q, v, v / points.length, points);
  } else {
    const OutwardAxis outward(q, Vector3::Zero(), half);
    points.gap = outward.gap;
    beyond = 1U << outward.axis;
    finish_box(b, q, v, outward.direction(q), points);
  }
  points.feature_b = box_feature(q, beyond);
  return true;
}

// Half the derivative of the squared distance from the box of the point q(t) = center + t half.
Scalar slope_at(Scalar t, const Vector3& center, const Vector3& along, const Vector3& half) {
  return along.dot(beyond_box(center + t * along, half));
}

// Where a segment is nearest to a box: the slope is continuous, never falls, and is linear between
// the places where the segment passes the planes of the faces.
Scalar nearest_place(const Vector3& center, const Vector3& along, const Vector3& half) {
  Scalar low = -1;
  Scalar slope_low = slope_at(low, center, along, half);
  if (slope_low >= 0) return low;
  Scalar high = 1;
  Scalar slope_high = slope_at(high, center, along, half);
  if (slope_high <= 0) return high;
  for (int k = 0; k < 3; ++k) {
    for (const Scalar side : {-half[k], half[k]}) {
      const Scalar t = (side - center[k]) / along[k];
      if (!(t > low && t < high)) continue;  // also for a segment parallel to the face
      const Scalar slope = slope_at(t, center, along, half);
      if (slope < 0) {
        low = t;
        slope_low = slope;
      } else {
        high = t;
        slope_high = slope;
      }
    }
  }
  return low + (high - low) * (slope_low / (slope_low - slope_high));
}

// The direction from the box to a place inside a segment: perpendicular to the segment and to the
// feature of the box, which rounding of v would tilt.
Vector3 outwards_at(const Vector3& v, unsigned beyond, const Vector3& along) {
  const bool is_edge = beyond == 3 || beyond == 5 || beyond == 6;
  if (!is_edge) return beyond == 7 ? across(v, along, along.squaredNorm()) : v;
  const int i = (beyond & 1U) != 0 ? 0 : 1;
  const int j = (beyond & 4U) != 0 ? 2 : 1;
  Vector3 n = Vector3::Zero();
  n[i] = -along[j];
  n[j] = along[i];
  if (!(n.squaredNorm() > kCrossingSquare * along.squaredNorm())) return v;
  return n.dot(v) >= 0 ? n : Vector3(-n);
}

bool segment_box(const PlacedCore& a, const PlacedCore& b, CorePoints& points) {
  const Vector3& half = b.core.half_extents;
  const Vector3 center = b.R.transpose() * (a.center - b.center);
  const Vector3 along = b.R.transpose() * a.half();
  const Scalar t = nearest_place(center, along, half);
  const Vector3 q = center + t * along;
  const Vector3 v = beyond_box(q, half);
  points.length = v.norm();
  points.feature_a = segment_feature(t);
  unsigned beyond = bits_beyond(v);
  Vector3 outwards;
  if (points.length > 0) {
    outwards = unit_or_x(is_inside(t) ? outwards_at(v, beyond, along) : v);
  } else {
    const OutwardAxis outward(center, along.cwiseAbs(), half);
    outwards = outward.direction(center);
    beyond = 1U << outward.axis;
  }
  points.gap = outwards.dot(center) - std::abs(outwards.dot(along)) - outwards.cwiseAbs().dot(half);
  finish_box(b, q, v, outwards, points);
  points.feature_b = box_feature(q, beyond);
  return true;
}

// --- two boxes ----------------------------------------------------------------------------------

// Two boxes in the frame of the first: x = t + R y for a point y of the second's frame.
struct BoxesInOne {
  Matrix3 R;
  Vector3 t;
  const Vector3& half_a;
  const Vector3& half_b;

  // The slab gap along a unit direction, from the first to the second.
  Scalar gap_along(const Vector3& n) const {
    return n.dot(t) - n.cwiseAbs().dot(half_a) - (R.transpose() * n).cwiseAbs().dot(half_b);
  }
};

// The number of the least of some numbers >= 0, and the number itself but for its last digits: as
// integers they keep their order, and leave room for a place. Which of them is the least is as good
// as random, so a branch would be mispredicted.
template <std::uint64_t kCount>
struct LeastOf {
  std::size_t place = 0;
  std::uint64_t key = 0;

  explicit LeastOf(const std::array<Scalar, kCount>& numbers) {
    constexpr std::uint64_t kPlaces = std::bit_ceil(kCount) - 1;
    std::array<std::uint64_t, kCount> keys;
    for (std::uint64_t i = 0; i < kCount; ++i) {
      keys[i] = (std::bit_cast<std::uint64_t>(numbers[i]) & ~kPlaces) | i;
    }
    key = keys[0];
    for (std::uint64_t i = 1; i < kCount; ++i) key = std::min(key, keys[i]);
    place = key & kPlaces;
  }
};

// The corner of a posed box that is nearest to the box of these half extents about the origin, by
// its number, with its squared distance. `spokes` are the posed half axes.
LeastOf<8> nearest_corner(const Vector3& center, const Matrix3& spokes, const Vector3& half) {
  using core_internal::LanePair;
  // Two corners side by side, which differ in the first axis.
  LanePair squares[4] = {LanePair(0), LanePair(0), LanePair(0), LanePair(0)};
  for (int k = 0; k < 3; ++k) {
    const LanePair along(center[k] - spokes(k, 0), center[k] + spokes(k, 0));
    const LanePair y(spokes(k, 1));
    const LanePair z(spokes(k, 2));
    const LanePair low = along - y;
    const LanePair high = along + y;
    const LanePair corners[4] = {low - z, high - z, low + z, high + z};
    for (int i = 0; i < 4; ++i) {
      const LanePair beyond = larger(magnitude(corners[i]) - LanePair(half[k]), LanePair(0));
      squares[i] = squares[i] + beyond * beyond;
    }
  }
  std::array<Scalar, 8> numbers;
  for (std::size_t i = 0; i < 4; ++i) squares[i].store(&numbers[2 * i]);
  return LeastOf<8>(numbers);
}

Vector3 corner_of(const Vector3& half, std::int32_t number) {
  constexpr Scalar kSigns[2] = {-1, 1};
  return {kSigns[number & 1] * half[0], kSigns[number >> 1 & 1] * half[1],
          kSigns[number >> 2 & 1] * half[2]};
}

// A corner of the second box, at q in the frame of the first; v leads there from the first.
void finish_corner(const BoxesInOne& pair, std::int32_t corner, CorePoints& points) {
  const Vector3 q = pair.t + pair.R * corner_of(pair.half_b, corner);
  const Vector3 v = beyond_box(q, pair.half_a);
  points.length = v.norm();
  unsigned beyond = bits_beyond(v);
  if (points.length > 0) {
    points.nhat = v / points.length;
  } else {
    const OutwardAxis outward(pair.t, pair.R.cwiseAbs() * pair.half_b, pair.half_a);
    points.nhat = outward.direction(pair.t);
    beyond = 1U << outward.axis;
  }
  points.gap = pair.gap_along(points.nhat);
  points.p_a = q - v;
  points.p_b = q;
  points.feature_a = box_feature(q, beyond);
  points.feature_b = {FeatureKind::Vertex, {corner}};
}

// A pair of edges of two boxes, one parallel to axis i of the first, one to axis j of the second,
// that face each other along the normal of both.
struct FacingEdges {
  int i = 0;
  int j = 0;
  Scalar gap = 0;
  Vector3 nhat = Vector3::Zero();  // from the first to the second, in the frame of the first

  // Picks the pair of edges, of nine, whose slabs are farthest apart; gap 0: none separates the
  // boxes.
  explicit FacingEdges(const BoxesInOne& pair) {
    const Matrix3& R = pair.R;
    const Matrix3 abs_R = R.cwiseAbs();
    std::array<Scalar, 9> slabs;
    std::array<Scalar, 9> alongs;
    std::array<Scalar, 9> sines_sq;
    std::array<Scalar, 9> nearness;
    for (int k = 0; k < 3; ++k) {
      const int k1 = (k + 1) % 3;
      const int k2 = (k + 2) % 3;
      for (int m = 0; m < 3; ++m) {
        const int m1 = (m + 1) % 3;
        const int m2 = (m + 2) % 3;
        const auto n = static_cast<std::size_t>(3 * k + m);
        sines_sq[n] = R(k1, m) * R(k1, m) + R(k2, m) * R(k2, m);
        alongs[n] = pair.t[k2] * R(k1, m) - pair.t[k1] * R(k2, m);
        slabs[n] = std::abs(alongs[n]) - pair.half_a[k1] * abs_R(k2, m) -
                   pair.half_a[k2] * abs_R(k1, m) - pair.half_b[m1] * abs_R(k, m2) -
                   pair.half_b[m2] * abs_R(k, m1);
      }
    }
    for (std::size_t n = 0; n < 9; ++n) {
      const Scalar slab = std::max(slabs[n], Scalar(0));
      // literal: squared sine below which edges are parallel; corners then face each other.
      nearness[n] = (sines_sq[n] > 1e-12 ? sines_sq[n] : kInfinity) / (slab * slab);
    }
    const std::size_t n = LeastOf<9>(nearness).place;
    if (!(nearness[n] < kInfinity)) return;
    i = static_cast<int>(n / 3);
    j = static_cast<int>(n % 3);
    const Scalar sine = std::sqrt(sines_sq[n]);
    gap = slabs[n] / sine;
    const Scalar sign = std::copysign(1 / sine, alongs[n]);
    const int k1 = (i + 1) % 3;
    const int k2 = (i + 2) % 3;
    nhat.setZero();
    nhat[k1] = -sign * R(k2, j);
    nhat[k2] = sign * R(k1, j);
  }
};

// The edge of a box parallel to an axis that is farthest along n: its middle, and its feature.
Vector3 farthest_edge(const Vector3& half, int axis, const Vector3& n, Feature& feature) {
  std::int32_t corner = corner_towards(n) & ~(1 << axis);
  feature = {FeatureKind::Edge, {corner, corner | 1 << axis}};
  Vector3 middle = corner_of(half, corner);
  middle[axis] = 0;
  return middle;
}

bool edge_edge(const BoxesInOne& pair, CorePoints& points) {
  const FacingEdges edges(pair);
  if (!(edges.gap > 0)) return false;
  const Vector3 middle_a = farthest_edge(pair.half_a, edges.i, edges.nhat, points.feature_a);
  const Vector3 n_B = pair.R.transpose() * edges.nhat;
  const Vector3 middle_b =
      pair.t + pair.R * farthest_edge(pair.half_b, edges.j, -n_B, points.feature_b);
  const Vector3 along_a = Vector3::Unit(edges.i) * pair.half_a[edges.i];
  const Vector3 along_b = pair.R.col(edges.j) * pair.half_b[edges.j];
  const auto [s, t] = nearest_places(middle_b - middle_a, along_a, along_a.squaredNorm(), along_b,
                                     along_b.squaredNorm());
  if (!is_inside(s) || !is_inside(t)) return false;
  points.p_a = middle_a + s * along_a;
  points.p_b = middle_b + t * along_b;
  points.length = (points.p_b - points.p_a).norm();
  points.nhat = edges.nhat;
  points.gap = pair.gap_along(edges.nhat);
  return true;
}

// Two boxes apart are nearest at a corner of one of them, or where two edges cross.
bool box_box(const PlacedCore& a, const PlacedCore& b, CorePoints& points) {
  const Vector3& half_a = a.core.half_extents;
  const Vector3& half_b = b.core.half_extents;
  const Vector3 between = b.center - a.center;
  const BoxesInOne pair{a.is_turned ? Matrix3(a.R.transpose() * b.R) : b.R,
                        a.is_turned ? Vector3(a.R.transpose() * between) : between, half_a, half_b};
  const BoxesInOne turned{pair.R.transpose(), -(pair.R.transpose() * pair.t), half_b, half_a};
  const LeastOf<8> of_b = nearest_corner(pair.t, pair.R * half_b.asDiagonal(), half_a);
  const LeastOf<8> of_a = nearest_corner(turned.t, turned.R * half_a.asDiagonal(), half_b);
  bool is_of_b = (of_b.key | 7) <= (of_a.key | 7);
  const auto corner = static_cast<std::int32_t>(is_of_b ? of_b.place : of_a.place);
  finish_corner(is_of_b ? pair : turned, corner, points);
  const Scalar size = pair.t.lpNorm<1>() + a.core.bounding_radius + b.core.bounding_radius;
  if (points.length > 0 && !(points.length - points.gap <= kPoseNoise / 2 * size)) {
    if (!edge_edge(pair, points)) return false;
    is_of_b = true;
  }
  const PlacedCore& first = is_of_b ? a : b;
  const Scalar sign = is_of_b ? 1 : -1;
  const Vector3 of_first = first.center + first.R * points.p_a;
  const Vector3 of_second = first.center + first.R * points.p_b;
  points.nhat = sign * (first.R * points.nhat);
  points.p_a = is_of_b ? of_first : of_second;
  points.p_b = is_of_b ? of_second : of_first;
  const Feature features[2] = {points.feature_a, points.feature_b};
  points.feature_a = features[is_of_b ? 0 : 1];
  points.feature_b = features[is_of_b ? 1 : 0];
  return true;
}

// --- the table ----------------------------------------------------------------------------------

using Form = bool (*)(const PlacedCore&, const PlacedCore&, CorePoints&);

template <Form kForm>
bool turned(const PlacedCore& a, const PlacedCore& b, CorePoints& points) {
  if (!kForm(b, a, points)) return false;
  std::swap(points.p_a, points.p_b);
  std::swap(points.feature_a, points.feature_b);
  points.nhat = -points.nhat;
  return true;
}

bool no_form(const PlacedCore&, const PlacedCore&, CorePoints&) {
  return false;
}

// By the kinds of A (rows) and B: General, Point, Segment, Box. Of half-spaces gjk_distance() knows
// the closed form against every convex shape.
constexpr std::array<std::array<Form, kCoreKinds>, kCoreKinds> kForms{{
    {no_form, no_form, no_form, no_form, no_form},
    {no_form, point_point, point_segment, point_box, no_form},
    {no_form, turned<point_segment>, segment_segment, segment_box, no_form},
    {no_form, turned<point_box>, turned<segment_box>, box_box, no_form},
    {no_form, no_form, no_form, no_form, no_form},
}};

PlacedCore placed(const SimpleCore& core, const Matrix3& R, const Vector3& origin, bool is_turned) {
  return {core, R, core.is_centred ? origin : Vector3(origin + R * core.center), is_turned};
}

// The rounded shapes from their cores: bounds and witness points as gjk_distance() gives them.
void add_radii(const CorePoints& points, Scalar radius_a, Scalar radius_b, Scalar noise,
               NearestPoints& result) {
  const Scalar radii = radius_a + radius_b;
  const Scalar lower = points.gap - radii - noise;
  result.lower = lower > 0 ? lower : 0;
  result.upper = std::max(Scalar(0), points.length - radii + noise);
  result.is_overlapping = !(lower > 0) && points.length - radii <= noise;
  result.nhat_AB = points.nhat;
  result.feature_a = points.feature_a;
  result.feature_b = points.feature_b;
  result.p_a = points.p_a;
  result.p_b = points.p_b;
  if (!(radii > 0)) return;
  // Along the witness segment, so that the points are no farther apart than `upper`. For
  // overlapping shapes, a point in both.
  const Scalar share = points.length > radii ? 1 / points.length : 1 / radii;
  if (!(share < kInfinity)) return;  // radii below the smallest normal numbers move no point
  const Vector3 v = points.p_b - points.p_a;
  result.p_a += (radius_a * share) * v;
  result.p_b -= (radius_b * share) * v;
}

}  // namespace

bool core_distance(const SimpleCore& a, const SimpleCore& b, const CorePlaces& places,
                   NearestPoints& result) {
  const Form form = kForms[static_cast<std::size_t>(a.kind)][static_cast<std::size_t>(b.kind)];
  if (form == no_form) return false;
  const Scalar size = places.p_AB_F.lpNorm<1>() + a.bounding_radius + b.bounding_radius;
  // literal: fourth powers of lengths stay in the range of double; false for NaN.
  if (!(size > 0x1p-200 && size < 0x1p200)) return false;
  CorePoints points;
  const PlacedCore placed_a = placed(a, places.R_FA, Vector3::Zero(), !places.is_in_a);
  if (!form(placed_a, placed(b, places.R_FB, places.p_AB_F, true), points)) return false;
  const Scalar noise = kPoseNoise * size;
  // The certificate; false for NaN. Shapes that overlap need none.
  const Scalar radii = a.rounding_radius + b.rounding_radius;
  if (!(points.length - points.gap <= noise || points.length - radii <= noise / 2)) return false;
  add_radii(points, a.rounding_radius, b.rounding_radius, noise, result);
  return true;
}

namespace {

// The half-space normal . p <= offset against a shape S at a pose, all in one frame.
HalfSpaceGap gap_above(const Vector3& normal, Scalar offset, const ConvexShape& shape,
                       const RigidPose& X_FS) {
  const Vector3 down_S = -(X_FS.rotation().transpose() * normal);
  const SupportPoint support = shape.core_support(down_S);
  HalfSpaceGap gap;
  gap.normal = normal;
  gap.lowest = X_FS * support.point - shape.rounding_radius() * normal;
  if (support.vertex) gap.feature = {FeatureKind::Vertex, {*support.vertex}};
  gap.height = normal.dot(gap.lowest) - offset;
  const HalfSpace* other = as_half_space(shape);
  const Scalar size = other ? std::abs(other->offset()) : shape.bounding_radius();
  // literal: more than all underflow, for shapes as small as the smallest numbers.
  gap.noise =
      kPoseNoise * (length_for_noise(X_FS.translation()) + size + std::abs(offset)) + 0x1p-1064;
  return gap;
}

}  // namespace

std::optional<HalfSpaceGap> half_space_gap(const ConvexShape& a, const ConvexShape& b,
                                           const RigidPose& X_AB) {
  if (const HalfSpace* plane = as_half_space(a)) {
    return gap_above(plane->normal(), plane->offset(), b, X_AB);
  }
  const HalfSpace* plane = as_half_space(b);
  if (!plane) return std::nullopt;
  const Vector3 normal = X_AB.rotation() * plane->normal();
  const Scalar along = normal.dot(X_AB.translation());
  HalfSpaceGap gap = gap_above(normal, plane->offset() + along, a, RigidPose());
  gap.noise += kPoseNoise * (length_for_noise(X_AB.translation()) + std::abs(plane->offset()));
  gap.is_of_b = true;
  return gap;
}

NearestPoints HalfSpaceGap::nearest() const {
  NearestPoints result;
  if (!std::isfinite(height)) return result;
  result.lower = std::max(Scalar(0), height - noise);
  result.upper = std::max(Scalar(0), height) + noise;
  result.is_overlapping = height <= noise;
  result.nhat_AB = is_of_b ? Vector3(-normal) : normal;
  // Of shapes that overlap a point in both.
  const Vector3 foot = lowest - std::max(Scalar(0), height) * normal;
  result.p_a = is_of_b ? lowest : foot;
  result.p_b = is_of_b ? foot : lowest;
  (is_of_b ? result.feature_a : result.feature_b) = feature;
  return result;
}

namespace {

// A segment is the triangle (0, 1, 1): names vertex 2 as 1, and drops what is there twice.
Feature feature_of_segment(const Feature& local) {
  bool has[2] = {false, false};
  for (std::size_t k = 0; k < local.vertex_count(); ++k) has[local.vertices[k] == 0 ? 0 : 1] = true;
  if (has[0] && has[1]) return {FeatureKind::Edge, {0, 1}};
  return {FeatureKind::Vertex, {has[0] ? 0 : 1}};
}

NearestPoints from_triangle_to_point(const Triangle& a, const Vector3& p) {
  const PointTriangleDistance found = point_triangle_distance(p, a);
  NearestPoints result;
  result.lower = found.lower;
  result.upper = found.upper;
  result.p_a = found.p_C;
  result.p_b = p;
  result.nhat_AB = found.nhat_C;
  result.feature_a = found.feature;
  result.feature_b = {FeatureKind::Vertex, {0}};
  result.is_overlapping = !(found.lower > 0) && (p - found.p_C).norm() <= found.upper / 2;
  return result;
}

NearestPoints from_triangle_to_segment(const Triangle& a, const Vector3& p, const Vector3& q) {
  NearestPoints result = triangle_distance(a, {p, q, q});
  result.feature_b = feature_of_segment(result.feature_b);
  return result;
}

}  // namespace

bool triangle_core_distance(const Triangle& a, const SimpleCore& b, const RigidPose& X_AB,
                            NearestPoints& result) {
  if (b.kind != CoreKind::Point && b.kind != CoreKind::Segment) return false;
  const Vector3 center = X_AB * b.center;
  if (b.kind == CoreKind::Point) {
    result = from_triangle_to_point(a, center);
  } else {
    const Vector3 half = X_AB.rotation() * b.half_extents;
    result = from_triangle_to_segment(a, center - half, center + half);
  }
  const Scalar radius = b.rounding_radius;
  if (!(radius > 0)) return true;
  // The sums below err by 2u of their terms.
  const Scalar noise = 4 * kUnitRoundoff * (result.upper + radius);
  const Vector3 v = result.p_b - result.p_a;
  const Scalar length = v.norm();
  const Scalar lower = result.lower - radius - noise;
  result.lower = lower > 0 ? lower : 0;
  result.is_overlapping =
      result.is_overlapping || (!(lower > 0) && length - radius <= kPoseNoise * (length + radius));
  result.upper = std::max(Scalar(0), result.upper - radius) + noise;
  // A point in both, where they overlap.
  const Scalar offset = length > radius ? radius / length : Scalar(1);
  result.p_b -= offset * v;
  return true;
}

}  // namespace dyop::distance_internal
