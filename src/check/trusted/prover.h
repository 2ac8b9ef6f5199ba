// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "check/trusted/recording.h"

/// Which pairs of bodies are proven over which intervals. TRUSTED.
namespace dyop_check {

/// All are counted, the first hundred are listed.
template <typename T>
struct Findings {
  std::int64_t count = 0;
  std::vector<T> listed;

  void add(const T& found) {
    constexpr std::int64_t kMost = 100;
    if (count++ < kMost) listed.push_back(found);
  }
};

/// A pair, an interval and what was found in it.
struct Finding {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  double begin = 0;
  double end = 0;
  double distance = 0;  ///< refuted: an upper bound of the distance at `begin`
  double target = 0;
};

/// Two segments of a body's motion that do not meet.
struct Jump {
  std::uint32_t body = 0;
  double t = 0;
  double length = 0;
};

struct Verdict {
  std::int64_t pairs = 0;        ///< pairs of bodies that count, at the start
  std::int64_t intervals = 0;    ///< of near pairs, each within a step, proven
  std::int64_t uncertified = 0;  ///< of pairs that the run itself calls so, not proven
  std::int64_t node_pairs = 0;
  double least_target = kInfinity;  ///< of near pairs
  double largest_target = 0;
  Findings<Finding> refuted;
  Findings<Finding> undecided;
  Findings<Jump> jumps;

  bool is_refuted() const { return refuted.count + jumps.count > 0; }
  bool is_proven() const { return !is_refuted() && undecided.count == 0; }
};

struct CheckOptions {
  /// Factor of the targets: 1 checks the distances that the run promises, 0 that nothing touches.
  double scale = 1;
  std::int64_t most_node_pairs = 20'000'000;  ///< for one pair within one step
};

/// Proves that every pair that counts keeps its target distance at all times of the run, or says
/// where it does not, or where neither was found.
Verdict check_geometry(const Recording& recording, const CheckOptions& options);

}  // namespace dyop_check
