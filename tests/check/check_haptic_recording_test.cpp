// SPDX-License-Identifier: BSD-3-Clause

// Verdicts of dyop-check on recorded runs of haptic tools: of sessions, which are right, and of
// motions that are made up, some of which are wrong.

#include <gtest/gtest.h>

#include "dyop/distance/distance.h"
#include "dyop/geometry/half_space.h"
#include "dyop/io/file_error.h"
#include "dyop/io/haptic_scene_file.h"
#include "io/record/recording_version.h"
#include "support/check_answer.h"
#include "support/damaged_files.h"
#include "support/inputs/haptic_run_texts.h"
#include "support/inputs/haptic_runs.h"
#include "support/inputs/random_inputs.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;

using testing::Answer;
using testing::check;
using testing::kProven;
using testing::kRefuted;
using testing::kUndecided;
using testing::kUnusable;

bool says(const Answer& answer, const std::string& words) {
  return answer.text.find(words) != std::string::npos;
}

// Ticks that are made up.
class MadeUpRun {
 public:
  MadeUpRun(const fs::path& file, HapticScene scene)
      : scene_(std::move(scene)), writer_(file, {}, scene_, testing::haptic_options()) {
    poses_.push_back(scene_.tools().front().start());
    for (const HapticTool& tool : scene_.more_tools) poses_.push_back(tool.start());
    progress_.resize(scene_.obstacles.size());
  }

  // One motion a tick.
  void move_to(const std::vector<ToolPose>& poses, Scalar fraction = 1) {
    TickRecord record;
    record.number = number_++;
    record.dt = 1e-3;
    record.others.resize(poses.size() - 1);
    std::vector<ObstacleProgress> after = progress_;
    if (deforming_) after[*deforming_] = {snapshot_, fraction};
    for (std::size_t k = 0; k < poses.size(); ++k) {
      HapticTick& tick = k == 0 ? record.tick : record.others[k - 1].tick;
      tick.status = status_;
      tick.path = {{0, poses_[k]}, {1e-3, poses[k]}};
      tick.path_progress = progress_;
      tick.path_progress.insert(tick.path_progress.end(), after.begin(), after.end());
      tick.progress = after;
      tick.tool = poses[k];
      tick.clearances.resize(scene_.obstacles.size());
      tick.tool_clearances.resize(poses.size());
      tick.snapshots.resize(scene_.obstacles.size());
      if (deforming_) tick.snapshots[*deforming_] = snapshot_;
    }
    writer_.add(record);
    poses_ = poses;
    progress_ = after;
  }

  void give(std::size_t obstacle, const std::vector<Vector3>& vertices) {
    writer_.add_snapshot(obstacle, vertices, 1e-3);
    deforming_ = obstacle;
    progress_[obstacle] = {++snapshot_, 0};
  }
  void give_mesh(std::size_t obstacle, const std::vector<Vector3>& vertices,
                 const std::vector<TriangleIndices>& triangles) {
    writer_.add_mesh(obstacle, vertices, triangles);
    deforming_ = obstacle;
    progress_[obstacle] = {++snapshot_, 1};
  }

  void leave_out(std::int64_t ticks) { number_ += ticks; }
  void jump_to(const std::vector<ToolPose>& poses) { poses_ = poses; }
  void jump_to(Scalar fraction) { progress_[*deforming_].fraction = fraction; }
  void say(HapticStatus status) { status_ = status; }
  void finish() { writer_.finish({}); }

 private:
  HapticScene scene_;
  HapticRecordingWriter writer_;
  std::vector<ToolPose> poses_;
  std::vector<ObstacleProgress> progress_;
  std::optional<std::size_t> deforming_;
  std::int64_t snapshot_ = 0;
  std::int64_t number_ = 0;
  HapticStatus status_ = HapticStatus::Free;
};

ToolPose pose_at(const Vector3& p_WT, const Vector3& turn = Vector3::Zero(), Scalar angle = 0) {
  return {RigidPose(rotation_from_vector(turn), p_WT), {angle}};
}

