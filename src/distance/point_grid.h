// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::distance_internal {

/// Numbered points in cubic cells, for finding points near each other.
class PointGrid {
 public:
  explicit PointGrid(Scalar cell_size)
      : cell_size_(std::max(cell_size, std::numeric_limits<Scalar>::min())) {}

  void add(const Vector3& p, std::size_t number) { cells_[cell_of(p, 0, 0, 0)].push_back(number); }

  /// Whether a point for which `is_sought(number)` is true lies in the cell of p or a neighbouring
  /// one. It is called for at least every point within one cell size of p.
  template <typename Predicate>
  bool any_near(const Vector3& p, const Predicate& is_sought) const {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dz = -1; dz <= 1; ++dz) {
          const auto cell = cells_.find(cell_of(p, dx, dy, dz));
          if (cell == cells_.end()) continue;
          if (std::any_of(cell->second.begin(), cell->second.end(), is_sought)) return true;
        }
      }
    }
    return false;
  }

 private:
  using Cell = std::tuple<std::int64_t, std::int64_t, std::int64_t>;
  struct CellHash {
    std::size_t operator()(const Cell& cell) const {
      // Unsigned, because the products may wrap.
      const auto mix = [](std::int64_t index, std::uint64_t prime) {
        return static_cast<std::uint64_t>(index) * prime;
      };
      const auto [x, y, z] = cell;
      return static_cast<std::size_t>(mix(x, 73856093) ^ mix(y, 19349663) ^ mix(z, 83492791));
    }
  };

  Cell cell_of(const Vector3& p, int dx, int dy, int dz) const {
    const auto index = [&](Scalar x, int shift) {
      // literal: beyond 2^52 cells neighbouring cells are the same number; clamp for the cast.
      return static_cast<std::int64_t>(std::clamp(std::floor(x / cell_size_), -4e15, 4e15)) + shift;
    };
    return Cell(index(p.x(), dx), index(p.y(), dy), index(p.z(), dz));
  }

  Scalar cell_size_;
  std::unordered_map<Cell, std::vector<std::size_t>, CellHash> cells_;
};

}  // namespace dyop::distance_internal
