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
  const Scalar low = c - x;
  const Scalar high = c + x;
  return {low - y, high - y, low + y, high + y};
}

}  // namespace

bool NearBoxes::serves(const ConvexShape& a, const TriangleMesh* surface_a, const ConvexShape& b,
                       const TriangleMesh* surface_b) {
  return is_ordinary(a, surface_a) && is_ordinary(b, surface_b);
}

// A box, its corners in the other's frame by coordinate, and the other's planes, bit 2 k for -k and
// 2 k + 1 for +k, that a corner is farther beyond than the reach.
struct BoxSide {
  BoxSide(const Vector3& own, const Vector3& other, const RigidPose& X_OS, Scalar reach);

  // Bit `place` of edges along an axis that are not wholly beyond one plane.
  unsigned near_edges(std::size_t axis) const;

  const Vector3& half;
  std::array<std::array<Scalar, 8>, 3> corners;
  std::array<unsigned, 8> beyond{};
};

BoxSide::BoxSide(const Vector3& own, const Vector3& other, const RigidPose& X_OS, Scalar reach)
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

unsigned BoxSide::near_edges(std::size_t axis) const {
  unsigned near = 0;
  for (std::size_t place = 0; place < 4; ++place) {
    const std::size_t v = (place & 1) << ((axis + 1) % 3) | (place >> 1) << ((axis + 2) % 3);
    near |= unsigned((beyond[v] & beyond[v | std::size_t(1) << axis]) == 0) << place;
  }
  return near;
}

// The edges along axis i of A and j of B, in A's frame: along the unit vectors e and f, with middle
// points a and b. With n = e x f and r = b - a, the lines are n . r / |n| apart. Their nearest
// points are (r - f (f . r)) . e / n^2 from a and (e (e . r) - r) . f / n^2 from b. All three are
// sums of one term of A's edge and one of B's. Edges by their places (kBoxEdgeAt).
class BoxEdgeAxes {
 public:
  BoxEdgeAxes(std::size_t i, std::size_t j, const Vector3& half_a, const Vector3& half_b,
              const RigidPose& X_AB);

  // To be called before height() and are_beside().
  void find_places();
  Scalar height(std::size_t a, std::size_t b) const { return height_b_[b] - height_a_[a]; }
  // Whether the lines come nearest within both edges, each longer by `more`, or by `margin` / n^2.
  bool are_beside(std::size_t a, std::size_t b, Scalar more, Scalar margin) const;

  // The places of A's edges, and of B's, with no face beside them that rises by more than `limit` /
  // |n| along -n, and along n.
  using BothWays = std::array<unsigned, 2>;
  BothWays admitting_a(Scalar limit) const;
  BothWays admitting_b(Scalar limit) const;
  // Whether such edges may be at least `least` and at most `most` / |n| apart along -n or n.
  bool may_admit(Scalar limit, Scalar least, Scalar most) const;
  bool admits(std::size_t a, std::size_t b, bool is_up, Scalar limit) const;

  Scalar sine() const { return sine_; }
  Scalar length() const { return half_a_[x_] + half_b_[y_]; }
  NearBoxes::EdgePair pair(std::size_t a, std::size_t b, bool is_admitted) const {
    return {std::uint8_t(kBoxEdgeAt[std::size_t(x_)][a]),
            std::uint8_t(kBoxEdgeAt[std::size_t(y_)][b]), is_admitted};
  }

 private:
  using Places = std::array<Scalar, 4>;
  static Eigen::Index after(Eigen::Index axis) { return axis < 2 ? axis + 1 : 0; }

  const Vector3& half_a_;
  const Vector3& half_b_;
  const RigidPose& X_AB_;
  Eigen::Index x_, u_, v_;     // A's axes, i first, in cyclic order
  Eigen::Index y_, k_, m_;     // B's
  std::array<Scalar, 2> n_a_;  // n along u and v
  std::array<Scalar, 2> n_b_;  // along k and m
  Scalar n_sq_;
  Scalar sine_;
  Scalar center_;     // n . r between the boxes' origins
  Places height_a_;   // n . a
  Places height_b_;   // n . b
  Places along_f_a_;  // f . a, from B's origin
  Places along_e_b_;  // e . b
};

