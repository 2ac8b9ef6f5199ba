// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/mesh_file.h"
#include "io/json_reader.h"

namespace dyop::io_internal {

/// Reads the object "shape" of docs/formats.md. Each mesh file is loaded once.
class DYOP_EXPORT ShapeReader {
 public:
  struct NamedShape {
    std::shared_ptr<const Shape> shape;
    std::string name;  ///< for display
  };

  /// @param directories Where to search for meshes, in this order.
  explicit ShapeReader(std::vector<std::filesystem::path> directories,
                       LoneVertices vertices = LoneVertices::Refused)
      : directories_(std::move(directories)), vertices_(vertices) {}

  /// @param is_shell The body is a surface without an inside: determines its centre of mass.
  NamedShape read(const JsonNode& node, bool is_shell);
  /// The mesh of the file named by a string, not placed.
  const TriangleMesh& load(const JsonNode& node);

 private:
  NamedShape read_of_kind(std::string_view kind, const JsonNode& node);
  NamedShape read_mesh(const JsonNode& node, bool is_shell);
  NamedShape read_hull(const JsonNode& node);
  NamedShape read_octree(const JsonNode& node);
  NamedShape read_point_cloud(const JsonNode& node);
  TriangleMesh read_placed_mesh(const JsonNode& node, bool is_shell);
  std::filesystem::path find(const JsonNode& node, const std::string& kind) const;

  std::vector<std::filesystem::path> directories_;
  LoneVertices vertices_;
  std::map<std::filesystem::path, TriangleMesh> loaded_;
};

}  // namespace dyop::io_internal
