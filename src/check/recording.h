// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "check/motion.h"
#include "check/shape.h"

/// A recorded run as it is in the file (docs/formats.md, "Recordings"). TRUSTED.
namespace dyop_check {

using Pair = std::pair<std::uint32_t, std::uint32_t>;  ///< the smaller number first

struct RecordedBody {
  std::string name;
  bool is_dynamic = false;
  bool is_sensor = false;
  std::shared_ptr<const Body> shape;
  std::vector<Segment> segments;  ///< in order of time
};

struct Recording {
  std::vector<RecordedBody> bodies;
  std::vector<std::pair<double, double>> steps;
  double begin = 0;
  double end = 0;
  bool is_complete = false;  ///< the run has ended in order
  bool has_scene = false;    ///< without one, all pairs count, at default distances
  /// What the scene says.
  std::optional<double> target_distance;
  std::map<Pair, double> target_distances;
  std::set<Pair> untested;  ///< filters, joints
  /// Pairs that the run itself says are uncertified: they began too near, or crossed.
  std::set<Pair> uncertified;

  double target(std::uint32_t a, std::uint32_t b) const;
  bool is_tested(std::uint32_t a, std::uint32_t b) const;
};

/// @throws BadFile
Recording read_recording(const std::string& file);

}  // namespace dyop_check
