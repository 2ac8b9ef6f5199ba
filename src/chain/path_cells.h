// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/chain/link_motion.h"

namespace dyop::internal {

/// Bounds on the twists of all links over short parts of one path, each as seen from every link
/// between it and the root: computed once per query, which looks them up many times.
class PathCells {
 public:
  /// Of `links`, the motions of all links in the world.
  void set(const JointPath& path, std::span<const LinkMotion> links);

  /// Bounds over a part of the path for a link as seen from one with `turns` moving joints between.
  TwistBound bound(std::size_t link, std::size_t turns, const TimeInterval& part) const;

 private:
  std::vector<Scalar> times_;  // start of every cell, and end of the last one
  std::vector<bool> begins_piece_;
  std::vector<std::size_t> offsets_;  // of a link's bounds among those of a cell, and their number
  std::vector<TwistBound> bounds_;    // by cell, link and number of joints
};

/// A LinkMotion whose bounds come from PathCells.
class CellMotion final : public Motion {
 public:
  /// Both must outlive it. `link` is the index of the link whose motion `motion` is.
  CellMotion(const LinkMotion& motion, std::size_t link, const PathCells& cells)
      : motion_(motion), link_(link), cells_(cells) {}

  RigidPose pose(Scalar t) const override { return motion_.pose(t); }
  Twist twist(Scalar t) const override { return motion_.twist(t); }
  MotionState state(Scalar t) const override { return motion_.state(t); }
  TwistBound twist_bound(const TimeInterval& interval) const override {
    return cells_.bound(link_, motion_.turns().size(), interval);
  }
  PoseScale pose_scale(const TimeInterval& interval) const override {
    return motion_.pose_scale(interval);
  }
  TimeInterval domain() const override { return motion_.domain(); }
  Scalar smooth_until(Scalar t) const override { return motion_.smooth_until(t); }
  bool is_trusted() const override { return true; }

 private:
  const LinkMotion& motion_;
  std::size_t link_;
  const PathCells& cells_;
};

}  // namespace dyop::internal
