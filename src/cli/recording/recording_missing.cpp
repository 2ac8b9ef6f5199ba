// SPDX-License-Identifier: BSD-3-Clause
#include "cli/recording/recording_tools.h"
#include "cli/tool/tool_summary.h"
#include "dyop/io/file_error.h"

namespace dyop::cli {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file) {
  throw FileError(file, "this dyop was built without HDF5 (on Debian: libhdf5-dev)");
}

}  // namespace

std::unique_ptr<RunOutput> make_hdf5_output(const std::filesystem::path& file, const Scene&,
                                            const std::string&) {
  refuse(file);
}

PageVerdict verdict_on(const std::filesystem::path& file) {
  refuse(file);
}

ExitCode print_recording(const std::filesystem::path& file, RecordingForm) {
  refuse(file);
}

void add_check_command(CLI::App&, ExitCode&) {}

ExitCode export_recording(const ExportArguments& arguments) {
  refuse(arguments.recording);
}

std::unique_ptr<ToolOutput> make_tool_output(const std::filesystem::path& file, const HapticRun&,
                                             HapticSession&) {
  refuse(file);
}

std::unique_ptr<LiveTool> make_live_tool(const HapticRun& run, int) {
  refuse(run.title);
}

ExitCode replay_tool(const std::filesystem::path& file) {
  refuse(file);
}

ExitCode print_haptic_recording(const std::filesystem::path& file, bool) {
  refuse(file);
}

}  // namespace dyop::cli
