// SPDX-License-Identifier: BSD-3-Clause

// A long run of the tool loop against an independent oracle:
//   tool_soak SCENE.json TICKS [SEED [DEADLINE in us [FIRST TICK]]]
// The strokes of the scene, repeated, with dropped, doubled and late ticks, a device that jumps or
// sends NaN, snapshots that come late, and ticks that are cut off anywhere. After every tick each
// committed motion is sampled against the tissue's motion, more densely the nearer they are, until
// it is proven that the margin was kept between the samples too; the positions of the tissue and the
// clearances that the session reports are compared as well. The exit code is 1 if any promise was
// broken.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <limits>
#include <random>

#include "dyop/tool_io/tool_scene_file.h"
#include "span_oracle.h"

namespace dyop::testing {
namespace {

// What the loop promises to keep besides the margin, as a fraction of the standoff, less rounding
// (docs/algorithms/tool_loop.md).
constexpr Scalar kKept = 0.075;
constexpr Scalar kRounding = 1e-7;     // literal: of numbers of size 300
constexpr Scalar kResolution = 2e-3;   // between samples where the margin is not yet proven
constexpr Scalar kLook = 0.3;          // pairs of triangles nearer than this are measured
constexpr Scalar kTissueNoise = 1e-9;  // literal: rounding of positions of size 300

Scalar processor_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return Scalar(now.tv_sec) * 1e6 + Scalar(now.tv_nsec) / 1e3;
}

long resident_kilobytes() {
  std::ifstream file("/proc/self/statm");
  long whole = 0, resident = 0;
  file >> whole >> resident;
  return resident * 4;
}

struct Totals {
  std::int64_t ticks = 0, near = 0, samples = 0, cut_off = 0;
  std::int64_t breaches = 0, unproven = 0, wrong_clearances = 0, wrong_tissue = 0;
  std::array<std::int64_t, 9> statuses{};
  std::int64_t jumps = 0, nans = 0, doubled = 0, dropped = 0, late = 0, late_snapshots = 0;
  Scalar least_excess = kInfinity;  // over the margin
  std::vector<Scalar> latency;

  std::int64_t broken() const { return breaches + unproven + wrong_clearances + wrong_tissue; }
};

class Soak {
 public:
  Soak(const char* file, std::uint64_t seed, std::int64_t deadline_us, std::int64_t first)
      : run_(load_tool_run(file)),
        session_(run_.scene, run_.options),
        oracle_(run_.scene),
        random_(seed),
        deadline_us_(deadline_us),
        tick_(first) {
    for (const ToolObstacle& obstacle : run_.scene.obstacles) tissue_.emplace_back(obstacle);
    for (const TissueFeed& feed : run_.tissue) {
      shapes_.push_back(run_.scene.obstacles[feed.obstacle].vertices);
    }
    numbers_.resize(run_.tissue.size());
    waits_.resize(run_.tissue.size());
  }

  void step();
  Totals totals;

 private:
  bool chance(int one_in) { return std::uniform_int_distribution<int>(1, one_in)(random_) == 1; }
  Scalar number(Scalar low, Scalar high) {
    return std::uniform_real_distribution<Scalar>(low, high)(random_);
  }
  void give_snapshots();
  DevicePose device();
  void check_tick(Scalar dt);
  void check_part(const SpanPart& part);
  void check_ends();

  ToolRun run_;
  ToolSession session_;
  SpanOracle oracle_;
  std::mt19937_64 random_;
  const std::int64_t deadline_us_;
  std::int64_t tick_;
  std::vector<TissuePath> tissue_;
  std::vector<std::vector<Vector3>> shapes_;  // last given
  std::vector<std::int64_t> numbers_, waits_;
  int jumping_ = 0;
  Vector3 jump_ = Vector3::Zero();
  std::vector<Scalar> distance_;  // of each obstacle at the end of the tick, at most the cap
};

// As soon as they are due, or up to three periods later.
void Soak::give_snapshots() {
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    if (waits_[k] > 0 && waits_[k]-- > 0) continue;
    const TissueFeed& feed = run_.tissue[k];
    std::vector<Vector3> next = shapes_[k];
    // Asked for only where it will be taken: the vertices of the last one are passed on.
    if (session_.snapshots_taken(feed.obstacle) < numbers_[k]) continue;
    feed.shape(numbers_[k] + 1, next);
    if (!session_.give_snapshot(feed.obstacle, next, feed.period)) continue;
    ++numbers_[k];
    tissue_[feed.obstacle].give(next, feed.period);
    shapes_[k] = std::move(next);
    if (chance(10)) {
      waits_[k] = std::int64_t(number(20, 80));
      ++totals.late_snapshots;
    }
  }
}

