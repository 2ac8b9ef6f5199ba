// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/commands.h"
#include "cli/console.h"
#include "cli/page/page_output.h"
#include "cli/recording/recording_tools.h"
#include "cli/scene_run.h"
#include "dyop/core/error.h"
#include "dyop/io/scene_file.h"
#include "dyop/view/live_server.h"
#include "dyop/view/run_files.h"
#include "io/file_bytes.h"

namespace dyop::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kViewExamples =
    R"(The page is one file that needs no network and opens by a double click; docs/player.md.

Examples:
  dyop simulate scene.json -o run.h5 && dyop view run.h5 -o run.html
  Two runs side by side, with one clock and one camera:
    dyop view coarse.h5 fine.h5 -o both.html
  With the verdict of dyop check on the page:
    dyop view run.h5 --check -o run.html
  A run in the browser while it is computed; Ctrl-C ends it:
    dyop view --live scene.json -o run.html
  A film of it at a tenth of the speed, and pictures (with Chromium, without a window):
    dyop view run.h5 --frames run.mp4 --speed 0.1
    dyop view run.h5 --frames pictures --fps 10 --link theme=dark
)";

struct ViewArguments {
  std::string file;
  std::string second_file;
  std::string out;
  std::vector<std::string> mesh_path;
  std::string frames;
  FrameOptions frame_options;
  bool is_live = false;
  bool checks = false;
  bool starts_paused = false;
  bool is_paced = false;
  LivePage live;
  int threads = 0;
  bool is_json = false;
};

void tell(const ViewArguments& arguments, const char* key, const std::string& value) {
  if (arguments.is_json) {
    std::cout << nlohmann::ordered_json{{key, value}}.dump() << std::endl;
  } else {
    std::cout << key << ": " << value << std::endl;
  }
}

ExitCode view_recording(const ViewArguments& arguments) {
  const fs::path second = arguments.second_file.empty() ? arguments.file : arguments.second_file;
  io_internal::require_other_than(arguments.out, {arguments.file, second});
  io_internal::require_other_than(arguments.frames, {arguments.file, second});
  RecordedPageOptions options;
  if (arguments.checks) options.verdict = verdict_on(arguments.file);
  const std::string page = arguments.second_file.empty()
                               ? recorded_page_html(arguments.file, options)
                               : compared_page_html(arguments.file, arguments.second_file, options);
  if (!arguments.out.empty()) {
    write_page(arguments.out, page);
    tell(arguments, "page", arguments.out);
  }
  if (arguments.frames.empty()) return ExitCode::Answered;
  const std::int64_t count = write_page_frames(page, arguments.frames, arguments.frame_options);
  tell(arguments, "frames", std::to_string(count));
  return ExitCode::Answered;
}

// Lets a step take at least as long as it stands for, at a speed of 1; or until it is to stop.
class Pace {
 public:
  explicit Pace(Scalar speed) : speed_(speed) {}

  void begin_step() { begin_ = std::chrono::steady_clock::now(); }

  void end_step(Scalar dt, const std::stop_token& stop) {
    using Seconds = std::chrono::duration<Scalar>;
    const auto end = begin_ + std::chrono::ceil<std::chrono::nanoseconds>(
                                  std::min(Seconds(dt / speed_), Seconds(kLongestStep)));
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, stop, end, [] { return false; });
  }

 private:
  static constexpr Scalar kLongestStep = 3600;  // seconds

  Scalar speed_;
  std::chrono::steady_clock::time_point begin_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
};

AdvanceStatus run_live(const Scene& scene, World& world, LiveServer& server,
                       std::optional<Scalar> speed, const std::stop_token& interrupt) {
  RunFollower follower(scene.options.gravity_W);
  std::optional<Pace> pace;
  if (speed) pace.emplace(*speed);
  std::stop_source stop;
  const std::stop_callback by_user(interrupt, [&] { stop.request_stop(); });
  const std::stop_callback by_page(server.stop_token(), [&] { stop.request_stop(); });
  const std::int64_t count = step_count(scene);
  for (std::int64_t k = 1; k <= count; ++k) {
    if (!server.may_go_on(interrupt)) return AdvanceStatus::Cancelled;
    if (pace) pace->begin_step();
    const Scalar dt = step_end(scene, k, count) - world.time();
    const AdvanceReport report = world.advance(dt, {stop.get_token(), std::nullopt});
    server.publish(follower.follow(report, world));
    if (report.status != AdvanceStatus::Completed) return report.status;
    if (pace) pace->end_step(dt, stop.get_token());
  }
  return AdvanceStatus::Completed;
}

