// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <map>
#include <memory>
#include <moveit/macros/class_forward.hpp>
#include <moveit/robot_model/joint_model.hpp>
#include <moveit/robot_model/link_model.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace moveit::core {

class JointModelGroup {
 public:
  const std::set<const LinkModel*>& getUpdatedLinkModelsSet() const { return links_; }
  void stub_add(const LinkModel* link) { links_.insert(link); }

 private:
  std::set<const LinkModel*> links_;
};

MOVEIT_CLASS_FORWARD(RobotModel);

// Built link by link, where the host reads URDF and SRDF.
class RobotModel {
 public:
  const std::vector<const LinkModel*>& getLinkModels() const { return links_const_; }
  const std::vector<const LinkModel*>& getLinkModelsWithCollisionGeometry() const {
    return links_with_geometry_;
  }
  const LinkModel* getLinkModel(const std::string& link) const {
    for (const LinkModel* model : links_const_)
      if (model->getName() == link) return model;
    return nullptr;
  }
  bool hasJointModelGroup(const std::string& group) const { return groups_.contains(group); }
  const JointModelGroup* getJointModelGroup(const std::string& name) const {
    return &groups_.at(name);
  }
  std::size_t getVariableCount() const { return variable_count_; }
  std::size_t getLinkGeometryCount() const { return geometry_count_; }

  JointModelGroup& stub_group(const std::string& name) { return groups_[name]; }

  // The shape is at the link's origin; null for none. The parent is null for the root.
  LinkModel* stub_add(const std::string& name, const LinkModel* parent,
                      std::unique_ptr<JointModel> joint, const Eigen::Isometry3d& origin,
                      const std::vector<shapes::ShapeConstPtr>& shapes,
                      const EigenSTL::vector_Isometry3d& poses) {
    links_.push_back(std::make_unique<LinkModel>(name, links_.size()));
    LinkModel* link = links_.back().get();
    joint->setFirstVariableIndex(int(variable_count_));
    variable_count_ +=
        joint->getType() == JointModel::FLOATING ? 7 : joint->getStateSpaceDimension();
    link->setParentLinkModel(parent);
    link->setParentJointModel(joint.get());
    link->setJointOriginTransform(origin);
    link->setGeometry(shapes, poses);
    link->setFirstCollisionBodyTransformIndex(int(geometry_count_));
    geometry_count_ += shapes.size();
    joints_.push_back(std::move(joint));
    links_const_.push_back(link);
    if (!shapes.empty()) links_with_geometry_.push_back(link);
    return link;
  }

 private:
  std::vector<std::unique_ptr<LinkModel>> links_;
  std::vector<std::unique_ptr<JointModel>> joints_;
  std::vector<const LinkModel*> links_const_;
  std::vector<const LinkModel*> links_with_geometry_;
  std::map<std::string, JointModelGroup> groups_;
  std::size_t variable_count_ = 0;
  std::size_t geometry_count_ = 0;
};

}  // namespace moveit::core
