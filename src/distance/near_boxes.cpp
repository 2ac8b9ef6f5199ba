// SPDX-License-Identifier: BSD-3-Clause
#include "distance/near_boxes.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/tolerance.h"
#include "geometry/box_surface.h"

namespace dyop::distance_internal {
namespace {

using geometry_internal::kBoxEdgeAt;
using geometry_internal::kBoxTriangles;

// Half extents whose fourth powers are normal numbers: from here, up to the inverse.
constexpr Scalar kLeastBoxSize = 0x1p-200;  // literal: products of four stay far from underflow
// A box this flat has faces whose corners are sharper than a sine of 1/1024, and no certain plane.
constexpr Scalar kMostFlatness = 512;

bool is_ordinary(const ConvexShape& shape, const TriangleMesh* surface) {
  const SimpleCore& core = shape.simple_core();
  if (core.kind != CoreKind::Box || !surface) return false;
  const Scalar least = core.half_extents.minCoeff();
  const Scalar most = core.half_extents.maxCoeff();
  return least >= kLeastBoxSize && most <= 1 / kLeastBoxSize && most <= kMostFlatness * least &&
         surface->triangles().size() == kBoxTriangles.size() &&
         std::memcmp(surface->triangles().data(), kBoxTriangles.data(), sizeof kBoxTriangles) == 0;
}

// The two triangles of each face, -x, +x, -y, +y, -z, +z. In its plane, with the coordinates b < c,
// the diagonal goes from corner (-, -) to (+, +); the second triangle is where b is positive.
constexpr std::array<std::array<std::uint16_t, 2>, 6> kTrianglesOfFace = [] {
  std::array<std::array<std::uint16_t, 2>, 6> result{};
  for (std::size_t t = 0; t < kBoxTriangles.size(); ++t) {
    const std::size_t axis = t / 4;
    const std::size_t b = axis == 0 ? 1 : 0;
    const std::size_t c = axis == 2 ? 1 : 2;
    for (const std::int32_t corner : kBoxTriangles[t]) {
      const bool is_b = (corner >> b & 1) != 0;
      const bool is_c = (corner >> c & 1) != 0;
      if (is_b != is_c) result[t / 2][is_b ? 1 : 0] = std::uint16_t(1U << t);
    }
  }
  return result;
}();

// c - x - y, c + x - y, c - x + y, c + x + y.
std::array<Scalar, 4> signed_sums(Scalar c, Scalar x, Scalar y) {
  return {c - x - y, c + x - y, c - x + y, c + x + y};
}

}  // namespace

bool NearBoxes::serves(const ConvexShape& a, const TriangleMesh* surface_a, const ConvexShape& b,
                       const TriangleMesh* surface_b) {
  return is_ordinary(a, surface_a) && is_ordinary(b, surface_b);
}

// A box, its corners in the other's frame by coordinate, and the other's planes, bit 2 k for -k and
// 2 k + 1 for +k, that a corner is farther beyond than the reach.
struct NearBoxes::Side {
  Side(const Vector3& own, const Vector3& other, const RigidPose& X_OS, Scalar reach);

  // Bit `place` of edges along an axis that are not wholly beyond one plane.
  unsigned near_edges(std::size_t axis) const;

  const Vector3& half;
  std::array<std::array<Scalar, 8>, 3> corners;
  std::array<unsigned, 8> beyond{};
};

NearBoxes::Side::Side(const Vector3& own, const Vector3& other, const RigidPose& X_OS, Scalar reach)
    : half(own) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Vector3 along = X_OS.rotation().row(k).transpose().cwiseProduct(own);
    const Scalar center = X_OS.translation()[k];
    const auto low = signed_sums(center - along.z(), along.x(), along.y());
    const auto high = signed_sums(center + along.z(), along.x(), along.y());
    std::array<Scalar, 8>& row = corners[std::size_t(k)];
    std::copy(low.begin(), low.end(), row.begin());
    std::copy(high.begin(), high.end(), row.begin() + 4);
    const Scalar limit = other[k] + reach;
    for (std::size_t v = 0; v < 8; ++v) {
      beyond[v] |= unsigned(row[v] < -limit) << (2 * k) | unsigned(row[v] > limit) << (2 * k + 1);
    }
  }
}

unsigned NearBoxes::Side::near_edges(std::size_t axis) const {
  unsigned near = 0;
  for (std::size_t place = 0; place < 4; ++place) {
    const std::size_t v = (place & 1) << ((axis + 1) % 3) | (place >> 1) << ((axis + 2) % 3);
    near |= unsigned((beyond[v] & beyond[v | std::size_t(1) << axis]) == 0) << place;
  }
  return near;
}

// The edges along axis i of A and j of B, in A's frame: along the unit vectors e and f, their middle
// points a and b. With n = e x f and r = b - a the lines are n . r / |n| apart; where they are
// nearest is (r - f (f . r)) . e / n^2 from a along e, (e (e . r) - r) . f / n^2 from b along f. All
// three are a sum of one term of A's edge and one of B's. Edges by their places, as in kBoxEdgeAt.
class NearBoxes::EdgeAxes {
 public:
  EdgeAxes(std::size_t i, std::size_t j, const Vector3& half_a, const Vector3& half_b,
           const RigidPose& X_AB);