std::vector<Vector3> raised(std::vector<Vector3> vertices, Scalar z) {
  for (Vector3& p : vertices) p.z() += z;
  return vertices;
}

// A ball of radius 1 at the height 3 over a sheet, whose margin is 0.1.
HapticScene ball_over_sheet() {
  HapticScene scene = testing::ball_tool(1, {0, 0, 3});
  scene.obstacles.push_back(testing::deforming_tissue(testing::sheet(10, 5)));
  scene.obstacles[0].margin = 0.1;
  return scene;
}

class CheckHapticRecording : public ::testing::Test {
 protected:
  fs::path file() const { return directory_.path() / "run.h5"; }

 private:
  testing::TemporaryDirectory directory_;
};

TEST_F(CheckHapticRecording, ProvesARunWithSnapshotsMeshesAndBadInput) {
  const std::vector<HapticTick> run = testing::record_heaving_run(file(), 400);
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
  EXPECT_TRUE(says(answer, "keeps its margin in every motion of 400 ticks")) << answer.text;
  EXPECT_TRUE(says(answer, "tissue became another mesh once")) << answer.text;
  int held = 0;
  for (const HapticTick& tick : run) held += !tick.contacts.empty();
  EXPECT_GT(held, 50);
  // The tool rests on tissue: to any larger margin it has come too near.
  EXPECT_EQ(check(file(), 1.5).code, kRefuted);
}

TEST_F(CheckHapticRecording, ProvesARunOfTwoTools) {
  testing::record_two(file(), 300);
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
  EXPECT_EQ(check(file(), 1.5).code, kRefuted);
}

// Runs a scene of `dyop tool`, and records it.
void record_scene(const fs::path& file, const std::string& text, std::int64_t ticks) {
  HapticRun run = parse_haptic_run("scene.json", text);
  run.runner.ticks = ticks;
  run.runner.is_paced = false;
  HapticSession session(run.scene, run.options);
  HapticRecordingWriter writer(file, {run.title, run.text, run.runner.period, ""}, session,
                               run.tissue);
  writer.finish(run_session(
      session, [&](std::int64_t tick) { return run.device(tick); }, run.tissue,
      [&](const TickRecord& record) { writer.add(record); }, run.runner));
}

TEST_F(CheckHapticRecording, ProvesTissueThatBreathesByAFormulaIsCutOrAnswers) {
  record_scene(file(), testing::cut_haptic_scene(), 900);
  const Answer cut = check(file());
  EXPECT_EQ(cut.code, kProven) << cut.text << cut.error;
  EXPECT_TRUE(says(cut, "tissue became another mesh once")) << cut.text;
  // The tool rests on the vessel, whose margin is 2.
  EXPECT_EQ(check(file(), 1.5).code, kRefuted);
  record_scene(file(), testing::elastic_haptic_scene(), 400);
  const Answer elastic = check(file());
  EXPECT_EQ(elastic.code, kProven) << elastic.text << elastic.error;
}

TEST_F(CheckHapticRecording, AFlippedBitIsNoticedOrChangesNothing) {
  testing::record_heaving_run(file(), 40);
  testing::flip_bits(
      file(),
      [&] {
        const Answer answer = check(file());
        if (answer.code == kUnusable) throw FileError(file(), "damaged");
        return std::uint64_t{std::hash<std::string>()(answer.text)};
      },
      200);
}

TEST_F(CheckHapticRecording, RefutesAToolThatDipsIntoTissueWithinOneMotion) {
  HapticScene scene = testing::ball_tool(1, {0, 0, 3});
  // A rod of 8 to one side: both ends of half a turn about x are free, the middle is not.
  scene.tool = {{std::make_shared<Box>(Vector3(0.2, 4, 0.2)), RigidPose(Vector3(0, 4, 0))}};
  scene.obstacles.push_back(testing::deforming_tissue(testing::sheet(10, 5)));
  for (const Scalar height : {9.0, 5.0}) {
    MadeUpRun run(file(), scene);
    run.move_to({pose_at({0, 0, height})});
    run.move_to({pose_at({0, 0, height}, {-2.4, 0, 0})});
    run.finish();
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, height > 8.3 ? kProven : kRefuted) << answer.text;
    EXPECT_EQ(says(answer, "organ and tool 1 in tick 1"), height < 8.3) << answer.text;
  }
}

