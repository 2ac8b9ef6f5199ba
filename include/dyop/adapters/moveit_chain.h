// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <moveit/robot_model/robot_model.hpp>
#include <moveit/robot_state/robot_state.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dyop/adapters/host_geometry.h"
#include "dyop/chain/kinematic_chain.h"
#include "dyop/chain/link_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"

namespace dyop::adapters {

/// The motions of a robot's links from one state to another, with proven bounds: from time 0 to
/// time 1 all joints move as moveit::core::RobotState::interpolate() moves them.
class MoveitPath {
 public:
  MoveitPath(std::shared_ptr<const KinematicChain> chain, std::shared_ptr<const JointPath> joints,
             std::shared_ptr<const Motion> root)
      : chain_(std::move(chain)), joints_(std::move(joints)), root_(std::move(root)) {}

  const KinematicChain& chain() const { return *chain_; }

  /// How a link moves in the model frame.
  std::shared_ptr<const Motion> link_motion(std::size_t link) const {
    return std::make_shared<ComposedMotion>(root_, in_root(link));
  }
  /// How it moves in the frame of another link, which is on the path from the root to it.
  std::shared_ptr<const Motion> link_motion(std::size_t link, std::size_t base) const {
    if (joints_) return std::make_shared<LinkMotion>(chain_, joints_, link, base);
    const std::vector<RigidPose> poses = chain_->link_poses(JointVector(0));
    return std::make_shared<RestMotion>(poses[base].inverse() * poses[link]);
  }
  /// Poses of all links in the model frame, in the order of the chain.
  std::vector<RigidPose> link_poses(Scalar t) const {
    std::vector<RigidPose> poses =
        chain_->link_poses(joints_ ? joints_->position(t) : JointVector(0));
    const RigidPose X_WR = root_->pose(t);
    for (RigidPose& pose : poses) pose = X_WR * pose;
    return poses;
  }

 private:
  std::shared_ptr<const Motion> in_root(std::size_t link) const {
    if (joints_) return std::make_shared<LinkMotion>(chain_, joints_, link);
    return std::make_shared<RestMotion>(chain_->link_poses(JointVector(0))[link]);
  }

  std::shared_ptr<const KinematicChain> chain_;
  std::shared_ptr<const JointPath> joints_;  // null if no joint moves
  std::shared_ptr<const Motion> root_;
};

/// A robot model of MoveIt as a chain. Its joint above the root may be floating or planar, all
/// others are fixed, revolute, continuous or prismatic. Immutable.
///
/// Written for MoveIt 2.12 (headers .hpp); compiled against stubs of its interface only.
class MoveitChain {
 public:
  /// @throws InvalidArgument as KinematicChain.
  explicit MoveitChain(const moveit::core::RobotModel& model) {
    std::vector<Link> links;
    std::vector<Joint> joints;
    for (const moveit::core::LinkModel* link : model.getLinkModels()) {
      links.push_back({.name = link->getName()});
      if (link->getParentLinkModel() == nullptr) {
        root_ = link;
      } else {
        joints.push_back(joint_above(*link));
      }
    }
    DYOP_REQUIRE(root_ != nullptr, "the robot model has no root link");
    chain_ = std::make_shared<const KinematicChain>(std::move(links), std::move(joints));
  }

  const KinematicChain& chain() const { return *chain_; }

  /// The path from one state to another. Both must be up to date.
  /// @throws InvalidArgument naming the joint if it is of a kind that a chain cannot have, or
  ///         naming the link if the chain does not place it where MoveIt does, at both ends and
  ///         halfway.
  MoveitPath path(const moveit::core::RobotState& from, const moveit::core::RobotState& to) const {
    DYOP_REQUIRE(unsupported_joint_.empty(), "joint \"", unsupported_joint_,
                 "\" has several degrees of freedom and is not above the root link");
    MoveitPath path(chain_, joint_path(from, to), root_motion(from, to));
    moveit::core::RobotState halfway(from);
    from.interpolate(to, kHalfway, halfway);
    halfway.update();
    require_same_poses(path, 0, from);
    require_same_poses(path, kHalfway, halfway);
    require_same_poses(path, 1, to);
    return path;
  }

 private:
  using JointModel = moveit::core::JointModel;

  static constexpr TimeInterval kUnit{0, 1};
  static constexpr Scalar kHalfway = 0.5;
  // literal: far above the rounding of forward kinematics, far below what a gap can matter
  static constexpr Scalar kPoseTolerance = 1e-9;

  Joint joint_above(const moveit::core::LinkModel& link) {
    const JointModel& model = *link.getParentJointModel();
    Joint joint{.name = model.getName(),
                .type = JointType::Fixed,
                .parent = link.getParentLinkModel()->getName(),
                .child = link.getName(),
                .X_PJ = pose_of(link.getJointOriginTransform())};
    if (model.getType() == JointModel::REVOLUTE) {
      joint.type = JointType::Revolute;
      joint.axis_J = static_cast<const moveit::core::RevoluteJointModel&>(model).getAxis();
    } else if (model.getType() == JointModel::PRISMATIC) {
      joint.type = JointType::Prismatic;
      joint.axis_J = static_cast<const moveit::core::PrismaticJointModel&>(model).getAxis();
    } else if (model.getType() != JointModel::FIXED) {
      unsupported_joint_ = model.getName();
    }
    if (joint.type != JointType::Fixed) moving_.push_back(&model);
    return joint;
  }

