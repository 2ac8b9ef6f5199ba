// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "cli/commands.h"
#include "dyop/core/error.h"
#include "dyop/core/types.h"
#include "dyop/dynamics/world.h"
#include "dyop/io/scene_file.h"
#include "dyop/view/page_encoder.h"
#include "dyop/view/run_files.h"

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

/// Where a run is recorded; this one keeps nothing.
class RunOutput {
 public:
  virtual ~RunOutput() = default;

  virtual void write(const AdvanceReport& /*report*/, const World& /*world*/) {}
  /// Both end the recording; the second with the message of what ended the run.
  virtual void finish() {}
  virtual void fail(const std::string& /*error*/) {}
};

/// A file of docs/formats.md.
/// @param pairs "none", "gaps" or "contacts".
/// @throws FileError if this program was built without HDF5.
std::unique_ptr<RunOutput> make_hdf5_output(const std::filesystem::path& file, const Scene& scene,
                                            const std::string& pairs);

}  // namespace dyop::cli
