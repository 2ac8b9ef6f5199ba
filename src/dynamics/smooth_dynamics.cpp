#include "dynamics/smooth_dynamics.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dyop/core/error.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/rest_motion.h"
#include "motion/rotation_rate.h"

namespace dyop::internal {
namespace {

constexpr std::size_t kStateSize = 12;

// A chart is good while its rotation vector stays well below pi; beyond this turn it is renewed.
constexpr Scalar kLargestChartTurn = 1.5;  // radians

// The numbers of one body within the state vector.
struct StateView {
  explicit StateView(const Scalar* y)
      : p_WBcm(y), theta(y + 3), momentum_W(y + 6), angular_momentum_W(y + 9) {}
  Eigen::Map<const Vector3> p_WBcm;
  Eigen::Map<const Vector3> theta;
  Eigen::Map<const Vector3> momentum_W;
  Eigen::Map<const Vector3> angular_momentum_W;
};

// Angular velocity in world axes of a body with angular momentum L.
Vector3 angular_velocity_W(const Matrix3& inverse_inertia_B, const Matrix3& R_WB,
                           const Vector3& L_W) {
  return R_WB * (inverse_inertia_B * (R_WB.transpose() * L_W));
}

}  // namespace

MotionState body_state(const MassProperties& properties, const Matrix3& R_WB, const Vector3& p_WBcm,
                     const Vector3& v_WBcm, const Vector3& w_WB) {
  const Vector3 p_BoBcm_W = R_WB * properties.p_BoBcm;
  return {RigidPose::from_trusted(R_WB, p_WBcm - p_BoBcm_W),
          Twist{v_WBcm - w_WB.cross(p_BoBcm_W), w_WB}};
}

SmoothDynamics::SmoothDynamics(IntegratorKind kind, const IntegratorOptions& options,
                               const Vector3& gravity_W)
    : kind_(kind), options_(options), gravity_W_(gravity_W) {}

void SmoothDynamics::restart(Scalar t, const std::vector<BodyRecord>& bodies) {
  std::vector<ActiveBody> active;
  std::vector<Scalar> y;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyRecord& body = bodies[i];
    if (!body.is_active()) continue;
    const MassProperties& properties = body.definition.mass_properties;
    active.push_back({i, &body.definition, body.state.X_WB.rotation(), properties.I_BBcm,
                      properties.I_BBcm.inverse()});
    const Vector3 momentum = properties.mass * body.center_velocity();
    const Vector3 angular_momentum = body.inertia_W() * body.state.twist.w_WB;
    for (const Vector3& part : std::array<Vector3, 4>{body.center_of_mass(), Vector3::Zero(),
                                                      momentum, angular_momentum}) {
      y.insert(y.end(), part.data(), part.data() + 3);
    }
  }
  const bool has_same_size = integrator_ && active.size() == bodies_.size();
  bodies_ = std::move(active);
  if (!has_same_size) {
    finished_ = statistics();
    integrator_ = make_integrator(
        kind_,
        [this](Scalar time, std::span<const Scalar> state, std::span<Scalar> derivative) {
          evaluate(time, state, derivative);
        },
        y.size(), options_);
  }
  integrator_->restart(t, y);
  begin_ = t;
}

void SmoothDynamics::step(Scalar t_end) {
  y_begin_.assign(integrator_->state().begin(), integrator_->state().end());
  begin_ = integrator_->time();
  // A step turns no body by more than about a radian: the chart and the cubic stay accurate.
  Scalar fastest = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const StateView view(y_begin_.data() + i * kStateSize);
    fastest =
        std::max(fastest, (bodies_[i].inverse_inertia_B.norm() * view.angular_momentum_W.norm()));
  }
  const Scalar turn_limit = fastest > 0 ? begin_ + 1 / fastest : kInfinity;
  // A limit below the resolution of time must not stop time.
  integrator_->step(turn_limit > begin_ ? std::min(t_end, turn_limit) : t_end);
}

