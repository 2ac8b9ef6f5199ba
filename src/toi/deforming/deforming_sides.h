// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/deforming_mesh.h"
#include "geometry/shape_tree.h"
#include "motion/guarded_state.h"
#include "toi/rigid/motion_bounds.h"
#include "toi/rigid/moving_pair.h"
#include "toi/rigid/safe_step.h"

namespace dyop::toi_internal {

// The two kinds of side of an impact query in which something deforms. Both provide a tree of
// boxes, and bound the motion of a node or triangle along a direction n that is fixed in world:
// after the time u the largest n.x is at most at(u, u^2 / 2) plus what rest() gives.

// Points that move at constant velocity: max over them of n.x, a convex function of time.
template <std::size_t N>
struct LinearSupport {
  std::array<Scalar, N> now;
  std::array<Scalar, N> rate;

  Scalar at(Scalar u, Scalar /*q*/) const {
    Scalar largest = now[0] + u * rate[0];
    for (std::size_t i = 1; i < N; ++i) largest = std::max(largest, now[i] + u * rate[i]);
    return largest;
  }
};

class DeformingSide {
 public:
  DeformingSide(const DeformingMesh& mesh, const TimeInterval& interval,
                const DeformingSpan& span = {})
      : mesh_(mesh),
        interval_(interval),
        span_(span),
        per_time_(interval.length() > 0 ? (span.end - span.begin) / interval.length() : 0),
        s_(span.begin) {}

  void set_time(Scalar t);
  Scalar smooth_until(Scalar /*t*/) const { return kInfinity; }
  void set_horizon(Scalar /*t*/, Scalar /*end*/) {}

  bool is_leaf(std::int32_t node) const { return at(node).is_leaf; }
  bool has_leaf(std::int32_t node) const {
    return node >= 0 && static_cast<std::size_t>(node) < mesh_.nodes().size() && is_leaf(node);
  }
  int part_count(std::int32_t /*node*/) const { return 2; }
  std::int32_t part(std::int32_t node, int i) const { return at(node).first + i; }
  std::int32_t triangle(std::int32_t leaf) const { return at(leaf).first; }
  std::span<const TriangleIndices> triangles() const { return mesh_.triangles(); }
  OrientedBox box_W(std::int32_t node) const;
  Triangle triangle_W(std::int32_t leaf) const { return mesh_.triangle(triangle(leaf), s_); }
  RigidPose pose() const { return {}; }
  TriangleMesh mesh_now() const { return mesh_.snapshot(s_); }

  LinearSupport<1> box_support(std::int32_t node, const Vector3& n_W) const;
  LinearSupport<3> triangle_support(std::int32_t leaf, const Vector3& n_W) const;
  template <std::size_t N>
  MotionRemainder rest(std::int32_t /*node*/, const LinearSupport<N>& /*support*/) const {
    return {};
  }
  // Bound on the speed of all points of a node.
  Scalar speed(std::int32_t /*node*/) const { return mesh_.largest_displacement() * per_time_; }
  // Size of all numbers involved, for the rounding allowance.
  Scalar size() const;
  Scalar start_size() const { return mesh_.largest_radius(); }
  Vector3 velocity_at(std::int32_t leaf, const Vector3& p_W) const;

 private:
  const DeformingMesh::Node& at(std::int32_t node) const {
    return mesh_.nodes()[static_cast<std::size_t>(node)];
  }
  Vector3 velocity(std::int32_t vertex) const {
    const auto i = static_cast<std::size_t>(vertex);
    return (mesh_.end()[i] - mesh_.begin()[i]) * per_time_;
  }

  const DeformingMesh& mesh_;
  const TimeInterval interval_;
  const DeformingSpan span_;
  const Scalar per_time_;
  Scalar s_;
};

// A piece of a rigid body along a direction that turns in the body's frame
// (docs/algorithms/time_of_impact.md).
template <typename Piece>
struct TurningSupport {
  TurningDirection direction;
  Scalar now;
  Scalar rate;
  Piece piece_B;

