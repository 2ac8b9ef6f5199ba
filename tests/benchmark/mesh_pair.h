// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/math/bv/RSS.h>
#include <fcl/narrowphase/distance.h>
#include <time.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/random_inputs.h"

// What the benchmarks on meshes share: FCL's copy of a mesh, and statistics of single calls.
namespace dyop::testing {

using FclRss = fcl::BVHModel<fcl::RSS<Scalar>>;
using FclObbRss = fcl::BVHModel<fcl::OBBRSS<Scalar>>;

template <typename Model>
std::shared_ptr<Model> fcl_model(const TriangleMesh& mesh) {
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(mesh.triangles().size());
  for (const TriangleIndices& t : mesh.triangles()) {
    triangles.emplace_back(std::size_t(t[0]), std::size_t(t[1]), std::size_t(t[2]));
  }
  auto model = std::make_shared<Model>();
  model->beginModel();
  model->addSubModel({mesh.vertices().begin(), mesh.vertices().end()}, triangles);
  model->endModel();
  return model;
}

inline fcl::Transform3<Scalar> fcl_pose(const RigidPose& X) {
  fcl::Transform3<Scalar> result = fcl::Transform3<Scalar>::Identity();
  result.linear() = X.rotation();
  result.translation() = X.translation();
  return result;
}

template <typename Model>
Scalar fcl_distance(const std::shared_ptr<Model>& a, const RigidPose& X_WA,
                    const std::shared_ptr<Model>& b, const RigidPose& X_WB) {
  fcl::DistanceRequest<Scalar> request;
  fcl::DistanceResult<Scalar> result;
  const fcl::CollisionObject<Scalar> object_a(a, fcl_pose(X_WA));
  const fcl::CollisionObject<Scalar> object_b(b, fcl_pose(X_WB));
  fcl::distance(&object_a, &object_b, request, result);
  return result.min_distance;
}

/// A pose of a copy B of the mesh A: B comes from a random side until the gap is reached. Nothing
/// if it does not meet A.
inline std::optional<RigidPose> pose_at_gap(const TriangleMesh& mesh, const RigidPose& X_WA,
                                            Scalar gap, std::mt19937_64& random) {
  const Vector3 direction = random_direction(random);
  const ConstantTwistMotion approach(RigidPose(random_rotation(random), 4 * direction),
                                     {-direction, Vector3::Zero()});
  ToiOptions options;
  options.target_distance = gap;
  options.distance_tolerance = 1e-3 * gap;  // literal: close enough to name the gap by
  const ToiResult result = time_of_impact(mesh, RestMotion(X_WA), mesh, approach, {0, 4}, options);
  if (result.status != ToiStatus::Impact) return std::nullopt;
  return result.X_WB;
}

/// Processor time of this thread in microseconds: what others do on the machine does not count but
/// for its caches.
inline Scalar processor_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * Scalar(now.tv_sec) + Scalar(now.tv_nsec) / 1000;
}

/// Microseconds of processor time that a call takes; the clock itself costs about 0.3.
template <typename Call>
Scalar microseconds(const Call& call) {
  const Scalar begin = processor_time();
  call();
  return processor_time() - begin;
}

/// Element at a quantile in [0, 1].
inline Scalar quantile(std::vector<Scalar> values, Scalar q) {
  std::sort(values.begin(), values.end());
  return values[std::size_t(q * Scalar(values.size() - 1))];
}

inline Scalar mean(const std::vector<Scalar>& values) {
  Scalar sum = 0;
  for (const Scalar value : values) sum += value;
  return sum / Scalar(values.size());
}

}  // namespace dyop::testing