TEST_F(CheckHapticRecording, RefutesTissueThatComesTooNear) {
  const HapticScene scene = ball_over_sheet();
  for (const Scalar height : {1.85, 1.95}) {
    MadeUpRun run(file(), scene);
    const ToolPose stays = pose_at({0, 0, 3});
    run.move_to({stays});
    run.give(0, raised(scene.obstacles[0].vertices, height));
    run.move_to({stays}, 0.5);
    run.move_to({stays}, 1);
    run.finish();
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, height < 1.9 ? kProven : kRefuted) << answer.text;
    EXPECT_EQ(says(answer, "in tick 2"), height > 1.9) << answer.text;
  }
}

TEST_F(CheckHapticRecording, RefutesTissueThatHasAlreadyLeftWhereTheToolGoes) {
  const HapticScene scene = ball_over_sheet();
  for (const bool too_early : {false, true}) {
    MadeUpRun run(file(), scene);
    run.move_to({pose_at({0, 0, 3})});
    run.give(0, raised(scene.obstacles[0].vertices, -2));
    // The tool follows the tissue down, or is there before it.
    const Scalar part = too_early ? 0.33 : 0.9;
    run.move_to({pose_at({0, 0, 0.2})}, part);
    run.finish();
    EXPECT_EQ(check(file()).code, too_early ? kRefuted : kProven);
  }
}

TEST_F(CheckHapticRecording, RefutesAJawThatSweepsThroughARigidRegion) {
  HapticScene scene = testing::ball_tool(1, {0, 0, 3});
  scene.hinges.push_back({RigidPose(), 0, 1});
  scene.tool.push_back(
      {std::make_shared<Capsule>(0.2, 2),
       RigidPose(rotation_from_vector({0, 1.5707963267948966, 0}), Vector3(3, 0, 0)), 0});
  ToolObstacle wall = testing::rigid_tissue(std::make_shared<Box>(Vector3(0.2, 0.2, 9)),
                                            RigidPose(Vector3(4, 2, 0)));
  wall.role = ObstacleRole::HardRegion;
  scene.obstacles.push_back(wall);
  for (const Scalar angle : {0.2, 1.4}) {
    MadeUpRun run(file(), scene);
    run.move_to({pose_at({0, 0, 3}, Vector3::Zero(), angle)});
    run.finish();
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, angle < 1 ? kProven : kRefuted) << answer.text;
    EXPECT_EQ(says(answer, "tool 1, hinge 1"), angle > 1) << answer.text;
  }
  scene.obstacles[0].role = ObstacleRole::SoftRegion;
  scene.obstacles[0].soft_stiffness = 1;
  MadeUpRun run(file(), scene);
  run.move_to({pose_at({0, 0, 3}, Vector3::Zero(), 1.4)});
  run.finish();
  EXPECT_EQ(check(file()).code, kProven);
}

TEST_F(CheckHapticRecording, RefutesToolsThatPassThroughEachOther) {
  HapticScene scene = testing::ball_tool(1, {-5, 0, 0});
  HapticTool other;
  other.parts = scene.tool;
  other.X_WT = RigidPose(Vector3(5, 0, 0));
  scene.more_tools.push_back(other);
  scene.tool_margin = 0.1;
  for (const Scalar y : {0.0, 2.2}) {
    MadeUpRun run(file(), scene);
    run.move_to({pose_at({-5, y, 0}), pose_at({5, 0, 0})});
    run.move_to({pose_at({5, y, 0}), pose_at({-5, 0, 0})});
    run.finish();
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, y > 0 ? kProven : kRefuted) << answer.text;
    EXPECT_EQ(says(answer, "tool 1 and tool 2 in tick 1"), y == 0) << answer.text;
  }
}

