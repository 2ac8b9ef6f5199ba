// SPDX-License-Identifier: BSD-3-Clause
#include "paper/experiment/paper_report.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

namespace dyop::cli {
namespace {

// A number with this many decimals.
std::string fixed(Scalar x, int decimals) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*f", decimals, x);
  return buffer;
}

struct Range {
  Scalar low;
  Scalar high;
};

Range gain_range(const AlgorithmMeasurement& fast, const AlgorithmMeasurement& slow) {
  Range range{kInfinity, -kInfinity};
  for (int object = 1; object <= kObjectCount; ++object) {
    const Scalar gain = gain_percent(fast, slow, object);
    range = {std::min(range.low, gain), std::max(range.high, gain)};
  }
  return range;
}

Range time_range(const AlgorithmMeasurement& algorithm) {
  Range range{kInfinity, 0};
  for (const ObjectMeasurement& object : algorithm.objects) {
    range = {std::min(range.low, object.median_ns), std::max(range.high, object.median_ns)};
  }
  return range;
}

std::string words(const Range& range, int decimals = 0) {
  return fixed(range.low, decimals) + " to " + fixed(range.high, decimals);
}

void describe_series(std::ostringstream& out, const PaperSeries& series) {
  const bool has_warm = &series.best_certified_dyop() != &series.of("certified DyOP");
  out << "\n## " << series.title() << "\n\n"
      << "| algorithm | ns per query | " << (has_warm ? "warm certified DyOP faster by, % | " : "")
      << "certified DyOP faster by, % | published DyOP faster by, % | "
         "wrong of 90 | value / truth when wrong: mean | worst | queries wrong, % |\n"
      << "|---|---|---|---|---|---|---|---|" << (has_warm ? "---|" : "") << '\n';
  const AlgorithmMeasurement& certified = series.of("certified DyOP");
  const AlgorithmMeasurement& best = series.best_certified_dyop();
  const AlgorithmMeasurement& published = series.of("published DyOP");
  for (const AlgorithmMeasurement& algorithm : series.algorithms) {
    const auto gain_of = [&](const AlgorithmMeasurement& fast) {
      return &fast == &algorithm ? std::string("-") : words(gain_range(fast, algorithm));
    };
    const bool is_wrong = algorithm.wrong_tests() > 0;
    out << "| " << algorithm.name << " | " << words(time_range(algorithm)) << " | "
        << (has_warm ? gain_of(best) + " | " : "") << gain_of(certified) << " | "
        << gain_of(published) << " | " << algorithm.wrong_tests() << " | "
        << (is_wrong ? fixed(algorithm.mean_factor, 2) : "-") << " | "
        << (is_wrong ? fixed(algorithm.worst_factor, 2) : "-") << " | "
        << fixed(100 * algorithm.wrong_query_share(), 3) << " |\n";
  }
}

void describe_errors(std::ostringstream& out, const PaperResults& results) {
  out << "\n## Errors of published DyOP by gap\n\n"
      << results.settings.error_pairs
      << " random pairs per row, in a square or cube of side 2, brought to the gap.\n\n"
      << "| dimension | gap | wrong, % | value / truth when wrong: mean | worst |\n"
      << "|---|---|---|---|---|\n";
  for (const GapErrors& row : results.errors) {
    out << "| " << row.dimension << " | " << row.gap << " | "
        << fixed(100.0 * row.wrong / row.pairs, 1) << " | " << fixed(row.mean_factor, 2) << " | "
        << fixed(row.worst_factor, 1) << " |\n";
  }
}

}  // namespace

