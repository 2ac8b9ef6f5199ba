// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/moving_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "core/tolerance.h"
#include "motion/curve/chart_curve.h"

namespace dyop::toi_internal {
namespace {

// Moves the body from time t_now to time t. A positive `noise` says that it has been moved before.
void move(BodyInstant& now, const MovingShape& body, Scalar t_now, Scalar t, Scalar noise) {
  const MotionState state = guarded_state(body.motion, body.is_trusted, t, body.name);
  const Matrix3& R_WB = state.X_WB.rotation();
  const Vector3& p_WB = state.X_WB.translation();
  if (noise > 0 && !body.is_trusted) {
    require_no_jump({now.R_WB, now.p_WB, R_WB, p_WB, t_now, t}, body.bounds.whole(), body.radius,
                    noise, body.name);
  }
  now.R_WB = R_WB;
  now.p_WB = p_WB;
  now.v_WB = state.twist.v_WB;
  now.w_WB = body.is_ball ? Vector3::Zero() : state.twist.w_WB;
}

BoundLookups lookups_of(const Shape& a, const Shape& b) {
  const bool is_one_pair = a.kind() == ShapeKind::Convex && b.kind() == ShapeKind::Convex;
  return is_one_pair ? BoundLookups::Few : BoundLookups::Many;
}

// The edges, in world, spanned by a witness point's feature: one for an edge, two for a face.
class FeatureEdges {
 public:
  FeatureEdges(const LeafPiece& piece, const Feature& feature, const Matrix3& R_WS) {
    const TriangleMesh* mesh = piece.mesh ? piece.mesh : piece.convex->core_surface();
    if (!mesh) return;
    const std::span<const Vector3> corners = mesh->vertices();
    const std::span numbers(feature.vertices.data(), feature.vertex_count());
    const auto is_outside = [&](std::int32_t n) {
      return static_cast<std::size_t>(n) >= corners.size();  // negative ones too
    };
    // A user's shape may use any vertex numbers.
    if (std::any_of(numbers.begin(), numbers.end(), is_outside)) return;
    const auto corner = [&](std::size_t k) -> const Vector3& {
      return corners[static_cast<std::size_t>(numbers[k])];
    };
    for (std::size_t k = 1; k < numbers.size(); ++k) {
      edges_[count_++] = R_WS * (corner(k) - corner(0));
    }
  }
  std::span<const Vector3> span() const { return {edges_.data(), count_}; }