DevicePose Soak::device() {
  DevicePose device = run_.device(tick_);
  if (jumping_ == 0 && chance(2000)) {
    jumping_ = int(number(1, 20));
    jump_ = Vector3(number(-1, 1), number(-1, 1), number(-1, 1)) * std::pow(10, number(0, 3));
    ++totals.jumps;
  }
  if (jumping_ > 0) {
    --jumping_;
    device.p_WD += jump_;
  }
  if (chance(500)) {
    device.p_WD.x() = std::numeric_limits<Scalar>::quiet_NaN();
    ++totals.nans;
  }
  return device;
}

void Soak::step() {
  give_snapshots();
  Scalar dt = run_.runner.period;
  if (chance(100)) {
    ++tick_;
    dt *= 2;
    ++totals.dropped;
  } else if (chance(100)) {
    dt = number(1, 4) * dt;
    ++totals.late;
  } else if (chance(100)) {
    dt = 0;
    --tick_;
    ++totals.doubled;
  }
  const DevicePose pose = device();
  const Scalar before = processor_us();
  if (deadline_us_ > 0) {
    session_.update(pose, dt,
                    std::chrono::steady_clock::now() + std::chrono::microseconds(deadline_us_));
  } else if (chance(50)) {
    session_.replay(pose, dt, TickCutoff{std::int64_t(number(1, 400)), 0});
  } else {
    session_.update(pose, dt);
  }
  totals.latency.push_back(processor_us() - before);
  ++tick_;
  ++totals.ticks;
  totals.cut_off += session_.last().cutoff.has_value();
  ++totals.statuses[std::size_t(session_.last().status)];
  check_tick(dt);
}

void Soak::check_tick(Scalar dt) {
  const ToolTick& tick = session_.last();
  if (dt >= 0) {
    for (TissuePath& path : tissue_) path.start_tick();
  }
  distance_.assign(tissue_.size(), kInfinity);
  for (std::size_t i = 1; i < tick.path.size(); ++i) {
    const Scalar length = tick.path[i].time - tick.path[i - 1].time;
    const ToolSpanPath path(tick.path[i - 1].tool, tick.path[i].tool);
    for (Scalar done = 0; done < length;) {
      Scalar time = length - done;
      for (TissuePath& tissue : tissue_) {
        if (!(tissue.time_left() > kTissueNoise * run_.runner.period)) tissue.go_on();
        time = std::min(time, tissue.time_left());
      }
      check_part({path, done / length, std::min(Scalar{1}, (done + time) / length), time});
      for (TissuePath& tissue : tissue_) tissue.pass(time);
      done += time;
    }
  }
  if (tick.path.size() > 1) check_ends();
}

void Soak::check_part(const SpanPart& part) {
  const ToolStatus status = session_.last().status;
  const bool is_exempt = status == ToolStatus::Recovering || status == ToolStatus::Overlapping;
  bool is_near = false;
  std::fill(distance_.begin(), distance_.end(), kInfinity);
  for (std::size_t k = 0; k < tissue_.size(); ++k) {
    const ToolObstacle& obstacle = run_.scene.obstacles[k];
    const bool is_hard =
        obstacle.role == ObstacleRole::Tissue || obstacle.role == ObstacleRole::HardRegion;
    if (!is_hard) continue;
    for (std::size_t body = 0; body < oracle_.part_count(); ++body) {
      const SpanDistance found = oracle_.check(body, part, tissue_[k], obstacle.margin + kLook,
                                               obstacle.margin + kRounding, kResolution);
      totals.samples += found.samples;
      is_near |= found.samples > 0;
      distance_[k] = std::min(distance_[k], found.at_end);
      totals.least_excess = std::min(totals.least_excess, found.least - obstacle.margin);
      if (is_exempt) continue;
      const bool is_breach =
          found.least < obstacle.margin + kKept * run_.options.standoff - kRounding;
      totals.breaches += is_breach;
      totals.unproven += !(found.proven > obstacle.margin);
      if (is_breach || !(found.proven > obstacle.margin)) {
        std::printf("tick %lld, obstacle %zu, part %zu: least %.6g, proven %.6g, margin %g\n",
                    static_cast<long long>(totals.ticks), k, body, found.least, found.proven,
                    obstacle.margin);
      }
    }
  }
  totals.near += is_near;
}

