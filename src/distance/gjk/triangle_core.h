// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/core/types.h"
#include "dyop/geometry/convex_shape.h"

namespace dyop::distance_internal {

// A triangle of a mesh as a convex core, in the mesh's frame, for queries of a mesh against a
// convex shape. Lives on the stack. Vertices are numbered 0, 1, 2; they may coincide.
class TriangleCore final : public ConvexShape {
 public:
  explicit TriangleCore(const Triangle& triangle) : triangle_(triangle) {
    const Scalar radius_sq =
        std::max({triangle[0].squaredNorm(), triangle[1].squaredNorm(), triangle[2].squaredNorm()});
    // Squares, sum and root err by less than 4u.
    bounding_radius_ = std::sqrt(radius_sq) * (1 + 8 * kUnitRoundoff);
  }

  // The first of equal vertices, so that a repeated vertex has one number.
  SupportPoint core_support(const Vector3& direction) const override {
    const Scalar d0 = direction.dot(triangle_[0]);
    const Scalar d1 = direction.dot(triangle_[1]);
    const Scalar d2 = direction.dot(triangle_[2]);
    if (d2 > d0 && d2 > d1) return {triangle_[2], 2};
    return d1 > d0 ? SupportPoint{triangle_[1], 1} : SupportPoint{triangle_[0], 0};
  }

  Vector3 core_center() const override { return (triangle_[0] + triangle_[1] + triangle_[2]) / 3; }

  AlignedBox bounding_box() const override {
    AlignedBox box(triangle_[0]);
    return box.extend(triangle_[1]).extend(triangle_[2]);
  }

  Scalar bounding_radius() const override { return bounding_radius_; }

  MassProperties compute_mass_properties(Scalar) const override {
    throw InvalidArgument("a triangle encloses no volume");
  }

 private:
  Triangle triangle_;
  Scalar bounding_radius_;
};

}  // namespace dyop::distance_internal
