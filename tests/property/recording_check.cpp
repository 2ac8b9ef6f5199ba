// SPDX-License-Identifier: BSD-3-Clause

// Checks a recording of `dyop simulate` against CGAL: recording_check SCENE RECORDING [times]. At
// the ends of all steps, and at so many times in each of them (default 4), no two bodies may
// intersect. If the file ends in .poses.json it holds what was drawn instead
// (tests/view/drawn_poses.mjs). Meshes are looked for as by the dyop command, see DYOP_MESH_PATH.
// The exit code is 1 if anything is wrong, 2 if the files cannot be used.

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "dyop/core/error.h"
#include "support/inputs/models.h"
#include "support/oracles/recording_oracle.h"

namespace {

using dyop::testing::check_recording;
using dyop::testing::RecordingReport;

// {"times": [...], "poses": [for each time, for each body: p 3, quaternion x y z w]}.
RecordingReport check_drawn(const dyop::Scene& scene, const std::filesystem::path& file) {
  std::ifstream in(file);
  const nlohmann::json drawn = nlohmann::json::parse(in);
  const auto times = drawn.at("times").get<std::vector<dyop::Scalar>>();
  const auto rows = drawn.at("poses").get<std::vector<std::vector<dyop::Scalar>>>();
  return dyop::testing::check_poses(scene, times, [&](dyop::BodyId body, std::size_t time) {
    const dyop::Scalar* row = rows.at(time).data() + 7 * body.slot;
    return dyop::RigidPose(dyop::Quaternion(row[6], row[3], row[4], row[5]).normalized(),
                           dyop::Vector3(row[0], row[1], row[2]));
  });
}

RecordingReport check(const dyop::Scene& scene, const std::filesystem::path& file, int between) {
  if (file.string().ends_with(".poses.json")) return check_drawn(scene, file);
  return check_recording(scene, dyop::RecordingReader(file), between);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: recording_check SCENE RECORDING [times]\n");
    return 2;
  }
  try {
    const dyop::Scene scene = dyop::load_scene(argv[1], dyop::testing::model_directories());
    const RecordingReport report = check(scene, argv[2], argc > 3 ? std::atoi(argv[3]) : 4);
    for (const std::string& fault : report.faults) std::printf("%s\n", fault.c_str());
    std::printf("%lld steps, %lld poses, %lld pairs of bodies, %lld examined, %zu faults\n",
                static_cast<long long>(report.steps), static_cast<long long>(report.poses),
                static_cast<long long>(report.pairs), static_cast<long long>(report.examined_pairs),
                report.faults.size());
    return report.faults.empty() ? 0 : 1;
  } catch (const dyop::Error& error) {
    std::fprintf(stderr, "recording_check: %s\n", error.what());
    return 2;
  }
}
