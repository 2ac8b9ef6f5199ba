// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "dyop/core/export.h"
#include "dyop/motion/motion.h"

namespace dyop::motion_internal {

/// How far a motion in pieces strays from constant twists, over windows of 2, 4, 8, ... pieces that
/// start at multiples of their length. In each window the constant twist leads from the first pose
/// to the last one, its chord. Proof: docs/algorithms/motions.md.
class ChordTree {
 public:
  /// From one knot to the next.
  struct Piece {
    RigidPose X_WB;          ///< at its start
    Scalar bow = 0;          ///< how far the origin strays from its chord
    Vector3 w_WB;            ///< an angular velocity near those in the piece
    Scalar turn_spread = 0;  ///< how far those differ from it
  };

  /// Fewer pieces are passed one by one.
  static constexpr std::size_t kFewest = 8;

  /// @param times  Where the pieces start, and where the last one ends.
  /// @param X_WB   The last pose.
  /// @param scale  Of the rounding of all poses.
  DYOP_EXPORT ChordTree(std::span<const Scalar> times, std::span<const Piece> pieces,
                        const RigidPose& X_WB, const PoseScale& scale);

  /// The shortest stretch from a time of the piece on that ends after `after`.
  DYOP_EXPORT std::optional<MotionStretch> stretch(std::size_t piece, Scalar after) const;

 private:
  struct Window {
    Scalar end = 0;
    Vector3 v_WB;
    Vector3 w_WB;
    Scalar linear_deviation = 0;
    Scalar angular_deviation = 0;
  };
  struct Input {
    std::span<const Scalar> times;
    std::span<const Piece> pieces;
    const RigidPose& last;
    PoseScale scale;
    std::vector<Vector3> turns;  // from the first knot to each, the pieces' turns added up

    const RigidPose& pose(std::size_t knot) const {
      return knot < pieces.size() ? pieces[knot].X_WB : last;
    }
  };
  static Window window(const Input& input, std::size_t first, std::size_t last);

  std::vector<std::vector<Window>> levels_;  // of 2, 4, 8, ... pieces
};

/// What a smooth motion with these bounds does in a piece of length h.
ChordTree::Piece chord_piece(const RigidPose& X_WB, const Vector3& w_WB_middle,
                             const TwistBound& bound, Scalar h);

}  // namespace dyop::motion_internal