  // The way that MoveIt takes between two angles of a joint that turns without end.
  static Scalar shortest_turn(Scalar difference) {
    constexpr Scalar kPi = std::numbers::pi;
    if (std::abs(difference) <= kPi) return difference;
    return difference > 0 ? difference - 2 * kPi : difference + 2 * kPi;
  }

  struct Ends {
    Scalar begin = 0;
    Scalar end = 0;
  };
  static Ends ends_of(const JointModel& joint, const moveit::core::RobotState& from,
                      const moveit::core::RobotState& to) {
    if (joint.getMimic() != nullptr) {
      const Ends leader = ends_of(*joint.getMimic(), from, to);
      const auto follow = [&joint](Scalar q) {
        return joint.getMimicFactor() * q + joint.getMimicOffset();
      };
      return {follow(leader.begin), follow(leader.end)};
    }
    const Scalar begin = from.getVariablePosition(joint.getFirstVariableIndex());
    const Scalar end = to.getVariablePosition(joint.getFirstVariableIndex());
    const bool is_endless =
        joint.getType() == JointModel::REVOLUTE &&
        static_cast<const moveit::core::RevoluteJointModel&>(joint).isContinuous();
    return {begin, is_endless ? begin + shortest_turn(end - begin) : end};
  }

  std::shared_ptr<const JointPath> joint_path(const moveit::core::RobotState& from,
                                              const moveit::core::RobotState& to) const {
    if (moving_.empty()) return nullptr;
    std::array<JointVector, 2> ends{JointVector(Eigen::Index(moving_.size())),
                                    JointVector(Eigen::Index(moving_.size()))};
    for (std::size_t k = 0; k < moving_.size(); ++k) {
      const Ends joint = ends_of(*moving_[k], from, to);
      DYOP_REQUIRE(std::isfinite(joint.begin) && std::isfinite(joint.end), "joint \"",
                   moving_[k]->getName(), "\" goes from ", joint.begin, " to ", joint.end);
      ends[0][Eigen::Index(k)] = joint.begin;
      ends[1][Eigen::Index(k)] = joint.end;
    }
    const std::array<Scalar, 2> times{kUnit.begin, kUnit.end};
    return std::make_shared<const JointPath>(JointPath::linear(times, ends));
  }

  // A floating base moves as interpolated poses do: on a straight line, along the shortest arc.
  std::shared_ptr<const Motion> root_motion(const moveit::core::RobotState& from,
                                            const moveit::core::RobotState& to) const {
    const RigidPose begin = pose_of(from.getGlobalLinkTransform(root_));
    const RigidPose end = pose_of(to.getGlobalLinkTransform(root_));
    const JointModel* joint = root_->getParentJointModel();
    const bool rests =
        begin.rotation() == end.rotation() && begin.translation() == end.translation();
    if (joint == nullptr || rests) return std::make_shared<RestMotion>(begin);
    if (joint->getType() == JointModel::FLOATING) {
      return std::make_shared<InterpolatedMotion>(kUnit, begin, end);
    }
    DYOP_REQUIRE(joint->getType() == JointModel::PLANAR &&
                     static_cast<const moveit::core::PlanarJointModel*>(joint)->getMotionModel() ==
                         moveit::core::PlanarJointModel::HOLONOMIC,
                 "joint \"", joint->getName(),
                 "\" above the root link moves, and neither floats nor slides in a plane");
    const int yaw = joint->getFirstVariableIndex() + 2;  // after x and y
    const Scalar turn = shortest_turn(to.getVariablePosition(yaw) - from.getVariablePosition(yaw));
    return std::make_shared<InterpolatedMotion>(
        InterpolatedMotion::from_chart(kUnit, begin, {begin.translation(), Vector3::Zero()},
                                       {end.translation(), Vector3(0, 0, turn)}));
  }

  void require_same_poses(const MoveitPath& path, Scalar t,
                          const moveit::core::RobotState& state) const {
    const std::vector<RigidPose> poses = path.link_poses(t);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const std::string& name = chain_->links()[k].name;
      const Eigen::Isometry3d& X = state.getGlobalLinkTransform(name);
      const Scalar shift = (X.translation() - poses[k].translation()).cwiseAbs().maxCoeff();
      const Scalar turn = (X.linear() - poses[k].rotation()).cwiseAbs().maxCoeff();
      DYOP_REQUIRE(
          shift <= kPoseTolerance * (1 + poses[k].translation().norm()) && turn <= kPoseTolerance,
          "at ", t, " of the way link \"", name, "\" is ", shift,
          " from where its joints put it, and turned by ", turn);
    }
  }

  std::shared_ptr<const KinematicChain> chain_;
  const moveit::core::LinkModel* root_ = nullptr;
  std::vector<const JointModel*> moving_;  // in the order of the coordinates
  std::string unsupported_joint_;
};

}  // namespace dyop::adapters
