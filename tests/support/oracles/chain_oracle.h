// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "dyop/chain/kinematic_chain.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/toi/obstacle_set.h"
#include "support/inputs/random_inputs.h"

/// Chains from the definition: products of homogeneous matrices, and distances at many single
/// times.
namespace dyop::testing {

/// A random tree of up to eight links, each a ball of a fifth of `size`, of all kinds of joints, at
/// offsets up to `size`.
inline KinematicChain random_tree(Scalar size, std::mt19937_64& random) {
  const int count = 1 + random_index(8, random);
  std::vector<Link> links;
  std::vector<Joint> joints;
  for (int i = 0; i < count; ++i) {
    links.push_back({std::to_string(i), std::make_shared<Sphere>(0.2 * size)});
    if (i == 0) continue;
    Joint joint;
    joint.name = std::to_string(i);
    joint.type = JointType(random_index(3, random));
    joint.parent = std::to_string(random_index(i, random));
    joint.child = std::to_string(i);
    joint.X_PJ = random_pose(size, random);
    joint.axis_J = random_magnitude(-2, 2, random) * random_direction(random);
    joints.push_back(joint);
  }
  KinematicChain::Options options;
  options.X_WR = random_pose(size, random);
  return KinematicChain(std::move(links), std::move(joints), options);
}

inline Eigen::Matrix4d homogeneous(const Matrix3& R, const Vector3& p) {
  Eigen::Matrix4d X = Eigen::Matrix4d::Identity();
  X.topLeftCorner<3, 3>() = R;
  X.topRightCorner<3, 1>() = p;
  return X;
}

inline Eigen::Matrix4d homogeneous(const RigidPose& X) {
  return homogeneous(X.rotation(), X.translation());
}

/// Poses of all links: for each, the matrices of the joints above it, from the root down.
inline std::vector<Eigen::Matrix4d> oracle_link_poses(const KinematicChain& chain,
                                                      const JointVector& q) {
  std::vector<Eigen::Matrix4d> poses;
  for (const Link& link : chain.links()) {
    Eigen::Matrix4d X = Eigen::Matrix4d::Identity();
    for (std::string name = link.name;;) {
      const auto joint = std::find_if(chain.joints().begin(), chain.joints().end(),
                                      [&](const Joint& j) { return j.child == name; });
      if (joint == chain.joints().end()) break;
      Eigen::Index coordinate = 0;
      for (auto before = chain.joints().begin(); before != joint; ++before) {
        coordinate += before->type != JointType::Fixed;
      }
      const Vector3 axis = joint->axis_J.normalized();
      Eigen::Matrix4d turn = Eigen::Matrix4d::Identity();
      if (joint->type == JointType::Revolute) {
        turn =
            homogeneous(Eigen::AngleAxisd(q[coordinate], axis).toRotationMatrix(), Vector3::Zero());
      } else if (joint->type == JointType::Prismatic) {
        turn = homogeneous(Matrix3::Identity(), q[coordinate] * axis);
      }
      X = homogeneous(joint->X_PJ) * turn * X;
      name = joint->parent;
    }
    poses.push_back(homogeneous(chain.X_WR()) * X);
  }
  return poses;
}

inline RigidPose oracle_pose(const Eigen::Matrix4d& X) {
  return RigidPose(Matrix3(X.topLeftCorner<3, 3>()), Vector3(X.topRightCorner<3, 1>()));
}

/// A bound on how fast the distance of any two bodies can change along a path, from the lengths of
/// the chain alone: every point of a link is within `reach` of every joint above it.
inline Scalar oracle_speed(const KinematicChain& chain, const JointPath& path) {
  Scalar reach = 0;
  for (const Link& link : chain.links()) {
    if (link.shape) reach = std::max(reach, link.shape->bounding_radius());
  }
  for (const Joint& joint : chain.joints()) reach += joint.X_PJ.translation().norm();
  Scalar speed = 0;
  for (std::size_t i = 0; i < chain.coordinate_count(); ++i) {
    const bool is_prismatic = chain.joints()[chain.joint_of(i)].type == JointType::Prismatic;
    if (is_prismatic) reach += path.largest_value(i);
  }
  for (std::size_t i = 0; i < chain.coordinate_count(); ++i) {
    const bool is_prismatic = chain.joints()[chain.joint_of(i)].type == JointType::Prismatic;
    speed += path.bound(i, path.domain()).speed * (is_prismatic ? 1 : reach);
  }
  return 2 * speed;  // two links may both move
}

/// The least distance of any link from its obstacles, and of any pair of links that self-collision
/// checks, at one time. `limit`: larger distances may be reported as any value above it.
inline Scalar oracle_gap(const KinematicChain& chain, const JointPath& path,
                         const ObstacleSet& obstacles, Scalar t, Scalar limit) {
  const std::vector<Eigen::Matrix4d> poses = oracle_link_poses(chain, path.position(t));
  Scalar least = limit;
  const auto compare = [&least](const Shape& a, const RigidPose& X_WA, bool solid_a, const Shape& b,
                                const RigidPose& X_WB, bool solid_b) {
    const Scalar gap = (X_WA.translation() - X_WB.translation()).norm() - a.bounding_radius() -
                       b.bounding_radius();
    if (gap > least) return;
    DistanceOptions options;
    options.max_distance = least;
    options.solid_a = solid_a;
    options.solid_b = solid_b;
    const DistanceResult found = distance(a, X_WA, b, X_WB, options);
    if (found.status != DistanceStatus::FartherThanMaxDistance) {
      least = std::min(least, found.upper);
    }
  };
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Link& link = chain.links()[i];
    if (!link.shape) continue;
    for (const ObstacleId id : obstacles.ids()) {
      const Obstacle& other = obstacles.obstacle(id);
      if ((other.groups & link.groups) == 0) continue;
      compare(*link.shape, oracle_pose(poses[i]), link.is_solid, *other.shape, other.X_WO->pose(t),
              other.is_solid);
    }
  }
  for (const KinematicChain::LinkPair& pair : chain.self_pairs()) {
    const Link& a = chain.links()[pair.first];
    const Link& b = chain.links()[pair.second];
    compare(*a.shape, oracle_pose(poses[pair.first]), a.is_solid, *b.shape,
            oracle_pose(poses[pair.second]), b.is_solid);
  }
  return least;
}

}  // namespace dyop::testing
