// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/free_flight.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "motion/curve/chart_curve.h"

namespace dyop::dynamics_internal {

TorqueFreeTurn::TorqueFreeTurn(const Matrix3& inverse_inertia_B, const Vector3& L_B)
    : inverse_inertia_B_(inverse_inertia_B) {
  // Time is scaled so that speeds are at most one: coefficients neither overflow nor vanish.
  const Scalar speed = inverse_inertia_B.norm() * L_B.norm();
  unit_ = speed > 0 ? 1 / speed : kInfinity;
  const bool turns = unit_ < kInfinity;
  if (!turns) unit_ = 1;
  std::array<Vector3, kDegree + 1> w_B;  // in units of 1 / unit_
  L_B_[0] = L_B;
  vector_[0].setZero();
  scalar_[0] = 1;
  w_B[0] = unit_ * (inverse_inertia_B * L_B);
  for (std::size_t k = 0; k < kDegree; ++k) {
    Vector3 L_rate = Vector3::Zero();
    Vector3 vector_rate = Vector3::Zero();
    Scalar scalar_rate = 0;
    for (std::size_t i = 0; i <= k; ++i) {
      const Vector3& w = w_B[k - i];
      L_rate += L_B_[i].cross(w);
      vector_rate += scalar_[i] * w + vector_[i].cross(w);
      scalar_rate -= vector_[i].dot(w);
    }
    const auto n = static_cast<Scalar>(k + 1);
    L_B_[k + 1] = L_rate / n;
    vector_[k + 1] = vector_rate / (2 * n);
    scalar_[k + 1] = scalar_rate / (2 * n);
    w_B[k + 1] = unit_ * (inverse_inertia_B * L_B_[k + 1]);
  }
  // Keeps the last two terms of each series below rounding, and the turn below a radian.
  Scalar reach = 1;
  for (const std::size_t k : {kDegree - 1, kDegree}) {
    const Scalar size = std::max(std::hypot(vector_[k].norm(), scalar_[k]), w_B[k].norm());
    const auto power = static_cast<Scalar>(k);
    if (size > 0) reach = std::min(reach, std::pow(kUnitRoundoff / size, 1 / power));
  }
  span_ = turns ? reach * unit_ : kInfinity;
}

TorqueFreeTurn::Turn TorqueFreeTurn::at(Scalar elapsed) const {
  const Scalar s = elapsed / unit_;
  Vector3 L_B = L_B_[kDegree];
  Vector3 vector = vector_[kDegree];
  Scalar scalar = scalar_[kDegree];
  for (std::size_t k = kDegree; k-- > 0;) {
    L_B = L_B * s + L_B_[k];
    vector = vector * s + vector_[k];
    scalar = scalar * s + scalar_[k];
  }
  const Scalar sine = vector.norm();
  Turn turn;
  turn.theta =
      sine > 0 ? Vector3(2 * std::atan2(sine, scalar) / sine * vector) : Vector3(2 * vector);
  const Vector3 w_B = inverse_inertia_B_ * L_B;
  // q w q^-1 with a quaternion of length one.
  const Vector3 half = 2 * vector.cross(w_B);
  turn.w_C = w_B + scalar * half + vector.cross(half);
  return turn;
}

namespace {

using Map = Eigen::Map<const Vector3>;

// A chart is good while its rotation vector stays well below pi; beyond this angle it is renewed.
constexpr Scalar kFlightChartTurn = 1.5;  // radians

// How many steps ahead a body without a wrench is computed.
constexpr Scalar kStepsAhead = 16;

// Largest number of attempts at the length of a piece.
constexpr int kMostHalvings = 50;

// State vector of one body: position of the centre of mass, rotation vector in the chart, momentum
// and angular momentum in world axes. The rotation cannot drift away from SO(3) ([Terze2016]).
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

void require_progress(const BodyRecord& body, int piece, Scalar t_end) {
  constexpr int kMostPieces = 1'000'000;
  if (piece < kMostPieces) return;
  throw IntegrationError(compose_message("body '", body.definition.name,
                                         "': too many steps of the integrator before t = ", t_end));
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

void FreeFlight::append(const Node& end) {
  const auto node = [&](const Node& from) {
    return HermiteNode{position(from.y.data()), Map(from.rate.data()), theta(from.y.data()),
                       Map(from.rate.data() + 3)};
  };
  auto center = std::make_shared<HermiteMotion>(
      HermiteMotion::from_chart({last_.t, end.t}, last_.R_WC, node(last_), node(end)));
  pieces_.push_back({last_, end, about_center(body_, std::move(center)), std::nullopt});
  last_ = end;
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
  }
  must_restart_ = true;  // unless the step is taken: a wrench may throw
  // A step turns the body by about a radian at most, so chart and cubic stay accurate.
  const Scalar speed = body_.inverse_inertia_B.norm() * spin(last_.y.data()).norm();
  const Scalar turn_limit = speed > 0 ? last_.t + 1 / speed : kInfinity;
  // A limit below the resolution of time must not stop progress.
  integrator_->step(turn_limit > last_.t ? std::min(t_end, turn_limit) : t_end);
  Node end;
  end.t = integrator_->time();
  end.R_WC = R_WC_;
  std::copy(integrator_->state().begin(), integrator_->state().end(), end.y.begin());
  evaluate(R_WC_, end.t, end.y, end.rate);
  must_restart_ = false;
  return end;
}

void FreeFlight::integrate(Scalar t_end) {
  for (int i = 0; last_.t < t_end; ++i) {
    require_progress(body_, i, t_end);
    try {
      append(integrated_end(t_end));
    } catch (const IntegrationError& error) {
      const std::string message = error.what();
      if (message.starts_with("body '")) throw;
      throw IntegrationError("body '" + body_.definition.name + "': " + message);
    }
    if (theta(last_.y.data()).norm() > kFlightChartTurn) {
      last_ = start_node(last_.t, state(last_.t));
      must_restart_ = true;
    }
  }
}

// Starting at last_.
void FreeFlight::renew_turn() {
  Matrix3 R_WB = last_.R_WC * rotation_from_vector(theta(last_.y.data()));
  // Not from last_, which came from a cubic: that way the errors of the cubics do not add up.
  if (turn_ && last_.t - t_turn_ <= turn_->span()) {
    R_WB = R_WT_ * rotation_from_vector(turn_->at(last_.t - t_turn_).theta);
  }
  R_WB = RigidPose(R_WB, Vector3::Zero()).rotation();  // removes the drift of many products
  turn_.emplace(body_.inverse_inertia_B, R_WB.transpose() * spin(last_.y.data()));
  R_WT_ = R_WB;
  t_turn_ = last_.t;
}

// A body without a wrench at time t: where the parabola and the free turn take it from last_.
FreeFlight::Node FreeFlight::turning_node(Scalar t) const {
  Node node = last_;
  const Scalar h = t - last_.t;
  const Vector3 v = Map(last_.rate.data());
  const TorqueFreeTurn::Turn turn = turn_->at(t - t_turn_);
  node.t = t;
  node.R_WC = R_WT_;
  Eigen::Map<Vector3>(node.y.data()) += h * (v + h / 2 * gravity_W_);
  Eigen::Map<Vector3>(node.y.data() + 3) = turn.theta;
  Eigen::Map<Vector3>(node.y.data() + 6) += h * Vector3(Map(last_.rate.data() + 6));
  Eigen::Map<Vector3>(node.rate.data()) = v + h * gravity_W_;
  Eigen::Map<Vector3>(node.rate.data() + 3) = rotation_vector_rate(turn.theta, turn.w_C);
  return node;
}

// The end of a piece starting at last_ that should serve several steps of length h.
FreeFlight::Node FreeFlight::coasting_end(Scalar h) {
  const Scalar wanted = std::min(h, coasting_length_);
  if (!turn_ || !(t_turn_ + turn_->span() - last_.t >= wanted)) renew_turn();
  const Scalar tolerance = std::max(options_.relative_tolerance, 8 * kUnitRoundoff);
  const Scalar most =
      std::min({t_turn_ + turn_->span() - last_.t, kStepsAhead * h, options_.max_step});
  const Node begin = turning_node(last_.t);
  const Vector3 theta_0 = theta(begin.y.data());
  const Vector3 rate_0 = Map(begin.rate.data() + 3);
  Scalar length = std::min(coasting_length_, most);
  for (int halving = 0;; ++halving) {
    // A length below the resolution of time must not stop progress.
    const Scalar t = std::max(last_.t + length, std::nextafter(last_.t, kInfinity));
    const Node end = turning_node(t);
    const Scalar half = (t - last_.t) / 2;
    const Vector3 rate_1 = Map(end.rate.data() + 3);
    const Vector3 middle =
        (theta_0 + theta(end.y.data())) / 2 + half / 4 * (rate_0 - rate_1);  // of the cubic
    const Scalar error = (middle - turn_->at(last_.t + half - t_turn_).theta).norm();
    // The error grows with the fourth power of the length.
    const Scalar factor = 0.9 * std::pow(tolerance / std::max(error, kUnitRoundoff), 0.25);
    coasting_length_ = factor * (t - last_.t);
    if (error <= tolerance || halving == kMostHalvings) return end;
    length = std::min(coasting_length_, length / 2);
  }
}

// Pieces without a wrench. The first one starts anew at t, so that one usually serves a step.
void FreeFlight::coast(Scalar t, Scalar t_end) {
  if (last_.t > t) {
    const Vector3 w_W = piece_at(t).motion->twist(t).w_WB;
    Node node = start_node(t, state(t));
    Eigen::Map<Vector3>(node.rate.data() + 3) = node.R_WC.transpose() * w_W;
    pieces_.clear();
    last_ = node;
  }
  for (int i = 0; last_.t < t_end; ++i) {
    require_progress(body_, i, t_end);
    const Node end = coasting_end(t_end - last_.t);
    if (last_.R_WC != end.R_WC) {
      const Matrix3 R_CW = end.R_WC.transpose();
      const Matrix3 R_WB = last_.R_WC * rotation_from_vector(theta(last_.y.data()));
      const Vector3 turn = rotation_vector(R_CW * R_WB);
      const Vector3 w_W =
          last_.R_WC * angular_velocity(theta(last_.y.data()), Map(last_.rate.data() + 3));
      Eigen::Map<Vector3>(last_.y.data() + 3) = turn;
      Eigen::Map<Vector3>(last_.rate.data() + 3) = rotation_vector_rate(turn, R_CW * w_W);
      last_.R_WC = end.R_WC;
    }
    append(end);
    Piece& piece = pieces_.back();
    piece.bound = piece.motion->twist_bound({piece.begin.t, piece.end.t});
    ++coasting_pieces_;
  }
}

std::shared_ptr<const Motion> FreeFlight::motion(Scalar t, Scalar t_end) {
  std::erase_if(pieces_, [&](const Piece& piece) { return piece.end.t <= t; });
  if (last_.t < t_end) body_.definition.wrench ? integrate(t_end) : coast(t, t_end);
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

std::optional<TwistBound> FreeFlight::known_bound(const TimeInterval& interval) const {
  if (pieces_.empty()) return std::nullopt;
  const Piece& piece = pieces_.front();
  const bool is_inside = piece.begin.t <= interval.begin && interval.end <= piece.end.t;
  return is_inside ? piece.bound : std::nullopt;
}

IntegratorStatistics FreeFlight::statistics() const {
  IntegratorStatistics sum = integrator_ ? integrator_->statistics() : IntegratorStatistics{};
  sum.steps += coasting_pieces_;
  return sum;
}

}  // namespace dyop::dynamics_internal
