// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dyop/chain/kinematic_chain.h"

namespace DYOP_EXPORT dyop {

/// A coordinate of a robot's chain as a function of one free coordinate f:
/// q = multiplier f + offset. A joint that mimics no other has a free coordinate of its own.
struct CoordinateCoupling {
  std::size_t free = 0;
  Scalar multiplier = 1;
  Scalar offset = 0;

  /// The free coordinates, smallest and largest, at which lower <= q <= upper; the largest is the
  /// smaller one if there are none.
  std::pair<Scalar, Scalar> free_limits(Scalar lower, Scalar upper) const;
};

/// Two links that a file exempts from self-collision, and the reason it gives. `Never` is a claim
/// about all joint values, mostly drawn from samples; other reasons are wishes.
struct DisabledPair {
  std::string first;
  std::string second;
  std::string reason;
};

/// A named set of links and joints, as SRDF defines it.
struct RobotGroup {
  std::string name;
  std::vector<std::string> links;
  std::vector<std::string> joints;
};

/// A robot: a tree of links, and what its files say beyond geometry. See docs/robots.md.
struct Robot {
  std::string name;
  /// One coordinate for each joint that moves, those that mimic others included.
  std::shared_ptr<const KinematicChain> chain;
  std::vector<Scalar> masses;                 ///< by link; 0 if the file states none
  std::vector<CoordinateCoupling> couplings;  ///< by coordinate of the chain
  /// The index of the joint of each free coordinate.
  std::vector<std::size_t> free_joints;
  std::vector<DisabledPair> disabled_pairs;
  std::vector<RobotGroup> groups;
  /// What the reader had to assume, one line each.
  std::vector<std::string> notes;

  std::size_t free_count() const { return free_joints.size(); }
  /// The chain's coordinates at free ones.
  /// @throws InvalidArgument unless there are free_count() numbers, all finite.
  JointVector expand(const JointVector& free) const;
  /// The chain's rates at rates of the free coordinates. Throws likewise.
  JointVector expand_rates(const JointVector& free_rates) const;
  /// The chain's path along a path of the free coordinates.
  /// @throws InvalidArgument unless it has free_count() coordinates.
  JointPath expand(const JointPath& free) const;
  /// The smallest free coordinates at which every joint is within its limits, also those that mimic
  /// others; above upper() where no coordinate is.
  JointVector lower() const;
  JointVector upper() const;
  /// Whether every joint is within its limits, also those that mimic others. Throws as expand().
  bool is_within_limits(const JointVector& free) const;
  /// Free coordinates of the robot at rest: zero, or the limit nearest to it.
  JointVector resting_state() const;
  /// The free coordinate of the joint of this name, if it has one of its own.
  std::optional<Eigen::Index> free_index(const std::string& joint) const;
};

/// A robot of a chain whose joints are all independent.
Robot make_robot(std::string name, KinematicChain chain);

/// The chain with one more link, fixed to an existing one: an object that is held.
/// @param object       Its name must be new.
/// @param touch_links  Links that the object may touch; it may always touch `parent`.
/// @throws InvalidArgument as KinematicChain, or if `parent` or a touch link is unknown.
KinematicChain attach(const KinematicChain& chain, Link object, const std::string& parent,
                      const RigidPose& X_PO, const std::vector<std::string>& touch_links = {});
/// The robot that holds the object, likewise. It weighs nothing.
Robot attach(const Robot& robot, Link object, const std::string& parent, const RigidPose& X_PO,
             const std::vector<std::string>& touch_links = {});

}  // namespace dyop
