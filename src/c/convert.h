// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <stop_token>
#include <vector>

#include "c/sized_struct.h"
#include "dyop/core/batch_options.h"
#include "dyop/distance/distance.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/dyop_c.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/obstacle_set.h"
#include "dyop/toi/time_of_impact.h"
#include "dyop/toi/toi_result.h"

// Converts values between C and C++.
namespace dyop::c {

inline Vector3 vector_from(const double (&x)[3]) {
  return {x[0], x[1], x[2]};
}

inline void write_vector(const Vector3& x, double (&out)[3]) {
  std::copy(x.begin(), x.end(), out);
}

inline RigidPose pose_from(const dyop_pose& pose) {
  const double* q = pose.rotation;
  return RigidPose(Quaternion(q[0], q[1], q[2], q[3]), vector_from(pose.position));
}

inline dyop_pose to_c(const RigidPose& X) {
  const Quaternion q = X.quaternion();
  dyop_pose pose{{}, {q.w(), q.x(), q.y(), q.z()}};
  write_vector(X.translation(), pose.position);
  return pose;
}

inline MotionState state_from(const dyop_state& state) {
  return {pose_from(state.pose), {vector_from(state.twist.v), vector_from(state.twist.w)}};
}

inline dyop_state to_c(const MotionState& state) {
  dyop_state result{to_c(state.X_WB), {}};
  write_vector(state.twist.v_WB, result.twist.v);
  write_vector(state.twist.w_WB, result.twist.w);
  return result;
}

inline dyop_mass_properties to_c(const MassProperties& properties) {
  dyop_mass_properties result{properties.mass, {}, {}};
  write_vector(properties.p_BoBcm, result.center);
  for (int k = 0; k < 9; ++k) result.inertia[k] = properties.I_BBcm(k / 3, k % 3);
  return result;
}

inline MassProperties mass_properties_from(const dyop_mass_properties& properties) {
  MassProperties result{properties.mass, vector_from(properties.center), {}};
  for (int k = 0; k < 9; ++k) result.I_BBcm(k / 3, k % 3) = properties.inertia[k];
  return result;
}

inline TimeInterval interval_from(const dyop_interval& interval) {
  return {interval.begin, interval.end};
}

inline dyop_witness to_c(const WitnessPair& pair) {
  dyop_witness witness{};
  witness.lower = pair.lower;
  witness.upper = pair.upper;
  write_vector(pair.p_WCa, witness.point_a);
  write_vector(pair.p_WCb, witness.point_b);
  write_vector(pair.nhat_AB_W, witness.normal);
  witness.triangle_a = pair.triangle_a.value_or(-1);
  witness.triangle_b = pair.triangle_b.value_or(-1);
  witness.child_a = pair.child_a.value_or(-1);
  witness.child_b = pair.child_b.value_or(-1);
  return witness;
}

inline DistanceOptions distance_options_from(const dyop_distance_options* given) {
  const auto c = read_struct<dyop_distance_options>(given, DYOP_DISTANCE_OPTIONS_INIT,
                                                    "dyop_distance_options");
  DistanceOptions options;
  options.max_distance = c.max_distance;
  options.absolute_tolerance = c.absolute_tolerance;
  options.relative_tolerance = c.relative_tolerance;
  options.solid_a = c.solid_a != 0;
  options.solid_b = c.solid_b != 0;
  return options;
}

inline ToiOptions toi_options_from(const dyop_toi_options* given) {
  const auto c = read_struct<dyop_toi_options>(given, DYOP_TOI_OPTIONS_INIT, "dyop_toi_options");
  ToiOptions options;
  options.target_distance = c.target_distance;
  if (c.distance_tolerance != 0) options.distance_tolerance = c.distance_tolerance;
  options.max_node_pairs = c.max_node_pairs;
  options.solid_a = c.solid_a != 0;
  options.solid_b = c.solid_b != 0;
  return options;
}

inline dyop_distance_result distance_result(const DistanceResult& found) {
  return {sizeof(dyop_distance_result), int(found.status),
          to_c(static_cast<const WitnessPair&>(found))};
}

inline dyop_toi_result toi_result(const ToiResult& found) {
  dyop_toi_result result{};
  result.status = int(found.status);
  result.t_safe = found.t_safe;
  result.t_hit = found.t_hit.value_or(std::numeric_limits<double>::quiet_NaN());
  result.rounding_allowance = found.rounding_allowance;
  result.pose_a = to_c(found.X_WA);
  result.pose_b = to_c(found.X_WB);
  if (found.contact) {
    result.has_contact = 1;
    result.closing_speed = found.contact->closing_speed;
    result.witness = to_c(static_cast<const WitnessPair&>(*found.contact));
  }
  result.node_pairs = found.statistics.node_pairs;
  return result;
}

inline BatchOptions batch_options_from(const dyop_batch_options* given, std::stop_source& stop) {
  const auto c =
      read_struct<dyop_batch_options>(given, DYOP_BATCH_OPTIONS_INIT, "dyop_batch_options");
  BatchOptions options;
  options.thread_count = c.thread_count;
  options.stop = stop.get_token();
  if (c.progress) {
    options.progress = [c, &stop](std::size_t done, std::size_t total) {
      if (c.progress(c.user, done, total) != 0) stop.request_stop();
    };
  }
  return options;
}

// Numbers of obstacles, joints and springs start at 1, so that zero refers to none.
template <typename Handle, typename Id>
Handle numbered(Id id) {
  return {std::uint64_t(id) + 1};
}

inline dyop_obstacle handle_of(const std::optional<ObstacleId>& id) {
  return id ? numbered<dyop_obstacle>(*id) : dyop_obstacle{};
}

// Handles of bodies start at generation 1, so that zero refers to none.
inline dyop_body to_c(const BodyId& id) {
  return {id.slot, id.generation + 1};
}

inline BodyId body_from(dyop_body body) {
  return BodyId(body.index, body.generation - 1);
}

// Rows of three, which throws InvalidArgument if there are none to read.
inline std::vector<Vector3> rows_from(const double* numbers, std::size_t count, const char* what) {
  DYOP_REQUIRE(numbers || count == 0, what, " must not be null");
  std::vector<Vector3> rows;
  for (std::size_t i = 0; i < count; ++i) {
    rows.emplace_back(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
  }
  return rows;
}

// Rows of three numbers of vertices.
inline std::vector<TriangleIndices> triangles_from(const std::int32_t* numbers, std::size_t count) {
  DYOP_REQUIRE(numbers || count == 0, "triangles must not be null");
  std::vector<TriangleIndices> rows;
  for (std::size_t i = 0; i < count; ++i) {
    rows.push_back({numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]});
  }
  return rows;
}

// Throws InvalidArgument.
template <typename Pointer>
Pointer* require_given(Pointer* pointer, const char* what) {
  DYOP_REQUIRE(pointer, what, " must not be null");
  return pointer;
}

// As many entries of a list as the caller has space for.
template <typename Struct>
void hand_over(const std::vector<Struct>& list, Struct* out, std::size_t capacity,
               std::size_t* count, const char* what) {
  auto array = sized_array(out, capacity, what);
  for (std::size_t i = 0; i < std::min(capacity, list.size()); ++i) array.write(i, list[i]);
  *require_given(count, "count") = list.size();
}

}  // namespace dyop::c
