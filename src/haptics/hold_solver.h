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
  ToolPoses from;
  ToolSteps wish;                ///< to the devices' poses
  Scalar duration = 0;           ///< time during which tissue moves
  Scalar rest_gap = 0;           ///< besides an obstacle's margin
  Scalar recovery = 0;           ///< largest growth in the step of a gap below it
  Scalar tolerance = 0;          ///< of the solve, length: largest that is accepted
  ToolSet moving = all_tools();  ///< the others stand, whatever they are pushed with
};

/// Finds the step nearest to the wished one, in the energy of the coupling's springs, that the
/// holds admit: gaps not below their rest gaps, and Coulomb friction. The impulses are then the
/// forces with which the springs pull against the holds. Solved as a velocity-level contact problem
/// in the step's own coordinates, one body for each tool's frame and one that can only turn for
/// each hinge's angle, so that no rows are needed; the unit of time is the step. Where that does
/// not converge, friction gives way, and gaps do not.
class HoldSolver {
 public:
  /// @param tools Each with its springs.
  HoldSolver(std::span<const HapticTool> tools, std::span<const ToolBody> bodies,
             std::size_t most_contacts);

  /// Other springs from now on.
  void set_coupling(std::size_t tool, const CouplingOptions& coupling);

  /// Writes the impulses into `holds`. If the clock runs out, they are only a good start for the
  /// next solve, and the step is none.
  ToolSteps solve(const StepGoal& goal, std::span<const std::unique_ptr<Obstacle>> obstacles,
                  std::vector<HoldPoint>& holds, WorkClock& clock);
  /// Whether no step was found in the last solve that keeps all gaps from shrinking.
  bool is_contradiction() const { return is_contradiction_; }
  /// The trocar's force on a tool in the last solve.
  const Vector3& trocar_force_W(std::size_t tool) const { return trocar_forces_W_[tool]; }

 private:
  using Obstacles = std::span<const std::unique_ptr<Obstacle>>;

  /// What a body of a tool moves with.
  struct Carrier {
    std::size_t tool = 0;
    std::optional<std::size_t> hinge;
  };

  void build(const StepGoal& goal, Obstacles obstacles, std::span<const HoldPoint> holds);
  void place_bodies(const StepGoal& goal);
  void place_tool(std::size_t tool, const ToolPose& from, const ToolStep& wish);
  void add_hold(const StepGoal& goal, const Obstacle& obstacle, const HoldPoint& hold);
  void add_other_tool(const StepGoal& goal, const HoldPoint& hold, PointContact& contact);
  void add_trocar(const StepGoal& goal, std::size_t tool);
  Vector3 axis_of(const ToolPose& from, std::size_t tool, std::size_t hinge) const;
  Vector3 arm(const StepGoal& goal, const Carrier& carrier, const Vector3& p_W) const;
  std::size_t angle_of(const Carrier& carrier) const {
    return frames_[carrier.tool] + 1 + *carrier.hinge;
  }
  bool run(const StepGoal& goal, int limit, WorkClock& clock);
  void keep_gaps(const StepGoal& goal, Obstacles obstacles, std::span<const HoldPoint> holds,
                 WorkClock& clock);
  ToolSteps read_steps(const StepGoal& goal) const;

  std::vector<HapticTool> tools_;
  std::vector<std::size_t> frames_;  // by tool: the body of its frame; those of its hinges follow
  std::vector<Carrier> carriers_;    // by body of the tools
  PerTool<Vector3> trocar_forces_W_;
  ContactProblem problem_;
  ContactCascade solver_;
  bool is_contradiction_ = false;
};

}  // namespace dyop::haptics_internal
