// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "dyop/chain/robot.h"

namespace DYOP_EXPORT dyop {

/// What is proven of two links for all joint values within their limits.
enum class PairVerdict {
  Never,     ///< proven: apart at all joint values
  Always,    ///< proven: they touch at all joint values
  Can,       ///< they touch at `witness`
  Undecided  ///< neither; undecided_share of the joint values is left
};

/// "never", "always", "can" or "undecided".
const char* to_string(PairVerdict verdict);

struct LinkPairReport {
  std::size_t first = 0;  ///< links, first < second
  std::size_t second = 0;
  PairVerdict verdict = PairVerdict::Undecided;
  /// Joined directly, or only through links without shapes: such links mostly touch by design.
  bool is_adjacent = false;
  /// Free coordinates (Robot) at which the links touch, within the limits; those that do not matter
  /// are in the middle of their limits, or zero, or at the limit nearest to it. If Can or Always.
  std::optional<JointVector> witness;
  /// The share of the sampled joint values at which they touch; 1 where there were no samples to
  /// take because no joint moves them.
  Scalar touching_share = 0;
  Scalar undecided_share = 0;  ///< of the box of joint values; 0 unless Undecided
  std::size_t joints = 0;      ///< free coordinates that move one link against the other
  std::int64_t boxes = 0;      ///< boxes of joint values examined
};

struct LinkPairOptions {
  /// Boxes of joint values to examine per pair, at most; >= 1.
  std::int64_t max_boxes = 1'000'000;
  /// Joint values to try before the long search of each pair; >= 0.
  int samples = 3000;
  /// Names of the links of each pair to decide; empty: all pairs of links that have shapes.
  std::vector<std::pair<std::string, std::string>> only = {};
  /// Time at which the pairs that are left stay undecided. Checked at every joint value.
  std::optional<std::chrono::steady_clock::time_point> deadline = {};
  /// Cooperative cancellation, likewise.
  std::stop_token stop = {};
  /// Called by the threads of the work, one at a time, with the number of pairs done so far; must
  /// not throw.
  std::function<void(std::size_t done, std::size_t all)> on_progress = {};
};

/// Decides for every pair of links that have shapes whether they can touch within the limits of the
/// joints, in the order of the links.
///
/// Branch and bound over boxes of joint values: a box is proven where the distance at its middle
/// exceeds what the joints can move the links by, and else is halved. Revolute joints without
/// limits, or with more than a turn, are taken for one turn; of several that follow one coordinate
/// for the turns until all have come back, or, beyond 60, for one turn each, independently: then
/// only samples can show that they touch. A prismatic joint without limits leaves its pairs
/// undecided. A closed mesh is a solid: a link inside another touches it.
///
/// Pairs run on several threads; the result does not depend on their number unless a deadline or
/// stop ends the work.
/// @throws InvalidArgument if a link of `only` is unknown, an option out of range, or the limits
/// leave a coordinate no value.
/// Proof: docs/robots.md.
std::vector<LinkPairReport> decide_link_pairs(const Robot& robot,
                                              const LinkPairOptions& options = {});

}  // namespace dyop
