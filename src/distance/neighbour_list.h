// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "distance/distance_traversal.h"
#include "dyop/core/export.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace dyop::distance_internal {

/// Two pieces are near if they are at most r + c l apart (`reach`, `slope`), l being the distance
/// of the moving side's farther point from the pivot: a turn about it moves far pieces more.
struct NearBound {
  Scalar reach = 0;
  Scalar slope = 0;
};

/// The near pairs of pieces of two shapes, kept while the shapes move little relative to each
/// other: a neighbour list [Verlet1967], about a pivot. Queries begin with it in place of the roots
/// of the trees.
///
/// The moving side M is a mesh, the other one is taken as fixed, F. A pair that was ever asked for
/// has a unit normal n and a proven gap b along it at build(). With T = R - I the turn of M since
/// then, t its shift, p a point of M's piece and rho the piece's radius about p, the pair is now at
/// least
///     b + n . (T p + t) - rho |T^T n|
/// apart, and (fast reject) at least b less what the pivot has moved and |T| l. All other pairs
/// were farther apart than r + c l, and are so now less what the pivot has moved and |T| l.
class DYOP_EXPORT NeighbourList {
 public:
  /// Two poses, as the list sees them: the motion of M since build(), in frame F.
  struct Placement {
    Matrix3 turn = Matrix3::Zero();   ///< R - I
    Vector3 shift = Vector3::Zero();  ///< of F's origin
    Scalar turning = 0;               ///< |R - I|
    Scalar way = 0;                   ///< of the pivot, a length
    Scalar noise = 0;                 ///< allowance for rounding in a gap, length
  };

  /// Lists all near pairs of two shapes, at least one of them a mesh and none a compound. Returns
  /// false, and lists nothing, if there are too many to be worth it.
  bool build(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
             const Vector3& pivot_W, const NearBound& bound);
  void clear() { is_built_ = false; }
  bool is_built() const { return is_built_; }

  /// How the shapes of build() stand to each other.
  Placement place(const Shape& a, const RigidPose& X_WA, const Shape& b,
                  const RigidPose& X_WB) const;
  /// Whether A is the moving side, not B.
  bool moves_a() const { return moves_a_; }
  /// The pivot of build(), fixed to F, in its frame.
  const Vector3& pivot_F() const { return pivot_F_; }
  /// Whether all pairs that are near there are listed.
  bool covers(const Placement& placement, const NearBound& bound) const;
  /// The listed pairs that may be near there, with lower bounds of their gaps, in any order. Of the
  /// shapes of build().
  void collect(const Shape& a, const Shape& b, const Placement& placement, const NearBound& bound,
               BoxPairStack& pairs);

 private:
  // Enough to leave out most pairs.
  struct Reach {
    Scalar gap = 0;  // lower bound along the normal
    Scalar far = 0;  // the most that a point of M's piece is from the pivot
  };
  struct Entry {
    std::int32_t a = 0;  // leaves
    std::int32_t b = 0;
    Scalar radius = -1;                // of M's piece about `p`; -1: not measured yet
    Vector3 p = Vector3::Zero();       // a point of M's piece, in frame F at build()
    Vector3 normal = Vector3::Zero();  // unit, from F to M; zero: no slab parts the pieces
  };

  void measure(const ShapeTree& a, const ShapeTree& b, Entry& entry, Reach& reach) const;

  bool is_built_ = false;
  bool moves_a_ = false;
  RigidPose X_FM_;    // at build()
  RigidPose X_AB_;    // likewise
  Scalar noise_ = 0;  // of a point of B in frame A there
  Vector3 pivot_F_ = Vector3::Zero();
  NearBound bound_;
  std::vector<Entry> entries_;
  std::vector<Reach> reaches_;  // theirs, side by side
};

/// Sorts pairs of boxes by gap, farthest first: a stack gives the nearest first.
DYOP_EXPORT void sort_farthest_first(BoxPairStack& pairs);

}  // namespace dyop::distance_internal
