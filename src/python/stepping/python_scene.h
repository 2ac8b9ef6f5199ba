// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "dyop/io/scene_file.h"
#include "python/glue/arguments.h"

namespace dyop::python {

/// A scene, and where it came from.
struct PythonScene {
  Scene scene;
  std::filesystem::path file;
  std::vector<std::filesystem::path> mesh_directories;
};

}  // namespace dyop::python