  Scalar at(Scalar u, Scalar q) const {
    return now + u * rate + largest_along(piece_B, direction.at(u, q));
  }
};

class RigidSide {
 public:
  RigidSide(const TriangleMesh& mesh, const Motion& motion, const TimeInterval& interval)
      : mesh_(mesh), tree_(mesh), motion_(motion), interval_(interval), bounds_(motion, interval) {
    set_time(interval.begin);
    noise_ = kStepNoise * size();
  }

  /// @throws InvalidArgument for a pose or twist that guarded_state() refuses, and for a jump.
  void set_time(Scalar t);
  Scalar smooth_until(Scalar t) const { return motion_.smooth_until(t); }
  void set_horizon(Scalar t, Scalar end) { near_ = bounds_.over(t, end); }

  bool is_leaf(std::int32_t box) const { return tree_.is_leaf(box); }
  bool has_leaf(std::int32_t box) const { return tree_.has_leaf(box); }
  int part_count(std::int32_t box) const { return tree_.node(tree_.child(box)).count(); }
  std::int32_t part(std::int32_t box, int i) const {
    return ShapeTree::box_number(tree_.child(box), i);
  }
  std::int32_t triangle(std::int32_t leaf) const { return tree_.triangle(leaf); }
  std::span<const TriangleIndices> triangles() const { return mesh_.triangles(); }
  OrientedBox box_W(std::int32_t box) const;
  /// The largest n.x over a box where it stands.
  Scalar box_reach(std::int32_t box, const Vector3& n_W) const {
    return n_W.dot(now_.p_WB) + largest_along(tree_.box(box), now_.R_WB.transpose() * n_W);
  }
  Scalar triangle_reach(std::int32_t leaf, const Vector3& n_W) const {
    return n_W.dot(now_.p_WB) +
           largest_along(mesh_.triangle(triangle(leaf)), now_.R_WB.transpose() * n_W);
  }
  Triangle triangle_W(std::int32_t leaf) const;
  RigidPose pose() const { return RigidPose::from_trusted(now_.R_WB, now_.p_WB); }
  const TriangleMesh& mesh_now() const { return mesh_; }

  TurningSupport<OrientedBox> box_support(std::int32_t node, const Vector3& n_W) const {
    return {TurningDirection(now_, {n_W}), n_W.dot(now_.p_WB), n_W.dot(now_.v_WB), tree_.box(node)};
  }
  TurningSupport<Triangle> triangle_support(std::int32_t leaf, const Vector3& n_W) const {
    return {TurningDirection(now_, {n_W}), n_W.dot(now_.p_WB), n_W.dot(now_.v_WB),
            mesh_.triangle(triangle(leaf))};
  }
  template <typename Piece>
  MotionRemainder rest(std::int32_t node, const TurningSupport<Piece>& support) const {
    const Scalar reach = radius(node);
    return {.jerk = support.direction.third * reach,
            .acceleration = near_.linear_acceleration + near_.angular_acceleration * reach,
            .turn = support.direction.rate};
  }
  Scalar speed(std::int32_t node) const {
    return bounds_.whole().linear_speed + bounds_.whole().angular_speed * radius(node);
  }
  Scalar size() const;
  /// No point of a box is farther from the origin of its frame.
  Scalar radius(std::int32_t box) const { return node_radius(tree_.box(box)); }
  // Size of the numbers at the current time.
  Scalar start_size() const { return now_.p_WB.norm() + mesh_.bounding_radius(); }
  Vector3 velocity_at(std::int32_t leaf, const Vector3& p_W) const;

 private:
  const TriangleMesh& mesh_;
  const ShapeTree tree_;
  const Motion& motion_;
  const TimeInterval interval_;
  const MotionBounds bounds_;
  Scalar time_ = 0;
  Scalar noise_ = 0;  // rounding allowance of a jump; 0 before the first time
  BodyInstant now_;
  TwistBound near_;
};

}  // namespace dyop::toi_internal
