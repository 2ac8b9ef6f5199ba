// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_runner.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <exception>
#include <mutex>
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

// Carries the news of ticks to a model in another thread. The loop never waits: while the model
// reads, news are kept for the next tick.
class NewsBox {
 public:
  explicit NewsBox(std::size_t tools) : tools_(tools), waiting_(tools, Vector3::Zero()) {}

  // For the loop, after each tick.
  void post(std::size_t obstacle, const TickRecord& record, Scalar period) {
    const ObstacleProgress& now = record.tick.progress[obstacle];
    const std::int64_t mesh = mesh_.load(std::memory_order_acquire);
    const bool is_cut = before_.snapshot < mesh && mesh <= now.snapshot;  // which is no motion
    const std::int64_t begun = now.snapshot - before_.snapshot - (is_cut ? 1 : 0);
    const Scalar moved = now.fraction - before_.fraction + Scalar(begun);
    before_ = now;
    if (record.dt > 0) {
      const Scalar part = std::clamp(moved * period / record.dt, Scalar{0}, Scalar{1});
      add_impulses(obstacle, part, record.tick, waiting_[0]);
      for (std::size_t k = 0; k < record.others.size(); ++k) {
        add_impulses(obstacle, part, record.others[k].tick, waiting_[k + 1]);
      }
    }
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    give(record.device, record.tick, 0);
    for (std::size_t k = 0; k < record.others.size(); ++k) {
      give(record.others[k].device, record.others[k].tick, k + 1);
    }
  }

  // For the model: the number of its newest mesh, before it is given.
  void tell_mesh(std::int64_t number) { mesh_.store(number, std::memory_order_release); }

  // For the model.
  void take(TissueNews& news) {
    const std::lock_guard lock(mutex_);
    news.tools = tools_;
    for (ToolNews& tool : tools_) tool.impulse_W.setZero();
  }

 private:
  static void add_impulses(std::size_t obstacle, Scalar part, const HapticTick& tick,
                           Vector3& sum) {
    for (const ToolImpulse& impulse : tick.impulses) {
      if (impulse.obstacle == obstacle) sum += part * impulse.impulse_W;
    }
  }

  void give(const DevicePose& device, const HapticTick& tick, std::size_t number) {
    ToolNews& news = tools_[number];
    news.device = device;
    news.tick = tick;
    news.impulse_W += waiting_[number];
    waiting_[number].setZero();
  }

  std::mutex mutex_;
  std::vector<ToolNews> tools_;
  std::atomic<std::int64_t> mesh_{-1};
  ObstacleProgress before_;
  std::vector<Vector3> waiting_;  // impulses
};

// A feed and the snapshot or mesh it has prepared.
class Feeder {
 public:
  Feeder(HapticSession& session, const TissueFeed& feed)
      : session_(session),
        feed_(feed),
        vertices_(session.tissue_vertices(feed.obstacle)),
        box_(std::make_unique<NewsBox>(session.tool_count())) {
    if (!feed.model) prepare();
  }

  void offer() {
    if (feed_.model && !ask()) return;
    const std::size_t obstacle = feed_.obstacle;
    const bool is_taken = mesh_ ? session_.give_mesh(obstacle, mesh_->vertices, mesh_->triangles)
                                : session_.give_snapshot(obstacle, vertices_, feed_.period);
    if (!is_taken) return;
    ++number_;
    if (feed_.model) {
      mesh_.reset();
      is_ready_ = false;
    } else {
      prepare();
    }
  }

  // For the loop.
  void tell(const TickRecord& record) {
    if (feed_.model) box_->post(feed_.obstacle, record, feed_.period);
  }

 private:
  // Whether the model's snapshot is ready to be given.
  bool ask() {
    if (is_ready_) return true;
    if (session_.snapshots_taken(feed_.obstacle) + 1 < number_) return false;
    box_->take(news_);
    news_.number = number_;
    news_.contacts.clear();
    if (news_.tools[0].tick.status != HapticStatus::NotRun) {
      news_.progress = news_.tools[0].tick.progress[feed_.obstacle];
      for (std::size_t k = 0; k < news_.tools.size(); ++k) {
        find_contacts(k, news_.tools[k].tick.tool);
      }
    }
    mesh_ = feed_.model->cut(news_);
    if (mesh_) {
      vertices_ = mesh_->vertices;
      box_->tell_mesh(number_);
      if (feed_.given_mesh) feed_.given_mesh(*mesh_);
    } else {
      feed_.model->step(news_, vertices_);
      if (feed_.given) feed_.given(vertices_);
    }
    is_ready_ = true;
    return true;
  }

  void find_contacts(std::size_t tool, const ToolPose& pose) {
    session_.find_contacts(feed_.obstacle, news_.progress, pose, feed_.model->search(), found_,
                           tool);
    news_.contacts.insert(news_.contacts.end(), found_.begin(), found_.end());
    found_.clear();
  }

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
  bool is_ready_ = false;
  TissueNews news_;
  std::vector<ToolContactPoint> found_;
  std::unique_ptr<NewsBox> box_;  // two threads
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
  std::vector<Feeder>& feeders;
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
    for (Feeder& feeder : feeders) feeder.tell(record);
  }
};

void run_unpaced(Loop& loop, const std::function<void(const TickRecord&)>& sink,
                 const std::stop_token& stop) {
  TickRecord record;
  for (std::int64_t k = 0; k < loop.options.ticks && !stop.stop_requested(); ++k) {
    for (Feeder& feeder : loop.feeders) feeder.offer();
    loop.tick(k, record);
    if (sink) sink(record);
  }
}

void run_paced(Loop& loop, const std::function<void(const TickRecord&)>& sink,
               const std::stop_token& stop) {
  haptics_internal::RecordRing ring(haptics_internal::kWaitingTicks);
  Worker tissue([&] {
    for (Feeder& feeder : loop.feeders) feeder.offer();
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
  DYOP_REQUIRE(options.period > 0 && options.period < kInfinity,
               "run_session: period must be finite and > 0, not ", options.period);
  std::vector<Feeder> feeders;
  for (const TissueFeed& feed : tissue) feeders.emplace_back(session, feed);
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
