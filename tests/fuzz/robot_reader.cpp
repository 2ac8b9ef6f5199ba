// SPDX-License-Identifier: BSD-3-Clause

// Robot files, paths and planning scenes of any bytes: a robot whose links have finite poses, a path
// of finite coordinates, a scene, or a FileError with a readable message. The first byte chooses.

#include <filesystem>

#include "dyop/io/file_error.h"
#include "dyop/io/planning_scene_file.h"
#include "dyop/io/robot_file.h"
#include "fuzz/fuzz_input.h"
#include "fuzz/scratch_file.h"

namespace dyop::fuzz {
namespace {

constexpr char kArm[] = R"(<robot name="arm"><link name="base"/>
<link name="hand"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<joint name="turn" type="continuous"><parent link="base"/><child link="hand"/></joint></robot>)";

Robot arm() {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(kArm);
  const std::filesystem::path file = scratch_file(".arm.urdf", bytes, sizeof kArm - 1);
  Robot robot = load_robot(file);
  std::filesystem::remove(file);
  return robot;
}

void check_robot(const Robot& robot) {
  const std::size_t links = robot.chain->links().size();
  require(robot.masses.size() == links, "every link has a mass");
  require(robot.couplings.size() == robot.chain->coordinate_count(), "coordinates are coupled");
  try {
    for (const RigidPose& X : robot.chain->link_poses(robot.expand(robot.resting_state()))) {
      require(X.rotation().allFinite(), "a rotation is finite");
    }
  } catch (const InvalidArgument& error) {  // couplings beyond all numbers
    require_readable(error.what());
  }
}

void check(std::uint8_t kind, const std::filesystem::path& file) {
  switch (kind % 4) {
    case 0:
      return check_robot(load_robot(file));
    case 1:
      require(load_joint_path(file, arm()).coordinate_count() == 1, "a path of one coordinate");
      return;
    case 2:
      load_planning_scene(file, arm());
      return;
    default:
      load_chain(file);
  }
}

}  // namespace
}  // namespace dyop::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dyop;
  if (size == 0) return 0;
  const char* ending = data[0] % 4 == 0 ? ".xml" : data[0] % 4 == 3 ? ".json" : ".yaml";
  const std::filesystem::path file = fuzz::scratch_file(ending, data + 1, size - 1);
  try {
    fuzz::check(data[0], file);
  } catch (const FileError& error) {
    fuzz::require_readable(error.what());
  }
  std::filesystem::remove(file);
  return 0;
}
