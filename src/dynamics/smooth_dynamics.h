#pragma once

#include <memory>
#include <vector>

#include "dynamics/body_record.h"
#include "dyop/dynamics/integrator.h"

namespace dyop::internal {

/// The differential equations of the active bodies between impacts, and their solver.
///
/// Per body twelve numbers: position of the centre of mass, rotation vector θ of R_WB = R_WC exp(θ)
/// in a chart C that is fixed between restarts, linear momentum, and angular momentum about the
/// centre of mass, all in world axes but θ. The rotation so never drifts off the rotations, and θ
/// is the polynomial that the impact engine needs ([Terze2016]).
class SmoothDynamics {
 public:
  SmoothDynamics(IntegratorKind kind, const IntegratorOptions& options, const Vector3& gravity_W);

  /// Takes over all active bodies at time t; the solver starts afresh.
  void restart(Scalar t, const std::vector<BodyRecord>& bodies);

  /// One internal step towards t_end: proposed, not committed.
  void step(Scalar t_end);
  Scalar begin() const { return begin_; }
  Scalar time() const { return integrator_->time(); }

  /// The motion of an active body over the last step: its centre of mass on a cubic Hermite
  /// polynomial, its rotation in the chart on another.
  std::shared_ptr<const Motion> motion(std::size_t body) const;

  /// State of an active body at t in the last step: the pose of motion(), the momenta of the
  /// solver.
  MotionState state(std::size_t body, const Motion& motion, Scalar t) const;

  /// True once a chart has turned so far that the solver should be restarted.
  bool needs_restart() const;

  IntegratorStatistics statistics() const;

 private:
  struct ActiveBody {
    std::size_t index = 0;  // into the World's bodies
    const BodyDefinition* definition = nullptr;
    Matrix3 R_WC;  // rotation of the chart
    Matrix3 inertia_B;
    Matrix3 inverse_inertia_B;
  };

  void evaluate(Scalar t, std::span<const Scalar> y, std::span<Scalar> dydt) const;
  const ActiveBody& active(std::size_t body) const;
  std::size_t slot(std::size_t body) const;

  IntegratorKind kind_;
  IntegratorOptions options_;
  Vector3 gravity_W_;
  std::vector<ActiveBody> bodies_;
  std::unique_ptr<Integrator> integrator_;
  IntegratorStatistics finished_;  // of solvers that were replaced
  std::vector<Scalar> y_begin_;
  Scalar begin_ = 0;
};

}  // namespace dyop::internal
