// SPDX-License-Identifier: BSD-3-Clause

// The page of a tool's run, in a browser, against the session itself.

#include "view/tool/tool_page.h"

#include <gtest/gtest.h>

#include <cmath>
#include <future>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/haptic_recording.h"
#include "dyop/io/haptic_scene_file.h"
#include "dyop/view/page_encoder.h"
#include "dyop/view/run_files.h"
#include "dyop/view/tool_follower.h"
#include "support/inputs/haptic_run_texts.h"
#include "support/inputs/haptic_scenes.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"
#include "view/browser_check.h"
#include "view/tool/tissue_tracks.h"

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

constexpr std::int64_t kCutNumber = 15;

// In place of snapshot 15 every other triangle is taken away; all shapes are stored.
void cut_tissue(const HapticRun& run, TissueFeed& feed,
                std::unique_ptr<HapticRecordingWriter>& writer, std::vector<Vector3>& last) {
  feed.formula.clear();
  feed.shape = [shape = feed.shape, &writer, &last, &feed](std::int64_t number,
                                                           std::span<Vector3> vertices) {
    shape(number, vertices);
    writer->add_snapshot(0, vertices, feed.period);
    last.assign(vertices.begin(), vertices.end());
  };
  feed.cut = [&](std::int64_t number) -> std::optional<TissueMesh> {
    if (number != kCutNumber) return std::nullopt;
    TissueMesh mesh{last, {}};
    const std::vector<TriangleIndices>& whole = run.scene.obstacles[0].triangles;
    for (std::size_t k = 0; k < whole.size(); k += 2) mesh.triangles.push_back(whole[k]);
    writer->add_mesh(0, mesh.vertices, mesh.triangles);
    return mesh;
  };
}

// Part 0 of the small scene is fixed to the tool; bodies are two parts, the device's two, liver,
// vessel, and the cut liver if it is.
nlohmann::json record_and_tell(const fs::path& file, bool is_cut) {
  constexpr std::size_t kLiver = 4, kCutLiver = 6, kDevice = 2;
  HapticRun run = parse_haptic_run("scene.json", testing::kSmallHapticScene);
  run.runner.ticks = 700;
  run.runner.is_paced = false;
  HapticSession session(run.scene, run.options);
  std::unique_ptr<HapticRecordingWriter> writer;
  std::vector<Vector3> last;
  if (is_cut) cut_tissue(run, run.tissue[0], writer, last);
  writer = std::make_unique<HapticRecordingWriter>(
      file, HapticRunHeader{"", run.text, run.runner.period, ""}, run.scene, run.options,
      run.tissue);
  nlohmann::json facts{{"rest_offset", run.options.rest_offset},
                       {"end", 0.7},
                       {"ghosts", is_cut ? 3 : 2},  // the cut liver is open
                       {"poses", nlohmann::json::array()},
                       {"present", nlohmann::json::array()},
                       {"boxes", nlohmann::json::array()}};
  const RigidPose& X_TP = run.scene.tool[0].X_TP;
  const RunnerReport report = run_session(
      session, [&](std::int64_t tick) { return run.device(tick); }, run.tissue,
      [&](const TickRecord& record) {
        writer->add(record);
        if (record.number % 37 != 5) return;
        const Scalar t = Scalar(record.number + 1) * run.runner.period;
        facts["poses"].push_back(pose_fact(0, t, record.tick.tool.X_WT * X_TP));
        const RigidPose X_WD(record.device.q_WD, record.device.p_WD);
        facts["poses"].push_back(pose_fact(kDevice, t, X_WD * X_TP));
        AlignedBox box;
        for (const Vector3& p : session.tissue_vertices(0)) box.extend(p);
        const bool is_open = is_cut && session.snapshots_taken(0) >= kCutNumber;
        if (is_cut) {
          facts["present"].push_back({{"body", kLiver}, {"t", t}, {"is", !is_open}});
          facts["present"].push_back({{"body", kCutLiver}, {"t", t}, {"is", is_open}});
        }
        facts["boxes"].push_back({{"body", is_open ? kCutLiver : kLiver},
                                  {"t", t},
                                  {"low", numbers_of(box.min())},
                                  {"high", numbers_of(box.max())}});
      },
      run.runner);
  writer->finish(report);
  return facts;
}

