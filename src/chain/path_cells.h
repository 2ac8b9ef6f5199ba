// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "chain/chain_frame.h"
#include "dyop/chain/link_motion.h"

namespace dyop::chain_internal {

/// Bounds on the twists of all links over short parts of one path, each as seen from every link
/// between it and the root: computed once per query, which looks them up many times.
class PathCells {
 public:
  /// Tabulates `links`, the motions of all links in the world.
  void set(const KinematicChain& chain, const JointPath& path, std::span<const LinkMotion> links);

  /// Bounds over a part of the path for a link as seen from one with `turns` moving joints between.
  TwistBound bound(std::size_t link, std::size_t turns, const TimeInterval& part) const;

  /// The state of a link in the world, the same bits as from its LinkMotion, if t is the middle of
  /// a cell; otherwise null.
  const MotionState* state(std::size_t link, Scalar t) const;

  std::size_t count() const { return times_.size() - 1; }
  /// Cells that cover the path from its start to t.
  std::size_t count_until(Scalar t) const;
  /// From the start of cell `first` to the end of the one before `last`.
  TimeInterval interval(std::size_t first, std::size_t last) const {
    return {times_[first], times_[last]};
  }
  Scalar middle(std::size_t cell) const { return middles_[cell]; }
  const RigidPose& middle_pose(std::size_t link, std::size_t cell) const {
    return states_[cell * frames_.size() + link].X_WB;
  }

 private:
  void set_states(const KinematicChain& chain, std::span<const LinkMotion> links, std::size_t cell);
  std::size_t cell_at(Scalar t) const;

  std::vector<Scalar> times_;  // where cells begin, and where the last one ends
  std::vector<bool> begins_piece_;
  std::vector<std::size_t> offsets_;  // of a link's bounds among those of a cell, and their number
  std::vector<TwistBound> bounds_;    // by cell, link and number of joints
  std::vector<Scalar> middles_;       // of cells
  std::vector<MotionState> states_;   // by cell and link
  std::vector<std::size_t> order_;    // links, parents first
  // For each cell.
  std::vector<JointPart> parts_;    // by coordinate
  std::vector<ChainFrame> frames_;  // by link
};

/// A LinkMotion whose bounds come from PathCells.
class CellMotion final : public Motion {
 public:
  enum class Frame { World, Link };

  /// Both must outlive it. `link` is the number of the link whose motion `motion` is, in `frame`.
  CellMotion(const LinkMotion& motion, std::size_t link, Frame frame, const PathCells& cells)
      : motion_(motion), link_(link), frame_(frame), cells_(cells) {}

  RigidPose pose(Scalar t) const override { return CellMotion::state(t).X_WB; }
  Twist twist(Scalar t) const override { return CellMotion::state(t).twist; }
  MotionState state(Scalar t) const override {
    const MotionState* const known = frame_ == Frame::World ? cells_.state(link_, t) : nullptr;
    return known ? *known : motion_.state(t);
  }
  TwistBound twist_bound(const TimeInterval& interval) const override {
    return cells_.bound(link_, motion_.turns().size(), interval);
  }
  PoseScale pose_scale(const TimeInterval& interval) const override {
    return motion_.pose_scale(interval);
  }
  TimeInterval domain() const override { return motion_.domain(); }
  Scalar smooth_until(Scalar t) const override { return motion_.smooth_until(t); }
  std::optional<MotionStretch> stretch(Scalar t, Scalar after) const override {
    return motion_.stretch(t, after);
  }
  bool is_trusted() const override { return true; }

 private:
  const LinkMotion& motion_;
  std::size_t link_;
  Frame frame_;
  const PathCells& cells_;
};

}  // namespace dyop::chain_internal