// The session's own view of the tissue and of the clearances at the end of the tick.
void Soak::check_ends() {
  const ToolTick& tick = session_.last();
  for (std::size_t k = 0; k < tissue_.size(); ++k) {
    const ToolObstacle& obstacle = run_.scene.obstacles[k];
    const Scalar look = obstacle.margin + kLook;
    const ToolClearance& clearance = tick.clearances[k];
    if (distance_[k] < look) {
      const bool is_right = clearance.lower <= distance_[k] + kRounding &&
                            clearance.upper >= distance_[k] - kRounding;
      totals.wrong_clearances += !is_right;
      if (!is_right) {
        std::printf("tick %lld, obstacle %zu: distance %.9g is not in [%.9g, %.9g]\n",
                    static_cast<long long>(totals.ticks), k, distance_[k], clearance.lower,
                    clearance.upper);
      }
    }
    if (obstacle.shape || totals.ticks % 100 != 0) continue;
    const std::vector<Vector3> places = session_.tissue_vertices(k);
    Scalar off = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      off = std::max(off, (places[i] - tissue_[k].place(i)).norm());
    }
    totals.wrong_tissue += !(off <= kTissueNoise);
    if (!(off <= kTissueNoise)) {
      std::printf("tick %lld, obstacle %zu: tissue is off by %g\n",
                  static_cast<long long>(totals.ticks), k, off);
    }
  }
}

void print_totals(Totals& totals) {
  std::sort(totals.latency.begin(), totals.latency.end());
  const auto quantile = [&](Scalar part) {
    return totals.latency[std::size_t(part * Scalar(totals.latency.size() - 1))];
  };
  const auto print = [](const char* name, std::int64_t value) {
    std::printf("%s %lld\n", name, static_cast<long long>(value));
  };
  print("ticks", totals.ticks);
  print("  cut off", totals.cut_off);
  print("  dropped", totals.dropped);
  print("  doubled", totals.doubled);
  print("  late", totals.late);
  print("  device jumps", totals.jumps);
  print("  NaN poses", totals.nans);
  print("  late snapshots", totals.late_snapshots);
  constexpr const char* kNames[] = {"not run", "free",       "held",        "blocked", "deadline",
                                    "trapped", "recovering", "overlapping", "invalid"};
  for (std::size_t k = 0; k < totals.statuses.size(); ++k) {
    if (totals.statuses[k] > 0) std::printf("  %s", kNames[k]), print("", totals.statuses[k]);
  }
  print("motions near something hard", totals.near);
  print("samples", totals.samples);
  std::printf("least distance over the margin %.6g\n", totals.least_excess);
  print("breaches", totals.breaches);
  print("unproven between samples", totals.unproven);
  print("wrong clearances", totals.wrong_clearances);
  print("wrong tissue", totals.wrong_tissue);
  std::printf("processor time of a tick, us: median %.1f, 99 %% %.1f, 99.9 %% %.1f, worst %.1f\n",
              quantile(0.5), quantile(0.99), quantile(0.999), totals.latency.back());
}

int run(const char* file, std::int64_t ticks, std::uint64_t seed, std::int64_t deadline_us,
        std::int64_t first) {
  Soak soak(file, seed, deadline_us, first);
  soak.totals.latency.reserve(std::size_t(ticks));
  for (std::int64_t k = 0; k < ticks; ++k) {
    soak.step();
    if ((k + 1) % 10000 == 0) {
      std::printf("after %lld ticks: %ld kB resident, %lld promises broken\n",
                  static_cast<long long>(k + 1), resident_kilobytes(),
                  static_cast<long long>(soak.totals.broken()));
      std::fflush(stdout);
    }
  }
  print_totals(soak.totals);
  return soak.totals.broken() > 0 ? 1 : 0;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const auto number = [&](int k, long long otherwise) {
    return argc > k ? std::atoll(argv[k]) : otherwise;
  };
  if (argc < 3 || number(2, 0) <= 0) {
    std::fprintf(stderr, "usage: tool_soak SCENE.json TICKS [SEED [DEADLINE_US [FIRST_TICK]]]\n");
    return 2;
  }
  return dyop::testing::run(argv[1], number(2, 0), std::uint64_t(number(3, 1)), number(4, 0),
                            number(5, 0));
}
