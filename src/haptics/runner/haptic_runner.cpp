// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_runner.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <exception>
#include <string>
#include <thread>
#include <vector>

#include "dyop/core/error.h"
#include "haptics/runner/record_ring.h"

namespace dyop::haptics_internal {

/// Gives the calling thread real-time priority and locks the process's memory, where the system
/// allows it, until destroyed.
class RealTime {
 public:
  explicit RealTime(bool is_wanted);
  ~RealTime();
  RealTime(const RealTime&) = delete;
  RealTime& operator=(const RealTime&) = delete;

  bool has_priority() const { return has_priority_; }
  bool has_locked_memory() const { return has_locked_memory_; }
  /// What was granted, and why not.
  const std::string& words() const { return words_; }

 private:
  bool has_priority_ = false;
  bool has_locked_memory_ = false;
  std::string words_;
};

}  // namespace dyop::haptics_internal

namespace dyop {
namespace {

using Clock = std::chrono::steady_clock;

// A thread that works until stopped, and keeps the exception that its work throws.
class Worker {
 public:
  template <typename Work>
  explicit Worker(Work work)
      : thread_([this, work](const std::stop_token& stop) {
          try {
            while (!stop.stop_requested()) {
              work();
              std::this_thread::sleep_for(haptics_internal::kIdle);
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

using DeviceSource = std::function<void(std::int64_t tick, std::span<DevicePose> devices)>;

struct Loop {
  HapticSession& session;
  std::vector<TissueFeeder>& feeders;
  const DeviceSource& source;
  const RunnerOptions& options;
  RunnerReport& report;
  std::vector<DevicePose> devices = std::vector<DevicePose>(session.tool_count());

  void tick(std::int64_t number, TickRecord& record) {
    source(number, devices);
    HapticSession::Deadline deadline;
    if (options.deadline) deadline = Clock::now() + *options.deadline;
    const auto ticks = session.update(devices, options.period, deadline);
    haptics_internal::put_record(number, devices, options.period, ticks, record);
    report.latency.add(record.tick.latency);
    ++report.ticks;
    for (TissueFeeder& feeder : feeders) feeder.tell(devices, options.period, ticks);
  }
};

void run_unpaced(Loop& loop, const std::function<void(const TickRecord&)>& sink,
                 const std::stop_token& stop) {
  TickRecord record;
  for (std::int64_t k = 0; k < loop.options.ticks && !stop.stop_requested(); ++k) {
    for (TissueFeeder& feeder : loop.feeders) feeder.offer();
    loop.tick(k, record);
    if (sink) sink(record);
  }
}

void run_paced(Loop& loop, const std::function<void(const TickRecord&)>& sink,
               const std::stop_token& stop) {
  haptics_internal::RecordRing ring(haptics_internal::kWaitingTicks);
  Worker tissue([&] {
    for (TissueFeeder& feeder : loop.feeders) feeder.offer();
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
      ring.push();
    } else {
      ++loop.report.unlogged;
    }
  }
  tissue.finish();
  logger.finish();
}

}  // namespace

std::vector<ToolClearance> TickRecord::tool_clearances() const {
  std::vector<ToolClearance> pairs;
  for (std::size_t k = 0; k < others.size(); ++k) {
    const std::vector<ToolClearance>& all = others[k].tick.tool_clearances;
    pairs.insert(pairs.end(), all.begin(), all.begin() + std::ptrdiff_t(k) + 1);
  }
  return pairs;
}

RunnerReport run_session(HapticSession& session,
                         const std::function<DevicePose(std::int64_t tick)>& device,
                         const std::vector<TissueFeed>& tissue,
                         const std::function<void(const TickRecord&)>& sink,
                         const RunnerOptions& options, const std::stop_token& stop) {
  return run_session(
      session,
      [&](std::int64_t tick, std::span<DevicePose> devices) {
        DYOP_REQUIRE(devices.size() == 1, "run_session: one device for ", devices.size(), " tools");
        devices[0] = device(tick);
      },
      tissue, sink, options, stop);
}

RunnerReport run_session(HapticSession& session, const DeviceSource& devices,
                         const std::vector<TissueFeed>& tissue,
                         const std::function<void(const TickRecord&)>& sink,
                         const RunnerOptions& options, const std::stop_token& stop) {
  std::vector<TissueFeeder> feeders = make_feeders(session, tissue);
  return run_session(session, devices, feeders, sink, options, stop);
}

RunnerReport run_session(HapticSession& session, const DeviceSource& devices,
                         std::vector<TissueFeeder>& feeders,
                         const std::function<void(const TickRecord&)>& sink,
                         const RunnerOptions& options, const std::stop_token& stop) {
  DYOP_REQUIRE(options.period > 0 && options.period < kInfinity,
               "run_session: period must be finite and > 0, not ", options.period);
  RunnerReport report;
  Loop loop{session, feeders, devices, options, report};
  if (options.is_paced) {
    run_paced(loop, sink, stop);
  } else {
    report.rights = "not paced by the clock";
    run_unpaced(loop, sink, stop);
  }
  return report;
}

void LatencyHistogram::add(std::chrono::nanoseconds latency) {
  const double doublings = std::log2(std::max(1.0, double(latency.count())));
  const auto bin = std::size_t(doublings * kBinsPerDoubling);
  ++bins_[std::min(bin, bins_.size() - 1)];
  ++count_;
  worst_ = std::max(worst_, latency);
}

std::chrono::nanoseconds LatencyHistogram::quantile(double part) const {
  DYOP_REQUIRE(part >= 0 && part <= 1, "LatencyHistogram: the part must be in [0, 1], not ", part);
  const double wanted = part * double(count_);
  std::int64_t sum = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    sum += bins_[bin];
    if (sum == 0 || double(sum) < wanted) continue;
    const double upper = std::exp2(double(bin + 1) / kBinsPerDoubling);
    return std::min(worst_, std::chrono::nanoseconds(std::int64_t(upper)));
  }
  return worst_;
}

}  // namespace dyop

#ifdef __linux__
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#endif

namespace dyop::haptics_internal {

#ifdef __linux__

RealTime::RealTime(bool is_wanted) {
  if (!is_wanted) {
    words_ = "no real-time rights were asked for";
    return;
  }
  sched_param priority{};
  priority.sched_priority = sched_get_priority_max(SCHED_FIFO) / 2;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  has_priority_ = error == 0;
  words_ = has_priority_ ? "real-time priority (SCHED_FIFO)"
                         : std::string("no real-time priority: ") + std::strerror(error);
  has_locked_memory_ = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  words_ += has_locked_memory_ ? ", memory is locked"
                               : std::string(", memory is not locked: ") + std::strerror(errno);
}

RealTime::~RealTime() {
  if (has_locked_memory_) munlockall();
  if (!has_priority_) return;
  const sched_param priority{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &priority);
}

#else

RealTime::RealTime(bool /*is_wanted*/) : words_("no real-time rights on this system") {}
RealTime::~RealTime() = default;

#endif

}  // namespace dyop::haptics_internal
