// SPDX-License-Identifier: BSD-3-Clause

// Time of impact of real models against the sampling oracle: stanford_models [motions] [seed].
// Bunny against bunny, horse and dragon, each pair with target 0 and a positive one. Prints one
// line for each; the exit code is 1 if any answer was wrong, undecided or not to be checked, or
// if hits were too rare or too frequent to mean anything, and 77 if there is no model.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/models.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/toi_oracle.h"

namespace {

using dyop::Motion;
using dyop::RigidPose;
using dyop::Scalar;
using dyop::TimeInterval;
using dyop::ToiOptions;
using dyop::ToiResult;
using dyop::ToiStatus;
using dyop::TriangleMesh;
using dyop::Vector3;
using dyop::testing::OracleBody;
using dyop::testing::ToiOracle;

constexpr int kSkipped = 77;
constexpr TimeInterval kInterval{0, 1};
// All models have a bounding radius of 1.
constexpr Scalar kTolerance = 1e-6;
constexpr std::array<Scalar, 2> kTargets{0, 0.02};
constexpr Scalar kTurningRate = 6;
// Too few motions tell nothing about the rate of hits.
constexpr std::size_t kRateNeeds = 50;

struct Model {
  std::string name;
  TriangleMesh mesh;
  OracleBody oracle{mesh};

