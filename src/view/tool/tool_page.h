// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/io/haptic_recording_reader.h"
#include "dyop/view/page_encoder.h"

namespace dyop::view_internal {

/// A page of the recorded run of a tool.
struct ToolPage {
  std::string title;
  std::vector<std::string> blocks;
};
ToolPage make_tool_page(const std::filesystem::path& recording);

/// Bodies of a tool's page: the parts of the tool, the same parts as a ghost of the device, and the
/// obstacles, in this order. Meshes that obstacles later go on as come after them.
class ToolBodies {
 public:
  explicit ToolBodies(const HapticScene& scene) : scene_(scene) {}

  std::size_t part_count() const { return scene_.tool.size(); }
  BodyId proxy(std::size_t part) const { return BodyId(part); }
  BodyId device(std::size_t part) const { return BodyId(part_count() + part); }
  BodyId obstacle(std::size_t number) const { return BodyId(2 * part_count() + number); }

  BodyId later(std::size_t mesh) const {
    return BodyId(2 * part_count() + scene_.obstacles.size() + mesh);
  }

  std::vector<PageBody> bodies() const;
  /// An obstacle that has gone on as another mesh.
  PageBody later_mesh(std::size_t number, std::shared_ptr<const Shape> mesh) const;
  RigidPose part_pose(std::size_t part, const ToolPose& tool) const;
  /// The greatest distance of a point of the part from the part's origin.
  Scalar reach(std::size_t part) const;

 private:
  const HapticScene& scene_;
};

/// A pose at a time.
struct TimedPose {
  Scalar t = 0;
  RigidPose X_WB;
};

/// How far a body may be from its poses: its origin and any of its points.
struct ThinningLimits {
  Scalar tolerance = 0;  ///< length
  Scalar reach = 0;      ///< of the farthest point from the origin
};

/// Motions of constant twist through few of the poses, which pass all others within the limits.
/// Times must ascend; fewer than two poses give nothing.
void add_thinned(BodyId body, std::span<const TimedPose> poses, const ThinningLimits& limits,
                 std::vector<PageSegment>& segments);

}  // namespace dyop::view_internal
