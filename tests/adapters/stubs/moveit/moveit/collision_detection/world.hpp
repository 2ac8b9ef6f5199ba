// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <eigen_stl_containers/eigen_stl_vector_container.h>
#include <geometric_shapes/shapes.h>

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <moveit/macros/class_forward.hpp>
#include <string>
#include <utility>
#include <vector>

namespace collision_detection {

MOVEIT_CLASS_FORWARD(World);

class World {
 public:
  struct Object {
    explicit Object(std::string object_id) : id_(std::move(object_id)) {}
    std::string id_;
    std::vector<shapes::ShapeConstPtr> shapes_;
    EigenSTL::vector_Isometry3d global_shape_poses_;
  };
  using ObjectPtr = std::shared_ptr<Object>;
  using const_iterator = std::map<std::string, ObjectPtr>::const_iterator;

  const_iterator begin() const { return objects_.begin(); }
  const_iterator end() const { return objects_.end(); }

  void addToObject(const std::string& object_id, const shapes::ShapeConstPtr& shape,
                   const Eigen::Isometry3d& shape_pose) {
    ObjectPtr& object = objects_[object_id];
    if (!object) object = std::make_shared<Object>(object_id);
    object->shapes_.push_back(shape);
    object->global_shape_poses_.push_back(shape_pose);
  }
  bool removeObject(const std::string& object_id) { return objects_.erase(object_id) > 0; }

 private:
  std::map<std::string, ObjectPtr> objects_;
};

}  // namespace collision_detection
