// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "dyop/core/batch_options.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

struct DistanceOptions {
  /// Stop as soon as the shapes are proven farther apart than this; length, >= 0.
  Scalar max_distance = kInfinity;
  /// How far apart the bounds may stay, besides rounding: upper - lower is at most the larger of
  /// the absolute tolerance (length, >= 0) and the relative one (in [0, 1)) times upper. The bounds
  /// still hold; pieces that could only narrow them are skipped. With an absolute tolerance
  /// overlapping shapes may be Inconclusive; close to max_distance the bounds may lie on both sides
  /// of it.
  Scalar absolute_tolerance = 0;
  Scalar relative_tolerance = 0;
  /// Compute penetration depth and direction of overlapping convex shapes (through libccd).
  bool with_penetration = false;
  /// Treat A (B) as a solid, not as a surface: anything inside it overlaps. A mesh must be closed;
  /// convex shapes are always solids.
  bool solid_a = false;
  bool solid_b = false;
};

/// What a distance query keeps for the next query of the same two shapes: the pieces that were
/// nearest. The caller owns it, one per pair of shapes. Any cache may be used with any pair; a
/// wrong one only costs time.
struct DistanceCache {
  /// Leaves of the hierarchies of A and B.
  struct Leaves {
    std::int32_t a;
    std::int32_t b;
  };
  std::optional<Leaves> nearest;

  /// Two convex shapes: the vertices that spanned the nearest points.
  struct Vertices {
    std::size_t count = 0;  ///< 0: none
    std::array<std::int32_t, 3> a{};
    std::array<std::int32_t, 3> b{};
  };
  Vertices vertices;

  /// A pair of boxes proven at least `gap` apart.
  struct BoxPair {
    Scalar gap;
    std::int32_t a;
    std::int32_t b;
  };
  /// Memory of the search: with it, queries allocate nothing once it has grown.
  std::vector<BoxPair> stack;
};

/// Returns the distance of two shapes, with proven bounds lower <= d <= upper and witness points.
///
/// For meshes d is the distance of the surfaces: a body wholly inside a closed mesh is at a
/// positive distance from it, unless an option says that the mesh is a solid; then both witness
/// points are the same inner point, and normal and features are meaningless. For convex shapes d is
/// the distance of the solids. upper - lower is rounding noise (docs/concepts.md) unless the
/// options allow more.
///
/// @param a, b       Shapes, each in its own frame A, B.
/// @param X_WA, X_WB Their poses in world W; any consistent unit of length.
/// @throws InvalidArgument if max_distance or a tolerance is out of its range or NaN, or a solid is
///         a mesh that is not closed.
/// Reads the shapes only; thread-safe. Method: docs/algorithms/distance.md.
DistanceResult distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                        const RigidPose& X_WB, const DistanceOptions& options = {});

/// The same, starting from the pieces that were nearest in the last query with `cache`, or from the
/// vertices of two convex shapes: twice as fast or more if bodies moved little. Bounds differ from
/// those without it only by rounding; where several pieces are as near, the witness may differ.
DistanceResult distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                        const RigidPose& X_WB, const DistanceOptions& options,
                        DistanceCache& cache);

/// Returns every contact of two shapes: the witness points of all pairs of surface pieces at most
/// `max_distance` apart, once per place: pairs with nearly the same normal whose points are closer
/// to each other, on both bodies, than sqrt(max_distance² - least gap²) count as one. Sorted by
/// lower bound, then by place, so the order is reproducible. A cube resting on its face gives its
/// corners, not one point.
/// @throws InvalidArgument unless max_distance is finite and >= 0.
std::vector<Contact> find_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                   const RigidPose& X_WB, Scalar max_distance);

/// One distance query of a batch: the arguments of distance(). Shapes belong to the caller, may be
/// shared by any number of queries, and must not change until the batch returns.
struct DistanceQuery {
  const Shape* a = nullptr;
  RigidPose X_WA = {};
  const Shape* b = nullptr;
  RigidPose X_WB = {};
  DistanceOptions options = {};
  /// Warm start read and updated by the query, as for distance(); null for none. No two queries of
  /// a batch may share one.
  DistanceCache* cache = nullptr;
};

/// Answers many distance queries on several threads: results[i] is bit for bit what distance()
/// returns for queries[i], for any number of threads. After a stop, queries that were not started
/// have status NotRun; all others are answered.
/// @throws InvalidArgument before any query is run if the spans differ in length, thread_count is
///         negative, or a query lacks a shape or would be refused by distance(); the message names
///         the lowest such index. An exception from the progress callback ends the batch as a stop
///         does.
void distance_batch(std::span<const DistanceQuery> queries, std::span<DistanceResult> results,
                    const BatchOptions& options = {});

/// What ends a search for contacts early.
struct ContactSearchLimits {
  /// Pairs of triangles within max_distance, at most; >= 0. Each takes some kilobytes meanwhile.
  std::int64_t max_triangle_pairs = std::numeric_limits<std::int64_t>::max();
  /// Cooperative cancellation.
  std::stop_token stop = {};
};

/// find_contacts() under limits: nothing if one of them ended the search, because contacts that are
/// not all there are not the nearest ones of their places.
/// @throws InvalidArgument likewise, or if max_triangle_pairs is negative.
std::optional<std::vector<Contact>> find_contacts(const Shape& a, const RigidPose& X_WA,
                                                  const Shape& b, const RigidPose& X_WB,
                                                  Scalar max_distance,
                                                  const ContactSearchLimits& limits);

}  // namespace dyop
