// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/straight_impact.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/tolerance.h"
#include "dyop/geometry/half_space.h"
#include "geometry/shape_tree.h"
#include "motion/guarded_state.h"
#include "toi/rigid/motion_bounds.h"
#include "toi/rigid/moving_pair.h"
#include "toi/rigid/safe_step.h"

namespace dyop::toi_internal {
namespace {

// The path of B's core relative to A's: at p when the query starts, then with the velocity v. A
// ball's core is its centre. A plane's core is the foot of the perpendicular from the ball's centre
// and moves along the plane with it, so p and v are along the plane's normal.
struct CorePath {
  Vector3 p = Vector3::Zero();
  Vector3 v = Vector3::Zero();
  Scalar radii = 0;  // sum of the balls' radii

  Vector3 after(Scalar s) const { return p + s * v; }
};

// One side of such a query.
struct StraightBody {
  StraightBody(const Shape& the_shape, const Motion& the_motion, const char* the_name)
      : shape(static_cast<const ConvexShape&>(the_shape)), motion(the_motion), name(the_name) {}

  const ConvexShape& shape;
  const Motion& motion;
  const char* name;  // of the motion, in messages
  TwistBound bound;
  MotionState state;  // at the time of the last set_time()

  const SimpleCore& core() const { return shape.simple_core(); }
  bool is_ball() const { return core().kind == CoreKind::Point; }
  const Vector3& origin() const { return state.X_WB.translation(); }
  Vector3 center() const {
    return core().is_centred ? origin() : Vector3(state.X_WB * core().center);
  }

  // Sets `bound`. Returns whether the ball's centre, or the plane, keeps its velocity.
  bool set_bound(const TimeInterval& interval) {
    if (!motion.is_trusted()) return false;
    bound = motion.twist_bound(interval);
    if (bound.linear_acceleration != 0) return false;
    return bound.angular_speed == 0 || (is_ball() && core().is_centred);
  }
  void set_time(Scalar t) { state = motion_internal::guarded_state(motion, true, t, name); }
};

// The vector from the plane of a half-space to a point above it; zero for points below.
Vector3 above_plane(const StraightBody& plane, const Vector3& p_W) {
  const auto& half_space = static_cast<const HalfSpace&>(plane.shape);
  const Vector3 n_W = plane.state.X_WB.rotation() * half_space.normal();
  const Scalar height = n_W.dot(p_W - plane.origin()) - half_space.offset();
  return std::max(height, Scalar(0)) * n_W;
}

// The part of a velocity along the normal of a half-space.
Vector3 along_normal(const StraightBody& plane, const Vector3& v_W) {
  const auto& half_space = static_cast<const HalfSpace&>(plane.shape);
  const Vector3 n_W = plane.state.X_WB.rotation() * half_space.normal();
  return n_W.dot(v_W) * n_W;
}

class StraightPair {
 public:
  explicit StraightPair(const RigidQuery& query)
      : query_(query), a_(query.a, query.X_WA, kMotionOfA), b_(query.b, query.X_WB, kMotionOfB) {}

  // Returns false, with `result` unchanged, if the search must decide.
  bool solve(ToiResult& result);

 private:
  void set_time(Scalar t) {
    a_.set_time(t);
    b_.set_time(t);
  }
  Scalar rounding_allowance() const;
  CorePath path() const;
  bool finish_impact(const CorePath& path, Scalar t, ToiResult& result);
  std::optional<Scalar> hit_time(const CorePath& path, Scalar t) const;
  ImpactContact contact(const CorePath& now) const;
  void finish(ToiStatus status, Scalar t, ToiResult& result) const;