TEST_F(CheckHapticRecording, TellsOfAToolThatBeginsWithinTissue) {
  for (const bool deforms : {false, true}) {
    HapticScene scene = testing::ball_tool(1, {0.5, 0, 0});
    const testing::MeshArrays shell = testing::icosphere(2, 4);
    scene.obstacles.push_back(deforms ? testing::deforming_tissue(shell)
                                      : testing::rigid_tissue(testing::shared_mesh(shell)));
    for (const Scalar x : {0.5, 9.0}) {
      scene.X_WT = RigidPose(Vector3(x, 0, 0));
      MadeUpRun run(file(), scene);
      run.move_to({pose_at({x + 0.1, 0, 0})});
      run.finish();
      const Answer answer = check(file());
      EXPECT_EQ(answer.code, kProven) << answer.text;
      EXPECT_EQ(says(answer, "inside: tool 1 begins within the surface of"), x < 1) << answer.text;
    }
  }
}

// Half a turn may have been made either way round.
TEST_F(CheckHapticRecording, LeavesTurnsByNearlyHalfATurnUndecided) {
  for (const Scalar angle : {2.4, 2.6}) {
    MadeUpRun run(file(), ball_over_sheet());
    run.move_to({pose_at({0, 0, 3})});
    run.move_to({pose_at({0, 0, 3}, {0, 0, angle})});
    run.finish();
    EXPECT_EQ(check(file()).code, angle > 2.5 ? kUndecided : kProven);
  }
}

TEST_F(CheckHapticRecording, CountsWhatATickAdmits) {
  const HapticScene scene = ball_over_sheet();
  const auto answer_of = [&](HapticStatus status, Scalar z) {
    MadeUpRun run(file(), scene);
    run.move_to({pose_at({0, 0, 3})});
    run.say(status);
    run.move_to({pose_at({0, 0, z})});
    run.finish();
    return check(file());
  };
  EXPECT_EQ(answer_of(HapticStatus::Held, 1.05).code, kRefuted);
  const Answer leaving = answer_of(HapticStatus::Recovering, 1.05);
  EXPECT_EQ(leaving.code, kProven);
  EXPECT_TRUE(says(leaving, "a part was nearer than its margin once")) << leaving.text;
  EXPECT_EQ(answer_of(HapticStatus::Recovering, 0.5).code, kRefuted);  // that is no crossing
  const Answer crossing = answer_of(HapticStatus::Overlapping, 0.5);
  EXPECT_EQ(crossing.code, kProven);
  EXPECT_TRUE(says(crossing, "a part is not proven once")) << crossing.text;
}

TEST_F(CheckHapticRecording, RefusesTicksThatEndElsewhereThanTheirMotions) {
  for (const bool is_off : {false, true}) {
    HapticRecordingWriter writer(file(), {}, ball_over_sheet(), testing::haptic_options());
    TickRecord record;
    HapticTick& tick = record.tick;
    tick.path = {{0, pose_at({0, 0, 3})}};
    tick.path_progress.resize(1);
    tick.tool = pose_at({0, 0, is_off ? 3.001 : 3});
    tick.clearances.resize(1);
    tick.snapshots.resize(1);
    writer.add(record);
    writer.finish({});
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, is_off ? kUnusable : kProven) << answer.text;
    EXPECT_EQ(answer.error.find("tick 0 ends elsewhere") != std::string::npos, is_off);
  }
}

TEST_F(CheckHapticRecording, TellsOfToolsThatBeganAfreshAndOfTicksThatAreMissing) {
  const HapticScene scene = ball_over_sheet();
  MadeUpRun run(file(), scene);
  const ToolPose above = pose_at({0, 0, 3}), below = pose_at({0, 0, -3});
  run.move_to({above});
  run.jump_to({below});
  run.move_to({below});
  run.leave_out(3);
  run.move_to({below});
  run.finish();
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kProven) << answer.text;
  EXPECT_TRUE(says(answer, "tools began afresh 2 times")) << answer.text;
  EXPECT_TRUE(says(answer, "3 ticks are not in the file")) << answer.text;
}

