// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "dyop/core/types.h"
#include "dyop/view/frame_pictures.h"

/// What needs HDF5: without it every function throws FileError, which names the package.
namespace dyop::cli {

/// True for the name of a recording in HDF5.
inline bool is_recording(const std::filesystem::path& file) {
  return file.extension() == ".h5" || file.extension() == ".hdf5";
}

/// Prints what a recording holds.
ExitCode print_recording(const std::filesystem::path& file, bool is_json);

struct ExportArguments {
  std::string recording;
  std::string out;     ///< may be empty if `frames` is not
  std::string frames;  ///< directory
  FrameOptions frame_options;
  std::string scene;
  std::vector<std::string> mesh_path;
  Scalar tolerance = 1e-4;  ///< literal: as GltfOptions
  std::string up = "z";
};

ExitCode export_recording(const ExportArguments& arguments);

}  // namespace dyop::cli
