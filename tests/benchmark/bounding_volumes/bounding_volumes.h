// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "dyop/core/rigid_pose.h"

// The bounding volumes that bounding_volume_comparison.cpp compares; k-DOPs are in k_dop.h. Each
// has `fit`, the volume of some points in the frame of their body; a `Placement`, what can be
// computed once from the pose of body B in body A for all pairs of volumes; and `separation` of one
// volume of each body. They are as tight as described, in plain double precision: nothing is
// rounded outward.
namespace dyop::testing {

/// A slab between two volumes: nhat . (y - x) >= gap for all points x of A and y of B.
struct Separation {
  Scalar gap = 0;                        ///< zero if nothing was found to separate them
  Vector3 nhat_AB_A = Vector3::UnitX();  ///< means nothing if gap is zero
};

/// A ball within about 1 % of the smallest, by 100 steps of the iteration of [BadoiuClarkson2003]:
/// the center moves towards the farthest point, by half of the distance first, then a third, ...
struct Sphere {
  using Placement = RigidPose;
  static constexpr const char* kName = "sphere";

  static Sphere fit(std::span<const Vector3> points);

  Vector3 center;
  Scalar radius = 0;
};

/// Exact: along the line of centers.
Separation separation(const RigidPose& X_AB, const Sphere& a, const Sphere& b);

/// A box along the axes of the body: an oriented box once the body is turned, but all boxes of a
/// body have the same axes.
struct AxisAlignedBox {
  struct Placement {
    explicit Placement(const RigidPose& pose) : X_AB(pose), abs_R(pose.rotation().cwiseAbs()) {}

    RigidPose X_AB;
    Matrix3 abs_R;
  };
  static constexpr const char* kName = "axis-aligned box";

  static AxisAlignedBox fit(std::span<const Vector3> points);

  Vector3 center;
  Vector3 half_extents;
};

/// The largest gap along the face normals, the cross products of edges and the line of centers.
Separation separation(const AxisAlignedBox::Placement& placement, const AxisAlignedBox& a,
                      const AxisAlignedBox& b);

/// A box along the principal axes of the points; of three points, along the longest edge and the
/// normal, as in split_tree.h.
struct PrincipalBox {
  using Placement = RigidPose;
  static constexpr const char* kName = "principal box";

  static PrincipalBox fit(std::span<const Vector3> points);

  Matrix3 axes;
  Vector3 center;
  Vector3 half_extents;
};

/// Along the same axes as for AxisAlignedBox.
Separation separation(const RigidPose& X_AB, const PrincipalBox& a, const PrincipalBox& b);

/// The smaller by area of the two boxes, which is dyop's choice.
struct SmallerBox : PrincipalBox {
  static constexpr const char* kName = "the smaller box";

  static SmallerBox fit(std::span<const Vector3> points);
};

/// All points within a radius of a rectangle, fitted as in [Larsen1999]: the rectangle lies across
/// the least principal axis, half way between the points; the radius reaches them there; its sides
/// are as short as the round borders allow.
struct RectangleSweptSphere {
  using Placement = RigidPose;
  static constexpr const char* kName = "rectangle-swept sphere";

  static RectangleSweptSphere fit(std::span<const Vector3> points);

  Matrix3 axes;  ///< the last one normal to the rectangle
  Vector3 center;
  Vector2 half_sides;
  Scalar radius = 0;
};

/// Exact: the distance of the rectangles less both radii.
Separation separation(const RigidPose& X_AB, const RectangleSweptSphere& a,
                      const RectangleSweptSphere& b);

}  // namespace dyop::testing
