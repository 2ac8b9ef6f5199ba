// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "cli/commands.h"
#include "dyop/dynamics/world.h"
#include "dyop/io/scene_file.h"

namespace dyop::cli {

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