TEST(ToolPage, ShowsToolDeviceAndTissueWhereTheyWere) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  for (const bool is_cut : {false, true}) {
    nlohmann::json facts = record_and_tell(file, is_cut);
    ASSERT_GT(facts.at("boxes").size(), 15u);
    RecordedPageOptions options;
    options.verdict = PageVerdict{!is_cut, "run.h5: what was found"};
    facts["badge"] = is_cut ? "not proven by dyop-check: run.h5" : "proven by dyop-check: run.h5";
    const fs::path facts_file = directory.write("facts.json", facts.dump());
    const fs::path page = directory.write("page.html", recorded_page_html(file, options));
    testing::expect_script_passes("tool", "check_tool_page.mjs",
                                  {page.string(), facts_file.string()});
  }
}

// Where tracks show a vertex of the first mesh.
Vector3 shown_vertex(const PageDeformation& track, const std::vector<Vector3>& rest, Scalar t,
                     std::size_t vertex) {
  const auto next = std::upper_bound(track.times.begin(), track.times.end(), t);
  if (next == track.times.begin()) return rest[vertex];
  const auto last = std::size_t(next - track.times.begin()) - 1;
  const bool is_over = next == track.times.end();
  const Scalar part = is_over ? 0 : (t - track.times[last]) / (*next - track.times[last]);
  Vector3 p = rest[vertex];
  for (std::size_t k = 0; k < track.modes.size(); ++k) {
    const Scalar from = track.weights[last * track.modes.size() + k];
    const Scalar to = is_over ? from : track.weights[(last + 1) * track.modes.size() + k];
    p += (from + part * (to - from)) * track.modes[k][vertex];
  }
  return p;
}

// Snapshots, some taken back, and motions that end early.
TEST(ToolPage, TracksShowTissueThatIsRetargetedWhereItWas) {
  constexpr std::size_t kVertex = 40;
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  HapticScene scene = testing::ball_tool(2, {0, 0, 9});
  scene.obstacles.push_back(testing::deforming_tissue(testing::sheet(30, 8)));
  const std::vector<Vector3>& rest = scene.obstacles[0].vertices;
  std::vector<Vector3> places;  // at the end of each tick
  {
    HapticSession session(scene, testing::haptic_options());
    HapticRecordingWriter writer(file, {}, session);
    int turns = 0;
    for (int k = 0; k < 400; ++k) {
      std::vector<Vector3> goal = rest;
      for (Vector3& p : goal) p.z() += std::sin(0.1 * k + 0.2 * p.x());
      if (k % 23 == 5) session.give_snapshot(0, goal, 0.012);
      if (k % 17 == 3) turns += session.retarget(0, goal, 0.015, 1e-3 * (k % 4));
      TickRecord record{k, testing::device_at({0, 0, 9}), 1e-3, {}};
      record.tick = session.update(record.device, record.dt);
      writer.add(record);
      places.push_back(session.tissue_vertices(0)[kVertex]);
    }
    writer.finish({});
    EXPECT_GT(turns, 15);
  }
  const HapticRecordingReader reader(file);
  const view_internal::ToolBodies bodies(scene);
  PageScene page;
  view_internal::TissueTracks(reader, file, bodies, 1e-9).add_to(page);
  ASSERT_EQ(page.deformations.size(), 1u);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Vector3 shown = shown_vertex(page.deformations[0], rest, 1e-3 * Scalar(k + 1), kVertex);
    EXPECT_TRUE(shown.isApprox(places[k], 1e-6)) << k;
  }
}

