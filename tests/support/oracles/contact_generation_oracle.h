// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace dyop::testing {

/// A pair of points, one on the core of each shape, in frame A.
struct OraclePoints {
  Vector3 p_a;
  Vector3 p_b;
};

/// Two small shapes with triangles (meshes, or convex shapes with a core surface) in frame A, and
/// the local minima of the distance of their cores, straight from the definition: all vertices
/// against all triangles and all sides against all sides, each tested with the directions to a
/// dense grid of points on every triangle that contains its points. Uses no connectivity of the
/// triangles.
class ContactOracle {
 public:
  ContactOracle(const Shape& a, const Shape& b, const RigidPose& X_AB);

  /// All candidates at most `reach` apart (cores) that rise by at most `sine`.
  std::vector<OraclePoints> minima(Scalar reach, Scalar sine) const;

  /// The largest n . t over directions t from p_a along A's surface, and -n . t over those from
  /// p_b; for a convex solid over all directions into it. @param slack How far off a triangle a
  /// point may be to lie on it.
  Scalar rise(const OraclePoints& points, const Vector3& nhat_AB_A, Scalar slack) const;

  /// Least distance of any triangle of the core of A (B) from a point.
  Scalar distance_to_a(const Vector3& p) const { return distance_to(a_, p); }
  Scalar distance_to_b(const Vector3& p) const { return distance_to(b_, p); }

  /// Whether a solid contains a corner of the other shape, given that their surfaces do not meet.
  bool is_enclosed() const;

  Scalar size() const { return size_; }

 private:
  struct Side {
    std::vector<Triangle> triangles;
    bool is_solid = false;
  };
  static Scalar distance_to(const Side& side, const Vector3& p);
  static Scalar rise_of(const Side& side, const Vector3& p, const Vector3& n, Scalar slack);
  static bool holds(const Side& solid, const Vector3& p);

  Side a_;
  Side b_;
  Scalar size_ = 0;
};

}  // namespace dyop::testing
