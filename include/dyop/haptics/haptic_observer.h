// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "dyop/haptics/haptic_tick.h"
#include "dyop/haptics/virtual_coupling.h"

namespace DYOP_EXPORT dyop {

/// What a deforming obstacle was given by give_snapshot(), give_mesh() or retarget().
struct TissueInput {
  std::size_t obstacle = 0;
  /// Its number as in ObstacleProgress: what retarget() takes back has that of what comes in its
  /// place.
  std::int64_t snapshot = 0;
  std::span<const Vector3> vertices;
  std::span<const TriangleIndices> triangles;  ///< of another mesh; otherwise empty
  Scalar duration = 0;                         ///< 0 of a mesh
  bool is_retarget = false;
};

/// Is told of all that a HapticSession is given, see HapticSession::observe(): each input that it
/// takes, before a tick can see it, and each tick. What an implementation throws ends the program.
class HapticObserver {
 public:
  virtual ~HapticObserver() = default;

  /// In the thread that gives tissue; which tick sees it, HapticTick::inputs tells.
  virtual void on_tissue(const TissueInput& input) noexcept = 0;
  // In the thread that calls update(), between two ticks:
  virtual void on_coupling(std::size_t tool, const CouplingOptions& coupling) noexcept = 0;
  virtual void on_reset(std::size_t tool, const ToolPose& pose) noexcept = 0;
  /// At the end of update(), for one pose and one tick for each tool.
  virtual void on_tick(std::span<const DevicePose> devices, Scalar dt,
                       std::span<const HapticTick> ticks) noexcept = 0;
};

}  // namespace dyop
