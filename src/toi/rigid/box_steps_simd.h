// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/box_axis.h"
#include "toi/rigid/box_steps.h"

// The kernels of box_steps.h for the instruction set that this file is compiled for. The
// mathematics is that of safe_step() along a fixed direction, derived in
// docs/algorithms/time_of_impact.md.
namespace dyop::toi_internal {
inline namespace DYOP_LANES {

/// A pair whose step turns a body by more than this angle is examined again before it is split, as
/// with kReadvanceRatio, if its gap exceeds this fraction of its size: what ends such a step is
/// that the direction turns away, and the parts' directions turn away as well.
constexpr double kReadvanceTurn = 0.05;
constexpr double kReadvanceTurnRatio = 0.05;

/// Angle of a step beyond which bounds without a direction are tried as well. Speed only.
constexpr double kDirectionlessTurn = 0.5;

/// Trials of the length of a step; a fourth gains nothing measurable.
constexpr int kStepTrials = 3;

/// Lengths tried side by side for a single box: 2, 4, 8, ... times a unit.
constexpr int kStepLengths = 8;
constexpr float kStepLength[kStepLengths] = {2, 4, 8, 16, 32, 64, 128, 256};

template <typename L>
DYOP_INLINE L infinity() {
  return L(__builtin_inf());
}

/// first_root() of safe_step.h, for all lanes.
template <typename L>
DYOP_INLINE L first_roots(L c0, L c1, L c2, L h) {
  const L zero(0.0);
  const L b = c0 - c1;
  const L a = b - (c1 - c2);
  const L discriminant = b * b - a * c0;
  // literal: 16u and 1 - 32u, as in first_root().
  const L root_noise = L(0x1p-49) * (b * b + magnitude(a) * c0);
  const L square_root = sqrt(larger(discriminant, zero));
  const auto is_falling = b > zero;
  const L x = select(is_falling, c0, b - square_root) / select(is_falling, b + square_root, a);
  // No root: all coefficients positive, discriminant negative, or the root is beyond h.
  const auto is_positive = (c1 >= zero) & (c2 >= zero);
  const auto has_no_root = zero - discriminant > root_noise;
  const auto never_falls = without(zero >= b, zero > a);
  const auto is_free = is_positive | (has_no_root | (never_falls | (x > L(1.0))));
  // If a coefficient is not finite, neither is the discriminant; inf - inf is NaN.
  const auto is_finite = discriminant - discriminant >= zero;
  const L step = select(x >= zero, x, zero) * h * L(1 - 0x1p-48);
  return select(is_finite & is_free, infinity<L>(), select(is_finite, step, zero));
}

/// The gap of the slabs along the turning direction n + u k + q m, minus the floor: G(u, q).
template <typename L>
struct TurningGaps {
  // Projections of n, k, m onto the terms of the gap.
  L constant;     // n . (origin + center of the other - center of the box) - floor
  L rate;         // derivative of the same by u: velocity and k
  L bend;         // derivative by q
  L along[6][3];  // per axis: n, k, m
  L reach[6];     // half extents

  template <typename Motion>
  DYOP_INLINE TurningGaps(const BoxLanes<L>& box, const FacingPiece& other, const Motion& motion,
                          const L* n) {
    const Broadcast3<L> from_origin(other.from_origin);
    constant = (dot(Broadcast3<L>(motion.origin).v, n) + dot(from_origin.v, n)) -
               dot(box.center, n) - L(motion.floor);
    rate = dot(Broadcast3<L>(motion.velocity).v, n);
    bend = L(0.0);
    for (int k = 0; k < 3; ++k) {
      along[k][0] = dot(box.axes[k], n);
      reach[k] = box.half_extents[k];
      along[3 + k][0] = dot(Broadcast3<L>(other.box.axes[k]).v, n);
      reach[3 + k] = L(other.box.half_extents[k]);
    }
  }

  /// The gap of one box in all lanes.
  DYOP_INLINE explicit TurningGaps(const TurningGaps<OneLane>& one) requires(L::kCount > 1)
      : constant(one.constant.v), rate(one.rate.v), bend(one.bend.v) {
    for (int k = 0; k < 6; ++k) {
      for (int i = 0; i < 3; ++i) along[k][i] = L(one.along[k][i].v);
      reach[k] = L(one.reach[k].v);
    }
  }

  DYOP_INLINE void add_turning(const BoxLanes<L>& box, const FacingPiece& other, const L* k_box,
                               const L* m_box, const L* k_other, const L* m_other) {
    const Broadcast3<L> from_origin(other.from_origin);
    rate = rate + (dot(from_origin.v, k_other) - dot(box.center, k_box));
    bend = dot(from_origin.v, m_other) - dot(box.center, m_box);
    for (int k = 0; k < 3; ++k) {
      const Broadcast3<L> axis(other.box.axes[k]);
      along[k][1] = dot(box.axes[k], k_box);
      along[k][2] = dot(box.axes[k], m_box);
      along[3 + k][1] = dot(axis.v, k_other);
      along[3 + k][2] = dot(axis.v, m_other);
    }
  }

  DYOP_INLINE L at_zero() const {
    L sum = constant;
    for (int k = 0; k < 6; ++k) sum = sum - magnitude(along[k][0]) * reach[k];
    return sum;
  }
  /// How fast the gap shrinks at the start of the step.
  DYOP_INLINE L closing() const {
    L sum = L(0.0) - rate;
    for (int k = 0; k < 6; ++k) sum = sum + flip_sign(along[k][1], along[k][0]) * reach[k];
    return sum;
  }
  DYOP_INLINE L at(L u) const {
    L sum = constant + u * rate;
    for (int k = 0; k < 6; ++k) sum = sum - magnitude(along[k][0] + u * along[k][1]) * reach[k];
    return sum;
  }
  DYOP_INLINE L at(L u, L q) const {
    L sum = constant + (u * rate + q * bend);
    for (int k = 0; k < 6; ++k) {
      sum = sum - magnitude(along[k][0] + (u * along[k][1] + q * along[k][2])) * reach[k];
    }
    return sum;
  }
};

/// What bounds the step of each lane, besides its direction.
template <typename L>
struct StepBounds {
  L radius;        // of the group's boxes about the origin of S
  L acceleration;  // of the gap beyond constant twists
  L jerk;

  /// Those of one box in all lanes.
  DYOP_INLINE explicit StepBounds(const StepBounds<OneLane>& one) requires(L::kCount > 1)
      : radius(one.radius.v), acceleration(one.acceleration.v), jerk(one.jerk.v) {}

  DYOP_INLINE StepBounds(const BoxLanes<L>& box, const FacingPiece& other,
                         const FacingMotion& motion) {
    // literal: as node_radius(): axes are orthonormal to single precision only.
    radius = (sqrt(dot(box.center, box.center)) + sqrt(dot(box.half_extents, box.half_extents))) *
             L(1 + 0x1p-20);
    acceleration = L(motion.linear_acceleration) + L(motion.angular_acceleration) * radius +
                   L(motion.other_angular_acceleration) * L(other.radius);
    jerk = L(0.0);
  }
};

/// The step that the largest speeds allow; only where gap > 0.
template <typename L>
DYOP_INLINE L speed_step(const FacingPiece& other, const FacingMotion& motion, L gap, L radius) {
  const L speed = L(motion.linear_speed) + L(motion.angular_speed) * radius +
                  L(motion.other_angular_speed) * L(other.radius);
  return gap / speed;  // never 0 / 0, because gap > 0; infinite speed gives zero
}

/// The bounds without a direction: largest speeds, and two balls about the origins of the bodies.
template <typename L>
DYOP_INLINE L directionless_step(const FacingPiece& other, const FacingMotion& motion, L gap,
                                 L radius) {
  const L zero(0.0);
  const L by_speed = speed_step(other, motion, gap, radius);
  const L h(motion.horizon);
  const L ball_gap =
      L(motion.origin_distance) - radius - L(other.radius) - L(motion.floor + motion.noise);
  const L shift = L(motion.origin_opening) * h;
  const L root =
      first_roots(ball_gap, ball_gap + shift * L(0.5),
                  ball_gap + shift - L(motion.linear_acceleration) * (h * h * L(0.5)), h);
  const L by_balls = select(ball_gap > zero, smaller(root, h), zero);
  const L step = select(by_speed > by_balls, by_speed, by_balls);
  return select(gap > zero, step, zero);
}

/// Steps of a gap that is linear in time.
template <typename L>
DYOP_INLINE L steady_step(L gap, L rate) {
  const L zero(0.0);
  // literal: 1 - 32u, as in first_root().
  const L step = gap / (zero - rate) * L(1 - 0x1p-48);
  return select(gap > zero, select(rate >= zero, infinity<L>(), step), zero);
}

/// The coupled bound with all terms bounded over h: the first root of a quadratic below the gap, or
/// h.
template <typename L>
DYOP_INLINE L trial_step(const TurningGaps<L>& gap_at, const FacingMotion& motion,
                         const StepBounds<L>& bounds, L gap, L h) {
  const L x = L(motion.largest_turning) * h;
  const L noise = L(motion.noise) * (L(1.0) + x + x * x);  // n + u k + q m is longer than n
  const L h_sq = h * h;
  const L c1 = gap_at.at(h * L(0.5)) - noise;
  // literal: 1/6 rounded up.
  const L c2 = gap_at.at(h, h_sq * L(0.5)) - noise -
               bounds.jerk * (h_sq * h * L(1.0 / 6 + 0x1p-54)) -
               bounds.acceleration * (h_sq * L(0.5));
  return smaller(first_roots(gap, c1, c2, h), h);
}

/// The coupled bound of a box in each lane, trying one length after another.
template <typename L>
DYOP_INLINE L coupled_step(const TurningGaps<L>& gap_at, const FacingMotion& motion,
                           const StepBounds<L>& bounds, const FacingPiece&, L gap) {
  const L zero(0.0);
  const L horizon(motion.horizon);
  L time = zero;
  // literal: a little longer than the gap lasts at its present rate.
  const L closing = gap_at.closing();
  const L guess = L(1.25) * gap / closing;
  L h = select(closing > zero, smaller(guess, horizon), horizon);
  auto is_active = gap > zero;
  for (int trial = 0; trial < kStepTrials; ++trial) {
    is_active = is_active & (h > zero);
    if (is_active.bits() == 0) break;
    const L step = trial_step(gap_at, motion, bounds, gap, h);
    // literal: a step within 5% of the last one is not worth another trial.
    const auto is_converged = (L(1.05) * time >= step) | ((h > step) & (step + step >= h));
    time = select(is_active & (step > time), step, time);
    const auto is_done = is_converged | ((step >= h) & (h >= horizon));
    is_active = without(is_active, is_done);
    // As in coupled_step() of safe_step.h.
    const auto is_much_too_long = h > L(kMuchTooLong) * step;
    h = smaller(horizon, select(is_much_too_long, sqrt(step * h), step + step));
  }
  return time;
}

/// The coupled bound of one box, trying several lengths at once.
DYOP_INLINE OneLane coupled_step(const TurningGaps<OneLane>& one_gap_at, const FacingMotion& motion,
                                 const StepBounds<OneLane>& one_bounds, const FacingPiece& other,
                                 OneLane gap) {
  const TurningGaps<Lanes> gap_at(one_gap_at);
  const StepBounds<Lanes> bounds(one_bounds);
  constexpr double kLongest = static_cast<double>(kStepLength[kStepLengths - 1]);
  double time = 0;
  double unit = speed_step(other, motion, gap, one_bounds.radius).v;
  if (!(unit > 0)) unit = motion.horizon / kLongest;  // infinite speeds
  for (int trial = 0; trial < kStepTrials; ++trial) {
    double longest = 0;
    for (int k = 0; k < kStepLengths; k += Lanes::kCount) {
      const Lanes h = smaller(Lanes(unit) * Lanes::load(kStepLength + k), Lanes(motion.horizon));
      double steps[Lanes::kCount];
      trial_step(gap_at, motion, bounds, Lanes(gap.v), h).store(steps);
      for (const double step : steps) longest = step > longest ? step : longest;
    }
    time = longest > time ? longest : time;
    const bool is_full = longest >= kLongest * unit;
    const bool is_short = longest < unit;
    if (longest >= motion.horizon || !(is_full || is_short)) break;
    unit = is_full ? longest : longest / 2;
  }
  return OneLane(time);
}

template <typename L>
DYOP_INLINE void box_steps(const GroupRows& rows, int first, const float (*axes)[kGroupWidth],
                           const FacingPiece& other, const FacingMotion& motion, BoxSteps* steps) {
  const BoxLanes<L> box(rows, first);
  L n[3];
  unit_axis(axes, first, n);
  TurningGaps<L> gap_at(box, other, motion, n);
  const L raw_gap = gap_at.at_zero() - L(motion.noise);
  // Overflow proves nothing; inf - inf is NaN.
  const L gap = select(raw_gap - raw_gap >= L(0.0), raw_gap, L(0.0));
  L time(0.0);
  if (motion.is_steady) {
    time = steady_step(gap, gap_at.rate);
  } else if ((gap > time).bits() != 0) {
    StepBounds<L> bounds(box, other, motion);
    L k_box[3];
    L m_box[3];
    L k_other[3];
    L m_other[3];
    const Broadcast3<L> turning(motion.turning);
    const Broadcast3<L> other_turning(motion.other_turning);
    cross(n, turning.v, k_box);
    cross(k_box, turning.v, m_box);
    cross(n, other_turning.v, k_other);
    cross(k_other, other_turning.v, m_other);
    gap_at.add_turning(box, other, k_box, m_box, k_other, m_other);
    // literal: 1 + 32u rounds the products up.
    bounds.jerk = (L(motion.turning_sq) * sqrt(dot(k_box, k_box)) * bounds.radius +
                   L(motion.other_turning_sq) * sqrt(dot(k_other, k_other)) * L(other.radius)) *
                  L(1 + 0x1p-48);
    time = coupled_step(gap_at, motion, bounds, other, gap);
    // Speeds and balls can win only where the direction has turned too far to mean anything, or
    // where what comes after the horizon is unknown.
    const L turned_by = time * L(motion.largest_turning);
    const L known = L(motion.horizon < motion.remaining ? motion.horizon : __builtin_inf());
    const auto is_directionless = (gap > L(0.0)) & ((turned_by > L(kDirectionlessTurn)) |
                                                    ((L(0.0) >= time) | (time >= known)));
    if (is_directionless.bits() != 0) {
      // Only there, so that a lane does not depend on its neighbours.
      const L step = directionless_step(other, motion, gap, bounds.radius);
      time = select(is_directionless & (step > time), step, time);
    }
  }
  const auto is_free = time >= L(motion.remaining);
  select(is_free & (gap > L(0.0)), infinity<L>(), time).store(steps->time + first);
  const L size = sqrt(dot(box.half_extents, box.half_extents)) + L(other.half_diagonal);
  const auto is_turned = (time * L(motion.largest_turning) > L(kReadvanceTurn)) &
                         (gap > L(kReadvanceTurnRatio) * size);
  steps->is_far |= ((gap > L(kReadvanceRatio) * size) | is_turned).bits() << first;
}

static void box_steps_group(const GroupRows& rows, int, int count, const FacingPiece& other,
                            const FacingMotion& motion, BoxSteps* steps) {
  steps->is_far = 0;
  float axes[3][kGroupWidth];
  find_axes(rows, count, RankingBox(other.box, rows), axes);
  for (int first = 0; first < count; first += Lanes::kCount) {
    box_steps<Lanes>(rows, first, axes, other, motion, steps);
  }
}

static void box_steps_one(const GroupRows& rows, int first, int, const FacingPiece& other,
                          const FacingMotion& motion, BoxSteps* steps) {
  steps->is_far = 0;
  float axes[3][kGroupWidth];
  // All boxes of the lanes cost no more than one, and branches cost nothing.
  find_axis<false, FloatLanes>(rows, first - first % FloatLanes::kCount,
                               RankingBox(other.box, rows), axes);
  box_steps<OneLane>(rows, first, axes, other, motion, steps);
}

}  // namespace DYOP_LANES

extern const BoxStepsKernels DYOP_KERNEL(box_steps);
const BoxStepsKernels DYOP_KERNEL(box_steps){box_steps_group, box_steps_one};

}  // namespace dyop::toi_internal