void SmoothDynamics::evaluate(Scalar t, std::span<const Scalar> y, std::span<Scalar> dydt) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const ActiveBody& body = bodies_[i];
    const MassProperties& properties = body.definition->mass_properties;
    const StateView view(y.data() + i * kStateSize);
    const Matrix3 R_CB = rotation_from_vector(view.theta);
    const Matrix3 R_WB = body.R_WC * R_CB;
    const Vector3 v_WBcm = view.momentum_W / properties.mass;
    const Vector3 w_WB = angular_velocity_W(body.inverse_inertia_B, R_WB, view.angular_momentum_W);
    Wrench wrench{properties.mass * gravity_W_, Vector3::Zero()};
    if (body.definition->wrench) {
      const Wrench user =
          body.definition->wrench(t, body_state(properties, R_WB, view.p_WBcm, v_WBcm, w_WB));
      wrench.force += user.force;
      wrench.torque += user.torque;
    }
    const Vector3 theta_rate = rotation_vector_rate(view.theta, body.R_WC.transpose() * w_WB);
    Scalar* out = dydt.data() + i * kStateSize;
    Eigen::Map<Vector3>(out + 0) = v_WBcm;
    Eigen::Map<Vector3>(out + 3) = theta_rate;
    Eigen::Map<Vector3>(out + 6) = wrench.force;
    Eigen::Map<Vector3>(out + 9) = wrench.torque;
  }
}

std::size_t SmoothDynamics::slot(std::size_t body) const {
  const auto found = std::lower_bound(
      bodies_.begin(), bodies_.end(), body,
      [](const ActiveBody& active, std::size_t index) { return active.index < index; });
  if (found == bodies_.end() || found->index != body) {
    throw InternalError(compose_message("body ", body, " is not active"));
  }
  return static_cast<std::size_t>(found - bodies_.begin());
}

std::shared_ptr<const Motion> SmoothDynamics::motion(std::size_t body) const {
  const std::size_t i = slot(body);
  const ActiveBody& active = bodies_[i];
  const auto node = [&](const Scalar* y) {
    const StateView view(y + i * kStateSize);
    const Matrix3 R_WB = active.R_WC * rotation_from_vector(view.theta);
    const Vector3 w_C = active.R_WC.transpose() *
                        angular_velocity_W(active.inverse_inertia_B, R_WB, view.angular_momentum_W);
    return HermiteNode{view.p_WBcm, view.momentum_W / active.definition->mass_properties.mass,
                       view.theta, rotation_vector_rate(view.theta, w_C)};
  };
  auto center = std::make_shared<HermiteMotion>(HermiteMotion::from_chart(
      {begin_, time()}, active.R_WC, node(y_begin_.data()), node(integrator_->state().data())));
  const Vector3& p_BoBcm = active.definition->mass_properties.p_BoBcm;
  if (p_BoBcm.isZero(0)) return center;
  return std::make_shared<ComposedMotion>(
      std::move(center), std::make_shared<RestMotion>(RigidPose(Vector3(-p_BoBcm))));
}

MotionState SmoothDynamics::state(std::size_t body, const Motion& motion, Scalar t) const {
  const std::size_t i = slot(body);
  const ActiveBody& active = bodies_[i];
  std::vector<Scalar> y(integrator_->state().size());
  integrator_->evaluate(t, y);
  const StateView view(y.data() + i * kStateSize);
  MotionState state;
  state.X_WB = motion.pose(t);
  const Matrix3& R_WB = state.X_WB.rotation();
  const Vector3 w_WB = angular_velocity_W(active.inverse_inertia_B, R_WB, view.angular_momentum_W);
  const Vector3 p_BoBcm_W = R_WB * active.definition->mass_properties.p_BoBcm;
  state.twist.w_WB = w_WB;
  state.twist.v_WB =
      view.momentum_W / active.definition->mass_properties.mass - w_WB.cross(p_BoBcm_W);
  return state;
}

bool SmoothDynamics::needs_restart() const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (StateView(integrator_->state().data() + i * kStateSize).theta.norm() > kLargestChartTurn) {
      return true;
    }
  }
  return false;
}

IntegratorStatistics SmoothDynamics::statistics() const {
  IntegratorStatistics sum = finished_;
  if (integrator_) {
    const IntegratorStatistics current = integrator_->statistics();
    sum.steps += current.steps;
    sum.rejected_steps += current.rejected_steps;
    sum.function_evaluations += current.function_evaluations;
  }
  return sum;
}

}  // namespace dyop::internal
