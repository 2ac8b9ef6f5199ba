// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <Eigen/Geometry>
#include <moveit/robot_model/link_model.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace moveit::core {

class AttachedBody {
 public:
  AttachedBody(const LinkModel* parent, std::string id, const Eigen::Isometry3d& pose,
               std::vector<shapes::ShapeConstPtr> shapes,
               const EigenSTL::vector_Isometry3d& shape_poses, std::set<std::string> touch_links)
      : parent_(parent),
        id_(std::move(id)),
        shapes_(std::move(shapes)),
        touch_links_(std::move(touch_links)) {
    for (const Eigen::Isometry3d& shape_pose : shape_poses) in_link_.push_back(pose * shape_pose);
  }
  const std::string& getName() const { return id_; }
  const std::string& getAttachedLinkName() const { return parent_->getName(); }
  const LinkModel* getAttachedLink() const { return parent_; }
  const std::vector<shapes::ShapeConstPtr>& getShapes() const { return shapes_; }
  const std::set<std::string>& getTouchLinks() const { return touch_links_; }
  const EigenSTL::vector_Isometry3d& getShapePosesInLinkFrame() const { return in_link_; }
  const EigenSTL::vector_Isometry3d& getGlobalCollisionBodyTransforms() const { return global_; }
  void computeTransform(const Eigen::Isometry3d& parent_link_global_transform) {
    global_.clear();
    for (const Eigen::Isometry3d& pose : in_link_)
      global_.push_back(parent_link_global_transform * pose);
  }

 private:
  const LinkModel* parent_;
  std::string id_;
  std::vector<shapes::ShapeConstPtr> shapes_;
  EigenSTL::vector_Isometry3d in_link_;
  EigenSTL::vector_Isometry3d global_;
  std::set<std::string> touch_links_;
};

}  // namespace moveit::core
