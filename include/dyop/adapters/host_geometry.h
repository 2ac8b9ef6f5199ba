// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <numbers>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/occupancy.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"

/// What several adapters need: poses and shapes that their hosts all have.
namespace dyop::adapters {

/// @throws InvalidArgument if a number is not finite or the linear part is no rotation.
inline RigidPose pose_of(const Eigen::Isometry3d& X) {
  return RigidPose(Matrix3(X.linear()), Vector3(X.translation()));
}

inline Eigen::Isometry3d isometry_of(const RigidPose& X) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = X.rotation();
  result.translation() = X.translation();
  return result;
}

/// Closed meshes are solids for the adapters, others are surfaces.
inline bool is_closed_mesh(const Shape& shape) {
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  return mesh != nullptr && mesh->is_closed();
}

/// The plane a x + b y + c z + d = 0, and all that is behind it.
/// @throws InvalidArgument as HalfSpace.
inline std::shared_ptr<const Shape> plane_shape(Scalar a, Scalar b, Scalar c, Scalar d) {
  const Vector3 normal(a, b, c);
  const Scalar length = normal.stableNorm();
  DYOP_REQUIRE(length > 0 && length < kInfinity, "a plane has the normal ", normal);
  return std::make_shared<HalfSpace>(normal, -d / length);
}

/// What stands in for an occupied leaf of an octree.
enum class LeafShape {
  Cube,         ///< the leaf itself
  InnerSphere,  ///< the ball inside it
  OuterSphere   ///< the ball around it
};

/// The occupied leaves of an octomap::OcTree, in its order; null if there is none.
template <typename OcTree>
std::shared_ptr<const Shape> occupied_leaves(const OcTree& tree, LeafShape leaf_shape) {
  std::vector<OccupiedCube> cubes;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    if (!tree.isNodeOccupied(*leaf)) continue;
    cubes.push_back({Vector3(leaf.getX(), leaf.getY(), leaf.getZ()), leaf.getSize()});
  }
  if (cubes.empty()) return nullptr;
  if (leaf_shape == LeafShape::Cube) return std::make_shared<CompoundShape>(occupancy(cubes));
  const Scalar radius_per_size =
      leaf_shape == LeafShape::InnerSphere ? 0.5 : std::numbers::sqrt3 / 2;  // to a corner
  std::vector<CompoundChild> balls;
  for (const OccupiedCube& cube : cubes) {
    balls.push_back(
        {std::make_shared<Sphere>(radius_per_size * cube.size), RigidPose(cube.center)});
  }
  return std::make_shared<CompoundShape>(balls);
}

}  // namespace dyop::adapters