BoxEdgeAxes::BoxEdgeAxes(std::size_t i, std::size_t j, const Vector3& half_a, const Vector3& half_b,
                         const RigidPose& X_AB)
    : half_a_(half_a),
      half_b_(half_b),
      X_AB_(X_AB),
      x_(Eigen::Index(i)),
      u_(after(x_)),
      v_(after(u_)),
      y_(Eigen::Index(j)),
      k_(after(y_)),
      m_(after(k_)) {
  const Matrix3& R = X_AB.rotation();
  const Vector3& p = X_AB.translation();
  // e_x x f = e_v f_u - e_u f_v, and f_y x f_k = f_m.
  n_a_ = {-R(v_, y_), R(u_, y_)};
  n_b_ = {R(x_, m_), -R(x_, k_)};
  n_sq_ = n_a_[0] * n_a_[0] + n_a_[1] * n_a_[1];
  sine_ = std::sqrt(n_sq_);
  center_ = n_a_[0] * p[u_] + n_a_[1] * p[v_];
}

void BoxEdgeAxes::find_places() {
  const Matrix3& R = X_AB_.rotation();
  const Vector3& p = X_AB_.translation();
  height_a_ = signed_sums(0, n_a_[0] * half_a_[u_], n_a_[1] * half_a_[v_]);
  height_b_ = signed_sums(center_, n_b_[0] * half_b_[k_], n_b_[1] * half_b_[m_]);
  along_f_a_ = signed_sums(-R.col(y_).dot(p), n_a_[1] * half_a_[u_], -n_a_[0] * half_a_[v_]);
  along_e_b_ = signed_sums(p[x_], -n_b_[1] * half_b_[k_], n_b_[0] * half_b_[m_]);
}

bool BoxEdgeAxes::are_beside(std::size_t a, std::size_t b, Scalar more, Scalar margin) const {
  const Scalar cosine = X_AB_.rotation()(x_, y_);
  const Scalar along_e = along_e_b_[b];
  const Scalar along_f = -along_f_a_[a];
  return !(std::abs(along_e - cosine * along_f) > (half_a_[x_] + more) * n_sq_ + margin) &&
         !(std::abs(cosine * along_e - along_f) > (half_b_[y_] + more) * n_sq_ + margin);
}

namespace {

// Places, of four, where no face beside an edge rises by more than the limit along -n, and along n,
// for these components of n. Bits 0 and 1 of a place are signs; faces go inwards.
std::array<unsigned, 2> convex_places(const std::array<Scalar, 2>& n, Scalar limit) {
  constexpr std::array<unsigned, 4> kFirst{0, 0b0101, 0b1010, 0b1111};
  constexpr std::array<unsigned, 4> kSecond{0, 0b0011, 0b1100, 0b1111};
  const auto low_first = unsigned(!(n[0] > limit));
  const auto high_first = unsigned(!(-n[0] > limit));
  const auto low_second = unsigned(!(n[1] > limit));
  const auto high_second = unsigned(!(-n[1] > limit));
  return {kFirst[high_first | low_first << 1] & kSecond[high_second | low_second << 1],
          kFirst[low_first | high_first << 1] & kSecond[low_second | high_second << 1]};
}

}  // namespace

BoxEdgeAxes::BothWays BoxEdgeAxes::admitting_a(Scalar limit) const {
  return convex_places(n_a_, limit);
}

BoxEdgeAxes::BothWays BoxEdgeAxes::admitting_b(Scalar limit) const {
  return convex_places({-n_b_[0], -n_b_[1]}, limit);
}

