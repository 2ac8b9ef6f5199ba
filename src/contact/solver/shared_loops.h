// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/team.h"
#include "dyop/core/types.h"

namespace dyop::contact_internal {

/// The larger of two, or NaN if one of them is.
inline Scalar larger_or_nan(Scalar x, Scalar y) {
  return x >= y || std::isnan(x) ? x : y;
}

/// Loops over the blocks or bodies of a large problem, shared by the threads of a team if there is
/// one: with the same bits for any number of them.
class SharedLoops {
 public:
  void set_team(core_internal::Team* team) { team_ = team; }
  bool has_team() const { return team_ != nullptr; }

  /// Calls item(i) for every i below `count`, in order if there is no team; items must not touch
  /// what others change.
  template <typename Item>
  void each(std::size_t count, const Item& item) const {
    each_of(count, kFewItems, item);
  }

  /// The same for items each of which is worth as much.
  template <typename Item>
  void each_long(std::size_t count, const Item& item) const {
    each_of(count, 1, item);
  }

  /// The largest value(i), at least zero; NaN if one is.
  template <typename Value>
  Scalar largest(std::size_t count, const Value& value) const;

  /// The sum of value(i), added to `start` in order.
  template <typename Value>
  Scalar sum(Scalar start, std::size_t count, const Value& value) const;

 private:
  // Worth a microsecond at least, several times as much as handing them out.
  static constexpr std::size_t kFewItems = 32;

  template <typename Item>
  void each_of(std::size_t count, std::size_t portion, const Item& item) const {
    if (!team_) {
      for (std::size_t i = 0; i < count; ++i) item(i);
      return;
    }
    team_->run(count, portion, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) item(i);
    });
  }

  core_internal::Team* team_ = nullptr;
  mutable std::vector<Scalar> values_;  // memory of the two reductions
};

template <typename Value>
Scalar SharedLoops::largest(std::size_t count, const Value& value) const {
  Scalar result = 0;
  if (!team_) {
    for (std::size_t i = 0; i < count; ++i) result = larger_or_nan(value(i), result);
    return result;
  }
  values_.resize(count);
  team_->run(count, kFewItems, [&](std::size_t begin, std::size_t end) {
    Scalar part = 0;
    for (std::size_t i = begin; i < end; ++i) part = larger_or_nan(value(i), part);
    values_[begin] = part;
    for (std::size_t i = begin + 1; i < end; ++i) values_[i] = 0;
  });
  for (const Scalar part : values_) result = larger_or_nan(part, result);
  return result;
}

template <typename Value>
Scalar SharedLoops::sum(Scalar start, std::size_t count, const Value& value) const {
  if (!team_) {
    for (std::size_t i = 0; i < count; ++i) start += value(i);
    return start;
  }
  values_.resize(count);
  each(count, [&](std::size_t i) { values_[i] = value(i); });
  for (const Scalar part : values_) start += part;
  return start;
}

}  // namespace dyop::contact_internal
