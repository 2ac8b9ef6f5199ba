// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::chain_internal {

/// How far the coordinates of a path stray from straight lines over windows of 2, 4, 8, ... pieces
/// that start at multiples of their length: as motion_internal::ChordTree.
class JointChords {
 public:
  /// Fewer pieces are passed one by one.
  static constexpr std::size_t kFewest = 8;

  /// From any time of a window to its end, coordinate j keeps within strays[j] of the straight line
  /// with rates[j] through its value at that time.
  struct Window {
    Scalar end = 0;
    std::span<const Scalar> rates;
    std::span<const Scalar> strays;
  };

  /// @param values By knot, then by coordinate.
  /// @param bows   By piece, then by coordinate: how far it strays from its chord in the piece.
  JointChords(std::span<const Scalar> times, std::span<const Scalar> values,
              std::span<const Scalar> bows);

  /// The shortest window that contains the piece and ends after `after`.
  std::optional<Window> window(std::size_t piece, Scalar after) const;

 private:
  struct Level {
    std::vector<Scalar> ends;
    std::vector<Scalar> rates;  // by window, then by coordinate
    std::vector<Scalar> strays;
  };
  std::size_t coordinate_count_;
  std::vector<Level> levels_;  // of 2, 4, 8, ... pieces
};

}  // namespace dyop::chain_internal