  Model(std::string the_name, const std::filesystem::path& file)
      : name(std::move(the_name)), mesh(dyop::testing::load_unit_model(file)) {}
  Model(const Model&) = delete;
};

struct Tally {
  std::size_t queries = 0;
  std::size_t hits = 0;
  std::size_t missed = 0;       // Separated, but the oracle finds them within the target
  std::size_t penetrating = 0;  // closer than promised at a time up to t_safe
  std::size_t loose = 0;        // gap at the impact above target + tolerance, or t_hit not within
  std::size_t undecided = 0;    // other statuses, or the oracle gave up
  Scalar widest = 0;            // gap at the impact - target, over the tolerance
  std::vector<double> milliseconds;
  std::int64_t box_tests = 0;
  std::int64_t triangle_tests = 0;
};

// Two turning bodies that pass each other: the first stays about the origin.
struct MotionPair {
  std::unique_ptr<Motion> a;
  std::unique_ptr<Motion> b;
};

// A curved path or a straight one, turning at up to kTurningRate.
std::unique_ptr<Motion> random_motion(bool is_curved, const Vector3& start, const Vector3& travel,
                                      std::mt19937_64& random) {
  using dyop::testing::random_direction;
  const RigidPose X_begin(dyop::testing::random_rotation(random), start);
  const Vector3 axis = random_direction(random);
  if (!is_curved) {
    const Vector3 w = dyop::testing::random_number(0, kTurningRate, random) * axis;
    return std::make_unique<dyop::ConstantTwistMotion>(X_begin, dyop::Twist{travel, w});
  }
  // Turned by less than pi, at a rate between |w| / 2 and 5/4 |w|.
  const Vector3 w = dyop::testing::random_number(0, kTurningRate / 2, random) * axis;
  const RigidPose X_end(dyop::rotation_from_vector(w) * X_begin.rotation(), start + travel);
  const Vector3 bend = 0.5 * random_direction(random);
  return std::make_unique<dyop::HermiteMotion>(kInterval,
                                               dyop::MotionState{X_begin, {travel + bend, 0.5 * w}},
                                               dyop::MotionState{X_end, {travel - bend, 0.5 * w}});
}

// They start at least 0.2 apart, and fly past at a distance at which about every second pair meets.
MotionPair random_pair(int trial, std::mt19937_64& random) {
  using dyop::testing::random_direction;
  const Vector3 start = dyop::testing::random_number(2.2, 4, random) * random_direction(random);
  const Vector3 side = start.cross(random_direction(random)).normalized();
  const Vector3 passing_at = dyop::testing::random_number(0.4, 2.2, random) * side;
  MotionPair pair;
  pair.a = random_motion(trial % 3 == 1, Vector3::Zero(), dyop::testing::random_vector(0.2, random),
                         random);
  pair.b = random_motion(trial % 3 != 0, start, 2 * (passing_at - start), random);
  return pair;
}

void check_safe(ToiOracle& oracle, const ToiResult& result, Scalar target, Tally& tally) {
  // The resolution is what the oracle leaves open.
  constexpr Scalar kResolution = kTolerance / 8;
  const Scalar floor = target + kTolerance / 4 - result.rounding_allowance;
  const auto broken =
      oracle.first_time_within(floor - kResolution, {kInterval.begin, result.t_safe}, kResolution);
  if (broken.t && !(broken.at_t.upper >= floor)) {
    ++(result.status == ToiStatus::Separated ? tally.missed : tally.penetrating);
  }
}

void check_impact(ToiOracle& oracle, const ToiResult& result, Scalar target, Tally& tally) {
  constexpr Scalar kFine = kTolerance / 1024;
  const Scalar gap = oracle.distance_at(result.t_safe, kFine).upper - target;
  tally.widest = std::max(tally.widest, gap / kTolerance);
  const bool is_tight = gap <= kTolerance + result.rounding_allowance + kFine;
  const bool is_bracketed =
      !result.t_hit || oracle.distance_at(*result.t_hit, kFine).lower - target <
                           kTolerance / 2 + result.rounding_allowance;
  if (!is_tight || !is_bracketed) ++tally.loose;
}

void examine(const Model& a, const Model& b, const MotionPair& motions, Scalar target,
             Tally& tally) {
  ToiOptions options;
  options.target_distance = target;
  options.distance_tolerance = kTolerance;
  const auto begin = std::chrono::steady_clock::now();
  const ToiResult result =
      dyop::time_of_impact(a.mesh, *motions.a, b.mesh, *motions.b, kInterval, options);
  const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - begin;
  ++tally.queries;
  tally.milliseconds.push_back(spent.count());
  tally.box_tests += result.statistics.box_tests;
  tally.triangle_tests += result.statistics.leaf_tests;
  const bool is_hit = result.status == ToiStatus::Impact;
  if (!is_hit && !(result.status == ToiStatus::Separated && result.t_safe == kInterval.end)) {
    ++tally.undecided;
    return;
  }
  tally.hits += is_hit;
  ToiOracle oracle(a.oracle, *motions.a, b.oracle, *motions.b);
  try {
    check_safe(oracle, result, target, tally);
    if (is_hit) check_impact(oracle, result, target, tally);
  } catch (const dyop::InternalError&) {
    ++tally.undecided;
  }
}

bool is_right(const Tally& tally) {
  const bool is_representative =
      tally.queries < kRateNeeds ||
      (10 * tally.hits >= 3 * tally.queries && 10 * tally.hits <= 7 * tally.queries);
  return is_representative && tally.missed + tally.penetrating + tally.loose + tally.undecided == 0;
}

void print_heading(std::uint64_t seed) {
  std::printf(
      "seed %llu, tolerance 1e-6, all radii 1, worst gap in tolerances, times in ms, tests a "
      "query\n",
      static_cast<unsigned long long>(seed));
  std::printf("%-14s %6s %7s %5s %6s %11s %5s %9s %9s %7s %7s %7s %9s %9s\n", "pair", "target",
              "queries", "hits", "missed", "penetrating", "loose", "undecided", "worst gap",
              "median", "mean", "max", "boxes", "triangles");
}

void print(const std::string& name, Scalar target, Tally& tally) {
  std::vector<double>& times = tally.milliseconds;
  std::sort(times.begin(), times.end());
  const double mean = std::accumulate(times.begin(), times.end(), 0.0) / double(times.size());
  std::printf("%-14s %6.2f %7zu %5zu %6zu %11zu %5zu %9zu %9.6f %7.2f %7.2f %7.2f %9lld %9lld\n",
              name.c_str(), target, tally.queries, tally.hits, tally.missed, tally.penetrating,
              tally.loose, tally.undecided, tally.widest, times[times.size() / 2], mean,
              times.back(), static_cast<long long>(tally.box_tests / std::int64_t(tally.queries)),
              static_cast<long long>(tally.triangle_tests / std::int64_t(tally.queries)));
  std::fflush(stdout);
}

bool study(const Model& a, const Model& b, int count, std::uint64_t seed) {
  bool is_all_right = true;
  for (const Scalar target : kTargets) {
    std::mt19937_64 random(seed);
    Tally tally;
    for (int k = 0; k < count; ++k) examine(a, b, random_pair(k, random), target, tally);
    print(a.name + "-" + b.name, target, tally);
    is_all_right = is_all_right && is_right(tally);
  }
  return is_all_right;
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::max(1, std::atoi(argv[1])) : 200;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  using dyop::testing::find_model;
  const auto bunny_file = find_model("bunny.obj");
  if (!bunny_file) {
    std::printf("skipped: no bunny.obj (Debian package glmark2-data)\n");
    return kSkipped;
  }
  const Model bunny("bunny", *bunny_file);
  print_heading(seed);
  bool is_all_right = study(bunny, bunny, count, seed);
  for (const char* file : {"horse.3ds", "dragon.ply"}) {
    const std::string name = std::filesystem::path(file).stem().string();
    if (const auto found = find_model(file)) {
      is_all_right = study(bunny, Model(name, *found), count, seed) && is_all_right;
    } else {
      std::printf("bunny-%s skipped: no %s at hand\n", name.c_str(), file);
    }
  }
  return is_all_right ? 0 : 1;
}
