// SPDX-License-Identifier: BSD-3-Clause

// The page of a tool's run, in a browser, against the session itself.

#include <gtest/gtest.h>

#include "dyop/core/error.h"
#include "dyop/geometry/box.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/recording/tool_recording_writer.h"
#include "dyop/tool_io/tool_scene_file.h"
#include "dyop/view/page_encoder.h"
#include "dyop/view/recorded_page.h"
#include "support/inputs/tool_run_texts.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"
#include "view/browser_check.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;

nlohmann::json numbers_of(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

nlohmann::json pose_fact(std::size_t body, Scalar t, const RigidPose& X) {
  const Quaternion q = X.quaternion();
  return {{"body", body},
          {"t", t},
          {"p", numbers_of(X.translation())},
          {"q", {q.x(), q.y(), q.z(), q.w()}}};
}

// Part 0 of the small scene is fixed to the tool; bodies are two parts, the device's two, liver,
// vessel.
nlohmann::json record_and_tell(const fs::path& file) {
  constexpr std::size_t kLiver = 4, kDevice = 2;
  ToolRun run = parse_tool_run("scene.json", testing::kSmallToolScene);
  run.runner.ticks = 700;
  run.runner.is_paced = false;
  ToolSession session(run.scene, run.options);
  ToolRecordingWriter writer(file, {"", run.text, run.runner.period, ""}, run.scene, run.options,
                             run.tissue);
  nlohmann::json facts{{"standoff", run.options.standoff},
                       {"end", 0.7},
                       {"poses", nlohmann::json::array()},
                       {"boxes", nlohmann::json::array()}};
  const RigidPose& X_TP = run.scene.tool[0].X_TP;
  const RunnerReport report = run_session(
      session, [&](std::int64_t tick) { return run.device(tick); }, run.tissue,
      [&](const TickRecord& record) {
        writer.add(record);
        if (record.number % 37 != 5) return;
        const Scalar t = Scalar(record.number + 1) * run.runner.period;
        facts["poses"].push_back(pose_fact(0, t, record.tick.tool.X_WT * X_TP));
        const RigidPose X_WD(record.device.q_WD, record.device.p_WD);
        facts["poses"].push_back(pose_fact(kDevice, t, X_WD * X_TP));
        AlignedBox box;
        for (const Vector3& p : session.tissue_vertices(0)) box.extend(p);
        facts["boxes"].push_back({{"body", kLiver},
                                  {"t", t},
                                  {"low", numbers_of(box.min())},
                                  {"high", numbers_of(box.max())}});
      },
      run.runner);
  writer.finish(report);
  return facts;
}

TEST(ToolPage, ShowsToolDeviceAndTissueWhereTheyWere) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  const nlohmann::json facts = record_and_tell(file);
  ASSERT_GT(facts.at("boxes").size(), 15u);
  const fs::path facts_file = directory.write("facts.json", facts.dump());
  const fs::path page = directory.write("page.html", recorded_page_html(file));
  testing::expect_script_passes("tool", "check_tool_page.mjs",
                                {page.string(), facts_file.string()});
}

TEST(ToolPage, RefusesADeformationThatDoesNotFitItsMesh) {
  PageScene scene;
  scene.bodies.push_back(
      {"box", BodyKind::Static, std::make_shared<Box>(Vector3(1, 1, 1)), "", {}});
  scene.deformations.push_back({BodyId(0), {}, {0}, {}});
  EXPECT_NE(testing::message_of([&] { PageEncoder{scene}; }).find("only a mesh can deform"),
            std::string::npos);
  scene.bodies[0].shape =
      std::make_shared<const TriangleMesh>(std::vector<Vector3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                                           std::vector<TriangleIndices>{{0, 1, 2}});
  EXPECT_NO_THROW(PageEncoder{scene});
  scene.deformations[0].modes.push_back(std::vector<Vector3>(2, Vector3::Zero()));
  EXPECT_NE(testing::message_of([&] { PageEncoder{scene}; }).find("2 displacements for 3"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop
