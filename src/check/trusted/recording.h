// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "check/trusted/hdf5_table.h"
#include "check/trusted/json.h"
#include "check/trusted/motion.h"
#include "check/trusted/shape.h"

/// The bodies of a recorded run, their motions, and which of them must keep which distance
/// (docs/formats.md, "Recordings"). TRUSTED.
namespace dyop_check {

using Pair = std::pair<std::uint32_t, std::uint32_t>;  ///< the smaller number first

Pair ordered(std::uint64_t a, std::uint64_t b);

/// The last of what holds from its time `from` on; before all of them, the first.
template <typename T>
const T& at_time(const std::vector<T>& all, double t) {
  const auto later = std::upper_bound(all.begin(), all.end(), t,
                                      [](double x, const T& entry) { return x < entry.from; });
  return later == all.begin() ? all.front() : *std::prev(later);
}

/// A line of the file that holds from a time on; the layers of laws read more from it.
struct Line {
  double from = 0;
  Json json;
};

/// A body with one shape and mass: with others it is another one here, that continues it.
struct RecordedBody {
  std::string name;
  std::uint32_t slot = 0;  ///< number in the file; after its end another body may have it
  double from = 0;         ///< time from which it exists
  std::optional<std::uint32_t> continues;  ///< the same body with what it was before
  bool is_dynamic = false;
  bool is_sensor = false;
  Vec center_of_mass;  ///< in the body's frame
  std::shared_ptr<const Body> shape;
  double bounding_radius = 0;
  double size = 0;                ///< for default distances
  std::vector<Segment> segments;  ///< in order of time
  std::set<double> placed;        ///< when the caller put it elsewhere
  std::vector<Line> lines;        ///< at least one

  /// The segment followed at t; where two meet, the later one, or the one before. Null: absent.
  const Segment* segment(double t, bool before = false) const;
};

/// What holds between bodies from a time on. Pairs are of slots.
struct Rules {
  double from = 0;
  std::optional<double> target_distance;
  std::map<Pair, double> target_distances;
  std::set<Pair> untested;  ///< filters, joints
  Json line;                ///< null: the file has none, and all pairs count
};

struct Recording {
  std::vector<RecordedBody> bodies;
  std::map<std::uint64_t, std::vector<std::uint32_t>> in_slot;  ///< bodies, in order of time
  std::vector<std::pair<double, double>> steps;                 ///< without gaps
  double begin = 0;
  double end = 0;
  bool is_complete = false;  ///< the run has ended in order
  std::vector<Rules> rules;  ///< in order of time, at least one
  /// Times from which, to which, the run itself calls a pair of slots uncertified: it began too
  /// near, or crossed.
  std::map<Pair, std::vector<std::pair<double, double>>> uncertified;

  /// The body in a slot at a time.
  /// @throws BadFile
  std::uint32_t body_at(std::uint64_t slot, double t) const;
  double target(std::uint32_t a, std::uint32_t b, const Rules& at) const;
  bool is_tested(std::uint32_t a, std::uint32_t b, const Rules& at) const;
  bool is_uncertified(std::uint32_t a, std::uint32_t b, double t) const;
};

/// The number of rows of a table, or of bytes, that belong to the run: those counted by the last row
/// of /frames.
std::uint64_t count_of(const Hdf5Reader& file, const char* column);

/// The columns of a table, as far as they belong to the run.
struct Table {
  const Hdf5Reader& file;
  const char* name;
  std::uint64_t count;

  Table(const Hdf5Reader& reader, const char* table, const char* counted)
      : file(reader), name(table), count(count_of(reader, counted)) {}
  std::vector<double> reals(const char* column) const { return file.reals(name, column, count); }
  std::vector<std::uint64_t> integers(const char* column) const {
    return file.integers(name, column, count);
  }
  std::vector<Vec> vectors(const char* column) const { return file.vectors(name, column, count); }
};

/// @throws BadFile
Recording read_recording(const Hdf5Reader& file);

}  // namespace dyop_check
