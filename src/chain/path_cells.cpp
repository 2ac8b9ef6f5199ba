// SPDX-License-Identifier: BSD-3-Clause
#include "chain/path_cells.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "chain/chain_frame.h"

namespace dyop::chain_internal {
namespace {

// Radians that all joints together turn in a cell, about. Less: closer bounds over short parts of the
// path, each for about a microsecond for a six-axis arm. Found by measurement.
constexpr Scalar kTurnOfCell = 0.5;
constexpr Scalar kMostCells = 16;  // per piece

// A joint that slides by the radius of the largest link counts as one that turns by a radian.
Scalar turn_of_joint(const KinematicChain& chain, std::size_t coordinate, Scalar travel) {
  if (chain.joints()[chain.joint_of(coordinate)].type != JointType::Prismatic) return travel;
  Scalar radius = 0;
  for (const Link& link : chain.links()) {
    if (link.shape) radius = std::max(radius, link.shape->bounding_radius());
  }
  return radius > 0 ? travel / radius : 0;
}

// The same number for all pieces.
std::size_t cells_per_piece(const KinematicChain& chain, const JointPath& path) {
  Scalar most = 0;
  for (std::size_t piece = 0; piece + 1 < path.times().size(); ++piece) {
    const TimeInterval part{path.times()[piece], path.times()[piece + 1]};
    Scalar turn = 0;
    for (std::size_t j = 0; j < path.coordinate_count(); ++j) {
      turn += turn_of_joint(chain, j, path.bound(j, part).speed * part.length());
    }
    most = std::max(most, turn);
  }
  return static_cast<std::size_t>(std::clamp(std::ceil(most / kTurnOfCell), 1.0, kMostCells));
}

}  // namespace

void PathCells::set(const KinematicChain& chain, const JointPath& path,
                    std::span<const LinkMotion> links) {
  const std::span<const Scalar> pieces = path.times();
  const std::size_t per_piece = cells_per_piece(chain, path);
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

std::size_t PathCells::count_until(Scalar t) const {
  const auto after = std::lower_bound(times_.begin() + 1, times_.end() - 1, t);
  return static_cast<std::size_t>(after - times_.begin());
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