  const RigidQuery& query_;
  StraightBody a_;
  StraightBody b_;
  Scalar noise_ = 0;
};

// The allowance that the search would compute.
Scalar StraightPair::rounding_allowance() const {
  const Scalar origins = (b_.origin() - a_.origin()).norm();
  const Scalar apart = largest_distance(origins, a_.bound, b_.bound, query_.interval);
  const auto size_of = [&](const StraightBody& body, const StraightBody& other) {
    const Scalar radius = geometry_internal::radius_beside(body.shape, other.shape, apart);
    return largest_coordinate(body.motion, body.bound, radius, query_.interval);
  };
  return kStepNoise * (size_of(a_, b_) + size_of(b_, a_));
}

CorePath StraightPair::path() const {
  CorePath path;
  path.v = b_.state.twist.v_WB - a_.state.twist.v_WB;
  path.radii = a_.core().rounding_radius + b_.core().rounding_radius;
  if (!a_.is_ball()) {
    path.p = above_plane(a_, b_.center());
    path.v = along_normal(a_, path.v);
  } else if (!b_.is_ball()) {
    path.p = -above_plane(b_, a_.center());
    path.v = along_normal(b_, path.v);
  } else {
    path.p = b_.center() - a_.center();
  }
  return path;
}

bool StraightPair::solve(ToiResult& result) {
  // The quadratic is solved again at its root until the gap there is small enough. Once will do,
  // unless the first distance is so long that its square hides the radii.
  constexpr int kSolutions = 8;
  const TimeInterval& interval = query_.interval;
  if (!a_.set_bound(interval) || !b_.set_bound(interval)) return false;
  set_time(interval.begin);
  noise_ = rounding_allowance();
  const CorePath path = this->path();
  const Scalar reach = path.radii + query_.band.leaf_target + noise_;
  Scalar t = interval.begin;
  for (int k = 0; k < kSolutions; ++k) {
    const Vector3 p = path.after(t - interval.begin);
    const Scalar remaining = interval.end - t;
    const Scalar step = safe_time_of_points(p, path.v, reach, remaining);
    if (!(step > 0)) return false;
    if (step >= remaining) {
      set_time(interval.end);
      finish(ToiStatus::Separated, interval.end, result);
      return true;
    }
    if (!(t + step > t)) return false;
    t = std::min(t + step, interval.end);
    const Scalar gap = path.after(t - interval.begin).norm() - path.radii;
    if (gap <= query_.band.contact) return finish_impact(path, t, result);
  }
  return false;
}

// Reports an impact at t by the rules of the search, at poses computed for t.
bool StraightPair::finish_impact(const CorePath& path, Scalar t, ToiResult& result) {
  const std::optional<Scalar> hit = hit_time(path, t);
  if (!hit) return false;
  set_time(t);
  const ImpactContact found = contact(this->path());
  const Scalar speeds = a_.state.twist.v_WB.norm() + b_.state.twist.v_WB.norm();
  const bool is_closing = found.closing_speed > kPoseNoise * speeds;
  if (!is_closing || !(found.upper <= query_.band.contact + noise_)) return false;
  result.contact = found;
  if (*hit <= query_.interval.end) result.t_hit = hit;
  result.statistics.leaf_tests = result.statistics.node_pairs = result.statistics.peak_queue = 1;
  finish(ToiStatus::Impact, t, result);
  return true;
}

// A time soon after t at which the gap is surely below the target of leaves, rounding included;
// nothing if the cores pass each other without coming so near.
std::optional<Scalar> StraightPair::hit_time(const CorePath& path, Scalar t) const {
  const Scalar begin = query_.interval.begin;
  const Scalar target = path.radii + query_.band.leaf_target;
  const Scalar reach = target - noise_;
  const Vector3 p = path.after(t - begin);
  const Scalar distance = p.norm();
  // The first root of |p + s v|^2 = reach^2, in the form without cancellation.
  const Scalar product = (distance - reach) * (distance + reach);
  const Scalar closing = -p.dot(path.v);
  const Scalar discriminant = closing * closing - path.v.squaredNorm() * product;
  if (!(discriminant > 0 && closing > 0 && product > 0)) return std::nullopt;
  const Scalar step = product / (closing + std::sqrt(discriminant));
  const Scalar hit = std::nextafter(t + step, kInfinity);
  // Rounding moves the distance by less than half of the allowance.
  const bool is_near = path.after(hit - begin).norm() <= target - noise_ / 2;
  return is_near && hit > t ? std::optional(hit) : std::nullopt;
}

// The contact at the current time. The cores must not coincide.
ImpactContact StraightPair::contact(const CorePath& now) const {
  const Scalar length = now.p.norm();
  const Scalar gap = length - now.radii;
  ImpactContact contact;
  contact.lower = std::max(Scalar(0), gap - noise_);
  contact.upper = gap + noise_;
  const Vector3 nhat_W = now.p / length;
  contact.nhat_AB_W = nhat_W;
  contact.closing_speed = -nhat_W.dot(now.v);
  const Vector3 core_a = a_.is_ball() ? a_.center() : Vector3(b_.center() - now.p);
  const Vector3 core_b = b_.is_ball() ? b_.center() : Vector3(a_.center() + now.p);
  contact.p_WCa = core_a + a_.core().rounding_radius * nhat_W;
  contact.p_WCb = core_b - b_.core().rounding_radius * nhat_W;
  if (a_.is_ball()) contact.feature_a = {FeatureKind::Vertex, {0}};
  if (b_.is_ball()) contact.feature_b = {FeatureKind::Vertex, {0}};
  return contact;
}

void StraightPair::finish(ToiStatus status, Scalar t, ToiResult& result) const {
  result.status = status;
  result.t_safe = t;
  result.rounding_allowance = noise_;
  result.X_WA = a_.state.X_WB;
  result.X_WB = b_.state.X_WB;
}

CoreKind kind_of(const Shape& shape) {
  if (shape.kind() != ShapeKind::Convex) return CoreKind::General;
  return static_cast<const ConvexShape&>(shape).simple_core().kind;
}

}  // namespace

bool are_balls_or_plane(const Shape& a, const Shape& b) {
  const CoreKind kind_a = kind_of(a);
  const CoreKind kind_b = kind_of(b);
  if (kind_a == CoreKind::Point) return kind_b == CoreKind::Point || kind_b == CoreKind::HalfSpace;
  return kind_a == CoreKind::HalfSpace && kind_b == CoreKind::Point;
}

bool straight_impact(const RigidQuery& query, ToiResult& result) {
  const ToiOptions& options = query.options;
  const bool is_for_search =
      options.with_contacts || options.deadline || options.stop.stop_requested();
  return !is_for_search && StraightPair(query).solve(result);
}

}  // namespace dyop::toi_internal
