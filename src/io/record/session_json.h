// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/haptics/haptic_session.h"
#include "dyop/io/recorded_tick.h"
#include "io/record/shape_rows.h"

/// What a HapticSession is made of, as JSON with every bit, and the shapes it names.
namespace dyop::io_internal {

/// Whether an obstacle's mesh deforms.
inline bool deforms(const ToolObstacle& obstacle) {
  return obstacle.shape == nullptr;
}

struct SessionText {
  std::string json;
  std::string shapes;  // lines
  ShapeRows rows;
};
SessionText session_text(const HapticScene& scene, const HapticOptions& options,
                         std::span<const TissueFeed> tissue);

struct StoredSession {
  HapticScene scene;
  HapticOptions options;
  std::vector<SnapshotSource> sources;
};
/// @throws InvalidArgument, or an exception of nlohmann, for a text of the wrong form.
StoredSession session_from(const Json& json, std::span<const std::shared_ptr<const Shape>> shapes);

}  // namespace dyop::io_internal
