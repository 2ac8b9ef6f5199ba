// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "dyop/core/types.h"
#include "paper/experiment/paper_tests.h"

namespace dyop::cli {

/// How wrong published DyOP is on random triangles at one gap.
struct GapErrors {
  int dimension = 2;
  Scalar gap = 0;
  int pairs = 0;
  int wrong = 0;           ///< value off by more than kWrongBy
  Scalar mean_factor = 1;  ///< value over true distance, where wrong
  Scalar worst_factor = 1;
};

/// Random triangles in [-1, 1]^2 and [-1, 1]^3, moved to each gap along the line of their nearest
/// points; `pairs` of them per row.
std::vector<GapErrors> measure_gap_errors(std::uint64_t seed, int pairs);

/// What is measured: see docs/algorithms/published_dyop.md, "The paper's experiment".
struct PaperSettings {
  std::uint64_t seed = 1;
  int repetitions = 101;    ///< timed batches per object and algorithm, each with new inputs
  int copies = 64;          ///< queries per test in a batch
  int error_pairs = 20000;  ///< random pairs per row of the table of errors
};

/// An algorithm's times and errors for one object, moved against the nine others.
struct ObjectMeasurement {
  Scalar median_ns = 0;  ///< of one query, over the repetitions
  Scalar lower_quartile_ns = 0;
  Scalar upper_quartile_ns = 0;
  int wrong_tests = 0;             ///< of the 9 tests: value off by more than kWrongBy
  std::int64_t wrong_queries = 0;  ///< the same for the first repetition's timed queries
  std::int64_t queries = 0;
};

struct AlgorithmMeasurement {
  std::string name;
  bool is_certified = false;
  std::array<ObjectMeasurement, kObjectCount> objects;
  /// Value over true distance, for those of the 90 tests that are wrong; 1 if none is.
  Scalar mean_factor = 1;
  Scalar worst_factor = 1;

  int wrong_tests() const;
  Scalar wrong_query_share() const;
};

/// All algorithms on one kind of input.
struct PaperSeries {
  int dimension = 2;
  bool is_moving = false;
  std::vector<AlgorithmMeasurement> algorithms;

  const AlgorithmMeasurement& of(const std::string& name) const;
  bool has(const std::string& name) const;
  /// Certified DyOP, warm-started from the last features where available.
  const AlgorithmMeasurement& best_certified_dyop() const;
  /// "2D", "3D, moving steps" and so on.
  std::string title() const;
};

/// One of the 90 tests with every algorithm's value.
struct TestRecord {
  int dimension = 2;
  int object = 1;
  int against = 2;
  std::vector<Scalar>
      vertices;      ///< of the moved triangle, then of the other: dimension * 6 numbers
  Scalar lower = 0;  ///< proven
  Scalar upper = 0;
  std::vector<Scalar> values;  ///< in the order of algorithm_names
};

struct PaperResults {
  PaperSettings settings;
  std::vector<std::string> algorithm_names;
  std::vector<TestRecord> tests;
  std::vector<PaperSeries> series;  ///< 2D and 3D at rest, 2D and 3D moving
  std::vector<GapErrors> errors;
};

/// A value this far from the proven distance is wrong; a length, where objects have a size of about
/// one.
inline constexpr Scalar kWrongBy = 1e-9;  // literal: far above rounding, far below the gap

/// Percentage by which `fast` beats `slow` for an object, as the paper defines it: slow / fast - 1.
Scalar gain_percent(const AlgorithmMeasurement& fast, const AlgorithmMeasurement& slow, int object);

/// Runs everything: takes a few seconds with the default settings.
DYOP_EXPORT PaperResults run_paper_experiment(const PaperSettings& settings);

}  // namespace dyop::cli
