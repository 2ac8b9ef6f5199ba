// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/geometry/convex_hull.h"

namespace DYOP_EXPORT dyop {

/// Bounds on a distance. Proven if the algorithm is certified; otherwise `upper` is its estimate
/// and `lower` is 0.
struct DistanceBounds {
  Scalar lower = 0;
  Scalar upper = kInfinity;
};

/// One algorithm for the distance of two triangles, or of two convex hulls; stateless and
/// thread-safe. For comparisons: each algorithm has its own function in this folder that also
/// returns witness points and features, and distance() is the front door for everything else.
///
/// To add an algorithm:
///   1. `include/dyop/paper/<name>.h` and `src/paper/<name>.cpp`, listed in
///      `src/paper/CMakeLists.txt`, with a page in docs/algorithms;
///   2. a class in `src/paper/distance_algorithm.cpp` and its name in the list at the end of
///      that file: the contract tests of tests/paper/distance_algorithm_test.cpp then check it, and
///      `dyop paper` measures and draws it.
class DistanceAlgorithm {
 public:
  virtual ~DistanceAlgorithm() = default;

  /// Unique name, as written in tables.
  virtual std::string_view name() const = 0;

  /// Whether `lower <= d <= upper` is proven for every answer.
  virtual bool is_certified() const = 0;

  /// Distance of two triangles in the plane. Coordinates must be finite and at most
  /// kLargestCoordinate; they are not checked here.
  virtual DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const = 0;

  /// The same in space.
  virtual DistanceBounds distance(const Triangle& a, const Triangle& b) const = 0;

  /// Distance of two hulls of any size, X_AB the pose of b's frame in a's frame; nothing if this
  /// algorithm is for triangles only.
  virtual std::optional<DistanceBounds> distance(const ConvexHull& a, const ConvexHull& b,
                                                 const RigidPose& X_AB) const;
};

/// All algorithms, certified DyOP first.
std::span<const DistanceAlgorithm* const> distance_algorithms();

/// The algorithm with that name.
/// @throws InvalidArgument if there is none; the message lists the names.
const DistanceAlgorithm& distance_algorithm(std::string_view name);

/// A second opinion: distance of two triangles by GJK with the public parts of libccd [Fiser]. An
/// estimate: nothing is proven. The planar version is the same in space with z = 0.
///
/// libccd tells whether shapes overlap and how deeply; it has no public distance call, and FCL
/// carries a copy of its private code for one. This adapter uses the public interface only:
/// libccd's support callbacks and its nearest points of a segment and a triangle to the origin, in
/// the loop that FCL runs after libccd's overlap test. Leaving that test out makes it faster, not
/// slower. Triangles that intersect give about zero.
///
/// Coordinates must be finite; they are not checked here. Bounded, no allocation.
Scalar libccd_distance(const Triangle& a, const Triangle& b);
Scalar libccd_distance(const PlanarTriangle& a, const PlanarTriangle& b);

/// Result of textbook_gjk(), in the frame of the arguments. An estimate: nothing is proven.
template <int dimension>
struct GjkEstimate {
  using Point = Eigen::Matrix<Scalar, dimension, 1>;

  Scalar distance = 0;
  Point p_a = Point::Zero();
  Point p_b = Point::Zero();
  bool is_overlapping = false;  ///< the simplex holds the origin, up to rounding
  int iterations = 0;
};

/// Distance of two triangles by the algorithm of [GilbertJohnsonKeerthi1988] as textbooks present
/// it ([vandenBergen2003] chapter 4, with the region tests of [Ericson2005] chapter 5), without a
/// certificate and without care for slivers: the rival in the experiment of [DyOP]. gjk_distance()
/// is the one to use.
///
/// Coordinates must be finite; they are not checked here. Bounded, no allocation.
GjkEstimate<2> textbook_gjk(const PlanarTriangle& a, const PlanarTriangle& b);
GjkEstimate<3> textbook_gjk(const Triangle& a, const Triangle& b);

}  // namespace dyop
