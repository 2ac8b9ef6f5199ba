// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/haptics/haptic_scene.h"
#include "dyop/haptics/haptic_tick.h"
#include "dyop/motion/steady_motions.h"

namespace dyop::haptics_internal {

/// One value for each tool of a session.
template <typename T>
class PerTool {
 public:
  PerTool() = default;
  explicit PerTool(std::size_t tools, const T& value = {}) : size_(tools) {
    std::fill_n(values_.begin(), size_, value);
  }

  std::size_t size() const { return size_; }
  T& operator[](std::size_t tool) { return values_[tool]; }
  const T& operator[](std::size_t tool) const { return values_[tool]; }
  auto begin() { return values_.begin(); }
  auto end() { return values_.begin() + std::ptrdiff_t(size_); }
  auto begin() const { return values_.begin(); }
  auto end() const { return values_.begin() + std::ptrdiff_t(size_); }

 private:
  std::array<T, kMostTools> values_{};
  std::size_t size_ = 1;
};

using ToolPoses = PerTool<ToolPose>;

/// A bit for each tool.
using ToolSet = std::bitset<kMostTools>;
inline ToolSet all_tools() {
  return ToolSet().set();
}

/// A mesh inflated by a ball: a mesh itself, or the core of a convex shape.
struct CorePiece {
  TriangleMesh mesh;
  Scalar radius = 0;
};

/// Parts that move together: all fixed parts of the tool, or the parts on one hinge.
struct ToolBody {
  std::size_t tool = 0;  ///< of the session
  std::shared_ptr<const Shape> shape;
  std::vector<CorePiece> pieces;     ///< the same surface, for queries against deforming meshes
  std::optional<std::size_t> hinge;  ///< B is J rotated by its angle; none: B is T
  AlignedBox box;                    ///< in B
  Scalar reach = 0;                  ///< no point is farther from T's origin
  Scalar thickness = 0;              ///< least side of the box, or its diagonal if that is flat
};

/// The bodies of a tool: the fixed one first, if there are fixed parts, then by hinge.
/// @throws InvalidArgument if there is no part, a shape is missing, a hinge does not exist or has
///         no parts, or with_pieces is set and a shape has no core surface.
std::vector<ToolBody> make_tool_bodies(const HapticTool& tool, std::size_t number,
                                       bool with_pieces);

/// No point of a tool is farther from T's origin.
Scalar reach_of(std::span<const ToolBody> bodies, std::size_t tool = 0);

/// A change of the tool's configuration: displacement of T's origin, rotation vector, both in
/// world, and change of the hinges' angles.
struct ToolStep {
  Vector3 v_W = Vector3::Zero();
  Vector3 w_W = Vector3::Zero();
  std::array<Scalar, kMostHinges> angles{};
};

/// From one configuration to another: the step whose ToolMotion ends there.
ToolStep step_between(const ToolPose& from, const ToolPose& to);
ToolStep scaled(const ToolStep& step, Scalar factor);
ToolStep difference(const ToolStep& step, const ToolStep& other);

using ToolSteps = PerTool<ToolStep>;
ToolSteps step_between(const ToolPoses& from, const ToolPoses& to);
ToolSteps scaled(const ToolSteps& steps, Scalar factor);

/// A frame J on a tool that moves with a constant twist, turning about its z axis at a constant
/// rate: X_WB(t) = X_WT(t) X_TJ Rz(q + t q').
///
/// With p = p_TJ and w the tool's rate: |v| <= |v_T| + |w||p|, |w_B| <= |w| + |q'|,
/// |v'| <= |w|^2 |p|, |w_B'| <= |w||q'|.
class HingeMotion final : public Motion {
 public:
  HingeMotion(const ConstantTwistMotion& X_WT, const RigidPose& X_TJ, Scalar angle, Scalar rate)
      : X_WT_(X_WT), X_TJ_(X_TJ), angle_(angle), rate_(rate) {}

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;

 private:
  const ConstantTwistMotion& X_WT_;
  const RigidPose X_TJ_;
  const Scalar angle_;
  const Scalar rate_;
};

/// The motion of the whole tool over [0, duration]: a step at constant rates. Not to be copied: the
/// hinges' motions refer to the frame's.
class ToolMotion {
 public:
  ToolMotion(const ToolPose& from, const ToolStep& step, Scalar duration,
             std::span<const ToolHinge> hinges);
  ToolMotion(const ToolMotion&) = delete;
  ToolMotion& operator=(const ToolMotion&) = delete;

  const Motion& of(const ToolBody& body) const {
    if (body.hinge) return *hinges_[*body.hinge];
    return frame_;
  }
  ToolPose at(Scalar t) const;

  /// Bound of the displacement of every point of a body until t.
  Scalar largest_displacement(const ToolBody& body, Scalar t) const;
  /// Displacement of the middle of its box until t, and a bound of how far that of any other point
  /// of the body differs from it, besides rounding.
  std::pair<Vector3, Scalar> shift(const ToolBody& body, Scalar t) const;

 private:
  ToolPose from_;
  ToolStep rate_;  // per time
  std::span<const ToolHinge> places_;
  ConstantTwistMotion frame_;
  std::array<std::optional<HingeMotion>, kMostHinges> hinges_;
};

/// The motions of all tools at once.
class ToolMotions {
 public:
  ToolMotions(const ToolPoses& from, const ToolSteps& steps, Scalar duration,
              std::span<const HapticTool> tools) {
    for (std::size_t k = 0; k < tools.size(); ++k) {
      motions_[k].emplace(from[k], steps[k], duration, tools[k].hinges);
    }
  }

  const Motion& of(const ToolBody& body) const { return motions_[body.tool]->of(body); }
  ToolPoses at(Scalar t) const {
    ToolPoses poses(std::size_t(std::count_if(motions_.begin(), motions_.end(),
                                              [](const auto& motion) { return !!motion; })));
    for (std::size_t k = 0; k < poses.size(); ++k) poses[k] = motions_[k]->at(t);
    return poses;
  }
  /// As ToolMotion.
  Scalar largest_displacement(const ToolBody& body, Scalar t) const {
    return motions_[body.tool]->largest_displacement(body, t);
  }
  std::pair<Vector3, Scalar> shift(const ToolBody& body, Scalar t) const {
    return motions_[body.tool]->shift(body, t);
  }

 private:
  std::array<std::optional<ToolMotion>, kMostTools> motions_;
};

/// X_TB of a body for given angles.
RigidPose body_in_tool(const ToolBody& body, std::span<const ToolHinge> hinges,
                       const ToolPose& pose);

}  // namespace dyop::haptics_internal
