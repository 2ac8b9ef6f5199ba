// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/link_pairs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#include "chain/pair_search.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

using chain_internal::JointBox;
using chain_internal::LinkHull;

bool drives_others(const Robot& robot, std::size_t free) {
  const auto count = std::count_if(robot.couplings.begin(), robot.couplings.end(),
                                   [&](const auto& coupling) { return coupling.free == free; });
  return count > 1;
}

// A revolute joint that drives no other needs one turn, whatever its limits.
JointBox limits_of(const Robot& robot) {
  constexpr Scalar kHalfTurn = std::numbers::pi_v<Scalar> * (1 + 0x1p-50);  // literal: rounded up
  JointBox box;
  box.middle = JointVector::Zero(Eigen::Index(robot.free_count()));
  box.half = JointVector::Constant(Eigen::Index(robot.free_count()), kInfinity);
  for (std::size_t free = 0; free < robot.free_count(); ++free) {
    const Joint& joint = robot.chain->joints()[robot.free_joints[free]];
    const auto k = Eigen::Index(free);
    const bool is_turn = joint.type == JointType::Revolute && !drives_others(robot, free);
    const Scalar width = joint.upper - joint.lower;
    if (std::isfinite(width) && !(is_turn && width > 2 * kHalfTurn)) {
      box.middle[k] = joint.lower + width / 2;
      box.half[k] = std::max(box.middle[k] - joint.lower, joint.upper - box.middle[k]);
    } else if (is_turn) {
      box.half[k] = kHalfTurn;
      if (std::isfinite(width)) {
        box.middle[k] = joint.lower + width / 2;
      } else if (std::isfinite(joint.lower)) {
        box.middle[k] = joint.lower + kHalfTurn;
      } else if (std::isfinite(joint.upper)) {
        box.middle[k] = joint.upper - kHalfTurn;
      }
    }
  }
  return box;
}

std::size_t index_of(const Robot& robot, const std::string& name) {
  const std::optional<std::size_t> link = robot.chain->find_link(name);
  DYOP_REQUIRE(link, "decide_link_pairs: '", name, "' is not a link of robot '", robot.name, "'");
  return *link;
}

LinkPairReport report_of(const Robot& robot, std::size_t first, std::size_t second) {
  LinkPairReport report;
  report.first = std::min(first, second);
  report.second = std::max(first, second);
  report.is_adjacent = robot.chain->are_neighbours(report.first, report.second);
  return report;
}

std::vector<LinkPairReport> list_pairs(const Robot& robot, const LinkPairOptions& options) {
  const std::span<const Link> links = robot.chain->links();
  std::vector<LinkPairReport> reports;
  for (const auto& [first, second] : options.only) {
    const LinkPairReport report = report_of(robot, index_of(robot, first), index_of(robot, second));
    DYOP_REQUIRE(report.first != report.second, "decide_link_pairs: '", first,
                 "' is not a pair of links");
    if (links[report.first].shape && links[report.second].shape) reports.push_back(report);
  }
  if (!options.only.empty()) return reports;
  for (std::size_t first = 0; first < links.size(); ++first) {
    for (std::size_t second = first + 1; second < links.size(); ++second) {
      if (!links[first].shape || !links[second].shape) continue;
      reports.push_back(report_of(robot, first, second));
    }
  }
  return reports;
}

}  // namespace

const char* to_string(PairVerdict verdict) {
  switch (verdict) {
    case PairVerdict::Never:
      return "never";
    case PairVerdict::Always:
      return "always";
    case PairVerdict::Can:
      return "can";
    case PairVerdict::Undecided:
      break;
  }
  return "undecided";
}

std::vector<LinkPairReport> decide_link_pairs(const Robot& robot, const LinkPairOptions& options) {
  DYOP_REQUIRE(robot.chain, "decide_link_pairs: the robot has no chain");
  DYOP_REQUIRE(options.max_boxes >= 1, "max_boxes must be at least 1, not ", options.max_boxes);
  DYOP_REQUIRE(options.samples >= 0, "samples must be at least 0, not ", options.samples);
  const std::size_t link_count = robot.chain->links().size();
  DYOP_REQUIRE(robot.inner_shapes.size() == link_count, "robot '", robot.name, "' has ",
               robot.inner_shapes.size(), " inner shapes for ", link_count, " links");
  std::vector<LinkPairReport> reports = list_pairs(robot, options);
  const JointBox whole = limits_of(robot);
  std::vector<LinkHull> hulls(link_count);
  tbb::parallel_for(std::size_t{0}, link_count, [&](std::size_t link) {
    const auto& shape = robot.chain->links()[link].shape;
    if (shape) hulls[link] = chain_internal::link_hull(*shape);
  });
  std::mutex progress;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, reports.size(), [&](std::size_t k) {
    LinkPairReport& report = reports[k];
    chain_internal::PairSearch search(robot, hulls[report.first], hulls[report.second], whole,
                                      report, options);
    search.run();
    if (!options.on_progress) return;
    const std::lock_guard lock(progress);
    options.on_progress(++done, reports.size());
  });
  return reports;
}

}  // namespace dyop