// The edges that are foremost along n are least apart. Another one is admitted only if it is on the
// other side along an axis with a component of n of at most `limit`.
bool BoxEdgeAxes::may_admit(Scalar limit, Scalar least, Scalar most) const {
  const Scalar extents = std::abs(n_a_[0]) * half_a_[u_] + std::abs(n_a_[1]) * half_a_[v_] +
                         std::abs(n_b_[0]) * half_b_[k_] + std::abs(n_b_[1]) * half_b_[m_];
  const Scalar more = 2 * limit * (half_a_[u_] + half_a_[v_] + half_b_[k_] + half_b_[m_]);
  const auto is_out = [&](Scalar foremost) { return foremost > most || foremost + more < least; };
  return !is_out(center_ - extents) || !is_out(-center_ - extents);
}

bool BoxEdgeAxes::admits(std::size_t a, std::size_t b, bool is_up, Scalar limit) const {
  const auto way = std::size_t(is_up);
  return (admitting_a(limit)[way] >> a & admitting_b(limit)[way] >> b & 1) != 0;
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
  const BoxSide side_a(core_a.half_extents, core_b.half_extents, X_AB.inverse(), reach_);
  const BoxSide side_b(core_b.half_extents, core_a.half_extents, X_AB, reach_);
  const auto all_beyond = [](const BoxSide& side) {
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

void NearBoxes::find_triangles(const BoxSide& own, const BoxSide& other,
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

void NearBoxes::find_edges(const BoxSide& a, const BoxSide& b, const RigidPose& X_AB) {
  const std::array<unsigned, 3> near_b{b.near_edges(0), b.near_edges(1), b.near_edges(2)};
  for (std::size_t i = 0; i < 3; ++i) {
    const unsigned near_a = a.near_edges(i);
    if (near_a == 0) continue;
    for (std::size_t j = 0; j < 3; ++j) {
      if (near_b[j] != 0) add_edges(BoxEdgeAxes(i, j, a.half, b.half, X_AB), near_a, near_b[j]);
    }
  }
}

void NearBoxes::add_edges(BoxEdgeAxes&& axes, unsigned edges_a, unsigned edges_b) {
  const Scalar sine = axes.sine();
  const Scalar unsure = margin_ / axes.length();
  if (sine + unsure < 0.5 * kContactNoCrossingSine) return;  // parallel
  const Scalar most_height = 1.04 * reach_ * sine + margin_;
  // Where the edges are nearly parallel, the normal may be another.
  const bool by_cone = search_.sine < 1 && sine > 1.1 * kContactParallelSine;
  constexpr Scalar kSlack = 1.0 / 1024;
  const Scalar rise = by_cone ? sine * (search_.sine + kSlack) + unsure : kInfinity;
  if (by_cone && !axes.may_admit(rise, -2 * margin_, most_height + margin_)) return;
  // The edges themselves lean by no more than `unsure`.
  const Scalar surely = sine * (search_.sine - kSlack) - unsure;
  axes.find_places();
  // Downwards and upwards.
  const BoxEdgeAxes::BothWays ways_a = axes.admitting_a(rise);
  const BoxEdgeAxes::BothWays ways_b = axes.admitting_b(rise);
  for (unsigned left = edges_a & (ways_a[0] | ways_a[1]); left != 0; left &= left - 1) {
    const auto a = std::size_t(std::countr_zero(left));
    const unsigned down = (ways_a[0] >> a & 1) != 0 ? edges_b & ways_b[0] : 0;
    const unsigned up = (ways_a[1] >> a & 1) != 0 ? edges_b & ways_b[1] : 0;
    for (unsigned rest = down | up; rest != 0; rest &= rest - 1) {
      const auto b = std::size_t(std::countr_zero(rest));
      const Scalar height = axes.height(a, b);
      const bool is_up = height > margin_;
      const bool is_down = height < -margin_;
      if (std::abs(height) > most_height || (is_up && (up >> b & 1) == 0) ||
          (is_down && (down >> b & 1) == 0) || !axes.are_beside(a, b, search_.noise, margin_)) {
        continue;
      }
      const bool is_admitted =
          by_cone && (is_up || is_down) && surely > unsure && axes.admits(a, b, is_up, surely);
      pairs_[pair_count_++] = axes.pair(a, b, is_admitted);
    }
  }
}

}  // namespace dyop::distance_internal
