// SPDX-License-Identifier: BSD-3-Clause

// A long run of the tool loop against an independent oracle:
//   tool_soak SCENE.json TICKS [SEED [DEADLINE in us [FIRST TICK]]]
// The strokes of the scene, repeated, with dropped, doubled and late ticks, a device that jumps or
// sends NaN, snapshots that come late, ticks that are cut off anywhere, and cuts: the scene's own,
// and others that take tissue away around the tool, slit it, shift it and sew it up again, most of
// them where other things go wrong too. Elastic tissue is cut by the blades of the scene, and gets
// faulty snapshots between. After every tick each committed motion is sampled against
// the tissue's motion, more densely the nearer they are, until it is proven that the margin was
// kept between the samples too; the positions of the tissue, the clearances, the times to a breach
// and the status that the session reports are compared as well; so are the distances between tools,
// where the scene has several. The run is recorded, and dyop-check must prove it. The exit code is 1
// if any promise was broken.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <limits>
#include <optional>
#include <random>

#include "check/check.h"
#include "dyop/core/error.h"
#include "dyop/io/haptic_recording.h"
#include "dyop/io/haptic_scene_file.h"
#include "support/temporary_directory.h"
#include "tick_check.h"
#include "tissue_cuts.h"
#include "tools_check.h"

namespace dyop::testing {
namespace {

// Other meshes among snapshots: one in so many, and where tissue closes in on the tool.
constexpr int kCuts = 25;
constexpr int kCutsInTrap = 4;
// Faults of one kind: one in so many ticks, and while a mesh waits to be taken.
constexpr int kFaults = 100;
constexpr int kFaultsAtCuts = 10;

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
  std::int64_t ticks = 0, cut_off = 0;
  std::array<std::int64_t, 10> statuses{};
  std::int64_t jumps = 0, nans = 0, doubled = 0, dropped = 0, late = 0, late_snapshots = 0;
  std::int64_t cuts = 0, traps_before_cuts = 0;
  std::int64_t faults_refused = 0, faults_taken = 0;  // snapshots
  std::vector<Scalar> latency;
};

// A deforming obstacle's snapshots and cuts.
struct Feed {
  Feed(const TissueFeed& given, const ToolObstacle& obstacle)
      : tissue(given), whole(obstacle.vertices), cuts(obstacle) {}

  const TissueFeed& tissue;
  std::vector<Vector3> whole;  // all vertices as given last
  TissueCuts cuts;
  std::int64_t number = 0;  // given
  std::int64_t wait = 0;    // ticks until the next is given
  bool is_mesh_waiting = false;
  bool is_ready = false;  // of a model: what it has made is not given yet
  std::optional<TissueMesh> mesh = {};
};

class Soak {
 public:
  Soak(const char* file, std::uint64_t seed, std::int64_t deadline_us, std::int64_t first)
      : run_(load_haptic_run(file)),
        session_(run_.scene, run_.options),
        writer_(recording(), {}, session_),
        between_(run_.scene, run_.options),
        jumps_(session_.tool_count()),
        random_(seed),
        deadline_us_(deadline_us),
        tick_(first) {
    for (std::size_t k = 0; k < session_.tool_count(); ++k) {
      checks_.emplace_back(run_.scene, run_.options, k);
    }
    for (const TissueFeed& feed : run_.tissue) {
      feeds_.emplace_back(feed, run_.scene.obstacles[feed.obstacle]);
    }
  }

  void step();
  /// Ends the recording.
  /// @return Whether it is proven.
  bool is_proven();
  TickFindings findings() const {
    TickFindings sum = between_.findings;
    for (const TickCheck& check : checks_) sum += check.findings;
    return sum;
  }
  Totals totals;

