// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_runner.h"

#include <atomic>
#include <exception>
#include <thread>

#include "dyop/core/error.h"
#include "haptics/runner/real_time.h"
#include "haptics/runner/record_ring.h"

namespace dyop {
namespace {

using Clock = std::chrono::steady_clock;

// Ticks that the log may be behind: two seconds at 1 kHz.
constexpr std::size_t kWaitingTicks = 2048;

// How often the threads beside the loop look for work.
constexpr std::chrono::microseconds kIdle{500};

// A feed and the snapshot or mesh it has prepared.
class Feeder {
 public:
  Feeder(HapticSession& session, const TissueFeed& feed)
      : session_(session), feed_(feed), vertices_(session.tissue_vertices(feed.obstacle)) {
    prepare();
  }

  void offer() {
    const std::size_t obstacle = feed_.obstacle;
    const bool is_taken = mesh_ ? session_.give_mesh(obstacle, mesh_->vertices, mesh_->triangles)
                                : session_.give_snapshot(obstacle, vertices_, feed_.period);
    if (!is_taken) return;
    ++number_;
    prepare();
  }

 private:
  void prepare() {
    mesh_ = feed_.cut ? feed_.cut(number_) : std::nullopt;
    if (mesh_) {
      vertices_ = mesh_->vertices;
    } else {
      feed_.shape(number_, vertices_);
    }
  }

  HapticSession& session_;
  const TissueFeed& feed_;
  std::vector<Vector3> vertices_;
  std::optional<TissueMesh> mesh_;
  std::int64_t number_ = 1;
};

// A thread that works until stopped, and keeps the exception that its work throws.
class Worker {
 public:
  template <typename Work>
  explicit Worker(Work work)
      : thread_([this, work](const std::stop_token& stop) {
          try {
            while (!stop.stop_requested()) {
              work();
              std::this_thread::sleep_for(kIdle);
            }
            work();
          } catch (...) {
            failure_ = std::current_exception();
            has_failed_.store(true, std::memory_order_release);
          }
        }) {}

  bool has_failed() const { return has_failed_.load(std::memory_order_acquire); }
  void finish() {
    thread_.request_stop();
    thread_.join();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::atomic<bool> has_failed_{false};
  std::exception_ptr failure_;
  std::jthread thread_;
};

struct Loop {
  HapticSession& session;
  const std::function<DevicePose(std::int64_t)>& device;
  const RunnerOptions& options;
  RunnerReport& report;

  void tick(std::int64_t number, TickRecord& record) const {
    record.number = number;
    record.device = device(number);
    record.dt = options.period;
    HapticSession::Deadline deadline;
    if (options.deadline) deadline = Clock::now() + *options.deadline;
    session.update(record.device, record.dt, deadline);
    report.latency.add(session.last().latency);
    ++report.ticks;
  }
};

void run_unpaced(const Loop& loop, std::vector<Feeder>& feeders,
                 const std::function<void(const TickRecord&)>& sink, const std::stop_token& stop) {
  TickRecord record;
  for (std::int64_t k = 0; k < loop.options.ticks && !stop.stop_requested(); ++k) {
    for (Feeder& feeder : feeders) feeder.offer();
    loop.tick(k, record);
    if (!sink) continue;
    record.tick = loop.session.last();
    sink(record);
  }
}

void run_paced(const Loop& loop, std::vector<Feeder>& feeders,
               const std::function<void(const TickRecord&)>& sink, const std::stop_token& stop) {
  haptics_internal::RecordRing ring(kWaitingTicks);
  Worker tissue([&] {
    for (Feeder& feeder : feeders) feeder.offer();
  });
  Worker logger([&] {
    for (; const TickRecord* record = ring.front(); ring.pop()) {
      if (sink) sink(*record);
    }
  });
  const haptics_internal::RealTime rights(loop.options.wants_real_time);
  loop.report.has_real_time_priority = rights.has_priority();
  loop.report.has_locked_memory = rights.has_locked_memory();
  loop.report.rights = rights.words();
  const auto period =
      std::chrono::nanoseconds(std::int64_t(loop.options.period * 1e9));  // nanoseconds
  const auto start = Clock::now();
  TickRecord unlogged;
  for (std::int64_t k = 0; k < loop.options.ticks && !stop.stop_requested(); ++k) {
    if (tissue.has_failed() || logger.has_failed()) break;
    const auto due = start + k * period;
    std::this_thread::sleep_until(due);
    loop.report.late_starts += Clock::now() > due + period;
    TickRecord* place = ring.free_place();
    loop.tick(k, place ? *place : unlogged);
    if (place) {
      place->tick = loop.session.last();
      ring.push();
    } else {
      ++loop.report.unlogged;
    }
  }
  tissue.finish();
  logger.finish();
}

}  // namespace

RunnerReport run_session(HapticSession& session,
                         const std::function<DevicePose(std::int64_t tick)>& device,
                         const std::vector<TissueFeed>& tissue,
                         const std::function<void(const TickRecord&)>& sink,
                         const RunnerOptions& options, const std::stop_token& stop) {
  DYOP_REQUIRE(options.period > 0 && options.period < kInfinity,
               "run_session: period must be finite and > 0, not ", options.period);
  std::vector<Feeder> feeders;
  for (const TissueFeed& feed : tissue) feeders.emplace_back(session, feed);
  RunnerReport report;
  const Loop loop{session, device, options, report};
  if (options.is_paced) {
    run_paced(loop, feeders, sink, stop);
  } else {
    report.rights = "not paced by the clock";
    run_unpaced(loop, feeders, sink, stop);
  }
  return report;
}

}  // namespace dyop
