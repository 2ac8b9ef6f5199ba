// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/io/haptic_recording.h"
#include "dyop/view/page_encoder.h"

namespace dyop::view_internal {

/// How far a drawn tool and drawn tissue may be from where they were, as a part of the rest offset:
/// what rests on tissue is not seen in it.
inline constexpr Scalar kPartOfRestOffset = 0.25;

/// A page of the recorded run of a tool.
struct ToolPage {
  std::string title;
  std::vector<std::string> blocks;
};
/// @param verdict What a checker said of the recording, to be shown.
ToolPage make_tool_page(const std::filesystem::path& recording,
                        const std::optional<PageVerdict>& verdict = {});

/// Bodies of a tool's page: the parts of all tools, the same parts as ghosts of the devices, and
/// the obstacles, in this order. Meshes that obstacles later go on as come after them.
class ToolBodies {
 public:
  explicit ToolBodies(const HapticScene& scene);

  std::size_t tool_count() const { return tools_.size(); }
  std::size_t part_count() const { return parts_.size(); }
  /// The first of a tool's parts, or their end for the number of tools.
  std::size_t first_part(std::size_t tool) const { return first_part_[tool]; }
  BodyId proxy(std::size_t part) const { return BodyId(part); }
  BodyId device(std::size_t part) const { return BodyId(part_count() + part); }
  BodyId obstacle(std::size_t number) const { return BodyId(2 * part_count() + number); }

  BodyId later(std::size_t mesh) const {
    return BodyId(2 * part_count() + scene_.obstacles.size() + mesh);
  }

  std::vector<PageBody> bodies() const;
  /// An obstacle that has gone on as another mesh.
  PageBody later_mesh(std::size_t number, std::shared_ptr<const Shape> mesh) const;
  /// Where the tools start.
  std::vector<ToolPose> start() const;
  /// @param tool The part's own.
  RigidPose part_pose(std::size_t part, const ToolPose& tool) const;
  /// The greatest distance of a point of the part from the part's origin.
  Scalar reach(std::size_t part) const;

 private:
  struct Part {
    std::size_t tool;
    std::size_t number;
  };
  const ToolPart& part(std::size_t number) const {
    return tools_[parts_[number].tool].parts[parts_[number].number];
  }

  const HapticScene& scene_;
  std::vector<HapticTool> tools_;
  std::vector<Part> parts_;
  std::vector<std::size_t> first_part_;
};

/// A pose at a time.
struct TimedPose {
  Scalar t = 0;
  RigidPose X_WB;
};

/// Of constant twist.
std::shared_ptr<const Motion> motion_between(const TimedPose& from, const TimedPose& to);

/// Whether a tick with this status had a device pose to draw.
bool knows_device(HapticStatus status);
/// Where a tool that followed the device at once would be.
ToolPose device_pose(const DevicePose& device);
/// The loop is in another state from now on.
PageMark mark_of(Scalar t, HapticStatus status);

/// The extremes of a number of ticks of all tools, for curves and gaps.
struct ToolSample {
  Scalar force = 0;
  Scalar torque = 0;
  Scalar latency = 0;  ///< microseconds
  Scalar energy = 0;   ///< of the last tick, all tools together
  Scalar lag = 0;
  Scalar behind = 0;                        ///< tissue, behind the session's time
  std::vector<ToolClearance> least;         ///< bounds: the least of all; points: of the last tick
  std::optional<std::size_t> nearest;       ///< obstacle of the last tick
  std::vector<ToolClearance> between = {};  ///< the same as `least`, by pair of tools

  static std::vector<PageChart> charts();

  /// A HapticTick or a RecordedTick.
  template <typename Tick>
  void add(const Tick& tick) {
    add_wrench(tick.wrench);
    latency = std::max(latency, Scalar(tick.latency.count()) / 1e3);
    energy = tick.energy_returned;
    lag = std::max(lag, tick.tissue_lag);
    behind = std::max(behind, tick.tissue_behind);
    least.resize(tick.clearances.size(), {kInfinity, kInfinity});
    nearest = nearest_of(tick);
    for (std::size_t k = 0; k < least.size(); ++k) {
      const ToolClearance& now = tick.clearances[k];
      least[k] = {std::min(least[k].lower, now.lower), std::min(least[k].upper, now.upper),
                  now.p_WT, now.p_WO};
    }
  }
  /// The same of a further tool, a HapticTick or a RecordedTool, after that of the first.
  template <typename Tick>
  void add_other(const Tick& tick) {
    add_wrench(tick.wrench);
    energy += tick.energy_returned;
    for (std::size_t k = 0; k < least.size(); ++k) {
      least[k].lower = std::min(least[k].lower, tick.clearances[k].lower);
      least[k].upper = std::min(least[k].upper, tick.clearances[k].upper);
    }
  }
  /// The same of what is between the tools, by pair: see RecordedTick::tool_clearances.
  void add_between(std::span<const ToolClearance> pairs);
  /// Adds it to a span, as what was known over this time.
  /// @param obstacles The body that each is drawn as.
  void write(const TimeInterval& time, const ToolBodies& bodies, std::span<const BodyId> obstacles,
             PageSpan& span) const;

 private:
  void add_wrench(const ToolWrench& wrench) {
    force = std::max(force, wrench.force_W.norm());
    torque = std::max(torque, wrench.torque_W.norm());
  }
  static std::optional<std::size_t> nearest_of(const RecordedTick& tick) { return tick.nearest; }
  static std::optional<std::size_t> nearest_of(const HapticTick& tick);
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
