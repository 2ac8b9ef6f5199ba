// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dyop/recording/recorded_tick.h"
#include "dyop/tool/tool_runner.h"
#include "dyop/tool/tool_session.h"
#include "recording/shape_rows.h"

/// What a ToolSession is made of, as JSON with every bit, and the shapes it names.
namespace dyop::internal {

/// Whether an obstacle's mesh deforms.
inline bool deforms(const ToolObstacle& obstacle) {
  return obstacle.shape == nullptr;
}

struct SessionText {
  std::string json;
  std::string shapes;  // lines
  ShapeRows rows;
};
SessionText session_text(const ToolScene& scene, const ToolOptions& options,
                         std::span<const TissueFeed> tissue);

struct StoredSession {
  ToolScene scene;
  ToolOptions options;
  std::vector<SnapshotSource> sources;
};
/// @throws InvalidArgument, or an exception of nlohmann, for a text of the wrong form.
StoredSession session_from(const Json& json, std::span<const std::shared_ptr<const Shape>> shapes);

}  // namespace dyop::internal
