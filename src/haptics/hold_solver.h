// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dyop/contact/contact_solver.h"
#include "dyop/haptics/virtual_coupling.h"
#include "haptics/obstacle.h"
#include "haptics/tool_body.h"

namespace dyop::haptics_internal {

/// The goal of a step.
struct StepGoal {
  ToolPose from;
  ToolStep wish;         ///< to the device's pose
  Scalar duration = 0;   ///< time during which tissue moves
  Scalar rest_gap = 0;   ///< besides an obstacle's margin
  Scalar recovery = 0;   ///< largest growth in the step of a gap below it
  Scalar tolerance = 0;  ///< of the solve, length: largest that is accepted
};

/// Finds the step nearest to the wished one, in the energy of the coupling's springs, that the
/// holds admit: gaps not below their rest gaps, and Coulomb friction. The impulses are then the
/// forces with which the springs pull against the holds. Solved as a velocity-level contact problem
/// in the step's own coordinates, one body for the tool's frame and one that can only turn for each
/// hinge's angle, so that no rows are needed; the unit of time is the step. Where that does not
/// converge, friction gives way, and gaps do not.
class HoldSolver {
 public:
  HoldSolver(const CouplingOptions& coupling, std::span<const ToolHinge> hinges,
             std::span<const ToolBody> bodies, const std::optional<ToolTrocar>& trocar,
             std::size_t most_contacts);

  /// Other springs from now on.
  void set_coupling(const CouplingOptions& coupling);

  /// Writes the impulses into `holds`. If the clock runs out, they are only a good start for the
  /// next solve, and the step is none.
  ToolStep solve(const StepGoal& goal, std::span<const std::unique_ptr<Obstacle>> obstacles,
                 std::vector<HoldPoint>& holds, WorkClock& clock);
  /// Whether no step was found in the last solve that keeps all gaps from shrinking.
  bool is_contradiction() const { return is_contradiction_; }
  /// The trocar's force on the tool in the last solve.
  const Vector3& trocar_force_W() const { return trocar_force_W_; }

 private:
  using Obstacles = std::span<const std::unique_ptr<Obstacle>>;

  void build(const StepGoal& goal, Obstacles obstacles, std::span<const HoldPoint> holds);
  void place_bodies(const StepGoal& goal);
  void add_hold(const StepGoal& goal, const Obstacle& obstacle, const HoldPoint& hold);
  void add_trocar(const StepGoal& goal);
  Vector3 axis_of(const StepGoal& goal, std::size_t hinge) const;
  bool run(const StepGoal& goal, int limit, WorkClock& clock);
  void keep_gaps(const StepGoal& goal, Obstacles obstacles, std::span<const HoldPoint> holds,
                 WorkClock& clock);
  ToolStep read_step(const StepGoal& goal) const;

  Matrix3 inverse_stiffness_;
  Matrix3 inverse_turn_stiffness_;
  std::vector<ToolHinge> hinges_;
  std::vector<std::optional<std::size_t>> hinge_of_body_;
  std::optional<ToolTrocar> trocar_;
  Vector3 trocar_force_W_ = Vector3::Zero();
  ContactProblem problem_;
  ContactCascade solver_;
  bool is_contradiction_ = false;
};

}  // namespace dyop::haptics_internal
