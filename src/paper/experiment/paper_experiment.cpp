// SPDX-License-Identifier: BSD-3-Clause
#include "paper/experiment/paper_experiment.h"

#include <algorithm>
#include <chrono>
#include <random>

#include "dyop/core/error.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/paper/distance_algorithm.h"
#include "dyop/paper/lin_canny.h"
#include "dyop/paper/planar_distance.h"
#include "dyop/paper/published_dyop.h"

namespace dyop::cli {
namespace {

constexpr int kPathSteps = 16;

// Lin-Canny as intended for moving objects: each walk starts where the last one ended. The first
// query of a path starts anywhere, which costs it some steps.
class WarmLinCanny final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "Lin-Canny, warm"; }
  bool is_certified() const override { return true; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    const PlanarDistance d = lin_canny_distance(a, b, &planar_cache_);
    return {d.lower, d.upper};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    const TriangleDistance d = lin_canny_distance(a, b, &cache_);
    return {d.lower, d.upper};
  }

 private:
  mutable LinCannyCache cache_;
  mutable LinCannyCache planar_cache_;
};

// The same for certified DyOP, in space.
class WarmDyop final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "certified DyOP, warm"; }
  bool is_certified() const override { return true; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    const PlanarDistance d = planar_triangle_distance(a, b);
    return {d.lower, d.upper};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    const TriangleDistance d = warm_triangle_distance(a, b, last_a_, last_b_);
    last_a_ = d.feature_a;
    last_b_ = d.feature_b;
    return {d.lower, d.upper};
  }

 private:
  mutable Feature last_a_;
  mutable Feature last_b_;
};

std::vector<const DistanceAlgorithm*> algorithms_for(int dimension, bool is_moving) {
  static const WarmLinCanny warm_lin_canny;
  static const WarmDyop warm_dyop;
  const auto all = distance_algorithms();
  std::vector<const DistanceAlgorithm*> result(all.begin(), all.end());
  if (is_moving) result.push_back(&warm_lin_canny);
  // In the plane the cold kernel only examines six edges, so a warm start gains nothing.
  if (is_moving && dimension == 3) result.push_back(&warm_dyop);
  return result;
}

bool is_wrong(Scalar value, const DistanceBounds& truth) {
  return !(value >= truth.lower - kWrongBy && value <= truth.upper + kWrongBy);
}

template <int dimension>
DistanceBounds true_distance(const PaperPair<dimension>& pair) {
  return distance_algorithms()[0]->distance(pair.a, pair.b);
}

// Nanoseconds per query. The sum keeps the compiler from removing the work.
template <int dimension>
Scalar time_batch(const DistanceAlgorithm& algorithm,
                  const std::vector<PaperPair<dimension>>& batch) {
  using Clock = std::chrono::steady_clock;
  Scalar sum = 0;
  const auto begin = Clock::now();
  for (const PaperPair<dimension>& pair : batch) sum += algorithm.distance(pair.a, pair.b).upper;
  const auto end = Clock::now();
  [[maybe_unused]] static volatile Scalar sink;
  sink = sum;
  return std::chrono::duration<Scalar, std::nano>(end - begin).count() /
         static_cast<Scalar>(batch.size());
}

// The timed input of one object's tests: nothing in it occurs twice, in this batch or a later one.
template <int dimension>
std::vector<PaperPair<dimension>> make_batch(const std::vector<PaperTest<dimension>>& tests,
                                             int object, bool is_moving, int copies,
                                             std::mt19937_64& random) {
  std::vector<PaperPair<dimension>> batch;
  for (int copy = 0; copy < copies; copy += is_moving ? kPathSteps : 1) {
    for (const PaperTest<dimension>& test : tests) {
      if (test.object != object) continue;
      if (is_moving) {
        append_path(test, kPathSteps, random, batch);
      } else {
        batch.push_back(rotated_copy(test.pair, random));
      }
    }
  }
  return batch;
}

template <int dimension>
void count_wrong(ObjectMeasurement& measurement, const DistanceAlgorithm& algorithm,
                 const std::vector<PaperPair<dimension>>& batch) {
  for (const PaperPair<dimension>& pair : batch) {
    const Scalar value = algorithm.distance(pair.a, pair.b).upper;
    measurement.wrong_queries += is_wrong(value, true_distance(pair));
    ++measurement.queries;
  }
}

