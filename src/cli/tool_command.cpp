// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "dyop/tool_io/tool_log.h"
#include "dyop/tool_io/tool_scene_file.h"

namespace dyop::cli {
namespace {

constexpr const char* kToolExamples =
    R"(Runs a haptic tool through the strokes of a scene (docs/tool-scene-format.md), and says what
happened and how long the ticks took. Without --paced one tick follows the other as fast as it can.

Examples:
  dyop tool examples/surgery/scene.json
  At 1 kHz by the clock, with a log, and the log run again:
    dyop tool examples/surgery/scene.json --paced --log run.dyoptool
    dyop tool examples/surgery/scene.json --replay run.dyoptool
)";

struct ToolArguments {
  std::string scene;
  std::string log;
  std::string replay;
  Scalar seconds = 0;
  bool is_paced = false;
};

// What a stroke was like.
struct StrokeSummary {
  std::int64_t ticks = 0;
  std::map<ToolStatus, std::int64_t> statuses;
  Scalar largest_force = 0;
  Scalar longest_lag = 0;
  std::vector<Scalar> least_clearance;
};

const char* words_of(ToolStatus status) {
  switch (status) {
    case ToolStatus::NotRun:
      return "not run";
    case ToolStatus::Free:
      return "free";
    case ToolStatus::Held:
      return "held by contact";
    case ToolStatus::Blocked:
      return "behind the device";
    case ToolStatus::Deadline:
      return "cut off by the deadline";
    case ToolStatus::Trapped:
      return "trapped, tissue stopped";
    case ToolStatus::Recovering:
      return "leaving a margin";
    case ToolStatus::Overlapping:
      return "leaving tissue";
    case ToolStatus::InvalidInput:
      return "bad input";
  }
  return "";
}

class Report {
 public:
  explicit Report(const ToolRun& run) : run_(run), strokes_(run.strokes.size()) {}

  void add(const TickRecord& record) {
    StrokeSummary& stroke = strokes_[run_.stroke_at(record.number)];
    const ToolTick& tick = record.tick;
    stroke.least_clearance.resize(tick.clearances.size(), kInfinity);
    ++stroke.ticks;
    ++stroke.statuses[tick.status];
    stroke.largest_force = std::max(stroke.largest_force, tick.wrench.force_W.norm());
    stroke.longest_lag = std::max(stroke.longest_lag, tick.tissue_lag);
    for (std::size_t k = 0; k < tick.clearances.size(); ++k) {
      stroke.least_clearance[k] = std::min(stroke.least_clearance[k], tick.clearances[k].lower);
    }
    energy_ = tick.energy_returned;
  }

  void print() const {
    for (std::size_t k = 0; k < strokes_.size(); ++k) print_stroke(k);
    std::printf("energy returned to the hand: %.4g\n", energy_);
  }

 private:
  void print_stroke(std::size_t number) const {
    const StrokeSummary& stroke = strokes_[number];
    if (stroke.ticks == 0) return;
    std::printf("%s: %lld ticks\n", run_.strokes[number].name.c_str(),
                static_cast<long long>(stroke.ticks));
    for (const auto& [status, count] : stroke.statuses) {
      std::printf("  %s: %.1f %%\n", words_of(status),
                  100.0 * double(count) / double(stroke.ticks));
    }
    std::printf("  largest force %.3g", stroke.largest_force);
    if (stroke.longest_lag > 0) std::printf(", tissue behind by %.3g s", stroke.longest_lag);
    std::printf("\n");
    for (std::size_t k = 0; k < stroke.least_clearance.size(); ++k) {
      const ToolObstacle& obstacle = run_.scene.obstacles[k];
      std::printf("  never nearer than %.3g to %s", stroke.least_clearance[k],
                  obstacle.name.c_str());
      if (obstacle.margin > 0) std::printf(" (margin %.3g)", obstacle.margin);
      std::printf("\n");
    }
  }

  const ToolRun& run_;
  std::vector<StrokeSummary> strokes_;
  Scalar energy_ = 0;
};

void print_latency(const RunnerReport& report) {
  const auto microseconds = [](std::chrono::nanoseconds time) {
    return double(time.count()) / 1e3;
  };
  std::printf("%lld ticks; %s\n", static_cast<long long>(report.ticks), report.rights.c_str());
  std::printf("latency in us: median %.0f, 99 %% %.0f, 99.9 %% %.0f, worst %.0f\n",
              microseconds(report.latency.quantile(0.5)),
              microseconds(report.latency.quantile(0.99)),
              microseconds(report.latency.quantile(0.999)), microseconds(report.latency.worst()));
  if (report.late_starts > 0) {
    std::printf("%lld ticks started more than a period late\n",
                static_cast<long long>(report.late_starts));
  }
  if (report.unlogged > 0) {
    std::printf("%lld ticks are missing in report and log\n",
                static_cast<long long>(report.unlogged));
  }
}

ExitCode replay(const ToolArguments& arguments) {
  const ToolReplay replay = replay_tool_log(arguments.replay, arguments.scene);
  std::printf("%lld ticks, %lld different", static_cast<long long>(replay.ticks),
              static_cast<long long>(replay.differing));
  if (replay.first_difference) {
    std::printf(", the first is number %lld", static_cast<long long>(*replay.first_difference));
  }
  std::printf("\n");
  return replay.differing == 0 ? ExitCode::Answered : ExitCode::Different;
}

ExitCode run_tool(const ToolArguments& arguments) {
  if (!arguments.replay.empty()) return replay(arguments);
  const InterruptGuard interrupt;
  ToolRun run = load_tool_run(arguments.scene);
  run.runner.is_paced = arguments.is_paced;
  if (arguments.seconds > 0) {
    run.runner.ticks = std::llround(arguments.seconds / run.runner.period);
  }
  ToolSession session(run.scene, run.options);
  std::unique_ptr<ToolLogWriter> log;
  if (!arguments.log.empty()) log = std::make_unique<ToolLogWriter>(arguments.log, run);
  Report report(run);
  const RunnerReport timing = run_session(
      session, [&](std::int64_t tick) { return run.device(tick); }, run.tissue,
      [&](const TickRecord& record) {
        report.add(record);
        if (log) log->add(record);
      },
      run.runner, interrupt.token());
  if (log) log->close();
  report.print();
  std::printf("the coupling is %spassive at this rate\n", session.is_passive() ? "" : "not ");
  print_latency(timing);
  if (log && timing.ticks > 0) {
    std::printf("log: %.0f bytes a tick\n", double(log->bytes_of_ticks()) / double(timing.ticks));
  }
  return timing.ticks == run.runner.ticks ? ExitCode::Answered : ExitCode::Undecided;
}

}  // namespace

void add_tool_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<ToolArguments>();
  CLI::App* command = app.add_subcommand("tool", "Run a haptic tool among tissue");
  command->footer(kToolExamples);
  command->add_option("SCENE", arguments->scene, "Scene of a tool, JSON")->required();
  command->add_option("--log", arguments->log, "File for the log of all ticks");
  command->add_option("--replay", arguments->replay, "Log to run again and compare");
  command->add_option("--seconds", arguments->seconds, "Instead of the scene's duration")
      ->check(CLI::PositiveNumber);
  command->add_flag("--paced", arguments->is_paced, "By the clock, with threads of their own");
  command->callback([arguments, &exit_code] { exit_code = run_tool(*arguments); });
}

}  // namespace dyop::cli