// Tools may begin afresh; tissue, between whose ticks none is missing, may not.
TEST_F(CheckHapticRecording, RefusesTissueThatJumpsWhileToolsBeginAfresh) {
  const HapticScene scene = ball_over_sheet();
  for (const Scalar fraction : {0.0, 0.7}) {
    MadeUpRun run(file(), scene);
    run.move_to({pose_at({0, 0, 4})});
    run.give(0, raised(scene.obstacles[0].vertices, 1));
    run.jump_to(fraction);
    run.jump_to(std::vector{pose_at({0, 0, 5})});
    run.move_to({pose_at({0, 0, 5.5})});
    run.finish();
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, fraction > 0 ? kUnusable : kProven) << answer.text << answer.error;
    EXPECT_EQ(answer.error.find("elsewhere without a motion") != std::string::npos, fraction > 0);
  }
}

TEST_F(CheckHapticRecording, LeavesUndecidedWhatDependsOnMissingTicks) {
  const HapticScene scene = ball_over_sheet();
  const std::vector<Vector3>& rest = scene.obstacles[0].vertices;
  const ToolPose stays = pose_at({0, 0, 3});
  MadeUpRun run(file(), scene);
  run.give(0, raised(rest, 0.1));
  run.move_to({stays}, 0.5);
  run.leave_out(2);
  run.give(0, raised(rest, 0.2));
  run.move_to({stays}, 0.5);  // where it set out is not in the file
  run.move_to({stays}, 1);
  run.give(0, raised(rest, 0.3));
  run.move_to({stays}, 1);
  run.finish();
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kUndecided) << answer.text;
  EXPECT_TRUE(says(answer, "undecided: organ and tool 1 in tick 3")) << answer.text;
  EXPECT_FALSE(says(answer, "in tick 5")) << answer.text;
}

TEST_F(CheckHapticRecording, ChecksAnotherMeshWhereItAppears) {
  const HapticScene scene = ball_over_sheet();
  for (const Scalar height : {0.0, 2.0}) {
    MadeUpRun run(file(), scene);
    run.move_to({pose_at({0, 0, 3})});
    run.give_mesh(0, raised(scene.obstacles[0].vertices, height), scene.obstacles[0].triangles);
    run.move_to({pose_at({0, 0, 3})});
    run.finish();
    EXPECT_EQ(check(file()).code, height == 0 ? kProven : kRefuted);
  }
}

TEST_F(CheckHapticRecording, ProvesAHalfSpaceAndRefusesOtherVersions) {
  HapticScene scene = testing::ball_tool(1, {0, 0, 3});
  scene.obstacles.push_back(testing::rigid_tissue(
      std::make_shared<HalfSpace>(Vector3::UnitZ(), 0.0), RigidPose(Vector3(0, 0, 1))));
  MadeUpRun run(file(), scene);
  run.move_to({pose_at({0, 0, 2.1})});
  run.move_to({pose_at({4, 0, 2.1}, {1, 0, 0})});
  run.finish();
  EXPECT_EQ(check(file()).code, kProven);
  EXPECT_EQ(check(file(), 0).code, kProven);
  testing::set_version(file(), 4);
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kUnusable);
  EXPECT_NE(answer.error.find("version 4, and versions 5 to 7 are checked"), std::string::npos)
      << answer.error;
}

