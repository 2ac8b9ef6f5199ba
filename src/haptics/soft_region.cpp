// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/soft_region.h"

#include <algorithm>

namespace dyop::haptics_internal {
namespace {

// The proxy's spring against turning is so many times as stiff as one at the tool's reach: it is
// pushed aside and hardly turned, so that the force is the stiffness times the depth within a
// hundredth wherever the region is entered.
constexpr Scalar kTurnStiffness = 100;

// Time that a tick may miss by rounding.
constexpr Scalar kTimeNoise = 0x1p-20;

// The proxy rests where the margin ends, not a rest offset farther away.
HapticScene region_alone(const HapticTool& tool, const ToolObstacle& obstacle,
                         Scalar turn_stiffness, Scalar rest_offset) {
  HapticScene alone{tool.parts, tool.hinges, {obstacle}, tool.X_WT};
  ToolObstacle& region = alone.obstacles.front();
  region.role = ObstacleRole::HardRegion;
  region.margin = std::max(Scalar{0}, region.margin - rest_offset);
  for (ToolHinge& hinge : alone.hinges) hinge.stiffness = turn_stiffness;
  return alone;
}

HapticOptions with_spring(HapticOptions options, Scalar stiffness, Scalar turn_stiffness) {
  options.coupling.stiffness.setConstant(stiffness);
  options.coupling.rotational_stiffness.setConstant(turn_stiffness);
  return options;
}

}  // namespace

SoftRegion::SoftRegion(const HapticTool& tool, const ToolObstacle& obstacle, std::size_t number,
                       const HapticOptions& options)
    : number_(number),
      stiffness_(obstacle.soft_stiffness),
      reach_(reach_of(make_tool_bodies(tool, 0, false))),
      clearance_work_(options.clearance_work),
      proxy_(region_alone(tool, obstacle, kTurnStiffness * stiffness_ * reach_ * reach_,
                          options.rest_offset),
             with_spring(options, stiffness_, kTurnStiffness * stiffness_ * reach_ * reach_)) {
  reset(proxy_.poses()[0]);
}

void SoftRegion::reset(const ToolPose& tool) {
  proxy_.reset(0, tool);
  WorkClock unlimited;
  TickStatistics work;
  proxy_.measure(WorkShare(unlimited), work);
}

void SoftRegion::follow(const ToolPose& tool, Scalar dt, WorkClock& clock, TickStatistics& work) {
  TickStatistics own;
  const PerTool<std::optional<ToolPose>> goal(1, tool);
  const FollowReport report = proxy_.follow(goal, dt, clock, own);
  const Scalar late = dt - report.committed;
  if (late > kTimeNoise * dt) region().stop(late);
  proxy_.measure({clock, clearance_work_}, own);
  work.impact_queries += own.impact_queries;
  work.distance_queries += own.distance_queries;
  work.node_pairs += own.node_pairs;
  work.solves += own.solves;
}

// A turn that the region forces on the proxy gives the torque of a spring at the tool's reach,
// besides that of the force at its lever.
AddedPull SoftRegion::pull(const RigidPose& X_WT, const Vector3& p_W) const {
  const RigidPose& X_WP = proxy_.poses()[0].X_WT;
  const Vector3 stretch = X_WP.translation() - X_WT.translation();
  const Vector3 turn = rotation_vector(X_WP.rotation() * X_WT.rotation().transpose());
  const Scalar turn_stiffness = stiffness_ * reach_ * reach_;
  AddedPull pull;
  pull.wrench.force_W = stiffness_ * stretch;
  const Vector3 torque_W = kTurnStiffness * turn_stiffness * turn;
  const Scalar most = pull.wrench.force_W.norm() * reach_ + turn_stiffness * turn.norm();
  const Scalar size = torque_W.norm();
  pull.wrench.torque_W = size > most ? Vector3(torque_W * (most / size)) : torque_W;
  pull.wrench.torque_W += (X_WT.translation() - p_W).cross(pull.wrench.force_W);
  pull.stored = (stiffness_ * stretch.squaredNorm() + turn_stiffness * turn.squaredNorm()) / 2;
  return pull;
}

}  // namespace dyop::haptics_internal