ExitCode view_live(const ViewArguments& arguments) {
  const InterruptGuard interrupt;
  std::optional<Scalar> speed;
  if (arguments.is_paced) {
    speed = arguments.frame_options.time_per_second;
    DYOP_REQUIRE(*speed > 0 && std::isfinite(*speed), "speed must be positive, not ", *speed);
  }
  io_internal::require_other_than(arguments.out, {arguments.file});
  const std::vector<fs::path> directories(arguments.mesh_path.begin(), arguments.mesh_path.end());
  Scene scene = load_scene(arguments.file, directories);
  scene.options.thread_count = arguments.threads;
  World world = make_world(scene);
  PageScene page_scene =
      RunFollower::scene_of(world, scene.title, scene.options.gravity_W, scene.end_time);
  page_scene.scene_file = scene.source;
  for (std::size_t k = 0; k < scene.bodies.size(); ++k) {
    page_scene.bodies[k].shape_name = scene.shape_names[k];
  }
  LiveServer server(PageEncoder(std::move(page_scene)), arguments.live.port);
  server.publish(RunFollower::start(world));
  if (arguments.starts_paused) server.pause();
  tell(arguments, "address", server.address());
  const AdvanceStatus status = run_live(scene, world, server, speed, interrupt.token());
  server.publish(RunFollower::ended(world, status, scene.end_time));
  server.finish();
  if (!arguments.out.empty()) {
    write_page(arguments.out, page_html(scene.title, server.blocks()));
    tell(arguments, "page", arguments.out);
  }
  tell(arguments, "t", std::to_string(world.time()));
  if (!arguments.live.ends_with_run && !interrupt.token().stop_requested()) {
    if (!arguments.is_json) std::cout << "the run is over; Ctrl-C ends the page" << std::endl;
    interrupt.wait();
  }
  return status == AdvanceStatus::Completed || status == AdvanceStatus::StoppedAtImpact
             ? ExitCode::Answered
             : ExitCode::Undecided;
}

ExitCode run_view(const ViewArguments& arguments) {
  if (!has_page()) {
    throw InvalidArgument(
        "this dyop was built without its page: that needs npm packages, see "
        "docs/player.md");
  }
  if (!arguments.second_file.empty() && (arguments.is_live || arguments.checks)) {
    throw InvalidArgument("view shows two files side by side without --live and --check");
  }
  if (arguments.is_live && arguments.checks) {
    throw InvalidArgument("view --check needs a recording, which --live has not");
  }
  if (arguments.is_live) return view_live(arguments);
  if (arguments.out.empty() && arguments.frames.empty()) {
    throw InvalidArgument("view needs -o PAGE.html, --frames, or --live");
  }
  return view_recording(arguments);
}

}  // namespace

void add_view_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<ViewArguments>();
  CLI::App* command = app.add_subcommand("view", "A recorded run as a page for the browser");
  command->footer(kViewExamples);
  command->add_option("FILE", arguments->file, "Recording, or with --live a scene file")
      ->required();
  command->add_option("SECOND", arguments->second_file,
                      "Another recording, to be shown beside the first");
  command->add_flag("--check", arguments->checks,
                    "Prove from the file that bodies kept apart, and show the verdict");
  command->add_option("-o,--out", arguments->out, "Page to write");
  command->add_flag("--live", arguments->is_live,
                    "Simulate FILE and serve its page meanwhile, on this machine only");
  command->add_flag("--paused", arguments->starts_paused,
                    "With --live: the run waits for Resume in the page");
  command->add_flag("--paced", arguments->is_paced,
                    "With --live: no faster than the clock, times --speed");
  add_live_options(*command, arguments->live);
  command->add_option("--frames", arguments->frames,
                      "Pictures at equal steps of time: a directory, or a film FILE.mp4");
  add_frame_options(*command, arguments->frame_options);
  command->add_option("--mesh-path", arguments->mesh_path, "More directories to search for meshes");
  command
      ->add_option("--threads", arguments->threads,
                   "0: as many as the machine has; the result is the same")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command->add_flag("--json", arguments->is_json, "One JSON object a line on stdout");
  command->callback([arguments, &exit_code] { exit_code = run_view(*arguments); });
}

}  // namespace dyop::cli
