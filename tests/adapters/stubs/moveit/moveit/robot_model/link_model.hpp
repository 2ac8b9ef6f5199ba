// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <eigen_stl_containers/eigen_stl_vector_container.h>
#include <geometric_shapes/shapes.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace moveit::core {

class JointModel;

class LinkModel {
 public:
  LinkModel(std::string name, std::size_t link_index)
      : name_(std::move(name)), link_index_(link_index) {}
  const std::string& getName() const { return name_; }
  std::size_t getLinkIndex() const { return link_index_; }
  int getFirstCollisionBodyTransformIndex() const { return first_collision_body_transform_index_; }
  void setFirstCollisionBodyTransformIndex(int index) {
    first_collision_body_transform_index_ = index;
  }
  const JointModel* getParentJointModel() const { return parent_joint_model_; }
  void setParentJointModel(const JointModel* joint) { parent_joint_model_ = joint; }
  const LinkModel* getParentLinkModel() const { return parent_link_model_; }
  void setParentLinkModel(const LinkModel* link) { parent_link_model_ = link; }
  const Eigen::Isometry3d& getJointOriginTransform() const { return joint_origin_transform_; }
  void setJointOriginTransform(const Eigen::Isometry3d& transform) {
    joint_origin_transform_ = transform;
  }
  const EigenSTL::vector_Isometry3d& getCollisionOriginTransforms() const {
    return collision_origin_transform_;
  }
  const std::vector<shapes::ShapeConstPtr>& getShapes() const { return shapes_; }
  void setGeometry(const std::vector<shapes::ShapeConstPtr>& shapes,
                   const EigenSTL::vector_Isometry3d& origins) {
    shapes_ = shapes;
    collision_origin_transform_ = origins;
  }

 private:
  std::string name_;
  std::size_t link_index_;
  const JointModel* parent_joint_model_ = nullptr;
  const LinkModel* parent_link_model_ = nullptr;
  Eigen::Isometry3d joint_origin_transform_ = Eigen::Isometry3d::Identity();
  EigenSTL::vector_Isometry3d collision_origin_transform_;
  std::vector<shapes::ShapeConstPtr> shapes_;
  int first_collision_body_transform_index_ = -1;
};

}  // namespace moveit::core
