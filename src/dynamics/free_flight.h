// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "dynamics/body_record.h"
#include "dyop/core/types.h"
#include "dyop/dynamics/integrator.h"

namespace dyop::dynamics_internal {

/// How a rigid body turns without torque: the Taylor series of its angular momentum in body axes
/// and of its quaternion about a start time. The equations are quadratic, so the coefficients
/// follow from each other by sums of products ([Jorba2005]).
class TorqueFreeTurn {
 public:
  /// From the angular momentum at the start, in the axes that B has then.
  TorqueFreeTurn(const Matrix3& inverse_inertia_B, const Vector3& L_B);

  /// Up to this time after the start the series are exact to rounding; > 0, may be infinite.
  Scalar span() const { return span_; }

  struct Turn {
    Vector3 theta;  // rotation vector from the start to now; its length is at most pi
    Vector3 w_C;    // angular velocity in the axes of B at the start
  };
  /// `elapsed` in [0, span()].
  Turn at(Scalar elapsed) const;

 private:
  static constexpr std::size_t kDegree = 16;
  // Coefficients in powers of elapsed / unit_.
  std::array<Vector3, kDegree + 1> L_B_;
  std::array<Vector3, kDegree + 1> vector_;  // of the quaternion
  std::array<Scalar, kDegree + 1> scalar_{};
  Matrix3 inverse_inertia_B_;
  Scalar unit_ = 1;
  Scalar span_ = 0;
};

/// The path of one body in free flight: gravity and its own wrench, integrated separately from all
/// other bodies.
///
/// Each piece is a cubic in position and rotation vector between two states of the integrator;
/// momenta are cubics too. A body without a wrench needs no integrator: it falls along a parabola
/// and turns as TorqueFreeTurn says. Its pieces extend beyond the step and serve several steps, as
/// long as a cubic follows the turn to the integrator's relative tolerance (radians).
class FreeFlight {
 public:
  /// Starts at `state`; `body` must outlive the flight.
  FreeFlight(const BodyRecord& body, const CentralState& state, const Vector3& gravity_W,
             IntegratorKind kind, const IntegratorOptions& options, Scalar t);
  ~FreeFlight();

  /// The motion of the frame B from t to t_end > t. Everything before t is discarded.
  /// @throws IntegrationError naming the body.
  std::shared_ptr<const Motion> motion(Scalar t, Scalar t_end);

  /// At a time covered by the last motion().
  CentralState state(Scalar t) const;

  /// The bound of the last motion() over at least this interval if it is already known; none if
  /// several pieces lie there.
  std::optional<TwistBound> known_bound(const TimeInterval& interval) const;

  IntegratorStatistics statistics() const;

 private:
  static constexpr std::size_t kStateSize = 12;
  // The body at the end of a piece. Rates are those of the equations of motion.
  struct Node {
    Scalar t = 0;
    Matrix3 R_WC;  // chart, the same at both ends of a piece
    std::array<Scalar, kStateSize> y{};
    std::array<Scalar, kStateSize> rate{};
  };
  struct Piece {
    Node begin;
    Node end;
    std::shared_ptr<const Motion> motion;  // of B
    std::optional<TwistBound> bound;       // of a coasting piece
  };

  void integrate(Scalar t_end);
  Node integrated_end(Scalar t_end);
  void coast(Scalar t, Scalar t_end);
  Node coasting_end(Scalar h);
  void renew_turn();
  Node turning_node(Scalar t) const;
  void append(const Node& end);
  void evaluate(const Matrix3& R_WC, Scalar t, std::span<const Scalar> y,
                std::span<Scalar> rate) const;
  Node start_node(Scalar t, const CentralState& state) const;
  const Piece& piece_at(Scalar t) const;

  const BodyRecord& body_;
  Vector3 gravity_W_;
  IntegratorKind kind_;
  IntegratorOptions options_;
  Node last_;
  std::vector<Piece> pieces_;
  std::unique_ptr<Integrator> integrator_;
  Matrix3 R_WC_ = Matrix3::Identity();  // chart of the integrator
  bool must_restart_ = true;
  // Without a wrench.
  std::optional<TorqueFreeTurn> turn_;
  Matrix3 R_WT_ = Matrix3::Identity();  // chart of turn_: the orientation at its start
  Scalar t_turn_ = 0;                   // start time of turn_
  Scalar coasting_length_ = kInfinity;  // of the next piece
  std::int64_t coasting_pieces_ = 0;
};

}  // namespace dyop::dynamics_internal
