// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/deforming_sides.h"

#include "toi/nearest_difference.h"

namespace dyop::toi_internal {

void DeformingSide::set_time(Scalar t) {
  s_ = std::clamp(span_.begin + (t - interval_.begin) * per_time_, span_.begin, span_.end);
  if (t >= interval_.end && interval_.length() > 0) s_ = span_.end;
}

OrientedBox DeformingSide::box_W(std::int32_t node) const {
  const AlignedBox& from = at(node).at_begin;
  const AlignedBox& to = at(node).at_end;
  const Vector3 lowest = from.min() + s_ * (to.min() - from.min());
  const Vector3 highest = from.max() + s_ * (to.max() - from.max());
  return {(lowest + highest) / 2, Matrix3::Identity(), (highest - lowest) / 2};
}

// The corner that is farthest along n is the same at all times.
LinearSupport<1> DeformingSide::box_support(std::int32_t node, const Vector3& n_W) const {
  const AlignedBox& from = at(node).at_begin;
  const AlignedBox& to = at(node).at_end;
  const auto is_highest = (n_W.array() > 0);
  const Vector3 begin = is_highest.select(from.max(), from.min());
  const Vector3 displacement = is_highest.select(to.max(), to.min()) - begin;
  return {{n_W.dot(begin + s_ * displacement)}, {n_W.dot(displacement) * per_time_}};
}

LinearSupport<3> DeformingSide::triangle_support(std::int32_t leaf, const Vector3& n_W) const {
  const Triangle corners = triangle_W(leaf);
  const TriangleIndices& indices = triangles()[static_cast<std::size_t>(triangle(leaf))];
  LinearSupport<3> support;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    support.now[i] = n_W.dot(corners[i]);
    support.rate[i] = n_W.dot(velocity(indices[i]));
  }
  return support;
}

// A time rounded by u max|t| moves points by their speed times that.
Scalar DeformingSide::size() const {
  const Scalar largest_time = std::max(std::abs(interval_.begin), std::abs(interval_.end));
  return mesh_.largest_radius() + mesh_.largest_displacement() * (1 + largest_time * per_time_);
}

Vector3 DeformingSide::velocity_at(std::int32_t leaf, const Vector3& p_W) const {
  const Triangle corners = triangle_W(leaf);
  const NearestDifference<3> nearest =
      find_nearest(Differences<3>{corners[0] - p_W, corners[1] - p_W, corners[2] - p_W});
  const TriangleIndices& indices = triangles()[static_cast<std::size_t>(triangle(leaf))];
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i) sum += nearest.weights[i] * velocity(indices[i]);
  return sum;
}

void RigidSide::set_time(Scalar t) {
  const MotionState state = guarded_state(motion_, motion_.is_trusted(), t, kMotionOfB);
  const BodyInstant before = now_;
  now_ = {state.X_WB.rotation(), state.X_WB.translation(), state.twist.v_WB, state.twist.w_WB};
  if (noise_ > 0 && !motion_.is_trusted()) {
    require_no_jump({before.R_WB, before.p_WB, now_.R_WB, now_.p_WB, time_, t}, bounds_.whole(),
                    mesh_.bounding_radius(), noise_, kMotionOfB);
  }
  time_ = t;
}

OrientedBox RigidSide::box_W(std::int32_t box) const {
  const OrientedBox box_B = tree_.box(box);
  return {pose() * box_B.center, now_.R_WB * box_B.axes, box_B.half_extents};
}

Triangle RigidSide::triangle_W(std::int32_t leaf) const {
  const Triangle corners = mesh_.triangle(triangle(leaf));
  const RigidPose X_WB = pose();
  return {X_WB * corners[0], X_WB * corners[1], X_WB * corners[2]};
}

Scalar RigidSide::size() const {
  return largest_coordinate(motion_, bounds_.whole(), mesh_.bounding_radius(), interval_);
}

Vector3 RigidSide::velocity_at(std::int32_t /*leaf*/, const Vector3& p_W) const {
  return now_.v_WB + now_.w_WB.cross(p_W - now_.p_WB);
}

}  // namespace dyop::toi_internal
