// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>

#include "cli/page/page_output.h"
#include "cli/recording/recording_tools.h"
#include "dyop/view/gltf_file.h"
#include "dyop/view/recorded_page.h"
#include "io/output_file.h"

namespace dyop::cli {
namespace {

void export_frames(const ExportArguments& arguments, const std::string& out) {
  const std::string page = recorded_page_html(arguments.recording);
  const std::int64_t count = write_page_frames(page, out, arguments.frame_options);
  std::cout << "frames: " << count << '\n';
}

}  // namespace

ExitCode export_recording(const ExportArguments& arguments) {
  const std::filesystem::path out = arguments.out;
  for (const std::string& file : {arguments.out, arguments.frames})
    io_internal::require_other_than(file, {arguments.recording});
  DYOP_REQUIRE(!arguments.out.empty() || !arguments.frames.empty(),
               "export needs -o FILE or --frames DIR");
  if (!arguments.frames.empty()) export_frames(arguments, arguments.frames);
  if (arguments.out.empty()) return ExitCode::Answered;
  if (out.extension() == ".mp4") {
    export_frames(arguments, arguments.out);
    return ExitCode::Answered;
  }
  if (out.extension() == ".glb") {
    GltfOptions options;
    options.tolerance = arguments.tolerance;
    options.z_is_up = arguments.up == "z";
    write_gltf(arguments.recording, out, options);
    return ExitCode::Answered;
  }
  throw InvalidArgument("-o " + arguments.out + ": expected a file .glb or .mp4");
}

}  // namespace dyop::cli