template <int dimension>
void judge_tests(AlgorithmMeasurement& result, const DistanceAlgorithm& algorithm,
                 const std::vector<PaperTest<dimension>>& tests) {
  int wrong = 0;
  Scalar sum = 0;
  for (const PaperTest<dimension>& test : tests) {
    const Scalar value = algorithm.distance(test.pair.a, test.pair.b).upper;
    const DistanceBounds truth = true_distance(test.pair);
    if (!is_wrong(value, truth)) continue;
    ++wrong;
    ++result.objects[static_cast<std::size_t>(test.object - 1)].wrong_tests;
    sum += value / truth.upper;
    result.worst_factor = std::max(result.worst_factor, value / truth.upper);
  }
  if (wrong > 0) result.mean_factor = sum / wrong;
}

void summarise(ObjectMeasurement& measurement, std::vector<Scalar>& times) {
  std::sort(times.begin(), times.end());
  const auto quantile = [&](std::size_t quarter) {
    return times[quarter * (times.size() - 1) / 4];
  };
  measurement.lower_quartile_ns = quantile(1);
  measurement.median_ns = quantile(2);
  measurement.upper_quartile_ns = quantile(3);
}

// Times of one series: [algorithm][object][repetition].
using Times = std::vector<std::array<std::vector<Scalar>, kObjectCount>>;

// All algorithms get the same batch, one right after another, starting with a different one each
// time, so that whatever else the machine does affects all of them alike.
template <int dimension>
void run_repetition(PaperSeries& series, Times& times,
                    const std::vector<PaperTest<dimension>>& tests, int repetition,
                    const PaperSettings& settings, std::mt19937_64& random) {
  const auto algorithms = algorithms_for(dimension, series.is_moving);
  for (std::size_t object = 0; object < kObjectCount; ++object) {
    const auto batch =
        make_batch(tests, static_cast<int>(object) + 1, series.is_moving, settings.copies, random);
    for (std::size_t turn = 0; turn < algorithms.size(); ++turn) {
      const std::size_t k =
          (turn + object + static_cast<std::size_t>(repetition)) % algorithms.size();
      times[k][object].push_back(time_batch(*algorithms[k], batch));
      if (repetition == 0) count_wrong(series.algorithms[k].objects[object], *algorithms[k], batch);
    }
  }
}

template <int dimension>
void run_series(PaperResults& results, const std::vector<PaperTest<dimension>>& tests,
                bool is_moving) {
  PaperSeries series{dimension, is_moving, {}};
  for (const DistanceAlgorithm* algorithm : algorithms_for(dimension, is_moving)) {
    AlgorithmMeasurement& measurement = series.algorithms.emplace_back();
    measurement.name = algorithm->name();
    measurement.is_certified = algorithm->is_certified();
    judge_tests(measurement, *algorithm, tests);
  }
  Times times(series.algorithms.size());
  std::mt19937_64 random(results.settings.seed + 1);
  for (int repetition = 0; repetition < results.settings.repetitions; ++repetition) {
    run_repetition(series, times, tests, repetition, results.settings, random);
  }
  for (std::size_t k = 0; k < times.size(); ++k) {
    for (std::size_t object = 0; object < kObjectCount; ++object) {
      summarise(series.algorithms[k].objects[object], times[k][object]);
    }
  }
  results.series.push_back(std::move(series));
}

template <int dimension>
void record_tests(PaperResults& results, const std::vector<PaperTest<dimension>>& tests) {
  for (const PaperTest<dimension>& test : tests) {
    TestRecord& record = results.tests.emplace_back();
    record.dimension = dimension;
    record.object = test.object;
    record.against = test.against;
    for (const auto* triangle : {&test.pair.a, &test.pair.b}) {
      for (const auto& p : *triangle) {
        record.vertices.insert(record.vertices.end(), p.begin(), p.end());
      }
    }
    const DistanceBounds truth = true_distance(test.pair);
    record.lower = truth.lower;
    record.upper = truth.upper;
    for (const DistanceAlgorithm* algorithm : distance_algorithms()) {
      record.values.push_back(algorithm->distance(test.pair.a, test.pair.b).upper);
    }
  }
}

}  // namespace

int AlgorithmMeasurement::wrong_tests() const {
  int sum = 0;
  for (const ObjectMeasurement& object : objects) sum += object.wrong_tests;
  return sum;
}