 private:
  std::array<Vector3, 2> edges_;
  std::size_t count_ = 0;
};

void copy(const Vector3& from, double* to) {
  for (int i = 0; i < 3; ++i) to[i] = from[i];
}

// How a body goes on until after a time: with its twist, if that does not jump before.
std::optional<MotionStretch> stretch_beyond(const MovingShape& body, const BodyInstant& now,
                                            Scalar t, Scalar after) {
  const Scalar end = body.motion.smooth_until(t);
  if (end > after) return MotionStretch{.end = end, .twist = {now.v_WB, now.w_WB}};
  return body.motion.stretch(t, after);
}

// Gives the body the twist of a stretch; returns how far its points may stray from that.
Scalar follow(BodyInstant& now, const MovingShape& body, const MotionStretch& stretch) {
  now.v_WB = stretch.twist.v_WB;
  if (body.is_ball) return stretch.linear_deviation;
  now.w_WB = stretch.twist.w_WB;
  return stretch.linear_deviation + motion_internal::times(stretch.angular_deviation, body.radius);
}

// The accelerations of a stretch that begins at t, until a time that is not after its end.
TwistBound bound_of(const MotionStretch& stretch, const MovingShape& body, Scalar t, Scalar end) {
  if (body.motion.smooth_until(t) >= end) return body.bounds.over(t, end);
  return {0, 0, stretch.linear_acceleration, stretch.angular_acceleration};
}

}  // namespace

MovingPair::MovingPair(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                       const TimeInterval& interval, Scalar floor)
    : interval_(interval),
      a_(a, X_WA, interval, extent_in(a, X_WA, b, X_WB, interval), lookups_of(a, b), kMotionOfA),
      b_(b, X_WB, interval, extent_in(b, X_WB, a, X_WA, interval), lookups_of(a, b), kMotionOfB),
      floor_(floor) {
  const TwistBound& bound_a = a_.bounds.whole();
  const TwistBound& bound_b = b_.bounds.whole();
  now_.linear_speed = bound_a.linear_speed + bound_b.linear_speed;
  now_.angular_speed_a = a_.is_ball ? 0 : bound_a.angular_speed;
  now_.angular_speed_b = b_.is_ball ? 0 : bound_b.angular_speed;
  largest_speed_ =
      now_.linear_speed + now_.angular_speed_a * a_.radius + now_.angular_speed_b * b_.radius;
  is_smooth_ = a_.motion.smooth_until(interval.begin) >= interval.end &&
               b_.motion.smooth_until(interval.begin) >= interval.end;
  set_time(interval.begin);
  now_.noise = rounding_allowance();
}

Scalar MovingPair::rounding_allowance() const {
  const auto size_of = [&](const MovingShape& body) {
    return largest_coordinate(body.motion, body.bounds.whole(), body.radius, interval_);
  };
  return kStepNoise * (size_of(a_) + size_of(b_));
}

void MovingPair::set_time(Scalar t) {
  move(now_.a, a_, time_, t, now_.noise);
  move(now_.b, b_, time_, t, now_.noise);
  time_ = t;
  X_AB_ = RigidPose::from_trusted(now_.a.R_WB.transpose() * now_.b.R_WB,
                                  now_.a.R_WB.transpose() * (now_.b.p_WB - now_.a.p_WB));
  facing_a_.is_current = false;
  facing_b_.is_current = false;
  further_count_ = 0;
  set_horizon();
}

void MovingPair::set_horizon() {
  now_.remaining = std::max(0.0, interval_.end - time_);
  now_.horizon = now_.remaining;
  if (!is_smooth_) {
    const Scalar end = std::min(a_.motion.smooth_until(time_), b_.motion.smooth_until(time_));
    now_.horizon = std::min(now_.remaining, end - time_);
  }
  const Scalar end = std::min(interval_.end, time_ + now_.horizon);
  horizon_end_ = end;
  bound_accelerations(now_, a_.bounds.over(time_, end), b_.bounds.over(time_, end));
}

void MovingPair::bound_accelerations(PairInstant& outlook, const TwistBound& a,
                                     const TwistBound& b) const {
  outlook.linear_acceleration = a.linear_acceleration + b.linear_acceleration;
  outlook.angular_acceleration_a = a_.is_ball ? 0 : a.angular_acceleration;
  outlook.angular_acceleration_b = b_.is_ball ? 0 : b.angular_acceleration;
}

std::size_t MovingPair::outlook_beyond(std::size_t k, Scalar step) {
  const Scalar after = std::max(time_ + step, k == 0 ? horizon_end_ : further_[k - 1].end);
  if (is_smooth_ || after >= interval_.end) return 0;
  // The shortest stretch that ends after a time is the shortest for later ones too, until it ends.
  for (std::size_t i = 0; i < further_count_; ++i) {
    if (further_[i].after <= after && after < further_[i].end) return i + 1;
  }
  return add_outlook(after) ? further_count_ : 0;
}

bool MovingPair::add_outlook(Scalar after) {
  const auto stretch_a = stretch_beyond(a_, now_.a, time_, after);
  if (!stretch_a) return false;
  const auto stretch_b = stretch_beyond(b_, now_.b, time_, after);
  if (!stretch_b) return false;
  if (further_count_ == further_.size()) further_.emplace_back();
  Outlook& outlook = further_[further_count_];
  outlook.after = after;
  outlook.end = std::min({interval_.end, stretch_a->end, stretch_b->end});
  if (!(outlook.end > after)) return false;
  outlook.facing_a.is_current = false;
  outlook.facing_b.is_current = false;
  PairInstant& instant = outlook.instant;
  instant = now_;
  instant.horizon = std::min(now_.remaining, outlook.end - time_);
  instant.noise += follow(instant.a, a_, *stretch_a) + follow(instant.b, b_, *stretch_b);
  bound_accelerations(instant, bound_of(*stretch_a, a_, time_, outlook.end),
                      bound_of(*stretch_b, b_, time_, outlook.end));
  ++further_count_;
  return true;
}

void MovingPair::fill(FacingMotion& facing, const PairInstant& outlook, bool from_a) const {
  const BodyInstant& body = from_a ? outlook.a : outlook.b;
  const BodyInstant& other = from_a ? outlook.b : outlook.a;
  const Matrix3 R_SW = body.R_WB.transpose();
  copy(R_SW * (other.p_WB - body.p_WB), facing.origin);
  copy(R_SW * (other.v_WB - body.v_WB), facing.velocity);
  copy(R_SW * body.w_WB, facing.turning);
  copy(R_SW * other.w_WB, facing.other_turning);
  facing.turning_sq = body.w_WB.squaredNorm();
  facing.other_turning_sq = other.w_WB.squaredNorm();
  // literal: 1 + 8u rounds the root up.
  facing.largest_turning =
      std::sqrt(std::max(facing.turning_sq, facing.other_turning_sq)) * (1 + 0x1p-50);
  const Vector3 p_SO = other.p_WB - body.p_WB;
  facing.origin_distance = p_SO.norm();
  facing.origin_opening = p_SO.dot(other.v_WB - body.v_WB) / facing.origin_distance;
  facing.remaining = outlook.remaining;
  facing.horizon = outlook.horizon;
  facing.linear_acceleration = outlook.linear_acceleration;
  facing.linear_speed = outlook.linear_speed;
  // Directions of the wide kernels have the length one up to 32u. literal: twice that.
  // Boxes hold cores: the balls around them turn with nothing and stay between them.
  facing.floor = (floor_ + a_.tree.rounding() + b_.tree.rounding()) * (1 + 64 * kUnitRoundoff);
  facing.noise = outlook.noise;
  facing.angular_acceleration = outlook.angular_acceleration_a;
  facing.other_angular_acceleration = outlook.angular_acceleration_b;
  facing.angular_speed = outlook.angular_speed_a;
  facing.other_angular_speed = outlook.angular_speed_b;
  if (!from_a) {
    std::swap(facing.angular_acceleration, facing.other_angular_acceleration);
    std::swap(facing.angular_speed, facing.other_angular_speed);
  }
  facing.is_steady = is_steady(outlook);
}

const FacingMotion& MovingPair::facing_motion(bool from_a, std::size_t k) {
  Facing& facing = k == 0 ? (from_a ? facing_a_ : facing_b_)
                          : (from_a ? further_[k - 1].facing_a : further_[k - 1].facing_b);
  if (facing.is_current) return facing.motion;
  fill(facing.motion, k == 0 ? now_ : further_[k - 1].instant, from_a);
  facing.is_current = true;
  return facing.motion;
}

// Whether both bodies move along straight lines at constant speed to the end of the query.
bool MovingPair::is_steady(const PairInstant& outlook) {
  return outlook.horizon >= outlook.remaining && outlook.linear_acceleration == 0 &&
         outlook.angular_speed_a == 0 && outlook.angular_speed_b == 0;
}

FacingPiece MovingPair::facing_piece(bool from_a, std::int32_t box) const {
  const RigidPose X_SO =
      from_a ? X_AB_
             : RigidPose::from_trusted(X_AB_.rotation().transpose(),
                                       now_.b.R_WB.transpose() * (now_.a.p_WB - now_.b.p_WB));
  const OrientedBox piece = (from_a ? b_ : a_).tree.box(box);
  FacingPiece result;
  result.box = facing_box(piece, X_SO);
  result.box.is_of_cores = a_.tree.rounding() + b_.tree.rounding() > 0;
  copy(X_SO.rotation() * piece.center, result.from_origin);
  result.half_diagonal = piece.half_extents.norm();
  result.radius = node_radius(piece);
  return result;
}

Scalar MovingPair::closing_speed(const PieceDistance& piece) const {
  const auto velocity = [&](const BodyInstant& body, const Vector3& p_AC) {
    const Vector3 p_WC = now_.a.R_WB * p_AC + now_.a.p_WB;
    return Vector3(body.v_WB + body.w_WB.cross(p_WC - body.p_WB));
  };
  const Vector3 n_W = now_.a.R_WB * piece.nhat_AB;
  return n_W.dot(velocity(now_.a, piece.p_a) - velocity(now_.b, piece.p_b));
}

bool MovingPair::is_closing(const PieceDistance& piece) const {
  const Scalar speeds = now_.a.v_WB.norm() + now_.b.v_WB.norm() + now_.a.w_WB.norm() * a_.radius +
                        now_.b.w_WB.norm() * b_.radius;
  return closing_speed(piece) > kPoseNoise * speeds;
}

TurningNormal MovingPair::normal_with_features(const PieceDistance& piece, const LeafPiece& piece_a,
                                               const LeafPiece& piece_b) const {
  const Vector3 n_W = now_.a.R_WB * piece.nhat_AB;
  // Features that do not turn keep their directions.
  if (now_.a.w_WB.isZero(0) && now_.b.w_WB.isZero(0)) return {n_W, Vector3::Zero()};
  for (const bool is_of_a : {true, false}) {
    const ConvexShape* convex = (is_of_a ? piece_a : piece_b).convex;
    if (!convex || !as_half_space(*convex)) continue;
    const Vector3& w_W = (is_of_a ? now_.a : now_.b).w_WB;
    return {n_W, w_W - n_W * n_W.dot(w_W)};
  }
  const FeatureEdges edges_a(piece_a, piece.feature_a, now_.a.R_WB);
  const FeatureEdges edges_b(piece_b, piece.feature_b, now_.b.R_WB);
  return {n_W, turn_with_edges(n_W, edges_a.span(), now_.a.w_WB, edges_b.span(), now_.b.w_WB)};
}

Scalar MovingPair::leaf_step(const PieceDistance& piece, std::int32_t leaf_a, std::int32_t leaf_b,
                             Scalar floor) {
  if (a_.is_ball && b_.is_ball) {
    return longest_step([&](const PairInstant& outlook) {
      return safe_step_of_balls(outlook, a_.radius, b_.radius, floor).time;
    });
  }
  const LeafPiece piece_a = a_.tree.piece(leaf_a);
  const LeafPiece piece_b = b_.tree.piece(leaf_b);
  const TurningNormal normal = normal_with_features(piece, piece_a, piece_b);
  const ConvexShape* convex_a = piece_a.convex;
  const ConvexShape* convex_b = piece_b.convex;
  if (a_.tree.convex() && b_.tree.convex()) {
    const Slab slab{normal, piece.lower, closing_speed(piece)};
    return longest_step([&](const PairInstant& outlook) {
      return safe_step(outlook, *convex_a, a_.radius, *convex_b, b_.radius, slab, floor).time;
    });
  }
  const Scalar radius_a = node_radius(a_.tree.box(leaf_a)) + a_.tree.rounding();
  const Scalar radius_b = node_radius(b_.tree.box(leaf_b)) + b_.tree.rounding();
  const auto step = [&](const auto& set_a, const auto& set_b) {
    return longest_step([&](const PairInstant& outlook) {
      return safe_step(outlook, set_a, radius_a, set_b, radius_b, normal, floor).time;
    });
  };
  const auto with_b = [&](const auto& set_a) {
    return convex_b ? step(set_a, *convex_b) : step(set_a, piece_b.corners());
  };
  return convex_a ? with_b(*convex_a) : with_b(piece_a.corners());
}

}  // namespace dyop::toi_internal
