// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/standing_pair.h"

#include <algorithm>

#include "core/tolerance.h"

namespace dyop::toi_internal {
namespace {

// More than the rounding error of the few operations in a bound.
constexpr Scalar kRoundedUp = 1 + 64 * kUnitRoundoff;

Scalar largest_size(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                    const TwistBound& bound, Scalar duration) {
  return a.largest_radius() + 2 * a.largest_displacement() +
         largest_coordinate(X_WB, bound, b.bounding_radius(), {0, duration});
}

}  // namespace

ChordGap::ChordGap(const DeformingMesh& a, const DeformingSpan& span, const TriangleMesh& b,
                   const Motion& X_WB, Scalar duration)
    : a_(a), span_(span), b_(b), X_WB_begin_(X_WB.pose(0)), X_WB_end_(X_WB.pose(duration)) {
  const TwistBound bound = X_WB.twist_bound({0, duration});
  const Scalar eighth = duration * duration / 8 * kRoundedUp;
  bend_ = eighth * bound.linear_acceleration;
  bend_per_length_ =
      eighth * (bound.angular_acceleration + bound.angular_speed * bound.angular_speed);
  noise_ = kStepNoise * largest_size(a, b, X_WB, bound, duration);
}

Scalar ChordGap::bend(Scalar radius) const {
  return bend_ + bend_per_length_ * radius * kRoundedUp;
}

Scalar ChordGap::least(std::int32_t triangle_a, std::int32_t triangle_b, const Vector3& n_W) const {
  const Triangle t_B = b_.triangle(triangle_b);
  Scalar radius_sq = 0;
  for (const Vector3& p_B : t_B) radius_sq = std::max(radius_sq, p_B.squaredNorm());
  const auto gap = [&](const RigidPose& X_WB, Scalar s) {
    const Vector3 n_B = X_WB.rotation().transpose() * n_W;
    return n_W.dot(X_WB.translation()) - largest_along(t_B, -n_B) -
           largest_along(a_.triangle(triangle_a, s), n_W);
  };
  return std::min(gap(X_WB_begin_, span_.begin), gap(X_WB_end_, span_.end)) -
         bend(std::sqrt(radius_sq)) - noise_;
}

Scalar ChordGap::least_of_boxes(const StandingPair& begin, const StandingPair& end,
                                std::int32_t box_a, std::int32_t box_b, const Vector3& n_W) const {
  return std::min(begin.box_gap(box_a, box_b, n_W), end.box_gap(box_a, box_b, n_W)) -
         bend(begin.b.radius(box_b)) - noise_;
}

StandingPair::StandingPair(const DeformingMesh& mesh_a, Scalar s, const TriangleMesh& mesh_b,
                           const RigidPose& X_WB, const MeshSlabs* slabs_of_a)
    : X_WB_motion(X_WB),
      a(mesh_a, {0, 0}, {s, s}),
      b(mesh_b, X_WB_motion, {0, 0}),
      fraction(s),
      slabs(slabs_of_a),
      noise(kStepNoise * (a.size() + b.size())) {}

std::optional<bool> StandingPair::is_apart_by(Scalar least, const std::function<bool()>& is_over,
                                              BoxPairStack& stack) const {
  DeformingTraversal<RigidSide> traversal(a, b, noise, least, stack);
  traversal.sought_middle = least;
  traversal.start();
  do {
    if (is_over()) return std::nullopt;
  } while (!traversal.run_portion(1));
  return traversal.lower > least;
}

namespace {

// More than the rounding of a node's bound that is made of one of its parts', relative to the size
// of the numbers.
constexpr Scalar kPartNoise = 32 * kUnitRoundoff;

// Some unit vector if there is no area.
Vector3 direction_of(const Vector3& area) {
  const Scalar length = area.norm();
  return length > 0 && length < kInfinity ? Vector3(area / length) : Vector3(Vector3::UnitX());
}

}  // namespace

void MeshSlabs::fit(const DeformingMesh& mesh) {
  slabs_.resize(mesh.nodes().size());
  areas_.resize(mesh.nodes().size());
  // Children come after their parents.
  for (std::size_t number = slabs_.size(); number-- > 0;) {
    const DeformingMesh::Node& node = mesh.nodes()[number];
    if (node.is_leaf) {
      fit_leaf(mesh, number);
      continue;
    }
    const auto part = static_cast<std::size_t>(node.first);
    areas_[number] = areas_[part] + areas_[part + 1];
    Slab slab{direction_of(areas_[number]), {}, {}};
    add_part(mesh, part, slab);
    add_part(mesh, part + 1, slab);
    slabs_[number] = slab;
  }
}

void MeshSlabs::fit_leaf(const DeformingMesh& mesh, std::size_t node) {
  const std::int32_t triangle = mesh.nodes()[node].first;
  const Triangle begin = mesh.triangle(triangle, 0), end = mesh.triangle(triangle, 1);
  areas_[node] = (begin[1] - begin[0]).cross(begin[2] - begin[0]);
  Slab slab{direction_of(areas_[node]), {}, {}};
  const auto add = [&](const Vector3& p, Range& range) {
    const Scalar along = slab.normal.dot(p), noise = kPartNoise * p.lpNorm<1>();
    range.add(along - noise, along + noise);
  };
  for (const Vector3& p : begin) add(p, slab.at_begin);
  for (const Vector3& p : end) add(p, slab.at_end);
  slabs_[node] = slab;
}

// With n the new normal, m that of the part: n.x = (n.m) m.x + (n - (n.m) m).x, of which the part's
// slab bounds the first and its box the second.
void MeshSlabs::add_part(const DeformingMesh& mesh, std::size_t part, Slab& slab) const {
  const Slab& from = slabs_[part];
  const Scalar along = slab.normal.dot(from.normal);
  const Vector3 across = slab.normal - along * from.normal;
  const auto add = [&](const AlignedBox& box, const Range& inner, Range& range) {
    const Vector3 center = (box.min() + box.max()) / 2, half = (box.max() - box.min()) / 2;
    const Scalar middle = across.dot(center);
    const Scalar spread =
        across.cwiseAbs().dot(half) + kPartNoise * (box.min().lpNorm<1>() + box.max().lpNorm<1>());
    const Scalar x = along * inner.lowest, y = along * inner.highest;
    range.add(std::min(x, y) + middle - spread, std::max(x, y) + middle + spread);
  };
  const DeformingMesh::Node& node = mesh.nodes()[part];
  add(node.at_begin, from.at_begin, slab.at_begin);
  add(node.at_end, from.at_end, slab.at_end);
}

}  // namespace dyop::toi_internal
