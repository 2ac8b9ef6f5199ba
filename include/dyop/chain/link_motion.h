// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/chain/joint_path.h"
#include "dyop/chain/kinematic_chain.h"
#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// The motion of one link of a chain along a joint path, in the world or as seen from a link closer
/// to the root. For any query that takes a Motion.
///
/// Bounds are composed from joint to joint, from the link towards the root: the proof is in
/// docs/algorithms/chain.md.
class LinkMotion final : public Motion {
 public:
  /// A moving joint between the base and the link. Fixed joints are merged into the next one.
  struct Turn {
    KinematicChain::Step step;
    Scalar reach = 0;         ///< largest distance of the link's origin from the joint, rounded up
    Scalar sine_to_next = 1;  ///< of the angle to the next axis towards the link, rounded up
  };

  /// The motion of a link in the world.
  /// @throws InvalidArgument if a pointer is null, the chain has no such link, or the path and the
  ///         chain differ in the number of coordinates.
  LinkMotion(std::shared_ptr<const KinematicChain> chain, std::shared_ptr<const JointPath> path,
             std::size_t link);
  /// The same in the frame of link `base`, which is `link` or on the path from the root to it.
  LinkMotion(std::shared_ptr<const KinematicChain> chain, std::shared_ptr<const JointPath> path,
             std::size_t link, std::size_t base);

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  MotionState state(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;
  TimeInterval domain() const override { return path_->domain(); }
  Scalar smooth_until(Scalar t) const override;
  /// With the mean rates of all coordinates over 2, 4, 8, ... pieces of the path.
  std::optional<MotionStretch> stretch(Scalar t, Scalar after) const override;
  bool is_trusted() const override { return true; }

  /// As given; without a base the motion is in the world.
  const std::shared_ptr<const KinematicChain>& chain() const { return chain_; }
  const std::shared_ptr<const JointPath>& path() const { return path_; }
  std::size_t link() const { return link_; }
  const std::optional<std::size_t>& base() const { return base_; }

  /// For inner loops: the joints from the base to the link, and the link's pose in the frame of the
  /// last of them.
  std::span<const Turn> turns() const { return turns_; }
  const RigidPose& X_JL() const { return X_JL_; }

 private:
  void collect();
  void measure();

  std::shared_ptr<const KinematicChain> chain_;
  std::shared_ptr<const JointPath> path_;
  std::size_t link_ = 0;
  std::optional<std::size_t> base_;
  RigidPose X_WF_;  // of the base, or of the root in the world
  std::vector<Turn> turns_;
  RigidPose X_JL_;  // fixed joints after the last turn
  PoseScale scale_;
};

}  // namespace dyop