  Scalar sine() const { return sine_; }
  Scalar height(std::size_t a, std::size_t b) const { return height_b_[b] - height_a_[a]; }
  // Whether the lines come nearest within both edges, each longer by `more`, or by `margin` / n^2.
  bool are_beside(std::size_t a, std::size_t b, Scalar more, Scalar margin) const;
  // The places of A's edges, and of B's, with no face beside them that rises by more than `limit` / |n|
  // along n, if `is_up`, or else along -n.
  unsigned admitting_a(bool is_up, Scalar limit) const;
  unsigned admitting_b(bool is_up, Scalar limit) const;
  EdgePair pair(std::size_t a, std::size_t b) const {
    return {std::uint8_t(kBoxEdgeAt[i_][a]), std::uint8_t(kBoxEdgeAt[j_][b])};
  }
  Scalar length() const { return half_a_ + half_b_; }

 private:
  using Places = std::array<Scalar, 4>;

  std::size_t i_;
  std::size_t j_;
  Scalar cosine_;  // e . f
  Scalar half_a_;
  Scalar half_b_;
  std::array<Scalar, 2> n_a_;  // along the two other axes of A
  std::array<Scalar, 2> n_b_;  // and of B
  Scalar n_sq_;
  Scalar sine_;
  Places height_a_;   // n . a
  Places height_b_;   // n . b
  Places along_f_a_;  // f . a, from B's origin
  Places along_e_b_;  // e . b
};

NearBoxes::EdgeAxes::EdgeAxes(std::size_t i, std::size_t j, const Vector3& half_a,
                              const Vector3& half_b, const RigidPose& X_AB)
    : i_(i), j_(j) {
  const auto at = [](std::size_t axis) { return Eigen::Index(axis % 3); };
  const auto [x, u, v] = std::array{at(i), at(i + 1), at(i + 2)};
  const auto [y, k, m] = std::array{at(j), at(j + 1), at(j + 2)};
  const Matrix3& R = X_AB.rotation();
  const Vector3& p = X_AB.translation();
  cosine_ = R(x, y);
  half_a_ = half_a[x];
  half_b_ = half_b[y];
  // e_x x f = e_v f_u - e_u f_v, and f_y x f_k = f_m.
  n_a_ = {-R(v, y), R(u, y)};
  n_b_ = {R(x, m), -R(x, k)};
  n_sq_ = n_a_[0] * n_a_[0] + n_a_[1] * n_a_[1];
  sine_ = std::sqrt(n_sq_);
  height_a_ = signed_sums(0, n_a_[0] * half_a[u], n_a_[1] * half_a[v]);
  height_b_ =
      signed_sums(n_a_[0] * p[u] + n_a_[1] * p[v], n_b_[0] * half_b[k], n_b_[1] * half_b[m]);
  along_f_a_ = signed_sums(-R.col(y).dot(p), R(u, y) * half_a[u], R(v, y) * half_a[v]);
  along_e_b_ = signed_sums(p[x], R(x, k) * half_b[k], R(x, m) * half_b[m]);
}

bool NearBoxes::EdgeAxes::are_beside(std::size_t a, std::size_t b, Scalar more,
                                     Scalar margin) const {
  const Scalar along_e = along_e_b_[b];
  const Scalar along_f = -along_f_a_[a];
  return !(std::abs(along_e - cosine_ * along_f) > (half_a_ + more) * n_sq_ + margin) &&
         !(std::abs(cosine_ * along_e - along_f) > (half_b_ + more) * n_sq_ + margin);
}

namespace {

// Places, of four, where neither -x nor -y rises above the limit: at an edge, faces go inwards. Bits
// 0 and 1 of a place are the signs.
unsigned convex_places(const std::array<Scalar, 2>& n, Scalar limit) {
  const unsigned first = unsigned(!(n[0] > limit)) * 0b0101U | unsigned(!(-n[0] > limit)) * 0b1010U;
  const unsigned second =
      unsigned(!(n[1] > limit)) * 0b0011U | unsigned(!(-n[1] > limit)) * 0b1100U;
  return first & second;
}

}  // namespace

unsigned NearBoxes::EdgeAxes::admitting_a(bool is_up, Scalar limit) const {
  const Scalar sign = is_up ? 1 : -1;
  return convex_places({sign * n_a_[0], sign * n_a_[1]}, limit);
}

unsigned NearBoxes::EdgeAxes::admitting_b(bool is_up, Scalar limit) const {
  const Scalar sign = is_up ? -1 : 1;
  return convex_places({sign * n_b_[0], sign * n_b_[1]}, limit);
}

