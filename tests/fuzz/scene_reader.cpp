// SPDX-License-Identifier: BSD-3-Clause

// Scene and motion files of any bytes: a scene whose world can be made or is refused, a motion with
// finite poses, or a FileError with a readable message. The first byte chooses.

#include <cmath>
#include <filesystem>

#include "dyop/io/file_error.h"
#include "dyop/io/motion_file.h"
#include "dyop/io/scene_file.h"
#include "fuzz/fuzz_input.h"
#include "fuzz/scratch_file.h"

namespace dyop::fuzz {
namespace {

void check_scene(const std::filesystem::path& file) {
  const Scene scene = load_scene(file);
  require(scene.bodies.size() == scene.shape_names.size(), "every body has a name for its shape");
  require(scene.end_time > 0 && scene.step > 0, "a scene takes time");
  try {
    make_world(scene);
  } catch (const InvalidArgument& error) {
    require_readable(error.what());
  }
}

void check_motion(const std::filesystem::path& file) {
  const auto motion = load_motion(file);
  const TimeInterval domain = motion->domain();
  const Scalar t = std::isfinite(domain.begin) ? domain.begin : 0;
  require(motion->pose(t).rotation().allFinite(), "a rotation is finite");
  require(motion->twist_bound({t, t}).angular_speed >= 0, "a bound is not NaN");
}

}  // namespace
}  // namespace dyop::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dyop;
  if (size == 0) return 0;
  const std::filesystem::path file = fuzz::scratch_file(".json", data + 1, size - 1);
  try {
    if (data[0] % 2 == 0) {
      fuzz::check_scene(file);
    } else {
      fuzz::check_motion(file);
    }
  } catch (const FileError& error) {
    fuzz::require_readable(error.what());
  }
  std::filesystem::remove(file);
  return 0;
}
