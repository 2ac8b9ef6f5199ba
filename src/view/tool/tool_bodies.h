// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/io/haptic_recording_reader.h"
#include "dyop/view/page_encoder.h"

namespace dyop::view_internal {

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

}  // namespace dyop::view_internal
