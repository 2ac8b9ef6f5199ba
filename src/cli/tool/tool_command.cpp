// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "cli/commands.h"
#include "cli/console.h"
#include "cli/page/page_output.h"
#include "cli/recording/recording_tools.h"
#include "cli/tool/tool_device.h"
#include "cli/tool/tool_summary.h"
#include "dyop/core/error.h"
#include "dyop/io/haptic_scene_file.h"
#include "dyop/tissue/soft_tissue.h"
#include "io/file_bytes.h"

namespace dyop::cli {
namespace {

constexpr const char* kToolExamples =
    R"(Runs a haptic tool through the strokes of a scene (docs/formats.md), and says what
happened and how long the ticks took. Without --paced one tick follows the other as fast as it can.

Examples:
  dyop tool examples/surgery/scene.json
  At 1 kHz by the clock, recorded; then as a page, and the recorded inputs run again:
    dyop tool examples/surgery/scene.json --paced -o run.h5
    dyop view run.h5 -o run.html
    dyop tool run.h5 --replay
  At 1 kHz, with a page in the browser that follows it; Ctrl-C ends both:
    dyop tool examples/surgery/scene.json --live
  A device that connects over TCP and sends its pose (OpenIGTLink TRANSFORM), and gets the tool's
  pose and force back; then the same over UDP, the answers to a port of its own:
    dyop tool examples/surgery/scene.json --device tcp:18944
    dyop tool examples/surgery/scene.json --device 18944 --send 127.0.0.1:18945
)";

// A time that a user may ask for; NaN is none.
std::string check_seconds(const std::string& text) {
  constexpr Scalar kMost = 1e6;  // literal: nanoseconds of so many seconds fit into an integer
  Scalar seconds = 0;
  const bool is_number = CLI::detail::lexical_cast(text, seconds);
  if (is_number && seconds > 0 && seconds <= kMost) return {};
  return "expected seconds, more than 0 and at most a million, not '" + text + "'";
}

struct ToolArguments {
  std::string scene;
  std::string recording;
  bool is_replay = false;
  Scalar seconds = 0;
  Scalar deadline = 0;
  bool is_paced = false;
  std::vector<std::string> devices;  // by tool
  std::string listen = "127.0.0.1";
  std::vector<std::string> receivers;
  bool is_live = false;
  LivePage live;
};

// What each stroke was like.
class Report {
 public:
  explicit Report(const HapticRun& run) : run_(run), strokes_(run.strokes.size()) {}

  void add(const TickRecord& record) {
    strokes_[run_.stroke_at(record.number)].add(record);
    energies_ = {record.tick.energy_returned};
    for (const ToolRecord& other : record.others) energies_.push_back(other.tick.energy_returned);
  }

  void print() const {
    for (std::size_t k = 0; k < strokes_.size(); ++k) {
      if (strokes_[k].ticks() == 0) continue;
      std::printf("%s: %lld ticks\n", printable(run_.strokes[k].name).c_str(),
                  static_cast<long long>(strokes_[k].ticks()));
      print_summary(strokes_[k], run_.scene);
    }
    std::printf("energy returned to the hand%s:", energies_.size() > 1 ? "s" : "");
    for (std::size_t k = 0; k < energies_.size(); ++k) {
      std::printf("%s %.4g", k > 0 ? "," : "", energies_[k]);
    }
    std::printf("\n");
  }

 private:
  const HapticRun& run_;
  std::vector<RunSummary> strokes_;
  std::vector<Scalar> energies_{0};  // by tool
};

void print_timing(const RunnerReport& report) {
  std::printf("%lld ticks; %s\n", static_cast<long long>(report.ticks), report.rights.c_str());
  print_latency(report.latency);
  if (report.late_starts > 0) {
    std::printf("%lld ticks started more than a period late\n",
                static_cast<long long>(report.late_starts));
  }
  if (report.unlogged > 0) {
    std::printf("%lld ticks are missing in report and recording\n",
                static_cast<long long>(report.unlogged));
  }
}

// What came of the cuts of elastic tissue.
void print_cuts(const HapticRun& run) {
  constexpr const char* kWords[] = {"not made", "missed", "made", "not made, as nothing were left",
                                    "not made, as the tissue crosses itself there"};
  for (const TissueFeed& feed : run.tissue) {
    const auto* model = dynamic_cast<const SoftTissueModel*>(feed.model.get());
    if (model == nullptr) continue;
    for (std::size_t k = 0; k < model->cut_reports().size(); ++k) {
      const CutReport& report = model->cut_reports()[k];
      std::printf("%s: cut %zu %s; parts: %zu\n",
                  printable(run.scene.obstacles[feed.obstacle].name).c_str(), k + 1,
                  kWords[std::size_t(report.status)], report.parts);
    }
  }
}

// Where poses come from, and where ticks go.
struct ToolLinks {
  std::vector<std::unique_ptr<LinkedDevice>> devices;  // by tool, or none
  std::vector<std::unique_ptr<LinkedOutput>> receivers;
  std::unique_ptr<ToolOutput> recording;
  std::unique_ptr<LiveTool> live;
  std::vector<DeviceMapping> to_hand;  // of the devices' motions, or none

