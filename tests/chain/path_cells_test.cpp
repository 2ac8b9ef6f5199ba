// SPDX-License-Identifier: BSD-3-Clause
#include "chain/path_cells.h"

#include <gtest/gtest.h>

#include <random>

#include "support/inputs/random_inputs.h"
#include "support/oracles/chain_oracle.h"

namespace dyop::testing {
namespace {

using chain_internal::CellMotion;
using chain_internal::PathCells;

bool same_bits(const MotionState& x, const MotionState& y) {
  return x.X_WB.rotation() == y.X_WB.rotation() && x.X_WB.translation() == y.X_WB.translation() &&
         x.twist.v_WB == y.twist.v_WB && x.twist.w_WB == y.twist.w_WB;
}

JointPath random_lines(std::size_t coordinates, int count, std::mt19937_64& random) {
  std::vector<Scalar> times;
  std::vector<JointVector> points;
  for (int i = 0; i < count; ++i) {
    times.push_back(i == 0 ? random_number(-2, 2, random)
                           : times.back() + random_number(0.1, 1, random));
    points.emplace_back(coordinates);
    for (Eigen::Index k = 0; k < points[0].size(); ++k) {
      points.back()[k] = random_number(-3, 3, random);
    }
  }
  return JointPath::linear(times, points);
}

// On trees of all joints and on paths of 1 to 30 pieces.
TEST(PathCells, GiveTheStatesAndNoSmallerBoundsThanTheLinksHave) {
  std::mt19937_64 random(7);
  PathCells cells;
  int known = 0;
  for (int round = 0; round < 200; ++round) {
    const auto chain = std::make_shared<KinematicChain>(random_tree(1, random));
    if (chain->coordinate_count() == 0) continue;
    const auto path = std::make_shared<JointPath>(
        random_lines(chain->coordinate_count(), 2 + random_index(30, random), random));
    std::vector<LinkMotion> links;
    for (std::size_t i = 0; i < chain->links().size(); ++i) links.emplace_back(chain, path, i);
    cells.set(*chain, *path, links);
    const TimeInterval whole = path->domain();
    for (std::size_t i = 0; i < links.size(); ++i) {
      const CellMotion motion(links[i], i, CellMotion::Frame::World, cells);
      for (int k = 0; k < 16; ++k) {
        // Middles of sixteenths are those of cells if the path has one piece.
        const Scalar t = k % 2 == 0 ? whole.begin + whole.length() * (k + 0.5) / 16
                                    : random_number(whole.begin, whole.end, random);
        ASSERT_TRUE(same_bits(motion.state(t), links[i].state(t)));
        known += cells.state(i, t) != nullptr;
      }
      Scalar begin = random_number(whole.begin, whole.end, random);
      Scalar end = random_number(whole.begin, whole.end, random);
      if (begin > end) std::swap(begin, end);
      const TwistBound bound = motion.twist_bound({begin, end});
      for (int k = 0; k <= 20; ++k) {
        const Scalar t = std::min(begin + k * (end - begin) / 20, end);
        if (t == end) continue;  // the twist there may be that of the next piece
        const Twist twist = links[i].twist(t);
        ASSERT_LE(twist.v_WB.norm(), bound.linear_speed * (1 + 1e-14));
        ASSERT_LE(twist.w_WB.norm(), bound.angular_speed * (1 + 1e-14));
      }
      const bool is_smooth = path->piece_at(begin) == path->piece_at(end);
      ASSERT_TRUE(is_smooth == std::isfinite(bound.linear_acceleration));
    }
  }
  EXPECT_GT(known, 50);
}

TEST(PathCells, SeeALinkFromOneBelowItAsItsMotionDoes) {
  std::mt19937_64 random(8);
  PathCells cells;
  for (int round = 0; round < 200; ++round) {
    const auto chain = std::make_shared<KinematicChain>(random_tree(1, random));
    if (chain->coordinate_count() == 0) continue;
    const auto path =
        std::make_shared<JointPath>(random_lines(chain->coordinate_count(), 2, random));
    std::vector<LinkMotion> links;
    for (std::size_t i = 0; i < chain->links().size(); ++i) links.emplace_back(chain, path, i);
    cells.set(*chain, *path, links);
    for (std::size_t i = 0; i < links.size(); ++i) {
      const std::size_t base =
          chain->common_ancestor(i, std::size_t(random_index(int(links.size()), random)));
      const LinkMotion seen(chain, path, i, base);
      const CellMotion motion(seen, i, CellMotion::Frame::Link, cells);
      const Scalar t = random_number(path->domain().begin, path->domain().end, random);
      ASSERT_TRUE(same_bits(motion.state(t), seen.state(t)));
      const TwistBound bound = motion.twist_bound(path->domain());
      ASSERT_LE(seen.twist(t).v_WB.norm(), bound.linear_speed * (1 + 1e-14) + 1e-14);
      ASSERT_LE(seen.twist(t).w_WB.norm(), bound.angular_speed * (1 + 1e-14) + 1e-14);
    }
  }
}

}  // namespace
}  // namespace dyop::testing
