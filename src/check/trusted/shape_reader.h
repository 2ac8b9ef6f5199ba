// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "check/trusted/json.h"
#include "check/trusted/shape.h"

/// The shapes of a file. TRUSTED.
namespace dyop_check {

/// A place in the frame of a shape's owner: the piece there.
Piece placed(const Pose& X, Piece piece);

class ShapeReader {
 public:
  ShapeReader(std::vector<Json> lines, std::vector<double> vertices,
              std::vector<std::int32_t> triangles)
      : lines_(std::move(lines)),
        vertices_(std::move(vertices)),
        triangles_(std::move(triangles)) {}

  std::size_t count() const { return lines_.size(); }
  /// The pieces of a line of /shapes, in its own frame.
  /// @throws BadFile
  std::vector<Piece> pieces(std::size_t shape, int depth = 0) const;
  /// The vertices of a mesh, and three numbers of them for each triangle.
  /// @throws BadFile if it is none, or one is out of range.
  std::vector<Vec> vertices(std::size_t mesh) const;
  std::vector<std::int32_t> corners(std::size_t mesh) const;

 private:
  Vec vertex(std::size_t number) const;
  const Json& mesh_line(std::size_t mesh) const;
  std::vector<Vec> points_of(const Json& line) const;
  std::vector<Piece> triangles_of(const Json& line) const;
  std::vector<Piece> children_of(std::size_t shape, int depth) const;

  std::vector<Json> lines_;
  std::vector<double> vertices_;
  std::vector<std::int32_t> triangles_;
};

}  // namespace dyop_check
