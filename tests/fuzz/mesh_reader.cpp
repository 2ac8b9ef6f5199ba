// SPDX-License-Identifier: BSD-3-Clause

// Mesh files of any bytes: a mesh, or a FileError with a readable message.
// The first byte chooses the format.

#include <zlib.h>

#include <array>
#include <filesystem>

#include "dyop/io/file_error.h"
#include "dyop/io/mesh_file.h"
#include "fuzz/fuzz_input.h"
#include "fuzz/scratch_file.h"

namespace dyop::fuzz {
namespace {

void check(const TriangleMesh& mesh) {
  require(!mesh.triangles().empty(), "a mesh has triangles");
  for (const Vector3& p : mesh.vertices()) require(p.allFinite(), "vertices are finite");
}

std::string compressed(const std::filesystem::path& file, const std::uint8_t* data,
                       std::size_t size) {
  const gzFile out = gzopen(file.c_str(), "wb1");
  require(out != nullptr, "the scratch file can be written");
  gzwrite(out, data, unsigned(size));
  gzclose(out);
  return file.string();
}

}  // namespace
}  // namespace dyop::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dyop;
  constexpr std::array<const char*, 6> kEndings{".obj", ".stl", ".ply", ".off", ".ply.gz", ".asc"};
  if (size == 0) return 0;
  const std::string ending = kEndings[data[0] % kEndings.size()];
  const std::filesystem::path file = fuzz::scratch_file(ending, data + 1, size - 1);
  if (ending == ".ply.gz") fuzz::compressed(file, data + 1, size - 1);
  try {
    fuzz::check(load_mesh(file));
  } catch (const FileError& error) {
    fuzz::require_readable(error.what());
  }
  std::filesystem::remove(file);
  return 0;
}
