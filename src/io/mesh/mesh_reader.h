// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::io_internal {

/// The contents of a mesh file: its vertices in order, and polygons on them. A polygon of two
/// corners is a segment, of one corner a point.
class PolygonMesh {
 public:
  std::vector<Vector3> vertices;

  /// Starts a polygon, to which add_corner() must add at least one corner.
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
  std::vector<std::int32_t> corners_;  // of all polygons, one after another
  std::vector<std::size_t> ends_;      // by polygon: its end in corners_
};

/// Read the bytes of a mesh file in double precision. Indices of the result are in range and
/// coordinates finite. `file` is only used in errors.
///
/// To add a format: its reader in `src/io/mesh/<name>_reader.cpp`, a row in the table of
/// `src/io/mesh_file.cpp`, its writer in `tests/support/mesh_writers.h`.
/// @throws FileError with the line, or for binary data the row.
PolygonMesh read_asc(const std::filesystem::path& file, std::string_view bytes);
PolygonMesh read_obj(const std::filesystem::path& file, std::string_view bytes);
PolygonMesh read_off(const std::filesystem::path& file, std::string_view bytes);
PolygonMesh read_ply(const std::filesystem::path& file, std::string_view bytes);
PolygonMesh read_stl(const std::filesystem::path& file, std::string_view bytes);

/// Where the vertical axis of a COLLADA file goes: to y, as in other formats, or nowhere.
enum class UpAxis { Y, AsWritten };

/// Reads a file of another format with assimp, in single precision; may open further files that
/// this one names.
/// @param bytes All of the file.
/// @throws FileError if assimp cannot read the file, or this library was built without it.
PolygonMesh read_with_assimp(const std::filesystem::path& file, std::string_view bytes,
                             UpAxis up = UpAxis::Y);

/// As load_mesh(), but a COLLADA file keeps its axes, as robot descriptions expect.
TriangleMesh load_mesh_as_written(const std::filesystem::path& file);

/// Largest number of corners of a polygon that is not strictly convex: ear clipping is quadratic at
/// best.
inline constexpr std::size_t kMostConcaveCorners = 4096;

/// Appends the triangles of a polygon: for n ≥ 3 corners n − 2 triangles, oriented like the
/// polygon, on its corners only, so that neighbours along its edges stay neighbours.
///
/// A strictly convex polygon becomes a fan around its first corner. From any other, ears are cut
/// (Meisters, "Polygons have ears", 1975) in the plane of its vector area; if no ear can be found,
/// as in a polygon that crosses itself, the rest becomes a fan. Two corners give the triangle a, b,
/// b, one corner a, a, a.
/// @throws InvalidArgument for a polygon of more than kMostConcaveCorners corners that is not
///         strictly convex.
void append_triangles(const std::vector<Vector3>& vertices, std::span<const std::int32_t> polygon,
                      std::vector<TriangleIndices>& triangles);

}  // namespace dyop::io_internal
