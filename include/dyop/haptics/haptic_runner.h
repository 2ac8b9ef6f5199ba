// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "dyop/core/export.h"
#include "dyop/haptics/haptic_session.h"

namespace DYOP_EXPORT dyop {

/// Counts durations from a nanosecond to minutes in bins of an eighth of a doubling: 9 % wide at
/// most. Fixed memory.
class LatencyHistogram {
 public:
  void add(std::chrono::nanoseconds latency);

  std::int64_t count() const { return count_; }
  std::chrono::nanoseconds worst() const { return worst_; }
  /// A duration that at least this part of all did not exceed, to the width of a bin; zero if there
  /// are none.
  /// @throws InvalidArgument unless 0 <= part <= 1.
  std::chrono::nanoseconds quantile(double part) const;

 private:
  static constexpr int kBinsPerDoubling = 8;
  static constexpr int kDoublings = 40;

  std::array<std::int64_t, kDoublings * kBinsPerDoubling> bins_{};
  std::int64_t count_ = 0;
  std::chrono::nanoseconds worst_{0};
};

/// Another mesh that a deforming obstacle goes on as.
struct TissueMesh {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
};

/// What a model of tissue is told of a tool.
struct ToolNews {
  DevicePose device;  ///< of the last tick
  HapticTick tick;    ///< the last one; NotRun before the first
  /// What the obstacle did to the tool in the ticks since the model was last told, force times the
  /// time in which the obstacle moved.
  Vector3 impulse_W = Vector3::Zero();
};

/// What a model of tissue is told when a snapshot is wanted of it.
struct TissueNews {
  std::int64_t number = 1;      ///< of the snapshot, counted from 1
  std::vector<ToolNews> tools;  ///< all of the session
  ObstacleProgress progress;    ///< of the obstacle, at the end of the last tick
  /// Where the tools of that tick touch the obstacle or soon may, without forces.
  std::vector<ToolContactPoint> contacts;
};

/// A model of tissue that answers the tool: SoftTissueModel, or one of your own.
class TissueModel {
 public:
  virtual ~TissueModel() = default;

  /// Which contacts it wants to be told of.
  virtual ContactSearch search() const = 0;
  /// Called before step(): another mesh that takes the place of this snapshot, where the one before
  /// ends, and has other vertices from then on; or nothing. See HapticSession::give_mesh().
  virtual std::optional<TissueMesh> cut(const TissueNews& /*news*/) { return std::nullopt; }
  /// Writes the snapshot that the obstacle shall reach one period after the one before, which the
  /// vertices hold. Called as soon as the session has set out for the one before.
  virtual void step(const TissueNews& news, std::span<Vector3> vertices) = 0;
};

/// Shapes of a deforming obstacle, one after the other.
struct TissueFeed {
  std::size_t obstacle = 0;
  Scalar period = 0.02;  ///< from one snapshot to the next, time of the session
  /// Writes snapshot `number`, counted from 1; the vertices hold the one before.
  std::function<void(std::int64_t number, std::span<Vector3> vertices)> shape;
  /// A text from which a replay can make `shape` and `cut` again; empty: a recording of the run
  /// must store the vertices.
  std::string formula = {};
  /// If not empty, called first: a mesh that takes the place of snapshot `number`, or nothing. See
  /// HapticSession::give_mesh().
  std::function<std::optional<TissueMesh>(std::int64_t number)> cut = {};
  /// In place of `shape` and `cut`: a model that is told of the tool.
  std::shared_ptr<TissueModel> model = {};
  /// If not empty, called with each of the model's snapshots before it is given: to show it.
  std::function<void(std::span<const Vector3> vertices)> given = {};
  /// The same with each of the model's meshes.
  std::function<void(const TissueMesh& mesh)> given_mesh = {};
};

/// Carries the shapes of a feed into a session whose loop is your own: run_session() makes one for
/// each feed. One thread calls offer(), which asks the model; the loop calls tell() after a tick.
class TissueFeeder {
 public:
  /// While no tick runs. Of a feed with a `shape`, that makes its first one. Expects snapshots:
  /// HapticTick::tissue_behind tells how far the feed is behind the session's time.
  /// @param session Must outlive the feeder. Nothing else may give that obstacle snapshots.
  /// @throws InvalidArgument if the obstacle does not deform, the period is not finite and > 0, or
  ///         the feed has neither `shape` nor `model`.
  TissueFeeder(HapticSession& session, const TissueFeed& feed);
  ~TissueFeeder();
  TissueFeeder(TissueFeeder&&) noexcept;
  TissueFeeder& operator=(TissueFeeder&&) noexcept;

