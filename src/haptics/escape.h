// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>

#include "dyop/core/types.h"

namespace dyop::haptics_internal {

/// The search for the shortest straight path out of an obstacle that crosses the tool, along an
/// axis or diagonal of the world, to a position where both are proven apart. Each tick tries a few
/// positions.
class Escape {
 public:
  /// @param first_length Distance of the first positions; each next one is 1.5 times as far.
  void start(std::size_t pair, Scalar first_length);
  void stop() { pair_.reset(); }
  bool is_for(std::size_t pair) const { return pair_ == pair; }

  /// Tries the next position: is_apart(displacement) is true if the two are proven apart there.
  /// What could not be decided in time is passed over: it would take as long again.
  template <typename IsApart>
  void try_next(const IsApart& is_apart);

  /// The unit direction of the shortest path, once all have been tried.
  std::optional<Vector3> direction() const;
  /// All have been tried, and none leads out.
  bool has_failed() const { return is_through() && !(shortest_ < kInfinity); }

  static constexpr int kDirections = 26;
  static constexpr int kLengths = 16;

 private:
  bool is_through() const { return number_ >= kDirections; }
  static Vector3 direction_of(int number);

  std::optional<std::size_t> pair_;
  Scalar first_length_ = 0;
  int number_ = 0;  // of the direction
  int steps_ = 0;   // along it
  Scalar length_ = 0;
  Scalar shortest_ = kInfinity;
  int best_ = 0;
};

template <typename IsApart>
void Escape::try_next(const IsApart& is_apart) {
  if (!pair_ || is_through()) return;
  const std::optional<bool> answer = is_apart(Vector3(length_ * direction_of(number_)));
  const bool is_out = answer.value_or(false);
  if (is_out) {
    shortest_ = length_;
    best_ = number_;
  }
  length_ *= 1.5;
  ++steps_;
  if (!is_out && steps_ < kLengths && length_ < shortest_) return;
  ++number_;
  steps_ = 0;
  length_ = first_length_;
}

}  // namespace dyop::haptics_internal