NearBoxes::NearBoxes(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                     const BoxSearch& search)
    : search_(search), reach_(search.reach + 16 * search.noise) {
  const SimpleCore& core_a = a.simple_core();
  const SimpleCore& core_b = b.simple_core();
  const Scalar size =
      X_AB.translation().norm() + core_a.bounding_radius + core_b.bounding_radius + search.reach;
  const Scalar shortest = std::min(core_a.half_extents.minCoeff(), core_b.half_extents.minCoeff());
  margin_ = 4 * search.noise * (1 + size / shortest);
  const Side side_a(core_a.half_extents, core_b.half_extents, X_AB.inverse(), reach_);
  const Side side_b(core_b.half_extents, core_a.half_extents, X_AB, reach_);
  const auto all_beyond = [](const Side& side) {
    unsigned beyond = side.beyond[0];
    for (const unsigned each : side.beyond) beyond &= each;
    return beyond != 0;
  };
  if (all_beyond(side_a) || all_beyond(side_b)) return;
  are_near_ = true;
  find_triangles(side_a, side_b, triangles_[0]);
  find_triangles(side_b, side_a, triangles_[1]);
  find_edges(side_a, side_b, X_AB);
}

void NearBoxes::find_triangles(const Side& own, const Side& other,
                               std::array<std::uint16_t, 8>& triangles) {
  const Scalar least_height = search_.only_outside ? -256 * search_.noise : -kInfinity;
  const Scalar reach_sq = reach_ * reach_;
  const Vector3& half = other.half;
  for (std::size_t vertex = 0; vertex < 8; ++vertex) {
    if (own.beyond[vertex] != 0) continue;
    const Vector3 p(own.corners[0][vertex], own.corners[1][vertex], own.corners[2][vertex]);
    const Vector3 over = p.cwiseAbs() - half;
    const Vector3 out_sq = over.cwiseMax(0).cwiseAbs2();
    for (int axis = 0; axis < 3; ++axis) {
      const int b = axis == 0 ? 1 : 0;
      const int c = axis == 2 ? 1 : 2;
      const Scalar beside_sq = out_sq[b] + out_sq[c];
      // The squared distance to the diagonal, times that of its length.
      const Scalar across = p[b] * half[c] - p[c] * half[b];
      const Scalar length_sq = half[b] * half[b] + half[c] * half[c];
      for (const bool is_positive : {false, true}) {
        const Scalar height = (is_positive ? p[axis] : -p[axis]) - half[axis];
        const Scalar height_sq = height * height;
        if (height < least_height || height_sq + beside_sq > reach_sq) continue;
        const auto& pair = kTrianglesOfFace[std::size_t(2 * axis + (is_positive ? 1 : 0))];
        const bool is_one = across * across > (reach_sq - height_sq) * length_sq;
        triangles[vertex] |= is_one ? pair[across > 0 ? 1 : 0] : std::uint16_t(pair[0] | pair[1]);
      }
    }
  }
}

void NearBoxes::find_edges(const Side& a, const Side& b, const RigidPose& X_AB) {
  const std::array<unsigned, 3> near_b{b.near_edges(0), b.near_edges(1), b.near_edges(2)};
  for (std::size_t i = 0; i < 3; ++i) {
    const unsigned near_a = a.near_edges(i);
    if (near_a == 0) continue;
    for (std::size_t j = 0; j < 3; ++j) {
      if (near_b[j] != 0) add_edges(EdgeAxes(i, j, a.half, b.half, X_AB), near_a, near_b[j]);
    }
  }
}

void NearBoxes::add_edges(const EdgeAxes& axes, unsigned edges_a, unsigned edges_b) {
  const Scalar sine = axes.sine();
  const Scalar unsure = margin_ / axes.length();
  if (sine + unsure < 0.5 * kContactNoCrossingSine) return;  // parallel
  const Scalar most_height = 1.04 * reach_ * sine + margin_;
  // Where the edges are nearly parallel, the normal may be another.
  const bool by_cone = search_.sine < 1 && sine > 1.1 * kContactParallelSine;
  const Scalar rise = by_cone ? sine * (search_.sine + 1.0 / 1024) + unsure : kInfinity;
  const std::array<unsigned, 2> near_a{edges_a & axes.admitting_a(false, rise),
                                       edges_a & axes.admitting_a(true, rise)};
  const std::array<unsigned, 2> near_b{edges_b & axes.admitting_b(false, rise),
                                       edges_b & axes.admitting_b(true, rise)};
  for (unsigned left = near_a[0] | near_a[1]; left != 0; left &= left - 1) {
    const auto a = std::size_t(std::countr_zero(left));
    // With the normal downwards, and upwards.
    const unsigned down = (near_a[0] >> a & 1) != 0 ? near_b[0] : 0;
    const unsigned up = (near_a[1] >> a & 1) != 0 ? near_b[1] : 0;
    for (unsigned rest = down | up; rest != 0; rest &= rest - 1) {
      const auto b = std::size_t(std::countr_zero(rest));
      const Scalar height = axes.height(a, b);
      const bool is_apart = std::abs(height) > most_height ||
                            (height > margin_ && (up >> b & 1) == 0) ||
                            (height < -margin_ && (down >> b & 1) == 0);
      if (is_apart || !axes.are_beside(a, b, search_.noise, margin_)) continue;
      pairs_[pair_count_++] = axes.pair(a, b);
    }
  }
}

}  // namespace dyop::distance_internal
