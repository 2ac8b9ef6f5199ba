// SPDX-License-Identifier: BSD-3-Clause
#include "chain/path_cells.h"

#include <algorithm>
#include <numeric>

#include "chain/chain_frame.h"

namespace dyop::chain_internal {
namespace {

// Minimum number of cells per path, of equal length within a piece. More: closer bounds on short
// parts, each for about a microsecond for a six-axis arm.
constexpr std::size_t kCells = 16;

}  // namespace

void PathCells::set(const KinematicChain& chain, const JointPath& path,
                    std::span<const LinkMotion> links) {
  const std::span<const Scalar> pieces = path.times();
  const std::size_t per_piece = (kCells + pieces.size() - 2) / (pieces.size() - 1);
  times_.clear();
  begins_piece_.clear();
  for (std::size_t piece = 0; piece + 1 < pieces.size(); ++piece) {
    const Scalar begin = pieces[piece];
    const Scalar end = pieces[piece + 1];
    for (std::size_t i = 0; i < per_piece; ++i) {
      const Scalar fraction = static_cast<Scalar>(i) / static_cast<Scalar>(per_piece);
      times_.push_back(std::min(begin + fraction * (end - begin), end));
      begins_piece_.push_back(i == 0);
    }
  }
  times_.push_back(pieces.back());
  offsets_.assign(1, 0);
  for (const LinkMotion& link : links) {
    offsets_.push_back(offsets_.back() + link.turns().size() + 1);
  }
  bounds_.resize((times_.size() - 1) * offsets_.back());
  states_.resize((times_.size() - 1) * links.size());
  middles_.resize(times_.size() - 1);
  parts_.resize(path.coordinate_count());
  frames_.resize(links.size());
  order_.resize(links.size());
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::stable_sort(order_.begin(), order_.end(), [&chain](std::size_t a, std::size_t b) {
    return chain.depth(a) < chain.depth(b);
  });
  for (std::size_t cell = 0; cell + 1 < times_.size(); ++cell) {
    const TimeInterval part{times_[cell], times_[cell + 1]};
    const PartMiddle middle(part);
    middles_[cell] = middle.time;
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      parts_[j] = joint_part(path, j, cell / per_piece, part, middle.time);
    }
    for (std::size_t i = 0; i < links.size(); ++i) {
      TwistBound* const row = bounds_.data() + cell * offsets_.back() + offsets_[i];
      visit_bounds(
          links[i], middle, kPoseNoise * links[i].pose_scale(part).length,
          [this](std::size_t coordinate) -> const JointPart& { return parts_[coordinate]; },
          [row](std::size_t count, const TwistBound& seen) { row[count] = seen; });
    }
    set_states(chain, links, cell);
  }
}

// A link's frame is its parent's, past one joint; fixed joints are part of the turn after them, or
// of X_JL.
void PathCells::set_states(const KinematicChain& chain, std::span<const LinkMotion> links,
                           std::size_t cell) {
  for (const std::size_t link : order_) {
    ChainFrame& frame = frames_[link];
    const std::optional<KinematicChain::Step>& step = chain.step(link);
    if (step) {
      frame = frames_[step->parent];
      if (step->type != JointType::Fixed) {
        const KinematicChain::Step& last = links[link].turns().back().step;
        advance(frame, last, parts_[last.coordinate].middle);
      }
    } else {
      frame = {chain.X_WR().rotation(), chain.X_WR().translation(), {}};
    }
    states_[cell * links.size() + link] = link_state(frame, links[link].X_JL());
  }
}

std::size_t PathCells::cell_at(Scalar t) const {
  const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, t);
  return static_cast<std::size_t>(after - times_.begin()) - 1;
}

const MotionState* PathCells::state(std::size_t link, Scalar t) const {
  const std::size_t cell = cell_at(t);
  return middles_[cell] == t ? &states_[cell * frames_.size() + link] : nullptr;
}

TwistBound PathCells::bound(std::size_t link, std::size_t turns, const TimeInterval& part) const {
  const std::size_t first = cell_at(part.begin);
  const TwistBound* row = bounds_.data() + first * offsets_.back() + offsets_[link] + turns;
  TwistBound result = *row;
  for (std::size_t cell = first + 1; cell + 1 < times_.size() && times_[cell] < part.end; ++cell) {
    row += offsets_.back();
    result = {std::max(result.linear_speed, row->linear_speed),
              std::max(result.angular_speed, row->angular_speed),
              std::max(result.linear_acceleration, row->linear_acceleration),
              std::max(result.angular_acceleration, row->angular_acceleration)};
    // Where two pieces meet the twist may jump.
    if (begins_piece_[cell]) result.linear_acceleration = kInfinity;
    if (begins_piece_[cell]) result.angular_acceleration = kInfinity;
  }
  return result;
}

}  // namespace dyop::chain_internal
