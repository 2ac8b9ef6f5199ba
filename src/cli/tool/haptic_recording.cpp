// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/haptic_recording.h"

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/tool/tool_summary.h"
#include "dyop/io/haptic_replay.h"
#include "dyop/view/live_server.h"
#include "dyop/view/tool_follower.h"

namespace dyop::cli {
namespace {

class Hdf5ToolOutput final : public ToolOutput {
 public:
  Hdf5ToolOutput(const std::filesystem::path& file, const HapticRun& run, HapticSession& session)
      : writer_(file, {run.title, run.text, run.runner.period, ""}, session, run.tissue) {}

  void add(const TickRecord& record) override { writer_.add(record); }
  void finish(const RunnerReport& report) override { writer_.finish(report); }
  void fail(const std::string& error) override { writer_.fail(error); }
  std::size_t bytes_per_tick() const override { return writer_.bytes_per_tick(); }

 private:
  HapticRecordingWriter writer_;
};

class ServedTool final : public LiveTool {
 public:
  ServedTool(const HapticRun& run, int port)
      : server_(PageEncoder(ToolFollower::scene_of(run)), port),
        follower_(run, [this](PageSpan span) { server_.publish(std::move(span)); }) {}

  std::string address() const override { return server_.address(); }
  std::stop_token stop_token() const override { return server_.stop_token(); }
  void add(const TickRecord& record) override { follower_.add(record); }
  void add_snapshot(std::size_t obstacle, std::span<const Vector3> vertices) override {
    follower_.add_snapshot(obstacle, vertices);
  }
  void add_cut(std::size_t obstacle, const TissueMesh& mesh) override {
    follower_.add_cut(obstacle, mesh);
  }
  void end(const std::string& why) override {
    follower_.finish(why);
    server_.finish();
  }

 private:
  LiveServer server_;
  ToolFollower follower_;
};

struct RecordedSummary {
  RunSummary run;
  LatencyHistogram latency;
  Scalar time = 0;

  void add(const RecordedTick& tick) {
    run.tools.resize(1 + tick.others.size());
    run.tools[0].add(tick);
    run.tools[0].add_tissue(tick);
    for (std::size_t k = 0; k < tick.others.size(); ++k) run.tools[k + 1].add(tick.others[k]);
    run.between.add_clearances(tick.tool_clearances);
    latency.add(tick.latency);
    time += tick.time_passed();
  }
};

RecordedSummary summarize(const HapticRecordingReader& reader) {
  RecordedSummary summary;
  reader.for_each_tick([&](const RecordedTick& tick) { summary.add(tick); });
  summary.run.tools.resize(1 + reader.scene().more_tools.size());  // also without a tick
  return summary;
}

std::string end_of(const HapticRecordingReader& reader) {
  if (!reader.end()) return "not ended: still running, or killed";
  return reader.end()->error.empty() ? "completed" : "Error: " + reader.end()->error;
}

void add_statuses(const ToolSummary& tool, nlohmann::ordered_json& json) {
  json["statuses"] = nlohmann::ordered_json::object();
  for (const auto& [status, count] : tool.statuses) json["statuses"][words_of(status)] = count;
  json["largest_force"] = tool.largest_force;
}

void print_json(const HapticRecordingReader& reader, const RecordedSummary& summary,
                std::uintmax_t bytes) {
  nlohmann::ordered_json json;
  json["title"] = reader.header().title;
  json["version"] = reader.header().version;
  json["end"] = end_of(reader);
  json["is_complete"] = reader.end().has_value();
  json["ticks"] = reader.tick_count();
  json["time"] = summary.time;
  json["bytes_per_tick"] = reader.bytes_per_tick();
  const std::vector<ToolSummary>& tools = summary.run.tools;
  add_statuses(tools[0], json);
  json["tissue_stopped"] = tools[0].tissue_stopped;
  json["longest_tissue_lag"] = tools[0].longest_lag;
  json["tissue_behind"] = tools[0].farthest_behind;
  json["obstacles"] = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < reader.scene().obstacles.size(); ++k) {
    const ToolObstacle& obstacle = reader.scene().obstacles[k];
    nlohmann::ordered_json line{{"name", obstacle.name}, {"margin", obstacle.margin}};
    if (reader.tick_count() > 0) line["least_clearance"] = tools[0].least_clearance[k];
    json["obstacles"].push_back(line);
  }
  for (std::size_t k = 1; k < tools.size(); ++k) {
    nlohmann::ordered_json tool;
    add_statuses(tools[k], tool);
    tool["least_clearances"] = tools[k].least_clearance;
    json["more_tools"].push_back(tool);
  }
  if (tools.size() > 1) json["least_between_tools"] = summary.run.between.least_clearance;
  json["latency_ns"] = {{"median", summary.latency.quantile(0.5).count()},
                        {"p999", summary.latency.quantile(0.999).count()},
                        {"worst", summary.latency.worst().count()}};
  json["bytes"] = bytes;
  std::cout << json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) << '\n';
}

}  // namespace

std::unique_ptr<ToolOutput> make_tool_output(const std::filesystem::path& file,
                                             const HapticRun& run, HapticSession& session) {
  return std::make_unique<Hdf5ToolOutput>(file, run, session);
}

std::unique_ptr<LiveTool> make_live_tool(const HapticRun& run, int port) {
  return std::make_unique<ServedTool>(run, port);
}

ExitCode replay_tool(const std::filesystem::path& file) {
  const HapticReplay replay = replay_haptic_recording(file);
  std::printf("%lld ticks, %lld different", static_cast<long long>(replay.ticks),
              static_cast<long long>(replay.differing));
  if (replay.first_difference) {
    std::printf(", the first is number %lld", static_cast<long long>(*replay.first_difference));
  }
  std::printf("\n");
  if (replay.recorded_by != DYOP_VERSION) {
    std::printf("recorded by dyop %s, replayed by %s: other versions may compute other bits\n",
                replay.recorded_by.c_str(), DYOP_VERSION);
  }
  return replay.differing == 0 ? ExitCode::Answered : ExitCode::Different;
}

ExitCode print_haptic_recording(const std::filesystem::path& file, bool is_json) {
  const HapticRecordingReader reader(file);
  const RecordedSummary summary = summarize(reader);
  const std::uintmax_t bytes = std::filesystem::file_size(file);
  if (is_json) {
    print_json(reader, summary, bytes);
    return ExitCode::Answered;
  }
  std::printf("run of a tool     %s\n", reader.header().title.c_str());
  std::printf("ended             %s\n", end_of(reader).c_str());
  std::printf("ticks             %lld in %.9g s, %zu bytes each\n",
              static_cast<long long>(reader.tick_count()), summary.time, reader.bytes_per_tick());
  if (reader.end() && reader.end()->unlogged > 0) {
    std::printf("missing           %lld ticks: it cannot be replayed\n",
                static_cast<long long>(reader.end()->unlogged));
  }
  if (reader.tick_count() > 0) print_summary(summary.run, reader.scene());
  print_latency(summary.latency);
  std::printf("size              %.4g MiB\n", double(bytes) / (1 << 20));
  return ExitCode::Answered;
}

}  // namespace dyop::cli
