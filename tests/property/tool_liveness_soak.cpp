// SPDX-License-Identifier: BSD-3-Clause

// A device that is held deep in tissue and tilts, over a scene's obstacles:
//   tool_liveness_soak SCENE.json TICKS_A_RUN RUNS [FIRST_SEED]
// Counts the ticks in which the tool does not move though some direction opens all active contacts
// (an oracle of its own says so), and the longest row of them. The exit code is 1 if one of these
// rows is longer than what docs/haptics.md promises.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "dyop/io/haptic_scene_file.h"
#include "support/oracles/way_out.h"

namespace dyop::testing {
namespace {

constexpr int kMostTicksHeld = 20;
constexpr Scalar kLeastOpening = 0.05;

struct Liveness {
  std::int64_t ticks = 0, trapped = 0, held_still = 0;
  int row = 0, longest = 0;
};

class TiltingHand {
 public:
  explicit TiltingHand(std::uint64_t seed) : random_(seed) {
    for (int k = 0; k < 3; ++k) {
      rates_[k] = number(1, 12);
      phases_[k] = number(0, 6);
      amplitudes_[k] = number(0.2, 1.5);
    }
    depth_ = number(5, 40);
  }
  Scalar number(Scalar low, Scalar high) {
    return std::uniform_real_distribution<Scalar>(low, high)(random_);
  }
  // Pressed deep towards a point from above, tilting ever more.
  DevicePose pose(const RigidPose& X_WT, const Vector3& inward_W, Scalar t) const {
    Vector3 turn;
    for (int k = 0; k < 3; ++k) turn[k] = amplitudes_[k] * std::sin(rates_[k] * t + phases_[k]);
    const Scalar pressed = depth_ * std::min(Scalar{1}, 5 * t);
    return DevicePose(RigidPose(Matrix3(rotation_from_vector(turn) * X_WT.rotation()),
                                X_WT.translation() + pressed * inward_W));
  }

 private:
  std::mt19937_64 random_;
  Scalar rates_[3], phases_[3], amplitudes_[3], depth_;
};

void run_once(const HapticRun& run, std::int64_t ticks, std::uint64_t seed, Liveness& all) {
  HapticSession session(run.scene, run.options);
  TiltingHand hand(seed);
  std::vector<std::int64_t> given(run.tissue.size());
  std::vector<std::vector<Vector3>> vertices;
  for (const TissueFeed& feed : run.tissue) {
    vertices.push_back(run.scene.obstacles[feed.obstacle].vertices);
  }
  // Where some tick of the scene's strokes leads, then inwards to what is nearest there.
  const auto from = std::int64_t(hand.number(0, 20'000));
  const DevicePose start = run.device(from);
  Liveness one;
  std::optional<RigidPose> base;
  Vector3 inward_W = -Vector3::UnitZ();
  for (std::int64_t k = 0; k < ticks; ++k) {
    for (std::size_t i = 0; i < run.tissue.size(); ++i) {
      if (session.snapshots_taken(run.tissue[i].obstacle) < given[i]) continue;
      run.tissue[i].shape(given[i] + 1, vertices[i]);
      if (session.give_snapshot(run.tissue[i].obstacle, vertices[i], run.tissue[i].period)) {
        ++given[i];
      }
    }
    const HapticTick& before = session.last();
    const RigidPose last = before.tool.X_WT;
    if (!base && k > 300) {
      base = last;
      Scalar nearest = kInfinity;
      for (const ToolClearance& clearance : before.clearances) {
        if (!(clearance.upper < nearest)) continue;
        nearest = clearance.upper;
        inward_W = (clearance.p_WO - clearance.p_WT).normalized();
      }
    }
    const DevicePose device =
        base ? hand.pose(*base, inward_W, Scalar(k - 300) * run.runner.period) : start;
    const HapticTick& tick = session.update(device, run.runner.period);
    ++one.ticks;
    one.trapped += tick.status == HapticStatus::Trapped;
    const bool is_still = tick.path.back().time < run.runner.period / 2 && !tick.cutoff;
    const bool could_move = is_still && way_out(tick, 20, kLeastOpening);
    one.held_still += could_move;
    one.row = could_move ? one.row + 1 : 0;
    one.longest = std::max(one.longest, one.row);
  }
  if (one.trapped > 0) {
    std::printf("seed %llu: trapped %lld, with a way out %lld, longest row %d\n",
                static_cast<unsigned long long>(seed), static_cast<long long>(one.trapped),
                static_cast<long long>(one.held_still), one.longest);
  }
  all.ticks += one.ticks;
  all.trapped += one.trapped;
  all.held_still += one.held_still;
  all.longest = std::max(all.longest, one.longest);
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: tool_liveness_soak SCENE.json TICKS_A_RUN RUNS [FIRST_SEED]\n");
    return 2;
  }
  const dyop::HapticRun run = dyop::load_haptic_run(argv[1]);
  dyop::testing::Liveness all;
  const std::uint64_t first = argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1;
  const auto runs = std::strtoull(argv[3], nullptr, 10);
  for (std::uint64_t k = 0; k < runs; ++k) {
    dyop::testing::run_once(run, std::atoll(argv[2]), first + k, all);
  }
  std::printf("ticks %lld, trapped %lld, with a way out %lld, longest row %d\n",
              static_cast<long long>(all.ticks), static_cast<long long>(all.trapped),
              static_cast<long long>(all.held_still), all.longest);
  return all.longest > dyop::testing::kMostTicksHeld ? 1 : 0;
}
