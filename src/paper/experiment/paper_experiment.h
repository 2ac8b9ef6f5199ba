// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "dyop/core/types.h"

/// The tests of [DyOP]: ten triangles, Obj1 to Obj10, each moved against the nine others until it
/// is at one fixed distance. The paper gives no coordinates, so the triangles are random, from a
/// seed.
namespace dyop::cli {

inline constexpr int kObjectCount = 10;
inline constexpr Scalar kPaperGap = 0.1;

template <int dimension>
using PaperPoint = Eigen::Matrix<Scalar, dimension, 1>;

template <int dimension>
using PaperTriangle = std::array<PaperPoint<dimension>, 3>;

template <int dimension>
struct PaperPair {
  PaperTriangle<dimension> a;  ///< the moved object
  PaperTriangle<dimension> b;
};

/// One of the 90 tests. Objects are numbered from 1, as in the paper.
template <int dimension>
struct PaperTest {
  int object = 1;
  int against = 2;
  PaperPair<dimension> pair;  ///< kPaperGap apart
  PaperPoint<dimension> away =
      PaperPoint<dimension>::UnitX();  ///< unit, from b to a: the direction from which a came
};

/// Vertices uniform in [-1, 1] along each axis.
template <int dimension>
PaperTriangle<dimension> random_paper_triangle(std::mt19937_64& random);

/// The 90 tests of ten such triangles; object i arrives along a random line through both centroids.
template <int dimension>
DYOP_EXPORT std::vector<PaperTest<dimension>> make_paper_tests(std::uint64_t seed);

/// The same pair as different input: rotated and shifted as a whole at random, each triangle's
/// vertices in random order. The distance stays the same; the boxes, and so what the pivot picks,
/// do not.
template <int dimension>
PaperPair<dimension> rotated_copy(const PaperPair<dimension>& pair, std::mt19937_64& random);

/// Moving steps: the object comes in from one unit farther away, turning by up to a radian about
/// its centroid, in equal steps that end at the test's own position; the whole path as in
/// rotated_copy().
template <int dimension>
void append_path(const PaperTest<dimension>& test, int steps, std::mt19937_64& random,
                 std::vector<PaperPair<dimension>>& pairs);

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

/// Figure 4 of [DyOP] as SVG: the time of one query per object and algorithm, with quartiles, and
/// below each object the number of its 9 tests that an algorithm got wrong.
DYOP_EXPORT std::string draw_times(const PaperSeries& series, const PaperSettings& settings);

/// Figure 5 of [DyOP] as SVG: the percentage by which DyOP, certified and as published, is faster
/// than GJK and than Lin-Canny, per object, with the range that the paper reports.
DYOP_EXPORT std::string draw_gains(const PaperSeries& series, const PaperSettings& settings);

/// Figures 2 and 3 of [DyOP] as SVG: both boxes, the internal box, the pivot, the vertices kept,
/// and the shortest segment between them beside the true one. In space, seen from above a corner.
template <int dimension>
DYOP_EXPORT std::string draw_construction(const PaperTest<dimension>& test);

/// The results as Markdown tables that are also readable as plain text.
DYOP_EXPORT std::string describe_paper(const PaperResults& results);

/// One line per object, algorithm and series: times, gains of certified DyOP, errors.
DYOP_EXPORT std::string paper_times_csv(const PaperResults& results);

/// One line per test: vertices to the last digit, proven bounds, and every algorithm's value.
DYOP_EXPORT std::string paper_tests_csv(const PaperResults& results);

/// Summary as one JSON object: settings, and one row per algorithm and series.
DYOP_EXPORT std::string paper_json(const PaperResults& results);

}  // namespace dyop::cli