  void send(std::size_t tool, const HapticTick& tick) const {
    const ToolWrench felt = to_hand.empty() ? tick.wrench : to_hand[tool].to_hand(tick.wrench);
    if (!devices.empty()) devices[tool]->answer(tick, felt);
    if (!receivers.empty()) receivers[tool]->send(tick, felt);
  }
};

ToolLinks open_links(const ToolArguments& arguments, const HapticRun& run, HapticSession& session) {
  ToolLinks links;
  const std::vector<HapticTool> tools = run.scene.tools();
  for (std::size_t k = 0; k < arguments.devices.size(); ++k) {
    links.devices.push_back(
        std::make_unique<LinkedDevice>(arguments.devices[k], arguments.listen, run, tools[k]));
    std::printf("device: %s\n", printable(links.devices[k]->name()).c_str());
    std::fflush(stdout);
    if (run.mapping) links.to_hand.emplace_back(*run.mapping, tools[k].X_WT);
  }
  for (const std::string& receiver : arguments.receivers) {
    links.receivers.push_back(std::make_unique<LinkedOutput>(receiver));
  }
  if (!arguments.recording.empty()) {
    links.recording = make_tool_output(arguments.recording, run, session);
  }
  if (arguments.is_live) {
    links.live = make_live_tool(run, arguments.live.port);
    std::printf("address: %s\n", links.live->address().c_str());
    std::fflush(stdout);
  }
  return links;
}

// With what models answer shown by the page.
std::vector<TissueFeed> shown_feeds(const HapticRun& run, const ToolLinks& links) {
  std::vector<TissueFeed> feeds = run.tissue;
  for (TissueFeed& feed : feeds) {
    if (!feed.model || !links.live) continue;
    feed.given = [&links, obstacle = feed.obstacle](std::span<const Vector3> vertices) {
      links.live->add_snapshot(obstacle, vertices);
    };
    feed.given_mesh = [&links, obstacle = feed.obstacle](const TissueMesh& mesh) {
      links.live->add_cut(obstacle, mesh);
    };
  }
  return feeds;
}

// Records the run, also one that an exception ends.
RunnerReport run_recorded(HapticSession& session, const HapticRun& run, Report& report,
                          const ToolLinks& links, const std::stop_token& stop) {
  ToolOutput* output = links.recording.get();
  try {
    const RunnerReport timing = run_session(
        session,
        [&](std::int64_t tick, std::span<DevicePose> devices) {
          for (std::size_t k = 0; k < devices.size(); ++k) {
            devices[k] = links.devices.empty() ? run.device(tick, k) : links.devices[k]->pose();
          }
        },
        shown_feeds(run, links),
        [&](const TickRecord& record) {
          report.add(record);
          links.send(0, record.tick);
          for (std::size_t k = 0; k < record.others.size(); ++k) {
            links.send(k + 1, record.others[k].tick);
          }
          if (output != nullptr) output->add(record);
          if (links.live) links.live->add(record);
        },
        run.runner, stop);
    if (output != nullptr) output->finish(timing);
    return timing;
  } catch (const std::exception& error) {
    if (output != nullptr) output->fail(error.what());
    if (links.live) links.live->end(error.what());
    throw;
  }
}

// The run with whatever stops it, and why it ended.
RunnerReport run_linked(HapticSession& session, const HapticRun& run, Report& report,
                        const ToolLinks& links, const std::stop_token& interrupt) {
  if (!links.live) return run_recorded(session, run, report, links, interrupt);
  std::stop_source stop;
  const std::stop_callback by_user(interrupt, [&] { stop.request_stop(); });
  const std::stop_callback by_page(links.live->stop_token(), [&] { stop.request_stop(); });
  RunnerReport timing = run_recorded(session, run, report, links, stop.get_token());
  const std::string ticks = std::to_string(timing.ticks) + " ticks";
  if (timing.ticks == run.runner.ticks) {
    links.live->end("completed, " + ticks);
  } else {
    links.live->end("stopped by " +
                    std::string(interrupt.stop_requested() ? "Ctrl-C" : "its page") + " after " +
                    ticks);
  }
  return timing;
}

void require_one_each(const char* option, const std::vector<std::string>& given,
                      std::size_t tools) {
  DYOP_REQUIRE(given.empty() || given.size() == tools, option,
               " must be given once for each tool, ", tools, " times, not ", given.size());
}

ExitCode run_tool(const ToolArguments& arguments) {
  if (arguments.is_replay) return replay_tool(arguments.scene);
  require_recording_name(arguments.recording);
  io_internal::require_other_than(arguments.recording, {arguments.scene});
  const InterruptGuard interrupt;
  HapticRun run = load_haptic_run(arguments.scene);
  const std::size_t tools = 1 + run.scene.more_tools.size();
  require_one_each("--device", arguments.devices, tools);
  require_one_each("--send", arguments.receivers, tools);
  run.runner.is_paced = arguments.is_paced || arguments.is_live || !arguments.devices.empty();
  if (!arguments.devices.empty()) {  // for the report
    const DevicePose pose(run.scene.X_WT);
    run.strokes = {{"device", {{0, pose}, {1, pose}}}};
  }
  if (arguments.seconds > 0) {
    run.runner.ticks = std::llround(arguments.seconds / run.runner.period);
  }
  if (arguments.deadline > 0) {
    run.runner.deadline = std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<Scalar>(arguments.deadline));
  }
  HapticSession session(run.scene, run.options);
  const ToolLinks links = open_links(arguments, run, session);
  Report report(run);
  const RunnerReport timing = run_linked(session, run, report, links, interrupt.token());
  report.print();
  print_cuts(run);
  std::printf("the coupling is %spassive at this rate\n", session.is_passive() ? "" : "not ");
  print_timing(timing);
  for (const auto& device : links.devices) {
    std::printf("%lld poses of the device were used\n", static_cast<long long>(device->messages()));
  }
  if (links.recording) {
    std::printf("recording: %zu bytes a tick\n", links.recording->bytes_per_tick());
  }
  if (links.live && !arguments.live.ends_with_run && !interrupt.token().stop_requested()) {
    std::printf("the run is over; Ctrl-C ends the page\n");
    std::fflush(stdout);
    interrupt.wait();
  }
  return timing.ticks == run.runner.ticks ? ExitCode::Answered : ExitCode::Undecided;
}

}  // namespace

