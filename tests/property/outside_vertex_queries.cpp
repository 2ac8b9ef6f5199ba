// SPDX-License-Identifier: BSD-3-Clause

// Runs the vertex-face and edge-edge queries of the outside benchmark [Wang2021] and compares with
// their exact answers: outside_vertex_queries [passes] [distance tolerance]. The data is looked for
// in the folder that DYOP_EXTERNAL_DATA names; without it the program says so and returns 77
// (skipped).

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "dyop/toi/vertex_time_of_impact.h"
#include "toi/vertex/exact_contact.h"

namespace {

namespace fs = std::filesystem;

using dyop::ContactRule;
using dyop::EdgeEdgePaths;
using dyop::ToiStatus;
using dyop::VertexFacePaths;
using dyop::VertexPath;
using dyop::VertexToiOptions;

constexpr int kSkipped = 77;

struct Query {
  std::variant<VertexFacePaths, EdgeEdgePaths> paths;
  bool has_contact = false;
  std::string name;
};

struct Outcome {
  bool is_separated = false;
  double nanoseconds = 0;
};

[[noreturn]] void fail(const std::string& where, const std::string& field) {
  throw std::runtime_error(where + ": expected 24 numbers and 0 or 1, found '" + field + "'");
}

Query parse(const std::string& line, bool is_edge_edge, const std::string& where) {
  std::array<double, 25> numbers{};
  std::istringstream fields(line);
  for (double& number : numbers) {
    std::string field;
    std::getline(fields, field, ',');
    char* end = nullptr;
    number = std::strtod(field.c_str(), &end);
    if (field.empty() || (*end != '\0' && *end != '\r')) fail(where, field);
  }
  if (numbers[24] != 0 && numbers[24] != 1) fail(where, std::to_string(numbers[24]));
  const auto path = [&](std::size_t i) {
    const double* begin = &numbers[3 * i];
    const double* end = &numbers[12 + 3 * i];
    return VertexPath{{begin[0], begin[1], begin[2]}, {end[0], end[1], end[2]}};
  };
  Query query{VertexFacePaths{path(0), {path(1), path(2), path(3)}}, numbers[24] == 1, where};
  if (is_edge_edge) query.paths = EdgeEdgePaths{{path(0), path(1)}, {path(2), path(3)}};
  return query;
}

std::vector<Query> read_queries(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".csv") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Query> queries;
  for (const fs::path& file : files) {
    const bool is_edge_edge = file.stem().string().ends_with("__edge-edge");
    std::ifstream in(file);
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
      const std::string where = file.filename().string() + ":" + std::to_string(number);
      queries.push_back(parse(line, is_edge_edge, where));
    }
  }
  return queries;
}

// Each pass asks every query once, in turn, as a simulation would; the shortest time of all passes
// counts, which leaves out what other programs took.
template <typename Ask>
std::vector<Outcome> ask_all(const std::vector<Query>& queries, int passes, const Ask& ask) {
  using Clock = std::chrono::steady_clock;
  std::vector<Outcome> outcomes(queries.size());
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const Clock::time_point begin = Clock::now();
      outcomes[i].is_separated = std::visit(ask, queries[i].paths);
      const double spent = std::chrono::duration<double, std::nano>(Clock::now() - begin).count();
      if (pass == 0 || spent < outcomes[i].nanoseconds) outcomes[i].nanoseconds = spent;
    }
  }
  return outcomes;
}

std::vector<Outcome> ask_all(const std::vector<Query>& queries, const VertexToiOptions& options,
                             int passes) {
  return ask_all(queries, passes, [&](const auto& paths) {
    return dyop::time_of_impact(paths, {}, options).status == ToiStatus::Separated;
  });
}

struct Summary {
  int missed = 0;
  int false_contacts = 0;
};

Summary report(const char* title, const std::vector<Query>& queries,
               const std::vector<Outcome>& outcomes, bool (*is_counted)(const Query&)) {
  Summary summary;
  std::vector<double> times;
  int contacts = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (!is_counted(queries[i])) continue;
    const bool is_separated = outcomes[i].is_separated;
    times.push_back(outcomes[i].nanoseconds);
    contacts += queries[i].has_contact ? 1 : 0;
    if (!is_separated && !queries[i].has_contact) ++summary.false_contacts;
    if (is_separated && queries[i].has_contact) {
      ++summary.missed;
      std::cout << "MISSED " << queries[i].name << '\n';
    }
  }
  std::sort(times.begin(), times.end());
  double total = 0;
  for (const double time : times) total += time;
  std::cout << std::left << std::setw(24) << title << std::right << std::fixed
            << std::setprecision(2) << std::setw(8) << times.size() << std::setw(9) << contacts
            << std::setw(8) << summary.missed << std::setw(8) << summary.false_contacts
            << std::setw(11) << times[times.size() / 2] / 1000 << std::setw(9)
            << total / static_cast<double>(times.size()) / 1000 << std::setw(9)
            << times.back() / 1000 << '\n';
  return summary;
}

int run(int passes, double tolerance) {
  const char* data = std::getenv("DYOP_EXTERNAL_DATA");
  const fs::path folder = fs::path(data == nullptr ? "" : data) / "ccd-queries";
  if (data == nullptr || !fs::is_directory(folder)) {
    std::cout << "skipped: DYOP_EXTERNAL_DATA names no folder that holds ccd-queries\n";
    return kSkipped;
  }
  const std::vector<Query> queries = read_queries(folder);
  if (queries.empty()) throw std::runtime_error("no .csv file in " + folder.string());
  const auto any = [](const Query&) { return true; };
  const auto is_face = [](const Query& query) { return query.paths.index() == 0; };
  const auto is_edge = [](const Query& query) { return query.paths.index() == 1; };
  std::cout
      << "tolerance " << tolerance << ", best of " << passes << " passes\n"
      << "                         queries contacts  missed   false  median us  mean us worst us\n";

  VertexToiOptions options;
  options.distance_tolerance = tolerance;
  const Summary near = report("within tolerance", queries, ask_all(queries, options, passes), any);
  options.contact_rule = ContactRule::Exact;
  const std::vector<Outcome> outcomes = ask_all(queries, options, passes);
  const Summary exact = report("exact", queries, outcomes, any);
  report("exact, vertex-face", queries, outcomes, is_face);
  report("exact, edge-edge", queries, outcomes, is_edge);
  const auto ask_predicate = [](const auto& paths) {
    return !dyop::toi_internal::has_contact(paths);
  };
  const Summary predicate =
      report("exact predicate alone", queries, ask_all(queries, passes, ask_predicate), any);
  const int wrong = near.missed + exact.missed + exact.false_contacts + predicate.missed +
                    predicate.false_contacts;
  return wrong == 0 ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    const int passes = count > 1 ? std::max(1, std::atoi(arguments[1])) : 3;
    return run(passes, count > 2 ? std::atof(arguments[2]) : 1e-6);
  } catch (const std::exception& error) {
    std::cerr << "outside_vertex_queries: " << error.what() << '\n';
    return 1;
  }
}