std::string describe_paper(const PaperResults& results) {
  std::ostringstream out;
  out << "# The experiment of the DyOP paper\n\n"
      << "Ten random triangles, each moved against the nine others until they are " << kPaperGap
      << " apart: 90 tests.\nSeed " << results.settings.seed << ", " << results.settings.repetitions
      << " interleaved repetitions of " << 9 * results.settings.copies
      << " queries per object, no input twice.\nRanges are over the ten objects; times are "
         "medians. "
         "Wrong: off by more than "
      << kWrongBy << ".\n";
  for (const PaperSeries& series : results.series) describe_series(out, series);
  describe_errors(out, results);
  Scalar widest = 0;
  for (const TestRecord& test : results.tests) widest = std::max(widest, test.upper - test.lower);
  out << "\nThe true distance of each of the 90 tests is proven to within " << widest << ".\n";
  return out.str();
}

std::string paper_times_csv(const PaperResults& results) {
  std::ostringstream out;
  out << "dimension,moving,object,algorithm,median_ns,lower_quartile_ns,upper_quartile_ns,"
         "certified_dyop_gain_percent,published_dyop_gain_percent,wrong_tests_of_9,wrong_queries,"
         "queries\n";
  for (const PaperSeries& series : results.series) {
    const AlgorithmMeasurement& certified = series.of("certified DyOP");
    const AlgorithmMeasurement& published = series.of("published DyOP");
    for (int object = 1; object <= kObjectCount; ++object) {
      for (const AlgorithmMeasurement& algorithm : series.algorithms) {
        const ObjectMeasurement& m = algorithm.objects[static_cast<std::size_t>(object - 1)];
        out << series.dimension << ',' << series.is_moving << ',' << object << ",\""
            << algorithm.name << "\"," << fixed(m.median_ns, 2) << ','
            << fixed(m.lower_quartile_ns, 2) << ',' << fixed(m.upper_quartile_ns, 2) << ','
            << fixed(gain_percent(certified, algorithm, object), 1) << ','
            << fixed(gain_percent(published, algorithm, object), 1) << ',' << m.wrong_tests << ','
            << m.wrong_queries << ',' << m.queries << '\n';
      }
    }
  }
  return out.str();
}

std::string paper_tests_csv(const PaperResults& results) {
  std::ostringstream out;
  out.precision(17);
  out << "dimension,object,against";
  for (const char* triangle : {"a", "b"}) {
    for (int k = 0; k < 3; ++k) {
      for (const char* axis : {"x", "y", "z"}) out << ',' << triangle << k << axis;
    }
  }
  out << ",lower,upper";
  for (const std::string& name : results.algorithm_names) out << ",\"" << name << '"';
  out << '\n';
  for (const TestRecord& test : results.tests) {
    out << test.dimension << ',' << test.object << ',' << test.against;
    for (std::size_t k = 0; k < test.vertices.size(); ++k) {
      out << ',' << test.vertices[k];
      if (test.dimension == 2 && k % 2 == 1) out << ",0";  // z
    }
    out << ',' << test.lower << ',' << test.upper;
    for (const Scalar value : test.values) out << ',' << value;
    out << '\n';
  }
  return out.str();
}

std::string paper_json(const PaperResults& results) {
  nlohmann::ordered_json json;
  json["seed"] = results.settings.seed;
  json["repetitions"] = results.settings.repetitions;
  json["gap"] = kPaperGap;
  for (const PaperSeries& series : results.series) {
    for (const AlgorithmMeasurement& algorithm : series.algorithms) {
      const Range times = time_range(algorithm);
      const Range gains = gain_range(series.of("certified DyOP"), algorithm);
      nlohmann::ordered_json row;
      row["dimension"] = series.dimension;
      row["is_moving"] = series.is_moving;
      row["algorithm"] = algorithm.name;
      row["is_certified"] = algorithm.is_certified;
      row["median_ns"] = {times.low, times.high};
      row["certified_dyop_gain_percent"] = {gains.low, gains.high};
      row["wrong_tests"] = algorithm.wrong_tests();
      row["mean_factor_when_wrong"] = algorithm.mean_factor;
      row["worst_factor"] = algorithm.worst_factor;
      row["wrong_query_share"] = algorithm.wrong_query_share();
      json["results"].push_back(row);
    }
  }
  return json.dump();
}

}  // namespace dyop::cli
