// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <moveit/robot_model/robot_model.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace collision_detection {

MOVEIT_CLASS_FORWARD(AllowedCollisionMatrix);

namespace BodyTypes {
enum Type { ROBOT_LINK, ROBOT_ATTACHED, WORLD_OBJECT };
}
using BodyType = BodyTypes::Type;

struct Contact {
  Eigen::Vector3d pos;
  Eigen::Vector3d normal;
  double depth = 0;
  std::string body_name_1;
  BodyType body_type_1;
  std::string body_name_2;
  BodyType body_type_2;
  double percent_interpolation = 0;
  Eigen::Vector3d nearest_points[2];
};

struct CostSource {
  std::array<double, 3> aabb_min;
  std::array<double, 3> aabb_max;
  double cost = 0;
  bool operator<(const CostSource& other) const { return aabb_min < other.aabb_min; }
};

struct CollisionResult;

struct CollisionRequest {
  std::string group_name = "";
  bool pad_environment_collisions = true;
  bool pad_self_collisions = false;
  bool distance = false;
  bool detailed_distance = false;
  bool cost = false;
  bool contacts = false;
  std::size_t max_contacts = 1;
  std::size_t max_contacts_per_pair = 1;
  std::size_t max_cost_sources = 1;
  std::function<bool(const CollisionResult&)> is_done = nullptr;
  bool verbose = false;
};

namespace DistanceRequestTypes {
enum DistanceRequestType { GLOBAL, SINGLE, LIMITED, ALL };
}
using DistanceRequestType = DistanceRequestTypes::DistanceRequestType;

struct DistanceRequest {
  bool enable_nearest_points = false;
  bool enable_signed_distance = false;
  DistanceRequestType type = DistanceRequestType::GLOBAL;
  std::size_t max_contacts_per_body = 1;
  std::string group_name = "";
  const std::set<const moveit::core::LinkModel*>* active_components_only = nullptr;
  const AllowedCollisionMatrix* acm = nullptr;
  double distance_threshold = std::numeric_limits<double>::max();
  bool verbose = false;
  bool compute_gradient = false;
};

struct DistanceResultsData {
  double distance = std::numeric_limits<double>::max();
  Eigen::Vector3d nearest_points[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::string link_names[2];
  BodyType body_types[2] = {BodyType::WORLD_OBJECT, BodyType::WORLD_OBJECT};
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

using DistanceMap = std::map<std::pair<std::string, std::string>, std::vector<DistanceResultsData>>;

struct DistanceResult {
  bool collision = false;
  DistanceResultsData minimum_distance;
  DistanceMap distances;
};

struct CollisionResult {
  bool collision = false;
  double distance = std::numeric_limits<double>::max();
  DistanceResult distance_result;
  std::size_t contact_count = 0;
  using ContactMap = std::map<std::pair<std::string, std::string>, std::vector<Contact>>;
  ContactMap contacts;
  std::set<CostSource> cost_sources;
};

}  // namespace collision_detection