 private:
  bool chance(int one_in) { return std::uniform_int_distribution<int>(1, one_in)(random_) == 1; }
  Scalar number(Scalar low, Scalar high) {
    return std::uniform_real_distribution<Scalar>(low, high)(random_);
  }
  Vector3 vector(Scalar size) {
    return {number(-size, size), number(-size, size), number(-size, size)};
  }
  void give_snapshot(Feed& feed);
  void give_modelled(Feed& feed);
  void ask(Feed& feed);
  void give_faults(const Feed& feed);
  bool give_mesh(Feed& feed);
  bool cut(Feed& feed);
  int faults() const;
  Scalar odd_time();
  DevicePose device(std::size_t tool);

  // A device that is somewhere else for some ticks.
  struct Jump {
    int ticks = 0;
    Vector3 by = Vector3::Zero();
  };

  std::filesystem::path recording() const { return directory_.path() / "run.h5"; }
  void record(const std::vector<DevicePose>& poses, Scalar dt);

  TemporaryDirectory directory_;
  HapticRun run_;
  HapticSession session_;
  HapticRecordingWriter writer_;
  std::vector<TickCheck> checks_;  // by tool
  ToolsCheck between_;
  std::vector<Jump> jumps_;  // by tool
  std::mt19937_64 random_;
  const std::int64_t deadline_us_;
  std::int64_t tick_;
  std::vector<Feed> feeds_;
};

// As soon as they are due, or up to three periods later.
void Soak::give_snapshot(Feed& feed) {
  if (feed.wait > 0 && feed.wait-- > 0) return;
  const std::size_t obstacle = feed.tissue.obstacle;
  // Asked for only where it will be taken: the vertices of the last one are passed on.
  if (session_.snapshots_taken(obstacle) < feed.number) return;
  if (feed.tissue.model) {
    give_modelled(feed);
    return;
  }
  feed.is_mesh_waiting = give_mesh(feed);
  if (!feed.is_mesh_waiting) {
    feed.tissue.shape(feed.number + 1, feed.whole);
    std::vector<Vector3> next = feed.cuts.gather(feed.whole);
    if (!session_.give_snapshot(obstacle, next, feed.tissue.period)) return;
    for (TickCheck& check : checks_) check.tissue(obstacle).give(next, feed.tissue.period);
  }
  ++feed.number;
  if (chance(feed.is_mesh_waiting ? 3 : 10)) {
    feed.wait = std::int64_t(number(20, 80));
    ++totals.late_snapshots;
  }
}

// As run_session() does, but for the impulses.
void Soak::ask(Feed& feed) {
  const std::size_t obstacle = feed.tissue.obstacle;
  TissueNews news;
  news.number = feed.number + 1;
  news.tools.resize(checks_.size());
  for (std::size_t k = 0; k < checks_.size() && totals.ticks > 0; ++k) {
    news.tools[k].device = run_.device(tick_, k);
    news.tools[k].tick = session_.last(k);
    news.progress = session_.last().progress[obstacle];
    std::vector<ToolContactPoint> found;
    session_.find_contacts(obstacle, news.progress, session_.last(k).tool,
                           feed.tissue.model->search(), found, k);
    news.contacts.insert(news.contacts.end(), found.begin(), found.end());
  }
  feed.mesh = feed.tissue.model->cut(news);
  if (feed.mesh) {
    feed.whole = feed.mesh->vertices;
  } else {
    feed.tissue.model->step(news, feed.whole);
  }
  feed.is_ready = true;
}

// Snapshots that must be refused and change nothing.
void Soak::give_faults(const Feed& feed) {
  std::vector<Vector3> faulty = feed.whole;
  if (chance(2)) {
    faulty.pop_back();
  } else {
    faulty.back().y() = std::numeric_limits<Scalar>::quiet_NaN();
  }
  try {
    session_.give_snapshot(feed.tissue.obstacle, faulty, feed.tissue.period);
    ++totals.faults_taken;
  } catch (const InvalidArgument&) {
    ++totals.faults_refused;
  }
}

void Soak::give_modelled(Feed& feed) {
  const std::size_t obstacle = feed.tissue.obstacle;
  if (!feed.is_ready) ask(feed);
  // The session knows of a new mesh's vertices only once it has been given.
  if (!feed.mesh && chance(10)) give_faults(feed);
  feed.is_mesh_waiting = feed.mesh.has_value();
  const bool is_taken =
      feed.mesh ? session_.give_mesh(obstacle, feed.mesh->vertices, feed.mesh->triangles)
                : session_.give_snapshot(obstacle, feed.whole, feed.tissue.period);
  if (!is_taken) return;
  for (TickCheck& check : checks_) {
    if (feed.mesh) {
      check.tissue(obstacle).give_mesh(feed.mesh->vertices, feed.mesh->triangles);
    } else {
      check.tissue(obstacle).give(feed.whole, feed.tissue.period);
    }
  }
  totals.cuts += feed.mesh ? 1 : 0;
  feed.mesh.reset();
  feed.is_ready = false;
  ++feed.number;
  if (chance(feed.is_mesh_waiting ? 3 : 10)) {
    feed.wait = std::int64_t(number(20, 80));
    ++totals.late_snapshots;
  }
}

// A cut in place of the next snapshot; now and then the new mesh is not quite where the last
// snapshot was.
bool Soak::give_mesh(Feed& feed) {
  const auto own = feed.tissue.cut ? feed.tissue.cut(feed.number + 1) : std::nullopt;
  if (own) {
    feed.cuts.take(*own);
  } else if (!cut(feed)) {
    return false;
  }
  std::vector<Vector3> next = feed.cuts.gather(feed.whole);
  if (!own && chance(4)) {
    const Vector3 shift = vector(1);
    for (Vector3& p : next) p += shift;
  }
  const std::size_t obstacle = feed.tissue.obstacle;
  if (!session_.give_mesh(obstacle, next, feed.cuts.triangles())) return false;
  for (TickCheck& check : checks_) {
    check.tissue(obstacle).give_mesh(next, feed.cuts.triangles());
  }
  ++totals.cuts;
  return true;
}

// Around what is nearest to the tool, or anywhere. Sewn up only where the tool is clear of the
// hole.
bool Soak::cut(Feed& feed) {
  const HapticTick& tick = session_.last();
  if (!chance(tick.status == HapticStatus::Trapped ? kCutsInTrap : kCuts)) return false;
  const ToolClearance* clearance =
      totals.ticks > 0 ? &tick.clearances[feed.tissue.obstacle] : nullptr;
  constexpr Scalar kLargestHole = 12;
  const bool is_clear = clearance && clearance->lower > 2 * kLargestHole;
  if (is_clear && !feed.cuts.is_whole() && chance(3)) {
    feed.cuts.sew();
    return true;
  }
  const std::size_t any =
      std::uniform_int_distribution<std::size_t>(0, feed.whole.size() - 1)(random_);
  const bool is_near = clearance && clearance->upper < kInfinity && chance(2);
  const Vector3 center = is_near ? clearance->p_WO : feed.whole[any];
  if (chance(3)) {
    feed.cuts.slit(center, vector(1), feed.whole);
    return true;
  }
  return feed.cuts.take_away(center, number(1, kLargestHole), feed.whole);
}

// More often while a mesh waits to be taken.
int Soak::faults() const {
  for (const Feed& feed : feeds_) {
    if (feed.is_mesh_waiting && session_.snapshots_taken(feed.tissue.obstacle) < feed.number) {
      return kFaultsAtCuts;
    }
  }
  return kFaults;
}

DevicePose Soak::device(std::size_t tool) {
  DevicePose device = run_.device(tick_, tool);
  Jump& jump = jumps_[tool];
  if (jump.ticks == 0 && chance(2000)) {
    jump.ticks = int(number(1, 20));
    jump.by = Vector3(number(-1, 1), number(-1, 1), number(-1, 1)) * std::pow(10, number(0, 3));
    ++totals.jumps;
  }
  if (jump.ticks > 0) {
    --jump.ticks;
    device.p_WD += jump.by;
  }
  if (chance(500)) {
    device.p_WD.x() = std::numeric_limits<Scalar>::quiet_NaN();
    ++totals.nans;
  }
  return device;
}

// The time of a tick that may be dropped, late or doubled.
Scalar Soak::odd_time() {
  const Scalar period = run_.runner.period;
  const int rare = faults();
  if (chance(rare)) {
    ++tick_;
    ++totals.dropped;
    return 2 * period;
  }
  if (chance(rare)) {
    ++totals.late;
    return number(1, 4) * period;
  }
  if (chance(rare)) {
    --tick_;
    ++totals.doubled;
    return 0;
  }
  return period;
}

void Soak::step() {
  for (Feed& feed : feeds_) give_snapshot(feed);
  const Scalar dt = odd_time();
  std::vector<DevicePose> poses;
  for (std::size_t k = 0; k < checks_.size(); ++k) poses.push_back(device(k));
  const Scalar before = processor_us();
  if (deadline_us_ > 0) {
    session_.update(poses, dt,
                    std::chrono::steady_clock::now() + std::chrono::microseconds(deadline_us_));
  } else if (chance(faults() / 2)) {
    session_.replay(poses, dt, TickCutoff{std::int64_t(number(1, 400)), 0});
  } else {
    session_.update(poses, dt);
  }
  totals.latency.push_back(processor_us() - before);
  record(poses, dt);
  ++tick_;
  ++totals.ticks;
  totals.cut_off += session_.last().cutoff.has_value();
  for (std::size_t k = 0; k < checks_.size(); ++k) {
    const HapticStatus status = session_.last(k).status;
    ++totals.statuses[std::size_t(status)];
    totals.traps_before_cuts += status == HapticStatus::Trapped && faults() == kFaultsAtCuts;
  }
  between_.check(session_);
  for (std::size_t k = 0; k < checks_.size(); ++k) {
    checks_[k].check(session_, poses[k], dt, between_.start(k));
  }
}

void Soak::record(const std::vector<DevicePose>& poses, Scalar dt) {
  TickRecord record{totals.ticks, poses[0], dt, session_.last()};
  for (std::size_t k = 1; k < poses.size(); ++k) {
    record.others.push_back({poses[k], session_.last(k)});
  }
  writer_.add(record);
}

bool Soak::is_proven() {
  writer_.finish({});
  return dyop_check::check_file(recording().string(), 1, std::cout, std::cerr) == 0;
}

void print_totals(Totals& totals, const TickFindings& findings) {
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
  print("  cuts", totals.cuts);
  print("  trapped while a cut waits", totals.traps_before_cuts);
  print("  faulty snapshots refused", totals.faults_refused);
  print("  faulty snapshots taken", totals.faults_taken);
  constexpr const char* kNames[] = {"not run", "free",       "held",        "blocked", "deadline",
                                    "trapped", "recovering", "overlapping", "invalid", "outlier"};
  for (std::size_t k = 0; k < totals.statuses.size(); ++k) {
    if (totals.statuses[k] > 0) std::printf("  %s", kNames[k]), print("", totals.statuses[k]);
  }
  print("motions near something", findings.near);
  print("samples", findings.samples);
  std::printf("least distance over the margin %.6g\n", findings.least_excess);
  print("breaches", findings.breaches);
  print("unproven between samples", findings.unproven);
  print("wrong clearances", findings.wrong_clearances);
  print("early breaches", findings.early_breaches);
  print("wrong tissue", findings.wrong_tissue);
  print("wrong statuses", findings.wrong_statuses);
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
                  static_cast<long long>(soak.findings().broken()));
      std::fflush(stdout);
    }
  }
  print_totals(soak.totals, soak.findings());
  if (soak.totals.faults_taken > 0) return 1;
  return soak.findings().broken() > 0 || !soak.is_proven() ? 1 : 0;
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