// The page names the tools, and its nearest pair may be two of them.
TEST(ToolPage, ShowsSeveralTools) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "two.h5";
  HapticRun run = parse_haptic_run("scene.json", testing::two_tools_haptic_scene());
  HapticSession session(run.scene, run.options);
  HapticRecordingWriter writer(file, {"", run.text, run.runner.period, ""}, run.scene, run.options,
                               run.tissue);
  run.runner.is_paced = false;
  run.runner.ticks = 400;
  writer.finish(run_session(
      session,
      [&](std::int64_t tick, std::span<DevicePose> devices) {
        for (std::size_t k = 0; k < devices.size(); ++k) devices[k] = run.device(tick, k);
      },
      run.tissue, [&](const TickRecord& record) { writer.add(record); }, run.runner));
  const view_internal::ToolBodies bodies(run.scene);
  std::vector<std::string> names;
  for (const PageBody& body : bodies.bodies()) names.push_back(body.name);
  EXPECT_EQ(names, (std::vector<std::string>{"tool 1, part 1", "tool 1, part 2", "tool 2",
                                             "device 1, part 1", "device 1, part 2", "device 2",
                                             "liver", "vessel"}));
  view_internal::ToolSample sample;
  int between = 0;
  HapticRecordingReader(file).for_each_tick([&](const RecordedTick& tick) {
    sample = {};
    sample.add(tick);
    sample.add_other(tick.others[0]);
    sample.add_between(tick.tool_clearances);
    PageSpan span;
    sample.write({0, 1}, bodies, std::vector<BodyId>{BodyId(6), BodyId(7)}, span);
    ASSERT_EQ(span.gaps.size(), 3u);
    EXPECT_EQ(span.gaps[2].a, BodyId(2));
    EXPECT_EQ(span.gaps[2].b, BodyId(0));
    EXPECT_EQ(span.gaps[2].lower, tick.tool_clearances[0].lower);
    between += span.gaps[2].witness_W.has_value();
    EXPECT_EQ(sample.force,
              std::max(tick.wrench.force_W.norm(), tick.others[0].wrench.force_W.norm()));
  });
  EXPECT_GT(between, 20);
  EXPECT_LT(between, 390);
}

// What a follower published, and what the run was like at the end of each tick.
struct Followed {
  HapticRun run;
  PageSpan span;
  std::vector<TickRecord> ticks;
  std::vector<std::vector<Vector3>> liver;  // vertices
  TissueMesh cut;                           // of a model's liver, the last one
  std::int64_t snapshots = 0;               // of a model's liver
  std::int64_t cut_number = 0;              // of the one in whose place the cut came
};

Followed follow_run(const std::string& text, bool is_stuck) {
  Followed followed;
  followed.run = parse_haptic_run("scene.json", text);
  HapticRun& run = followed.run;
  run.runner.ticks = 700;
  run.runner.is_paced = false;
  HapticSession session(run.scene, run.options);
  std::promise<void> release;
  std::shared_future<void> released = release.get_future().share();
  if (!is_stuck) release.set_value();
  ToolFollower follower(run, [&followed, released](PageSpan span) {
    released.wait();
    append(followed.span, std::move(span));
  });
  for (TissueFeed& feed : run.tissue) {
    if (!feed.model) continue;
    feed.given = [&](std::span<const Vector3> vertices) {
      ++followed.snapshots;
      follower.add_snapshot(0, vertices);
    };
    feed.given_mesh = [&](const TissueMesh& mesh) {
      followed.cut_number = ++followed.snapshots;
      followed.cut = mesh;
      follower.add_cut(0, mesh);
    };
  }
  // A publisher that is stuck for the whole run holds nobody up: else this would never return.
  run_session(
      session,
      [&](std::int64_t tick, std::span<DevicePose> devices) {
        for (std::size_t k = 0; k < devices.size(); ++k) devices[k] = run.device(tick, k);
      },
      run.tissue,
      [&](const TickRecord& record) {
        follower.add(record);
        followed.ticks.push_back(record);
        followed.liver.push_back(session.tissue_vertices(0));
      },
      run.runner);
  if (is_stuck) release.set_value();
  follower.finish("for a reason");
  return followed;
}

std::string cut_elastic_scene() {
  return testing::replaced(
      testing::elastic_haptic_scene(), "\"cube\"",
      R"("cuts": [{"t": 0.2, "blade": {"position": [0, 0, 40], "size": [1, 60, 40]}}], "cube")");
}

