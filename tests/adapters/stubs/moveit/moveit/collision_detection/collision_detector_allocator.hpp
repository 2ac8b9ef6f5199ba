// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <memory>
#include <moveit/collision_detection/collision_env.hpp>
#include <string>

namespace collision_detection {

MOVEIT_CLASS_FORWARD(CollisionDetectorAllocator);

class CollisionDetectorAllocator {
 public:
  virtual ~CollisionDetectorAllocator() {}
  virtual const std::string& getName() const = 0;
  virtual CollisionEnvPtr allocateEnv(
      const WorldPtr& world, const moveit::core::RobotModelConstPtr& robot_model) const = 0;
  virtual CollisionEnvPtr allocateEnv(const CollisionEnvConstPtr& orig,
                                      const WorldPtr& world) const = 0;
  virtual CollisionEnvPtr allocateEnv(
      const moveit::core::RobotModelConstPtr& robot_model) const = 0;
};

template <class CollisionEnvType, class CollisionDetectorAllocatorType>
class CollisionDetectorAllocatorTemplate : public CollisionDetectorAllocator {
 public:
  const std::string& getName() const override { return CollisionDetectorAllocatorType::NAME; }
  CollisionEnvPtr allocateEnv(const WorldPtr& world,
                              const moveit::core::RobotModelConstPtr& robot_model) const override {
    return std::make_shared<CollisionEnvType>(robot_model, world);
  }
  CollisionEnvPtr allocateEnv(const CollisionEnvConstPtr& orig,
                              const WorldPtr& world) const override {
    return std::make_shared<CollisionEnvType>(dynamic_cast<const CollisionEnvType&>(*orig), world);
  }
  CollisionEnvPtr allocateEnv(const moveit::core::RobotModelConstPtr& robot_model) const override {
    return std::make_shared<CollisionEnvType>(robot_model);
  }
  static CollisionDetectorAllocatorPtr create() {
    return std::make_shared<CollisionDetectorAllocatorType>();
  }
};

}  // namespace collision_detection
