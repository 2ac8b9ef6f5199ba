#pragma once

#include <filesystem>

#include "dyop/geometry/triangle_mesh.h"

namespace dyop {

/// Returns all surfaces of a file as one mesh.
///
/// Formats: OBJ, STL, PLY, OFF, glTF and glb, 3DS, and whatever else assimp reads; also PLY
/// compressed with gzip (`.ply.gz`). Every mesh is placed by the transforms of its nodes; a
/// mirroring transform turns its triangles over, so that they still face outward. Polygons are
/// triangulated; lines and points become degenerate triangles. Vertices at exactly the same place
/// are joined, because most formats repeat a vertex for every triangle or normal; they are numbered
/// in the order of first use. Triangles keep the order of the file. Coordinates have single
/// precision: that is what assimp stores.
///
/// OBJ, STL, PLY and OFF are checked before assimp reads them, since it repairs or ignores some
/// damage without a word.
/// @throws FileError if the file is missing, empty, truncated or not understood, has no triangle, a
///         number that is not finite, or an index out of range; with the line where there is one.
TriangleMesh load_mesh(const std::filesystem::path& file);

/// Where the origin of a mesh is put.
enum class MeshCenter {
  None,    ///< left as it is
  Bounds,  ///< middle of the bounding box
  Mass,    ///< centre of mass: of the solid, or of the surface with MeshPlacement::is_shell
};

struct MeshPlacement {
  Scalar scale = 1;  ///< > 0; applied first
  MeshCenter center = MeshCenter::None;
  bool is_shell = false;  ///< the mesh is a surface without an inside
};

/// The same triangles scaled and moved.
/// @throws InvalidArgument unless scale is finite and positive, or if Mass is asked of an open mesh
///         that is not declared a shell.
TriangleMesh place_mesh(const TriangleMesh& mesh, const MeshPlacement& placement);

}  // namespace dyop
