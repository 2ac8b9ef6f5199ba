// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <map>
#include <memory>
#include <moveit/collision_detection/collision_matrix.hpp>
#include <moveit/collision_detection/world.hpp>
#include <moveit/robot_state/robot_state.hpp>
#include <string>
#include <vector>

namespace collision_detection {

MOVEIT_CLASS_FORWARD(CollisionEnv);

class CollisionEnv {
 public:
  CollisionEnv() = delete;
  CollisionEnv(const moveit::core::RobotModelConstPtr& model, double padding = 0.0,
               double scale = 1.0)
      : CollisionEnv(model, std::make_shared<World>(), padding, scale) {}
  CollisionEnv(const moveit::core::RobotModelConstPtr& model, const WorldPtr& world,
               double padding = 0.0, double scale = 1.0)
      : robot_model_(model), world_(world), world_const_(world) {
    for (const auto* link : model->getLinkModelsWithCollisionGeometry()) {
      link_padding_[link->getName()] = padding;
      link_scale_[link->getName()] = scale;
    }
  }
  CollisionEnv(const CollisionEnv& other, const WorldPtr& world)
      : robot_model_(other.robot_model_),
        link_padding_(other.link_padding_),
        link_scale_(other.link_scale_),
        world_(world),
        world_const_(world) {}
  virtual ~CollisionEnv() {}

  virtual void checkSelfCollision(const CollisionRequest& req, CollisionResult& res,
                                  const moveit::core::RobotState& state) const = 0;
  virtual void checkSelfCollision(const CollisionRequest& req, CollisionResult& res,
                                  const moveit::core::RobotState& state,
                                  const AllowedCollisionMatrix& acm) const = 0;
  virtual void checkRobotCollision(const CollisionRequest& req, CollisionResult& res,
                                   const moveit::core::RobotState& state) const = 0;
  virtual void checkRobotCollision(const CollisionRequest& req, CollisionResult& res,
                                   const moveit::core::RobotState& state,
                                   const AllowedCollisionMatrix& acm) const = 0;
  virtual void checkRobotCollision(const CollisionRequest& req, CollisionResult& res,
                                   const moveit::core::RobotState& state1,
                                   const moveit::core::RobotState& state2,
                                   const AllowedCollisionMatrix& acm) const = 0;
  virtual void checkRobotCollision(const CollisionRequest& req, CollisionResult& res,
                                   const moveit::core::RobotState& state1,
                                   const moveit::core::RobotState& state2) const = 0;
  virtual void distanceSelf(const DistanceRequest& req, DistanceResult& res,
                            const moveit::core::RobotState& state) const = 0;
  double distanceSelf(const moveit::core::RobotState& state) const {
    DistanceRequest req;
    DistanceResult res;
    distanceSelf(req, res, state);
    return res.minimum_distance.distance;
  }
  virtual void distanceRobot(const DistanceRequest& req, DistanceResult& res,
                             const moveit::core::RobotState& state) const = 0;
  double distanceRobot(const moveit::core::RobotState& state, bool /*verbose*/ = false) const {
    DistanceRequest req;
    DistanceResult res;
    distanceRobot(req, res, state);
    return res.minimum_distance.distance;
  }

  const WorldPtr& getWorld() { return world_; }
  const WorldConstPtr& getWorld() const { return world_const_; }
  const moveit::core::RobotModelConstPtr& getRobotModel() const { return robot_model_; }
  void setLinkPadding(const std::string& link_name, double padding) {
    link_padding_[link_name] = padding;
  }
  double getLinkPadding(const std::string& link_name) const {
    const auto found = link_padding_.find(link_name);
    return found == link_padding_.end() ? 0.0 : found->second;
  }
  void setLinkScale(const std::string& link_name, double scale) { link_scale_[link_name] = scale; }
  double getLinkScale(const std::string& link_name) const {
    const auto found = link_scale_.find(link_name);
    return found == link_scale_.end() ? 1.0 : found->second;
  }

 protected:
  moveit::core::RobotModelConstPtr robot_model_;
  std::map<std::string, double> link_padding_;
  std::map<std::string, double> link_scale_;

 private:
  WorldPtr world_;
  WorldConstPtr world_const_;
};

}  // namespace collision_detection
