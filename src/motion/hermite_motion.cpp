#include "dyop/motion/hermite_motion.h"

#include "motion/bernstein.h"
#include "motion/rotation_rate.h"

namespace dyop {

using internal::evaluate;
using internal::largest_norm;
using internal::restrict_to;

HermiteMotion::HermiteMotion(const TimeInterval& interval, const RigidPose& X_WC)
    : interval_(interval), R_WC_(X_WC.rotation()) {
  require_valid(interval, "domain of Hermite motion");
  DYOP_REQUIRE(interval.length() > 0 && std::isfinite(interval.length()),
               "domain of Hermite motion must have a positive, finite length, not [",
               interval.begin, ", ", interval.end, "]");
}

HermiteMotion::HermiteMotion(const TimeInterval& interval, const State& begin, const State& end)
    : HermiteMotion(interval, RigidPose(begin.X_WB.rotation(), Vector3::Zero())) {
  internal::require_finite(begin.twist_WB.w_WB, "angular velocity at begin");
  internal::require_finite(end.twist_WB.w_WB, "angular velocity at end");
  const Matrix3 R_CW = R_WC_.transpose();
  const Vector3 theta = rotation_vector(R_CW * end.X_WB.rotation());
  set_nodes(
      {begin.X_WB.translation(), begin.twist_WB.v_WB, Vector3::Zero(), R_CW * begin.twist_WB.w_WB},
      {end.X_WB.translation(), end.twist_WB.v_WB, theta,
       internal::rotation_vector_rate(theta, R_CW * end.twist_WB.w_WB)});
}

HermiteMotion HermiteMotion::from_chart(const TimeInterval& interval, const Matrix3& R_WC,
                                        const HermiteNode& begin, const HermiteNode& end) {
  return from_chart(interval, RigidPose(R_WC, Vector3::Zero()), begin, end);
}

HermiteMotion HermiteMotion::from_chart(const TimeInterval& interval, const RigidPose& X_WC,
                                        const HermiteNode& begin, const HermiteNode& end) {
  HermiteMotion motion(interval, X_WC);
  motion.set_nodes(begin, end);
  return motion;
}

void HermiteMotion::set_nodes(const HermiteNode& begin, const HermiteNode& end) {
  for (const auto& [node, name] : {std::pair(&begin, " at begin"), std::pair(&end, " at end")}) {
    const std::string place = name;
    internal::require_finite(node->p_WB, ("position" + place).c_str());
    internal::require_finite(node->v_WB, ("velocity" + place).c_str());
    internal::require_finite(node->theta, ("rotation vector" + place).c_str());
    internal::require_finite(node->theta_rate, ("rotation vector's rate" + place).c_str());
  }
  begin_ = begin;
  end_ = end;
  const Scalar h = interval_.length();
  displacement_ = make_cubic(
      internal::cubic_hermite(Vector3::Zero(), begin.v_WB, end.p_WB - begin.p_WB, end.v_WB, h), h);
  theta_ = make_cubic(
      internal::cubic_hermite(begin.theta, begin.theta_rate, end.theta, end.theta_rate, h), h);
  for (const Cubic* cubic : {&displacement_, &theta_}) {
    DYOP_REQUIRE(std::isfinite(cubic->acceleration_noise), "Hermite motion over a time of ", h,
                 " is too fast: accelerations overflow");
  }
}

HermiteMotion::Cubic HermiteMotion::make_cubic(const std::array<Vector3, 4>& value,
                                               Scalar duration) {
  Cubic cubic;
  cubic.value = value;
  cubic.rate = internal::derivative<4>(value, duration);
  cubic.acceleration = internal::derivative<3>(cubic.rate, duration);
  cubic.value_noise = kMotionNoise * largest_norm<4>(value);
  cubic.rate_noise = kMotionNoise * largest_norm<3>(cubic.rate);
  // Differences of the rates cancel: the error is relative to the rates, not to the differences.
  cubic.acceleration_noise = cubic.rate_noise / duration;
  return cubic;
}

MotionState HermiteMotion::state(Scalar t) const {
  const Scalar s = parameter(t);
  const auto [R, w] =
      internal::turning_state(evaluate<4>(theta_.value, s), evaluate<3>(theta_.rate, s));
  return {RigidPose::from_trusted(R_WC_ * R, begin_.p_WB + evaluate<4>(displacement_.value, s)),
          {evaluate<3>(displacement_.rate, s), R_WC_ * w}};
}

RigidPose HermiteMotion::pose(Scalar t) const {
  return HermiteMotion::state(t).X_WB;
}

Twist HermiteMotion::twist(Scalar t) const {
  return HermiteMotion::state(t).twist;
}

TwistBound HermiteMotion::twist_bound(const TimeInterval& interval) const {
  using internal::round_up;
  const Scalar s0 = parameter(interval.begin);
  const Scalar s1 = parameter(interval.end);
  const auto acceleration = [=](const Cubic& cubic) {
    return largest_norm<2>(restrict_to<2>(cubic.acceleration, s0, s1)) + cubic.acceleration_noise;
  };
  const auto v = restrict_to<3>(displacement_.rate, s0, s1);
  const auto theta = restrict_to<4>(theta_.value, s0, s1);
  const auto theta_rate = restrict_to<3>(theta_.rate, s0, s1);
  const Scalar turn_noise = theta_.value_noise * (theta_.rate_noise / kMotionNoise);
  const Scalar turn = largest_norm<6>(internal::cross_product(theta, theta_rate)) + turn_noise;
  const Scalar angular_speed = largest_norm<3>(theta_rate) + theta_.rate_noise;
  return {
      round_up(largest_norm<3>(v) + displacement_.rate_noise), round_up(angular_speed),
      round_up(acceleration(displacement_)),
      round_up(internal::angular_acceleration_bound(angular_speed, acceleration(theta_), turn))};
}

}  // namespace dyop
