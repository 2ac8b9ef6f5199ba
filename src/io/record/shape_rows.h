// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "io/json_reader.h"

/// Shapes as the lines and rows of docs/formats.md, and back with every bit.
namespace dyop::io_internal {

/// Rows of /vertices and /triangles.
struct ShapeRows {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;
};

/// Stores each shape once. Numbers shapes from 0 in the order of their lines.
class ShapeWriter {
 public:
  /// The number of the shape. A new shape is appended to `lines` and `rows`.
  /// @throws InvalidArgument for a shape of a kind that dyop does not define.
  std::size_t add(const std::shared_ptr<const Shape>& shape, std::string& lines, ShapeRows& rows);

 private:
  struct Stored {
    std::shared_ptr<const Shape> shape;
    std::uint64_t hash;
  };
  std::vector<Stored> stored_;
  std::uint64_t vertex_count_ = 0;
  std::uint64_t triangle_count_ = 0;
};

/// A pose as 12 numbers, the rotation row by row and then the position, and back with every bit.
Json pose_numbers(const RigidPose& X);
RigidPose pose_from_numbers(const Json& json);

/// The hash of docs/formats.md.
std::uint64_t content_hash(const Shape& shape);

/// The shape of a line.
/// @param earlier Shapes of the lines before it.
/// @throws FileError, InvalidArgument, or an exception of nlohmann for a line of the wrong form.
std::shared_ptr<const Shape> shape_from(const Json& line, const ShapeRows& rows,
                                        std::span<const std::shared_ptr<const Shape>> earlier);

}  // namespace dyop::io_internal