// A tool with a jaw and a mesh that deforms, in one random motion. The oracle measures their
// distance at many times by dyop's own queries, with which the checker shares no code.
struct RandomMotion {
  explicit RandomMotion(std::mt19937_64& random, Scalar size) {
    scene = testing::ball_tool(0.5 * size, Vector3::Zero(), 1);
    const auto vector = [&](Scalar length) {
      return testing::random_vector(length * size, random);
    };
    const auto turn = [&](Scalar angle) { return testing::random_vector(angle, random); };
    scene.tool.push_back({std::make_shared<Capsule>(0.1 * size, 0.6 * size),
                          RigidPose(rotation_from_vector(turn(2)), vector(0.8)), 0});
    scene.hinges.push_back({RigidPose(rotation_from_vector(turn(2)), vector(0.4)), 0, 1});
    from = {
        RigidPose(rotation_from_vector(turn(2)), Vector3(vector(1) + Vector3(0, 0, 1.6 * size))),
        {turn(1).x()}};
    to = {RigidPose(rotation_from_vector(turn(1)) * from.X_WT.rotation(),
                    Vector3(from.X_WT.translation() + vector(0.8))),
          {from.angles[0] + turn(1.5).x()}};
    scene.X_WT = from.X_WT;
    scene.hinges[0].angle = from.angles[0];
    testing::MeshArrays sheet = testing::sheet(4 * size, 3);
    for (Vector3& p : sheet.vertices) p += vector(0.2);
    scene.obstacles.push_back(testing::deforming_tissue(sheet));
    const Vector3 shift = vector(4);  // much faster than the tool
    for (Vector3& p : sheet.vertices) p += shift + vector(0.5);
    goal = sheet.vertices;
  }

  // At a part of the motion.
  Scalar distance(Scalar s) const {
    const ToolObstacle& organ = scene.obstacles[0];
    std::vector<Vector3> vertices = organ.vertices;
    for (std::size_t k = 0; k < vertices.size(); ++k) vertices[k] += s * (goal[k] - vertices[k]);
    const TriangleMesh mesh(vertices, organ.triangles);
    const Matrix3 turned = to.X_WT.rotation() * from.X_WT.rotation().transpose();
    const RigidPose X_WT(
        Matrix3(rotation_from_vector(s * rotation_vector(turned)) * from.X_WT.rotation()),
        Vector3(from.X_WT.translation() + s * (to.X_WT.translation() - from.X_WT.translation())));
    const Scalar angle = from.angles[0] + s * (to.angles[0] - from.angles[0]);
    const RigidPose& X_TJ = scene.hinges[0].X_TJ;
    const RigidPose turned_hinge(rotation_from_vector(Vector3(0, 0, angle)), Vector3::Zero());
    const RigidPose X_WP = X_WT * X_TJ * turned_hinge * X_TJ.inverse() * scene.tool[1].X_TP;
    return std::min(dyop::distance(mesh, RigidPose(), *scene.tool[0].shape, X_WT).lower,
                    dyop::distance(mesh, RigidPose(), *scene.tool[1].shape, X_WP).lower);
  }

  HapticScene scene;
  ToolPose from;
  ToolPose to;
  std::vector<Vector3> goal;
};

TEST_F(CheckHapticRecording, AgreesWithDistancesAtManyTimesOfRandomMotions) {
  constexpr int kRuns = 150;
  constexpr int kTimes = 200;
  std::mt19937_64 random(11);
  int proven = 0;
  int refuted = 0;
  for (int k = 0; k < kRuns; ++k) {
    const Scalar size = std::pow(Scalar{10}, k % 4 - 2);
    RandomMotion motion(random, size);
    Scalar least = kInfinity;
    for (int i = 0; i <= kTimes; ++i) least = std::min(least, motion.distance(i / Scalar(kTimes)));
    // A little nearer and a little farther than it comes: by more than can lie between two times.
    for (const Scalar margin : {0.9 * least - 1e-2 * size, least + 1e-9 * size}) {
      if (margin < 0) continue;
      motion.scene.obstacles[0].margin = margin;
      MadeUpRun run(file(), motion.scene);
      run.give(0, motion.goal);
      run.move_to({motion.to}, 1);
      run.finish();
      const Answer answer = check(file());
      EXPECT_EQ(answer.code, margin < least ? kProven : kRefuted)
          << "run " << k << ", distance " << least << ", margin " << margin << '\n'
          << answer.text;
      ++(margin < least ? proven : refuted);
    }
  }
  EXPECT_GT(proven, 50);
  EXPECT_GT(refuted, 50);
}

}  // namespace
}  // namespace dyop
