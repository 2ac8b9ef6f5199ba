// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "dyop/core/time_interval.h"
#include "dyop/core/types.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

/// A point that moves on a straight line at constant speed over an interval of time: from `begin`
/// at its start to `end` at its end, world frame. The path is the exact line through the two given
/// points, unaffected by rounding.
struct VertexPath {
  Vector3 begin = Vector3::Zero();
  Vector3 end = Vector3::Zero();
};

/// A moving vertex (side A) and a moving triangle (side B). The triangle may degenerate to a
/// segment or a point, always or at some times.
struct VertexFacePaths {
  VertexPath vertex;
  std::array<VertexPath, 3> face;
};

/// Two moving edges, sides A and B. An edge may degenerate to a point, always or at some times.
struct EdgeEdgePaths {
  std::array<VertexPath, 2> edge_a;
  std::array<VertexPath, 2> edge_b;
};

/// What counts as an impact.
enum class ContactRule {
  WithinTolerance,  ///< coming within δ + ε, as for rigid shapes
  Exact,  ///< having a point in common at some instant, decided without rounding; needs δ = 0
};

struct VertexToiOptions {
  /// Gap δ at which the two elements count as touching; length, >= 0.
  Scalar target_distance = 0;
  /// How much above the target an impact may be reported: ε; length, > 0.
  /// Default: a millionth of the smaller element's size, which is its largest distance between
  /// vertices; for a vertex against a triangle, of the triangle's.
  std::optional<Scalar> distance_tolerance = {};
  ContactRule contact_rule = ContactRule::WithinTolerance;
  /// Largest number of steps in time, >= 1; after that the status is BudgetExhausted.
  std::int64_t max_steps = 1000;
};

/// Result of the queries below. ToiStatus states what each member promises in each status.
struct VertexToiResult {
  ToiStatus status = ToiStatus::NotRun;
  Scalar t_safe = 0;
  /// Vertices are numbered as in the paths.
  std::optional<ImpactContact> contact;
  Scalar rounding_allowance = 0;  ///< ν, length
  std::int64_t steps = 0;         ///< closest points computed
};

/// Returns when a moving vertex (A) and a moving triangle (B) first come within target_distance, or
/// proves that they do not.
///
/// Conservative advancement along fixed and turning directions; under ContactRule::Exact, pairs
/// that come within ε are decided in integer arithmetic.
///
/// @param interval The paths are at `begin` at its start and at `end` at its end. Finite, not
///                 reversed; for an interval of length zero only `begin` counts.
/// @throws InvalidArgument if a coordinate is not finite or beyond kLargestCoordinate, an option is
///         out of range, or the interval is not valid.
/// Thread-safe, deterministic; bounded by max_steps. No allocation, except for the exact decision.
/// See [Mirtich1996], docs/algorithms/linear_vertex_motion.md.
VertexToiResult time_of_impact(const VertexFacePaths& paths, const TimeInterval& interval = {},
                               const VertexToiOptions& options = {});

/// The same for two moving edges.
VertexToiResult time_of_impact(const EdgeEdgePaths& paths, const TimeInterval& interval = {},
                               const VertexToiOptions& options = {});

}  // namespace dyop