  std::size_t obstacle() const;

  /// To be called again and again, some times a period. Makes the next snapshot or mesh as soon as
  /// it may be made, and gives it as soon as the session takes it.
  /// @return Whether one was given. What the model throws comes out; the next call asks it again.
  bool offer();

  /// What a tick was like, for a model. Never waits: news that the model is just reading come with
  /// the next tick's.
  /// @param devices, ticks One for each tool.
  /// @throws InvalidArgument if their numbers differ from that of the tools.
  void tell(std::span<const DevicePose> devices, Scalar dt, std::span<const HapticTick> ticks);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A tool's part of a tick.
struct ToolRecord {
  DevicePose device;
  HapticTick tick;
};

/// One tick with its inputs, as a log wants it.
struct TickRecord {
  std::int64_t number = 0;
  DevicePose device;
  Scalar dt = 0;
  HapticTick tick;
  std::vector<ToolRecord> others = {};  ///< of further tools

  const HapticTick& tick_of(std::size_t tool) const {
    return tool == 0 ? tick : others[tool - 1].tick;
  }
  /// Between tools: one for each pair, (0, 1), (0, 2), (1, 2) and so on, as the second one of the
  /// pair sees it.
  std::vector<ToolClearance> tool_clearances() const;
};

struct RunnerOptions {
  Scalar period = 1e-3;    ///< of a tick, seconds
  std::int64_t ticks = 0;  ///< to run
  /// Longest duration of a tick; none: no limit.
  std::optional<std::chrono::nanoseconds> deadline = {};
  /// Wait for the clock, with tissue and log in threads of their own; otherwise one tick after the
  /// other, with snapshots given as soon as they are due: the same bits in every run without a
  /// deadline.
  bool is_paced = true;
  /// Ask the system for a real-time priority and locked memory, while paced.
  bool wants_real_time = true;
};

struct RunnerReport {
  std::int64_t ticks = 0;
  std::int64_t late_starts = 0;  ///< ticks that started later than a period after their time
  std::int64_t unlogged = 0;     ///< ticks that the sink was too slow for
  LatencyHistogram latency;      ///< of update()
  bool has_real_time_priority = false;
  bool has_locked_memory = false;
  std::string rights;  ///< what the system said, in words
};

/// Runs a session at a fixed rate: the tick in the calling thread, tissue and log in others.
///
/// @param device Called before every tick with its number, in the calling thread.
/// @param tissue Called in the tissue's thread.
/// @param sink   Called for every tick, in order, in the logger's thread; may be empty.
/// @throws InvalidArgument if the period is not finite and > 0, as TissueFeeder, or if two feeds
///         are of one obstacle; what the functions throw ends the run.
RunnerReport run_session(HapticSession& session,
                         const std::function<DevicePose(std::int64_t tick)>& device,
                         const std::vector<TissueFeed>& tissue,
                         const std::function<void(const TickRecord&)>& sink,
                         const RunnerOptions& options, const std::stop_token& stop = {});

/// The same for a session of several tools.
/// @param devices Writes a pose for each.
RunnerReport run_session(
    HapticSession& session,
    const std::function<void(std::int64_t tick, std::span<DevicePose> devices)>& devices,
    const std::vector<TissueFeed>& tissue, const std::function<void(const TickRecord&)>& sink,
    const RunnerOptions& options, const std::stop_token& stop = {});

/// The same with feeders of the session that the caller keeps: the next run goes on where this one
/// ends, and a model keeps its place.
RunnerReport run_session(
    HapticSession& session,
    const std::function<void(std::int64_t tick, std::span<DevicePose> devices)>& devices,
    std::vector<TissueFeeder>& tissue, const std::function<void(const TickRecord&)>& sink,
    const RunnerOptions& options, const std::stop_token& stop = {});

/// Feeders for run_session().
/// @throws InvalidArgument as TissueFeeder, or if two feeds are of one obstacle.
std::vector<TissueFeeder> make_feeders(HapticSession& session,
                                       const std::vector<TissueFeed>& tissue);

}  // namespace dyop
