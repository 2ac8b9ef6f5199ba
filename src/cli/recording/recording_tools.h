// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "cli/commands.h"
#include "dyop/core/error.h"
#include "dyop/core/types.h"
#include "dyop/view/frame_pictures.h"
#include "dyop/view/page_encoder.h"

/// What needs HDF5: without it every function throws FileError, which names the package.
namespace dyop::cli {

/// True for the name of a recording in HDF5.
inline bool is_recording(const std::filesystem::path& file) {
  return file.extension() == ".h5" || file.extension() == ".hdf5";
}

/// For -o of a run: empty, or the name of a recording.
inline void require_recording_name(const std::string& file) {
  DYOP_REQUIRE(file.empty() || is_recording(file), "-o ", file,
               ": a recording is HDF5, its name ends in .h5");
}

enum class RecordingForm { Words, Json, JsonLines };

/// Prints what a recording holds: a summary in words or as JSON, or all of it as JSON lines.
ExitCode print_recording(const std::filesystem::path& file, RecordingForm form);

/// What dyop-check says of a recording.
PageVerdict verdict_on(const std::filesystem::path& file);

struct ExportArguments {
  std::string recording;
  std::string out;     ///< may be empty if `frames` is not
  std::string frames;  ///< directory
  FrameOptions frame_options;
  Scalar tolerance = 1e-4;  ///< literal: as GltfOptions
  std::string up = "z";
};

ExitCode export_recording(const ExportArguments& arguments);

}  // namespace dyop::cli
