// SPDX-License-Identifier: BSD-3-Clause

// Instead of assimp_reader.cpp in a build without assimp.

#include "dyop/io/file_error.h"
#include "io/mesh/mesh_reader.h"

namespace dyop::io_internal {

PolygonMesh read_with_assimp(const std::filesystem::path& file, std::string_view, UpAxis) {
  throw FileError(file,
                  "this format needs assimp, which this build of dyop lacks "
                  "(CMake option DYOP_WITH_ASSIMP); supported without it: .obj, .off, .ply, .stl");
}

}  // namespace dyop::io_internal
