// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Every number in dyop is a double; no option changes that.
using Scalar = double;

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Quaternion = Eigen::Quaterniond;

/// Axis-aligned box, [min(), max()] per axis.
using AlignedBox = Eigen::AlignedBox3d;

inline constexpr Scalar kInfinity = std::numeric_limits<Scalar>::infinity();

/// Three vertices in some frame. Two or three of them may coincide or lie on a line: a segment and
/// a point are legal triangles.
using Triangle = std::array<Vector3, 3>;

/// A triangle in the plane, vertices in any order.
using PlanarTriangle = std::array<Vector2, 3>;

/// Vertex numbers of a triangle of a mesh; repeated numbers make a segment or a point.
using TriangleIndices = std::array<std::int32_t, 3>;

}  // namespace dyop