void add_tool_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<ToolArguments>();
  CLI::App* command = app.add_subcommand("tool", "Run a haptic tool among tissue");
  command->footer(kToolExamples);
  command->add_option("SCENE", arguments->scene, "Scene of a tool, JSON; with --replay a recording")
      ->required();
  command->add_option("-o,--out", arguments->recording, "Recording of all ticks, HDF5");
  command->add_flag("--replay", arguments->is_replay,
                    "Run the inputs of a recording again and compare every bit");
  command->add_option("--seconds", arguments->seconds, "Instead of the scene's duration")
      ->check(check_seconds);
  command->add_flag("--paced", arguments->is_paced, "By the clock, with threads of their own");
  command
      ->add_option("--deadline", arguments->deadline,
                   "Seconds a tick may take, instead of the scene's")
      ->check(check_seconds);
  command
      ->add_option("--device", arguments->devices,
                   "TRANSFORM messages of OpenIGTLink in place of the strokes, by the clock: "
                   "PORT to listen on over UDP, tcp:PORT over TCP, or tcp:ADDRESS:PORT to "
                   "connect to; port 0: any that is free; once for each tool")
      ->allow_extra_args(false);
  command->add_option("--listen", arguments->listen,
                      "Address of this machine on which --device listens: by default only this "
                      "machine is heard; 0.0.0.0: every network");
  command
      ->add_option("--send", arguments->receivers,
                   "ADDRESS:PORT that gets the tool's pose and the force as such messages, "
                   "over UDP; over TCP the device gets them anyway; once for each tool")
      ->allow_extra_args(false);
  command->add_flag("--live", arguments->is_live,
                    "By the clock, with a page that follows the run, on this machine only");
  add_live_options(*command, arguments->live);
  command->callback([arguments, &exit_code] { exit_code = run_tool(*arguments); });
}

}  // namespace dyop::cli
