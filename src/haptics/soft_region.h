// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "haptics/proxy.h"

namespace dyop::haptics_internal {

/// A region that pushes the tool back: a second proxy that stays out of it, as if the region were
/// hard, follows the tool, and a spring pulls the tool towards it. The pull grows from the region's
/// margin inwards and goes on growing beyond its surface, whatever the tool does there, towards the
/// side where it came from.
class SoftRegion {
 public:
  /// @param obstacle One with soft_stiffness > 0, and its number in the scene.
  SoftRegion(const HapticTool& tool, const ToolObstacle& obstacle, std::size_t number,
             const HapticOptions& options);

  std::size_t obstacle() const { return number_; }
  Scalar stiffness() const { return stiffness_; }
  /// Its own copy of the obstacle, which gets the same snapshots.
  Obstacle& region() const { return *proxy_.scene().obstacles.front(); }

  /// The tool is elsewhere.
  void reset(const ToolPose& tool);
  /// Follows the tool while time dt passes.
  void follow(const ToolPose& tool, Scalar dt, WorkClock& clock, TickStatistics& work);
  /// The pull on the tool, about p_W.
  AddedPull pull(const RigidPose& X_WT, const Vector3& p_W) const;

 private:
  std::size_t number_;
  Scalar stiffness_;
  Scalar reach_;
  int clearance_work_;
  Proxy proxy_;
};

}  // namespace dyop::haptics_internal
