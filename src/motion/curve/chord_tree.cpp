// SPDX-License-Identifier: BSD-3-Clause
#include "motion/curve/chord_tree.h"

#include <algorithm>
#include <cmath>

#include "dyop/motion/steady_motions.h"
#include "motion/curve/chart_curve.h"

namespace dyop::motion_internal {
namespace {

// Up to this turn the shortest rotation is a window's chord; beyond it may be some turns short.
constexpr Scalar kShortestTurn = 3;

// How far a rotation moves a point at a distance of one from where another rotation moves it.
Scalar turned_away(const Matrix3& x, const Matrix3& y) {
  // The two columns that differ span a plane: the norm of all nine entries is sqrt(2) larger.
  // literal: sqrt(1/2) rounded up.
  return (x - y).norm() * 0.70710678118654758;
}

}  // namespace

// Of pieces first to last - 1. Between two knots the origin strays from the window's chord as a
// straight line does, plus the bow; two turns move apart no faster than their rates differ, from
// either knot.
ChordTree::Window ChordTree::window(const Input& input, std::size_t first, std::size_t last) {
  const Scalar h = input.times[last] - input.times[first];
  const RigidPose& begin = input.pose(first);
  const RigidPose& end = input.pose(last);
  Vector3 turn = input.turns[last] - input.turns[first];
  if (turn.norm() < kShortestTurn) {
    turn = rotation_vector(end.rotation() * begin.rotation().transpose());
  }
  Window window{input.times[last], (end.translation() - begin.translation()) / h, turn / h, 0, 0};
  const SteadyTurn R_WB(begin.rotation(), window.w_WB);
  Scalar strayed = 0;  // at the last knot
  Scalar turned = 0;
  for (std::size_t i = first; i < last; ++i) {
    const Piece& piece = input.pieces[i];
    const RigidPose& next = input.pose(i + 1);
    const Scalar tau = input.times[i + 1] - input.times[first];
    const Scalar strays = norm_of(next.translation() - (begin.translation() + tau * window.v_WB));
    const Scalar turns = turned_away(next.rotation(), R_WB.at(tau));
    const Scalar way = (input.times[i + 1] - input.times[i]) *
                       (norm_of(piece.w_WB - window.w_WB) + piece.turn_spread);
    // In this order NaN survives, until round_up().
    window.linear_deviation =
        std::max(std::max(strays, strayed) + piece.bow, window.linear_deviation);
    window.angular_deviation = std::max((turned + turns + way) / 2, window.angular_deviation);
    strayed = strays;
    turned = turns;
  }
  const Scalar length = input.scale.length + h * norm_of(window.v_WB);
  const Scalar angle = input.scale.angle + norm_of(turn);
  // Twice: at the start of a stretch the motion may be to one side, later to the other.
  window.linear_deviation = 2 * round_up(window.linear_deviation + kMotionNoise * length);
  window.angular_deviation =
      std::min(2.0, 2 * round_up(window.angular_deviation + kMotionNoise * angle));
  return window;
}

ChordTree::ChordTree(std::span<const Scalar> times, std::span<const Piece> pieces,
                     const RigidPose& X_WB, const PoseScale& scale) {
  const std::size_t count = pieces.size();
  if (count < kFewest) return;
  Input input{times, pieces, X_WB, scale, {}};
  input.turns.reserve(count + 1);
  input.turns.push_back(Vector3::Zero());
  for (std::size_t i = 0; i < count; ++i) {
    input.turns.push_back(input.turns.back() + (times[i + 1] - times[i]) * pieces[i].w_WB);
  }
  for (std::size_t width = 2; width < 2 * count; width *= 2) {
    std::vector<Window>& level = levels_.emplace_back();
    level.reserve((count + width - 1) / width);
    for (std::size_t first = 0; first < count; first += width) {
      level.push_back(window(input, first, std::min(first + width, count)));
    }
  }
}

std::optional<MotionStretch> ChordTree::stretch(std::size_t piece, Scalar after) const {
  std::size_t index = piece / 2;
  for (const std::vector<Window>& level : levels_) {
    const Window& window = level[index];
    if (window.end > after) {
      return MotionStretch{.end = window.end,
                           .twist = {window.v_WB, window.w_WB},
                           .linear_deviation = window.linear_deviation,
                           .angular_deviation = window.angular_deviation};
    }
    index /= 2;
  }
  return std::nullopt;
}

ChordTree::Piece chord_piece(const RigidPose& X_WB, const Vector3& w_WB_middle,
                             const TwistBound& bound, Scalar h) {
  const Scalar turning = norm_of(w_WB_middle);
  const Scalar bow =
      std::min(times(bound.linear_acceleration, h * h / 8), times(bound.linear_speed, h));
  const Scalar spread =
      std::min(times(bound.angular_acceleration, h / 2), bound.angular_speed + turning);
  return {X_WB, round_up(bow), w_WB_middle, round_up(spread) + kMotionNoise * turning};
}

}  // namespace dyop::motion_internal
