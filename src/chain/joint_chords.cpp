// SPDX-License-Identifier: BSD-3-Clause
#include "chain/joint_chords.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "motion/curve/chart_curve.h"

namespace dyop::chain_internal {

JointChords::JointChords(std::span<const Scalar> times, std::span<const Scalar> values,
                         std::span<const Scalar> bows)
    : coordinate_count_(values.size() / times.size()) {
  const std::size_t count = times.size() - 1;
  for (std::size_t width = 2; width < 2 * count; width *= 2) {
    Level& level = levels_.emplace_back();
    for (std::size_t first = 0; first < count; first += width) {
      const std::size_t last = std::min(first + width, count);
      const Scalar h = times[last] - times[first];
      level.ends.push_back(times[last]);
      for (std::size_t j = 0; j < coordinate_count_; ++j) {
        const auto value = [&](std::size_t knot) { return values[knot * coordinate_count_ + j]; };
        const Scalar rate = (value(last) - value(first)) / h;
        Scalar most = 0;
        Scalar strayed = 0;  // at the last knot
        for (std::size_t i = first; i < last; ++i) {
          const Scalar line = value(first) + (times[i + 1] - times[first]) * rate;
          const Scalar strays = std::abs(value(i + 1) - line);
          // In this order NaN survives, until round_up().
          most = std::max(std::max(strays, strayed) + bows[i * coordinate_count_ + j], most);
          strayed = strays;
        }
        const Scalar size = std::abs(value(first)) + h * std::abs(rate);
        level.rates.push_back(rate);
        // Twice: at the start the coordinate may be to one side, later to the other.
        level.strays.push_back(2 * motion_internal::round_up(most + kMotionNoise * size));
      }
    }
  }
}

std::optional<JointChords::Window> JointChords::window(std::size_t piece, Scalar after) const {
  std::size_t index = piece / 2;
  for (const Level& level : levels_) {
    if (level.ends[index] > after) {
      const std::size_t row = index * coordinate_count_;
      return Window{level.ends[index],
                    {level.rates.data() + row, coordinate_count_},
                    {level.strays.data() + row, coordinate_count_}};
    }
    index /= 2;
  }
  return std::nullopt;
}

}  // namespace dyop::chain_internal
