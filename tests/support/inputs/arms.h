// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "dyop/chain/kinematic_chain.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "dyop/toi/obstacle_set.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

/// A generated robot and its surroundings, for tests, benchmarks and soak runs of chains.
namespace dyop::testing {

inline std::shared_ptr<const Shape> along_z(const std::shared_ptr<const Shape>& shape, Scalar z) {
  return std::make_shared<CompoundShape>(
      std::vector<CompoundChild>{{shape, RigidPose(Vector3(0, 0, z))}});
}

/// A closed tube of an arm from z = 0 to `length`, as an ellipsoid-like mesh of 1280 triangles.
inline std::shared_ptr<const Shape> arm_mesh(Scalar length, Scalar radius) {
  testing::MeshArrays arrays = testing::icosphere(3);
  for (Vector3& v : arrays.vertices) {
    v = Vector3(radius * v.x(), radius * v.y(), length / 2 * (1 + v.z()));
  }
  return std::make_shared<TriangleMesh>(arrays.mesh());
}

/// Six revolute axes as on an industrial robot of a reach of about 1.1: base, shoulder, elbow, and
/// three at the wrist, with a tool fixed to the flange. Primitive links and meshes in turn. The
/// base belongs to group 2 only, so that it may stand on obstacles of group 1.
inline KinematicChain six_axis_arm() {
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), z = Vector3::UnitZ();
  const auto gear = std::make_shared<TriangleMesh>(testing::gear(16, 0.05, 0.06, 0.03).mesh());
  std::vector<Link> links{
      {"base", along_z(std::make_shared<Box>(Vector3(0.1, 0.1, 0.05)), 0.05), false, 2},
      {"shoulder", along_z(std::make_shared<Capsule>(0.08, 0.05), 0.08), true},
      {"upper_arm", arm_mesh(0.45, 0.06), true},
      {"forearm", arm_mesh(0.4, 0.05), true},
      {"wrist_1", std::make_shared<Capsule>(0.04, 0.03), true},
      {"wrist_2", std::make_shared<Sphere>(0.045), true},
      {"flange", std::make_shared<Box>(Vector3(0.03, 0.03, 0.02)), true},
      {"tool", along_z(gear, 0.03), true}};
  const Scalar pi = std::numbers::pi;
  const auto turn = [&](const char* name, const char* parent, const char* child, Scalar height,
                        const Vector3& axis, Scalar limit) {
    return Joint{
        name, JointType::Revolute, parent, child, RigidPose(Vector3(0, 0, height)), axis, -limit,
        limit};
  };
  std::vector<Joint> joints{
      turn("turn", "base", "shoulder", 0.1, z, pi),
      turn("lift", "shoulder", "upper_arm", 0.15, y, 2),
      turn("bend", "upper_arm", "forearm", 0.45, y, 2.6),
      turn("roll", "forearm", "wrist_1", 0.42, z, pi),
      turn("tilt", "wrist_1", "wrist_2", 0.07, x, 2),
      turn("spin", "wrist_2", "flange", 0.06, z, pi),
      Joint{"mount", JointType::Fixed, "flange", "tool", RigidPose(Vector3(0, 0, 0.02))}};
  KinematicChain::Options options;
  // All but adjacent links, which overlap at the wrist.
  options.ignored_pairs = {{"forearm", "wrist_2"}, {"wrist_1", "flange"}, {"wrist_2", "tool"},
                           {"wrist_1", "tool"},    {"forearm", "flange"}, {"shoulder", "forearm"}};
  return KinematicChain(std::move(links), std::move(joints), options);
}

/// Boxes, balls and meshes of size about 0.1 at random within the reach of the arm, but not within
/// 0.35 of its column.
inline ObstacleSet arm_surroundings(int count, std::mt19937_64& random) {
  const auto torus = std::make_shared<TriangleMesh>(testing::torus(0.06, 0.025, 24, 12).mesh());
  const std::vector<std::shared_ptr<const Shape>> shapes{
      std::make_shared<Box>(Vector3(0.05, 0.04, 0.06)), std::make_shared<Sphere>(0.05), torus,
      std::make_shared<Capsule>(0.03, 0.06)};
  ObstacleSet set;
  while (set.size() < std::size_t(count)) {
    const RigidPose place = random_pose(1.4, random);
    const Vector3& p = place.translation();
    if (p.head<2>().norm() < 0.35 || p.z() < 0.05) continue;
    set.add(shapes[set.size() % shapes.size()], place);
  }
  return set;
}

/// Coordinates within the limits of the joints, which must be finite.
inline JointVector random_coordinates(const KinematicChain& chain, std::mt19937_64& random) {
  JointVector q(chain.coordinate_count());
  for (std::size_t i = 0; i < chain.coordinate_count(); ++i) {
    const Joint& joint = chain.joints()[chain.joint_of(i)];
    q[Eigen::Index(i)] = random_number(joint.lower, joint.upper, random);
  }
  return q;
}

}  // namespace dyop::testing
