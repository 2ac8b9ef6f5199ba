#include "dynamics/free_flight.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/sequence_motion.h"
#include "motion/rotation_rate.h"

namespace dyop::internal {
namespace {

using Map = Eigen::Map<const Vector3>;

// A chart is good while its rotation vector stays well below pi; beyond this turn it is renewed.
constexpr Scalar kFlightChartTurn = 1.5;  // radians

// How many steps ahead a body without a wrench is integrated.
constexpr Scalar kStepsAhead = 16;

// The numbers of one body: position of the centre of mass, rotation vector in the chart, momentum
// and angular momentum in world axes. The rotation never drifts off the rotations ([Terze2016]).
Map position(const Scalar* y) {
  return Map(y);
}
Map theta(const Scalar* y) {
  return Map(y + 3);
}
Map linear_momentum(const Scalar* y) {
  return Map(y + 6);
}
Map spin(const Scalar* y) {
  return Map(y + 9);
}

// Cubic through two values and rates, at s in [0, 1] of an interval of length h.
Vector3 cubic(const Map& x0, const Map& rate0, const Map& x1, const Map& rate1, Scalar h,
              Scalar s) {
  const Scalar s2 = s * s;
  const Scalar s3 = s2 * s;
  return x0 + (3 * s2 - 2 * s3) * (x1 - x0) + h * ((s3 - 2 * s2 + s) * rate0 + (s3 - s2) * rate1);
}

}  // namespace

FreeFlight::FreeFlight(const BodyRecord& body, const CentralState& state, const Vector3& gravity_W,
                       IntegratorKind kind, const IntegratorOptions& options, Scalar t)
    : body_(body), gravity_W_(gravity_W), kind_(kind), options_(options) {
  last_ = start_node(t, state);
}

FreeFlight::~FreeFlight() = default;

FreeFlight::Node FreeFlight::start_node(Scalar t, const CentralState& state) const {
  Node node;
  node.t = t;
  node.R_WC = state.X_WM.rotation();
  const Vector3 momentum = body_.definition.mass_properties.mass * state.v_W;
  Eigen::Map<Vector3>(node.y.data()) = state.X_WM.translation();
  Eigen::Map<Vector3>(node.y.data() + 6) = momentum;
  Eigen::Map<Vector3>(node.y.data() + 9) = state.L_W;
  evaluate(node.R_WC, t, node.y, node.rate);
  return node;
}

void FreeFlight::evaluate(const Matrix3& R_WC, Scalar t, std::span<const Scalar> y,
                          std::span<Scalar> rate) const {
  const MassProperties& properties = body_.definition.mass_properties;
  const Vector3 turn = theta(y.data());
  const Matrix3 R_WB = R_WC * rotation_from_vector(turn);
  const Vector3 v_W = linear_momentum(y.data()) / properties.mass;
  const Vector3 w_W =
      R_WB * (body_.inverse_inertia_B * (R_WB.transpose() * Vector3(spin(y.data()))));
  Wrench wrench{properties.mass * gravity_W_, Vector3::Zero()};
  if (body_.definition.wrench) {
    const RigidPose X_WM = RigidPose::from_trusted(R_WB, position(y.data()));
    wrench = total_wrench(body_, gravity_W_, t, motion_state(properties, X_WM, v_W, w_W));
  }
  Eigen::Map<Vector3>(rate.data()) = v_W;
  Eigen::Map<Vector3>(rate.data() + 3) = rotation_vector_rate(turn, R_WC.transpose() * w_W);
  Eigen::Map<Vector3>(rate.data() + 6) = wrench.force;
  Eigen::Map<Vector3>(rate.data() + 9) = wrench.torque;
}

bool FreeFlight::turns_steadily(const Node& node) const {
  if (body_.definition.wrench) return false;
  const Vector3 w_W = node.R_WC * Vector3(Map(node.rate.data() + 3));  // theta is zero here
  const Vector3 L_W = spin(node.y.data());
  return w_W.cross(L_W).norm() <= 8 * kUnitRoundoff * w_W.norm() * L_W.norm();
}

void FreeFlight::append(const Node& end) {
  const auto node = [&](const Node& from) {
    return HermiteNode{position(from.y.data()), Map(from.rate.data()), theta(from.y.data()),
                       Map(from.rate.data() + 3)};
  };
  auto center = std::make_shared<HermiteMotion>(
      HermiteMotion::from_chart({last_.t, end.t}, last_.R_WC, node(last_), node(end)));
  pieces_.push_back({last_, end, about_center(body_, std::move(center))});
  last_ = end;
}

FreeFlight::Node FreeFlight::steady_end(Scalar t_end) const {
  Node end = last_;
  const Scalar h = t_end - last_.t;
  const Vector3 v = Map(last_.rate.data());
  end.t = t_end;
  Eigen::Map<Vector3>(end.y.data()) += h * (v + h / 2 * gravity_W_);
  Eigen::Map<Vector3>(end.y.data() + 3) = h * Vector3(Map(last_.rate.data() + 3));
  Eigen::Map<Vector3>(end.y.data() + 6) += h * Vector3(Map(last_.rate.data() + 6));
  Eigen::Map<Vector3>(end.rate.data()) = v + h * gravity_W_;
  return end;
}

FreeFlight::Node FreeFlight::integrated_end(Scalar t_end) {
  if (!integrator_) {
    integrator_ = make_integrator(
        kind_,
        [this](Scalar t, std::span<const Scalar> y, std::span<Scalar> rate) {
          evaluate(R_WC_, t, y, rate);
        },
        kStateSize, options_);
  }
  if (must_restart_) {
    R_WC_ = last_.R_WC;
    integrator_->restart(last_.t, last_.y);
    must_restart_ = false;
  }
  // A step turns the body by no more than about a radian: the chart and the cubic stay accurate.
  const Scalar speed = body_.inverse_inertia_B.norm() * spin(last_.y.data()).norm();
  const Scalar turn_limit = speed > 0 ? last_.t + 1 / speed : kInfinity;
  // A limit below the resolution of time must not stop time.
  integrator_->step(turn_limit > last_.t ? std::min(t_end, turn_limit) : t_end);
  longest_step_ = std::max(longest_step_, integrator_->time() - last_.t);
  Node end;
  end.t = integrator_->time();
  end.R_WC = R_WC_;
  std::copy(integrator_->state().begin(), integrator_->state().end(), end.y.begin());
  evaluate(R_WC_, end.t, end.y, end.rate);
  return end;
}

void FreeFlight::extend(Scalar t_end) {
  const bool is_slow = longest_step_ > 2 * (t_end - last_.t);
  const bool goes_ahead = !body_.definition.wrench && (is_slow || longest_step_ == 0);
  // Pieces that hardly outlast the step end with it instead: one motion then serves it.
  const Scalar ahead = goes_ahead ? last_.t + kStepsAhead * (t_end - last_.t) : t_end;
  constexpr int kMostPieces = 1'000'000;
  for (int i = 0; last_.t < t_end; ++i) {
    if (i == kMostPieces) {
      throw IntegrationError(
          compose_message("body '", body_.definition.name,
                          "': too many steps of the integrator before t = ", t_end));
    }
    const bool is_steady = theta(last_.y.data()).isZero(0) && turns_steadily(last_);
    if (is_steady) {
      append(steady_end(ahead));
    } else {
      try {
        append(integrated_end(ahead));
      } catch (const IntegrationError& error) {
        const std::string message = error.what();
        if (message.starts_with("body '")) throw;
        throw IntegrationError("body '" + body_.definition.name + "': " + message);
      }
    }
    if (is_steady || theta(last_.y.data()).norm() > kFlightChartTurn) {
      last_ = start_node(last_.t, state(last_.t));
      must_restart_ = true;
    }
  }
}

std::shared_ptr<const Motion> FreeFlight::motion(Scalar t, Scalar t_end) {
  std::erase_if(pieces_, [&](const Piece& piece) { return piece.end.t <= t; });
  if (last_.t < t_end) extend(t_end);
  if (pieces_.front().begin.t <= t && pieces_.front().end.t >= t_end) {
    return pieces_.front().motion;
  }
  std::vector<SequenceMotion::Part> parts;
  for (const Piece& piece : pieces_) {
    if (piece.begin.t >= t_end) break;
    parts.push_back({{std::max(t, piece.begin.t), std::min(t_end, piece.end.t)}, piece.motion});
  }
  return std::make_shared<SequenceMotion>(std::move(parts));
}

const FreeFlight::Piece& FreeFlight::piece_at(Scalar t) const {
  for (const Piece& piece : pieces_) {
    if (t <= piece.end.t) return piece;
  }
  return pieces_.back();
}

CentralState FreeFlight::state(Scalar t) const {
  const Piece& piece = piece_at(t);
  const Node& a = piece.begin;
  const Node& b = piece.end;
  const Scalar h = b.t - a.t;
  const Scalar s = (t - a.t) / h;
  const auto part = [&](std::size_t first) {
    if (t == b.t) return Vector3(Map(b.y.data() + first));
    return cubic(Map(a.y.data() + first), Map(a.rate.data() + first), Map(b.y.data() + first),
                 Map(b.rate.data() + first), h, s);
  };
  CentralState state;
  const RigidPose X_WB = piece.motion->pose(t);
  const MassProperties& properties = body_.definition.mass_properties;
  state.X_WM = RigidPose::from_trusted(X_WB.rotation(),
                                       X_WB.translation() + X_WB.rotation() * properties.p_BoBcm);
  state.v_W = part(6) / properties.mass;
  state.L_W = part(9);
  return state;
}

IntegratorStatistics FreeFlight::statistics() const {
  return integrator_ ? integrator_->statistics() : IntegratorStatistics{};
}

}  // namespace dyop::internal