// What a blade leaves is a body of its own, which takes the old one's place.
TEST(ToolFollower, AddsTissueThatABladeHasCut) {
  const Followed followed = follow_run(cut_elastic_scene(), false);
  ASSERT_EQ(followed.span.bodies.size(), 1u);
  const auto* mesh = dynamic_cast<const TriangleMesh*>(followed.span.bodies[0].shape.get());
  ASSERT_NE(mesh, nullptr);
  EXPECT_TRUE(mesh->is_closed());
  EXPECT_EQ(mesh->triangles().size(), followed.cut.triangles.size());
  const BodyId added(ToolFollower::scene_of(followed.run).bodies.size());
  Scalar begin = 0, end = 0;
  for (const PageSegment& segment : followed.span.segments) {
    if (segment.body == added) begin = segment.interval.begin;
    if (segment.motion == nullptr && segment.interval.begin > 0.2) end = segment.interval.begin;
  }
  EXPECT_GT(begin, 0.2);
  EXPECT_EQ(begin, end);
}

// Of what is drawn: vertices that a triangle has.
AlignedBox box_of(const std::vector<Vector3>& vertices,
                  const std::vector<TriangleIndices>& triangles) {
  AlignedBox box;
  for (const TriangleIndices& corners : triangles) {
    for (const std::int32_t corner : corners) box.extend(vertices[std::size_t(corner)]);
  }
  return box;
}

// Facts of the ticks that became pictures.
nlohmann::json facts_of(const Followed& followed) {
  const HapticRun& run = followed.run;
  std::size_t parts = 0;
  for (const HapticTool& tool : run.scene.tools()) parts += tool.parts.size();
  const std::size_t liver = 2 * parts, cut_liver = liver + 2, device = parts;
  constexpr std::int64_t kCut = 5;
  const bool has_formula = ToolFollower::scene_of(run).bodies.size() > cut_liver;
  const bool is_cut = has_formula || followed.cut_number > 0;
  const std::int64_t cut_number = has_formula ? kCut : followed.cut_number;
  const std::vector<TriangleIndices> cut =
      has_formula ? run.tissue[0].cut(kCut)->triangles : followed.cut.triangles;
  nlohmann::json facts{
      {"rest_offset", run.options.rest_offset},  {"end", 0.7},
      {"ghosts", parts + (has_formula ? 1 : 0)}, {"samples", followed.span.frames.size()},
      {"gaps", 1 + run.scene.tools().size()},    {"poses", nlohmann::json::array()},
      {"boxes", nlohmann::json::array()},        {"present", nlohmann::json::array()}};
  const RigidPose& X_TP = run.scene.tool[0].X_TP;
  for (const PageFrame& frame : followed.span.frames) {
    const Scalar t = frame.interval.end;
    const auto number = std::size_t(std::llround(t / run.runner.period)) - 1;
    const TickRecord& record = followed.ticks.at(number);
    facts["poses"].push_back(pose_fact(0, t, record.tick.tool.X_WT * X_TP));
    const RigidPose X_WD(record.device.q_WD, record.device.p_WD);
    facts["poses"].push_back(pose_fact(device, t, X_WD * X_TP));
    std::size_t other = run.scene.tool.size();  // the first part of a further tool
    for (std::size_t k = 0; k < record.others.size(); ++k) {
      const HapticTool& tool = run.scene.more_tools[k];
      const RigidPose& X_WT = record.others[k].tick.tool.X_WT;
      facts["poses"].push_back(pose_fact(other, t, X_WT * tool.parts[0].X_TP));
      other += tool.parts.size();
    }
    const bool is_open = is_cut && record.tick.progress[0].snapshot >= cut_number;
    const AlignedBox box =
        box_of(followed.liver.at(number), is_open ? cut : run.scene.obstacles[0].triangles);
    facts["present"].push_back({{"body", liver}, {"t", t}, {"is", !is_open}});
    facts["boxes"].push_back({{"body", is_open ? cut_liver : liver},
                              {"t", t},
                              {"low", numbers_of(box.min())},
                              {"high", numbers_of(box.max())}});
  }
  return facts;
}

