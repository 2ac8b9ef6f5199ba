// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::internal {

/// What a reader takes from a file: its vertices in their order, and polygons of them. A polygon of
/// two corners is a segment, of one corner a point.
class PolygonMesh {
 public:
  std::vector<Vector3> vertices;

  /// Begins a polygon, to which add_corner() adds at least one.
  void begin_polygon() { ends_.push_back(ends_.empty() ? 0 : ends_.back()); }
  void add_corner(std::int64_t vertex) {
    corners_.push_back(std::int32_t(vertex));
    ++ends_.back();
  }

  std::size_t polygon_count() const { return ends_.size(); }
  std::span<const std::int32_t> polygon(std::size_t k) const {
    const std::size_t begin = k == 0 ? 0 : ends_[k - 1];
    return std::span(corners_).subspan(begin, ends_[k] - begin);
  }

 private:
  std::vector<std::int32_t> corners_;  // of all polygons, one after the other
  std::vector<std::size_t> ends_;      // of each polygon in corners_
};

/// The bytes of a mesh file, read in double precision. Indices of the result are in range and
/// coordinates finite. `file` is only named in errors.
///
/// To add a format: its reader in `src/io/mesh/<name>_reader.cpp`, a row in the table of
/// `src/io/mesh_file.cpp`, its writer in `tests/support/mesh_writers.h`.
/// @throws FileError with the line, or for binary data the row.
PolygonMesh read_obj(const std::filesystem::path& file, std::string_view bytes);
PolygonMesh read_off(const std::filesystem::path& file, std::string_view bytes);
PolygonMesh read_ply(const std::filesystem::path& file, std::string_view bytes);
PolygonMesh read_stl(const std::filesystem::path& file, std::string_view bytes);

/// Reads a file of another format with assimp, in single precision; it may open further files that
/// this one names.
/// @throws FileError if assimp does not understand the file, or this library was built without it.
PolygonMesh read_with_assimp(const std::filesystem::path& file);

}  // namespace dyop::internal