Scalar AlgorithmMeasurement::wrong_query_share() const {
  std::int64_t wrong = 0;
  std::int64_t all = 0;
  for (const ObjectMeasurement& object : objects) {
    wrong += object.wrong_queries;
    all += object.queries;
  }
  return all > 0 ? static_cast<Scalar>(wrong) / static_cast<Scalar>(all) : 0;
}

const AlgorithmMeasurement& PaperSeries::of(const std::string& name) const {
  const auto found = std::find_if(algorithms.begin(), algorithms.end(),
                                  [&](const auto& algorithm) { return algorithm.name == name; });
  DYOP_REQUIRE(found != algorithms.end(), "no algorithm named ", name, " was measured");
  return *found;
}

bool PaperSeries::has(const std::string& name) const {
  return std::any_of(algorithms.begin(), algorithms.end(),
                     [&](const auto& algorithm) { return algorithm.name == name; });
}

const AlgorithmMeasurement& PaperSeries::best_certified_dyop() const {
  const std::string warm = "certified DyOP, warm";
  return of(has(warm) ? warm : "certified DyOP");
}

std::string PaperSeries::title() const {
  return (dimension == 2 ? std::string("2D") : std::string("3D")) +
         (is_moving ? ", moving steps" : ", at rest");
}

Scalar gain_percent(const AlgorithmMeasurement& fast, const AlgorithmMeasurement& slow,
                    int object) {
  const auto k = static_cast<std::size_t>(object - 1);
  return 100 * (slow.objects[k].median_ns / fast.objects[k].median_ns - 1);
}

PaperResults run_paper_experiment(const PaperSettings& settings) {
  PaperResults results;
  results.settings = settings;
  for (const DistanceAlgorithm* algorithm : distance_algorithms()) {
    results.algorithm_names.emplace_back(algorithm->name());
  }
  const auto planar = make_paper_tests<2>(settings.seed);
  const auto solid = make_paper_tests<3>(settings.seed);
  record_tests(results, planar);
  record_tests(results, solid);
  for (const bool is_moving : {false, true}) {
    run_series(results, planar, is_moving);
    run_series(results, solid, is_moving);
  }
  results.errors = measure_gap_errors(settings.seed, settings.error_pairs);
  return results;
}

namespace {

PlanarDistance certified(const PaperPair<2>& pair) {
  return planar_triangle_distance(pair.a, pair.b);
}
TriangleDistance certified(const PaperPair<3>& pair) {
  return triangle_distance(pair.a, pair.b);
}

// Moving b along the normal changes the distance by exactly that amount: so do both the slab that
// proves it and the segment that attains it.
template <int dimension>
PaperPair<dimension> pair_at(Scalar gap, std::mt19937_64& random) {
  for (;;) {
    PaperPair<dimension> pair{random_paper_triangle<dimension>(random),
                              random_paper_triangle<dimension>(random)};
    const auto d = certified(pair);
    if (!(d.lower > 0)) continue;
    for (auto& p : pair.b) p += (gap - d.upper) * d.nhat_AB;
    return pair;
  }
}

template <int dimension>
GapErrors measure(Scalar gap, int pairs, std::mt19937_64& random) {
  GapErrors errors{dimension, gap, pairs};
  Scalar sum = 0;
  for (int k = 0; k < pairs; ++k) {
    const PaperPair<dimension> pair = pair_at<dimension>(gap, random);
    const Scalar value = published_dyop(pair.a, pair.b).distance;
    const Scalar truth = certified(pair).upper;
    if (value <= truth + kWrongBy) continue;
    ++errors.wrong;
    sum += value / truth;
    errors.worst_factor = std::max(errors.worst_factor, value / truth);
  }
  if (errors.wrong > 0) errors.mean_factor = sum / errors.wrong;
  return errors;
}

}  // namespace

std::vector<GapErrors> measure_gap_errors(std::uint64_t seed, int pairs) {
  std::mt19937_64 random(seed);
  constexpr Scalar kGaps[] = {10, 1, 0.3, 0.1, 0.01, 0.001};
  std::vector<GapErrors> rows;
  for (const Scalar gap : kGaps) rows.push_back(measure<2>(gap, pairs, random));
  for (const Scalar gap : kGaps) rows.push_back(measure<3>(gap, pairs, random));
  return rows;
}

}  // namespace dyop::cli
