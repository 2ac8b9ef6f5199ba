// SPDX-License-Identifier: BSD-3-Clause
#include "distance/near_features.h"

#include <algorithm>
#include <cmath>

#include "core/simd_pair.h"
#include "distance/core_distance.h"
#include "distance/gjk/warm_gjk.h"

namespace dyop::distance_internal {
namespace {

// A direction in frame A along which the slab gap of the two shapes is nearly their distance.
Vector3 separating_direction(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                             Scalar reach) {
  const Matrix3 identity = Matrix3::Identity();
  NearestPoints nearest;
  if (core_distance(a.simple_core(), b.simple_core(),
                    {identity, X_AB.rotation(), X_AB.translation()}, nearest)) {
    return nearest.nhat_AB;
  }
  GjkGoal goal;
  goal.slack = reach / 4;
  GjkSeed seed;
  return gjk_distance(a, b, X_AB, goal, seed).nhat_AB;
}

}  // namespace

NearFeatures::NearFeatures(const TriangleMesh& surface, const RigidPose& X_AS)
    : topology_(surface.topology()),
      vertices_of_surface_(surface.vertices()),
      indices_(surface.triangles()),
      X_AS_(X_AS) {}

Scalar NearFeatures::measure(const Vector3& direction_A) {
  const Vector3 n = X_AS_.rotation().transpose() * direction_A;
  const Scalar offset = direction_A.dot(X_AS_.translation());
  const std::span<const Vector3> all = vertices_of_surface_;
  Scalar largest = -kInfinity;
  for (std::size_t v = 0; v < all.size(); ++v) {
    heights_[v] = n.dot(all[v]) + offset;
    largest = std::max(largest, heights_[v]);
  }
  return largest;
}

bool NearFeatures::add_triangle(std::int32_t triangle) {
  const auto t = std::size_t(triangle);
  if (is_listed_[t]) return true;
  if (triangle_count_ == kMostNear) return false;
  is_listed_[t] = true;
  triangles_[triangle_count_++] = triangle;
  const TriangleIndices& corners = indices_[t];
  for (std::size_t k = 0; k < 3; ++k) {
    const auto from = std::size_t(corners[k]);
    const auto to = std::size_t(corners[k < 2 ? k + 1 : 0]);
    if (!is_corner_[from]) {
      is_corner_[from] = true;
      corners_[corner_count_++] = corners[k];
      points_[from] = X_AS_ * vertices_of_surface_[from];
    }
    if (!is_near_[from] && !is_near_[to]) continue;
    const std::int32_t side = 3 * triangle + std::int32_t(k);
    const std::optional<std::int32_t> edge = topology_.edge_of_side(side);
    if (edge && topology_.sides_of_edge(*edge)[0] == side) sides_[side_count_++] = side;
  }
  return true;
}

bool NearFeatures::gather(Scalar least_height) {
  const std::size_t count = vertices_of_surface_.size();
  for (std::size_t v = 0; v < count; ++v) {
    if (heights_[v] < least_height) continue;
    if (vertex_count_ == kMostNear) return false;
    is_near_[v] = true;
    vertices_[vertex_count_++] = std::int32_t(v);
  }
  for (std::size_t k = 0; k < vertex_count_; ++k) {
    for (const std::int32_t corner : topology_.corners_of_vertex(vertices_[k])) {
      if (!add_triangle(corner / 3)) return false;
    }
  }
  return true;
}

void NearFeatures::find_planes(Scalar reach, Scalar noise) {
  // Squared sine of the sharpest corner below which rounding turns a plane by more than `slack`
  // allows: 4u over the sine, times the size of everything, is half of it.
  constexpr Scalar kLeastSine = 1.0 / 1024;
  const Scalar slack = 256 * noise;  // noise is at least 128u of the size
  for (std::size_t k = 0; k < triangle_count_; ++k) {
    const TriangleIndices& t = indices_[std::size_t(triangles_[k])];
    const Vector3& p = point(t[0]);
    const Vector3 e = point(t[1]) - p;
    const Vector3 f = point(t[2]) - p;
    const Vector3 n = e.cross(f);
    const Scalar length_sq = n.squaredNorm();
    const bool has_plane = length_sq > kLeastSine * kLeastSine * e.squaredNorm() * f.squaredNorm();
    const Scalar length = std::sqrt(length_sq);
    for (Eigen::Index i = 0; i < 3; ++i) normals_[std::size_t(i)][k] = n[i];
    offsets_[k] = n.dot(p);
    least_[k] = has_plane ? -slack * length : -kInfinity;
    most_[k] = has_plane ? (reach + slack) * length : kInfinity;
  }
  // Two are compared at a time; nothing is beyond the one that may be added.
  if (triangle_count_ % 2 != 0) {
    for (auto& row : normals_) row[triangle_count_] = 0;
    offsets_[triangle_count_] = least_[triangle_count_] = most_[triangle_count_] = 0;
  }
}

void NearFeatures::compare(std::int32_t vertex, const NearFeatures& other) {
  using core_internal::LanePair;
  const Vector3& p = point(vertex);
  const LanePair x(p[0]), y(p[1]), z(p[2]);
  std::uint64_t beyond = 0;
  std::uint64_t below = 0;
  for (std::size_t k = 0; k < other.triangle_count_; k += 2) {
    const auto two = [k](const auto& row) { return LanePair(row[k], row[k + 1]); };
    const LanePair height = two(other.normals_[0]) * x + two(other.normals_[1]) * y +
                            two(other.normals_[2]) * z - two(other.offsets_);
    beyond |= std::uint64_t(bits(above(height, two(other.most_)))) << k;
    below |= std::uint64_t(bits(above(two(other.least_), height))) << k;
  }
  beyond_[std::size_t(vertex)] = beyond;
  above_[std::size_t(vertex)] = ~below & other.all_triangles();
}

bool NearFeatures::is_beyond_one_plane(std::int32_t side) const {
  const TriangleIndices& t = indices_[std::size_t(side / 3)];
  const auto k = std::size_t(side % 3);
  return (beyond_[std::size_t(t[k])] & beyond_[std::size_t(t[k < 2 ? k + 1 : 0])]) != 0;
}

void NearFeatures::leave_out_beyond(const NearFeatures& other) {
  for (std::size_t k = 0; k < corner_count_; ++k) compare(corners_[k], other);
  const auto left = [](auto& list, std::size_t count, const auto& is_out) {
    const auto end = list.begin() + std::ptrdiff_t(count);
    return std::size_t(std::remove_if(list.begin(), end, is_out) - list.begin());
  };
  vertex_count_ =
      left(vertices_, vertex_count_, [&](std::int32_t v) { return beyond_[std::size_t(v)] != 0; });
  side_count_ =
      left(sides_, side_count_, [&](std::int32_t side) { return is_beyond_one_plane(side); });
  for (std::size_t k = 0; k < triangle_count_; ++k) {
    const TriangleIndices& t = indices_[std::size_t(triangles_[k])];
    const bool is_far =
        (beyond_[std::size_t(t[0])] & beyond_[std::size_t(t[1])] & beyond_[std::size_t(t[2])]) != 0;
    far_triangles_ |= std::uint64_t(is_far) << k;
  }
}

NearSearch find_near_features(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                              Scalar reach, Scalar noise, NearFeatures& of_a, NearFeatures& of_b) {
  const Vector3 n = separating_direction(a, b, X_AB, reach);
  const Scalar top_a = of_a.measure(n);
  const Scalar bottom_b = -of_b.measure(-n);
  const Scalar thickness = reach + 4 * noise;
  if (bottom_b - top_a > thickness) return NearSearch::None;
  if (!of_a.gather(bottom_b - thickness) || !of_b.gather(-(top_a + thickness))) {
    return NearSearch::Unserved;
  }
  of_a.find_planes(reach, noise);
  of_b.find_planes(reach, noise);
  of_a.leave_out_beyond(of_b);
  of_b.leave_out_beyond(of_a);
  return NearSearch::Found;
}

}  // namespace dyop::distance_internal
