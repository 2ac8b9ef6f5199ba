// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"
#include "support/oracles/shape_oracle.h"

namespace dyop::testing {

/// A shape prepared for many distance queries: a binary tree of axis-aligned boxes, split at the
/// median, over the triangles of its surface. Refers to the shape, which must outlive it.
class OracleBody {
 public:
  struct Node {
    Vector3 center;
    Vector3 half_extents;
    Scalar radius;            ///< of a ball about `center` that contains the triangles
    std::int32_t first = -1;  ///< inner: the children are nodes first and first + 1; leaf: triangle
    bool is_leaf = false;
  };

  /// @throws InvalidArgument for a convex shape whose core_surface() is null.
  explicit OracleBody(const Shape& shape);

  const Shape& shape() const { return *shape_; }
  const OracleSurface& surface() const { return surface_; }
  const std::vector<Node>& nodes() const { return nodes_; }

  /// Largest distance of a point of the shape from the frame's origin, from its vertices.
  Scalar radius() const { return radius_; }

 private:
  void build(std::size_t node, std::size_t begin, std::size_t end, std::vector<std::int32_t>& order,
             const std::vector<AlignedBox>& boxes);

  const Shape* shape_;
  OracleSurface surface_;
  std::vector<Node> nodes_;
  Scalar radius_ = 0;
};

/// lower <= distance <= upper.
struct DistanceBracket {
  Scalar lower = 0;
  Scalar upper = kInfinity;
};

/// Pair of triangles to start with; after the query the pair that gave its upper bound.
struct PairSeed {
  std::int32_t triangle_a = 0;
  std::int32_t triangle_b = 0;
};

/// How far apart the bounds may be left: `absolute`, or if larger, `relative` times the excess of
/// the distance over `target`.
struct SearchGap {
  Scalar absolute = 0;
  Scalar relative = 0;
  Scalar target = 0;
};

/// Distance of the surfaces (with rounding radii) by branch and bound in double, with its own
/// formulas. The bounds are proven by the slab between the triangles, and by quad precision where
/// double is not enough. They differ by at most the gap requested, plus 2^-40 of the size of a pair
/// of triangles, plus 512 u (size of both shapes + distance of their origins), u = 2^-53. A shape
/// inside a solid is not detected: see oracle_contains(). `seed` affects only the speed.
DistanceBracket fast_oracle_distance(const OracleBody& a, const RigidPose& X_WA,
                                     const OracleBody& b, const RigidPose& X_WB,
                                     const SearchGap& gap, PairSeed& seed);

}  // namespace dyop::testing
