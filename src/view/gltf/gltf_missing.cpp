// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/file_error.h"
#include "dyop/view/gltf_file.h"

namespace dyop {

void write_gltf(const std::filesystem::path&, const std::filesystem::path& out,
                const GltfOptions&) {
  throw FileError(out,
                  "cannot be written: this dyop was built without tinygltf and HDF5 (on Debian: "
                  "libtinygltf-dev, libhdf5-dev)");
}

}  // namespace dyop
