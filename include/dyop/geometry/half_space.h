// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/convex_shape.h"

namespace DYOP_EXPORT dyop {

/// All points p with normal . p <= offset: a floor or a wall without an end. A solid: what lies
/// below the plane overlaps it. Has no mass, so its body is static or kinematic; cannot be part of
/// a compound.
///
/// Every query against another shape takes it as unbounded. Its own bounds and support points are
/// those of its part within bounding_radius() of the origin, kLargestCoordinate unless it comes
/// from within().
class HalfSpace final : public ConvexShape {
 public:
  /// @param normal Outwards, of any length > 0; scaled to length one.
  /// @throws InvalidArgument unless the normal is finite and not zero, and |offset| is at most
  ///         kLargestCoordinate / 2.
  explicit HalfSpace(const Vector3& normal = Vector3::UnitZ(), Scalar offset = 0);

  const Vector3& normal() const { return normal_; }  ///< unit
  Scalar offset() const { return offset_; }

  /// The height of a point above the plane, negative inside.
  Scalar height(const Vector3& p) const { return normal_.dot(p) - offset_; }

  /// The same half-space, with the bounds of its part within radius + 2 |offset| of the origin. All
  /// points that are nearest to something within the radius are in it.
  HalfSpace within(Scalar radius) const;

  SupportPoint core_support(const Vector3& direction) const override;
  Scalar core_reach(const Vector3& direction) const override;
  Vector3 core_center() const override { return normal_ * ((offset_ - radius_) / 2); }
  FlatPart flat_part(const Vector3& unit_direction, Scalar sine) const override;
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override { return radius_; }
  /// @throws InvalidArgument always: it has no finite mass.
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  Vector3 normal_;
  Scalar offset_;
  Scalar radius_;
};

/// The shape as a half-space, or null.
inline const HalfSpace* as_half_space(const Shape& shape) {
  if (shape.kind() != ShapeKind::Convex) return nullptr;
  const auto& convex = static_cast<const ConvexShape&>(shape);
  return convex.simple_core().kind == CoreKind::HalfSpace ? static_cast<const HalfSpace*>(&convex)
                                                          : nullptr;
}

}  // namespace dyop
