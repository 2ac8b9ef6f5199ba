// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <memory>
#include <moveit/robot_model/robot_model.hpp>
#include <moveit/robot_state/attached_body.hpp>
#include <string>
#include <utility>
#include <vector>

namespace moveit::core {

// Positions start at zero, quaternions at the identity.
class RobotState {
 public:
  explicit RobotState(const RobotModelConstPtr& robot_model)
      : robot_model_(robot_model),
        position_(robot_model->getVariableCount(), 0),
        global_link_transforms_(robot_model->getLinkModels().size()),
        global_collision_body_transforms_(robot_model->getLinkGeometryCount()) {
    for (const LinkModel* link : robot_model->getLinkModels()) {
      const JointModel& joint = *link->getParentJointModel();
      if (joint.getType() == JointModel::FLOATING)
        position_[std::size_t(joint.getFirstVariableIndex()) + 6] = 1;
    }
  }

  double getVariablePosition(int index) const { return position_[std::size_t(index)]; }
  void setVariablePosition(int index, double value) {
    position_[std::size_t(index)] = value;
    for (const LinkModel* link : robot_model_->getLinkModels())
      follow(*link->getParentJointModel());
    dirty_ = true;
  }

  void update(bool /*force*/ = false) {
    for (const LinkModel* link : robot_model_->getLinkModels()) {
      const JointModel& joint = *link->getParentJointModel();
      Eigen::Isometry3d turn;
      joint.computeTransform(position_.data() + joint.getFirstVariableIndex(), turn);
      const LinkModel* parent = link->getParentLinkModel();
      const Eigen::Isometry3d above = parent != nullptr
                                          ? global_link_transforms_[parent->getLinkIndex()]
                                          : Eigen::Isometry3d::Identity();
      const Eigen::Isometry3d X = above * link->getJointOriginTransform() * turn;
      global_link_transforms_[link->getLinkIndex()] = X;
      for (std::size_t k = 0; k < link->getShapes().size(); ++k)
        global_collision_body_transforms_[geometry(*link, k)] =
            X * link->getCollisionOriginTransforms()[k];
    }
    for (AttachedBody& body : attached_)
      body.computeTransform(getGlobalLinkTransform(body.getAttachedLink()));
    dirty_ = false;
  }
  bool dirtyCollisionBodyTransforms() const { return dirty_; }

  const Eigen::Isometry3d& getGlobalLinkTransform(const LinkModel* link) const {
    return global_link_transforms_[link->getLinkIndex()];
  }
  const Eigen::Isometry3d& getGlobalLinkTransform(const std::string& link_name) const {
    return getGlobalLinkTransform(robot_model_->getLinkModel(link_name));
  }
  const Eigen::Isometry3d& getCollisionBodyTransform(const LinkModel* link,
                                                     std::size_t index) const {
    return global_collision_body_transforms_[geometry(*link, index)];
  }

  void interpolate(const RobotState& to, double t, RobotState& state) const {
    for (const LinkModel* link : robot_model_->getLinkModels()) {
      const JointModel& joint = *link->getParentJointModel();
      const int at = joint.getFirstVariableIndex();
      joint.interpolate(position_.data() + at, to.position_.data() + at, t,
                        state.position_.data() + at);
    }
    for (const LinkModel* link : robot_model_->getLinkModels())
      state.follow(*link->getParentJointModel());
    state.dirty_ = true;
  }

  void getAttachedBodies(std::vector<const AttachedBody*>& attached_bodies) const {
    attached_bodies.clear();
    for (const AttachedBody& body : attached_) attached_bodies.push_back(&body);
  }
  void attachBody(std::unique_ptr<AttachedBody> attached_body) {
    attached_.push_back(std::move(*attached_body));
    dirty_ = true;
  }

  // As updateStateWithLinkAt() of the host does it: without regard to the joints.
  void updateStateWithLinkAt(const LinkModel* link, const Eigen::Isometry3d& transform,
                             bool /*backward*/ = false) {
    global_link_transforms_[link->getLinkIndex()] = transform;
  }

 private:
  static std::size_t geometry(const LinkModel& link, std::size_t index) {
    return std::size_t(link.getFirstCollisionBodyTransformIndex()) + index;
  }
  void follow(const JointModel& joint) {
    if (joint.getMimic() == nullptr) return;
    position_[std::size_t(joint.getFirstVariableIndex())] =
        joint.getMimicFactor() * getVariablePosition(joint.getMimic()->getFirstVariableIndex()) +
        joint.getMimicOffset();
  }

  RobotModelConstPtr robot_model_;
  std::vector<double> position_;
  EigenSTL::vector_Isometry3d global_link_transforms_;
  EigenSTL::vector_Isometry3d global_collision_body_transforms_;
  std::vector<AttachedBody> attached_;
  bool dirty_ = true;
};

}  // namespace moveit::core