// Writes a page and its facts, and returns where they are.
std::vector<std::string> write_page(const testing::TemporaryDirectory& directory,
                                    const std::string& name, const Followed& followed) {
  PageEncoder encoder(ToolFollower::scene_of(followed.run));
  encoder.add_bodies(followed.span.bodies);
  const std::vector<std::string> blocks{encoder.head(), encoder.span(followed.span)};
  return {directory.write(name + ".html", page_html(name, blocks)).string(),
          directory.write(name + ".json", facts_of(followed).dump()).string()};
}

TEST(ToolFollower, ShowsToolDeviceAndTissueWhereTheyAre) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const testing::TemporaryDirectory directory;
  std::vector<std::string> files;  // for one browser: its start takes longer than a page
  const auto add = [&](const std::string& name, const std::string& text, bool is_stuck) {
    const auto written = write_page(directory, name, follow_run(text, is_stuck));
    files.insert(files.end(), written.begin(), written.end());
  };
  add("cut", testing::cut_haptic_scene(), false);
  add("elastic", testing::elastic_haptic_scene(), false);
  add("cut_elastic", cut_elastic_scene(), false);
  add("two_tools", testing::two_tools_haptic_scene(), false);
  // A page that gets few pictures, as on a busy machine, shows these where they are.
  add("few_pictures", cut_elastic_scene(), true);
  testing::expect_script_passes("followed", "check_tool_page.mjs", files);
}

TEST(ToolFollower, AStuckPageHoldsNobodyUp) {
  const Followed followed = follow_run(testing::kSmallHapticScene, true);
  const PageSpan& span = followed.span;
  // What had no room is in the last picture.
  EXPECT_LE(span.frames.size(), 12u);
  ASSERT_FALSE(span.frames.empty());
  EXPECT_EQ(span.frames.back().interval.end, followed.ticks.back().tick.time);
  Scalar largest = 0;
  for (const TickRecord& record : followed.ticks) {
    largest = std::max(largest, record.tick.wrench.force_W.norm());
  }
  EXPECT_GT(largest, 0);
  Scalar shown = 0;
  for (const PageSample& sample : span.samples) shown = std::max(shown, sample.values.at(0));
  EXPECT_EQ(shown, largest);
  EXPECT_EQ(span.marks.back().kind, "end");
  EXPECT_EQ(span.marks.back().text, "for a reason");
}

TEST(ToolFollower, FollowsALoopByTheClockWithoutItsWaiting) {
  HapticRun run = parse_haptic_run("scene.json", testing::kSmallHapticScene);
  run.runner.ticks = 100;
  HapticSession session(run.scene, run.options);
  std::promise<void> release;
  ToolFollower follower(
      run, [released = release.get_future().share()](const PageSpan&) { released.wait(); });
  const RunnerReport report = run_session(
      session, [&](std::int64_t tick) { return run.device(tick); }, run.tissue,
      [&](const TickRecord& record) { follower.add(record); }, run.runner);
  EXPECT_EQ(report.ticks, 100);
  EXPECT_EQ(report.unlogged, 0);  // the log has room for more than all of them
  release.set_value();
}

TEST(PageSpan, AppendsDeformationsAsOne) {
  const std::vector<Vector3> mode(3, Vector3::UnitX());
  PageSpan whole;
  whole.deformations.push_back({BodyId(1), {mode}, {1, 2}, {10, 20}});
  PageSpan part;
  part.deformations.push_back({BodyId(2), {}, {3}, {}});
  part.deformations.push_back({BodyId(1), {mode}, {3}, {30, 31}});
  append(whole, part);
  ASSERT_EQ(whole.deformations.size(), 2u);
  EXPECT_EQ(whole.deformations[0].modes.size(), 2u);
  EXPECT_EQ(whole.deformations[0].times, (std::vector<Scalar>{1, 2, 3}));
  EXPECT_EQ(whole.deformations[0].weights, (std::vector<Scalar>{10, 0, 20, 0, 30, 31}));
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
