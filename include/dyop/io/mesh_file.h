// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>

#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

/// What a file may ask for before it is refused.
struct MeshFileLimits {
  /// Bytes that a compressed file may unpack to: a few megabytes can hold gigabytes.
  std::size_t most_unpacked_bytes = std::size_t{1} << 30;
};

/// What becomes of a file that has vertices only.
enum class LoneVertices { Refused, Points };

/// Returns all surfaces of a file as one mesh.
///
/// OBJ, OFF, PLY and STL, text or binary (OFF: text), also compressed with gzip (`.ply.gz`), are
/// read in double precision: every number is the double nearest to the one in the file. Other
/// formats that assimp supports, such as glTF and 3DS, are read in single precision, if this
/// library was built with it (CMake option DYOP_WITH_ASSIMP); meshes are placed by the transforms
/// of their nodes, and under a mirroring transform polygons are reversed, so that they still face
/// outward. An ESRI ASCII grid (`.asc`) becomes the closed mesh of height_field(), row 0 in the
/// south; heights stand at the middles of its cells.
///
/// Vertices keep the order of the file. Those at exactly the same place are joined, because many
/// formats repeat a vertex for every triangle or normal; in a file without repeats, vertices have
/// the numbers of the file (counted from 0). Triangles also keep the order of the file. A polygon
/// of n corners becomes n − 2 triangles: if strictly convex, a fan around its first corner,
/// otherwise by ear clipping in the plane of its vector area. Lines and points become degenerate
/// triangles. Groups, materials, normals, colours and weights are ignored.
/// @param vertices Points: where there is no polygon, line or point, each vertex is one.
/// @throws FileError if the file is missing, empty, truncated or not understood, has no triangle, a
///         number that is not finite, or an index out of range, with the line if known; or if it
///         exceeds a limit.
TriangleMesh load_mesh(const std::filesystem::path& file, const MeshFileLimits& limits = {},
                       LoneVertices vertices = LoneVertices::Refused);

/// Where the origin of a mesh is placed.
enum class MeshCenter {
  None,    ///< unchanged
  Bounds,  ///< middle of the bounding box
  Mass,    ///< centre of mass: of the solid, or of the surface with MeshPlacement::is_shell
};

struct MeshPlacement {
  Scalar scale = 1;  ///< > 0; applied first
  MeshCenter center = MeshCenter::None;
  bool is_shell = false;  ///< the mesh is a surface without an inside
};

/// The same triangles, scaled and moved.
/// @throws InvalidArgument unless scale is finite and positive, or if Mass is requested for an open
///         mesh that is not declared a shell.
TriangleMesh place_mesh(const TriangleMesh& mesh, const MeshPlacement& placement);

}  // namespace dyop
