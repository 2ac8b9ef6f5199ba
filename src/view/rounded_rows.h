// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "dyop/view/page_encoder.h"
#include "view/column_block.h"

namespace dyop::view_internal {

/// Steps to which the numbers of a chunk are rounded, in the units of the scene.
struct Rounding {
  Scalar place = 1;     ///< of positions
  Scalar velocity = 1;  ///< of velocities; in a frame it moves a body by `place`
  Scalar contact = 1;   ///< of the places of contacts, which are only drawn
  Scalar impulse = 1;

  /// Directions of contacts, and the way between witness points in gaps: parts of 1.
  static constexpr Scalar kDirection = 1.0 / 16384;

  /// For the places of bodies 2^-26 to 2^-27 of the radius of the smallest one that moves.
  static Rounding of(const PageScene& scene, const TimeInterval& time, const PageSpan& span);
  /// Of turns of a body of this radius: they move its surface by `place`.
  Scalar turn(Scalar radius) const;
  /// Of velocities over a segment of this length: no coarser than `velocity`, and so fine that the
  /// body ends within `place`.
  Scalar velocity_over(Scalar length) const;
};

/// A column of whole numbers: values as differences from what was to be expected, in units of a
/// step. The few that do not fit into 32 bits are kept as they are, in a column of their own.
class RoundedColumn {
 public:
  /// Adds a value and returns what the page will read.
  Scalar add(Scalar value, Scalar expected, Scalar step);
  void add_to(ColumnBlock& block, const std::string& name) const;

 private:
  std::vector<std::uint32_t> steps_;
  std::vector<double> large_;
};

/// Three columns, one for each axis.
class RoundedVectors {
 public:
  Vector3 add(const Vector3& value, const Vector3& expected, Scalar step);
  void add_to(ColumnBlock& block, const std::string& name) const;

 private:
  RoundedColumn axes_[3];
};

/// The times of a chunk, each once and in order; rows refer to them by number.
class TimeTable {
 public:
  void add(Scalar t) {
    if (times_.empty() || t != times_.back()) times_.push_back(t);  // most rows share one time
  }
  void sort();
  /// Of a time that was added.
  std::uint32_t at(Scalar t) const;
  void add_to(ColumnBlock& block) const;

 private:
  std::vector<double> times_;
};

/// Rows of pairs, each pair's in order of time: how many each pair has, and of each when.
void add_rounded_gaps(ColumnBlock& block, const std::vector<PageGap>& gaps,
                      const Rounding& rounding, const TimeTable& times);
void add_rounded_contacts(ColumnBlock& block, const std::vector<PageContact>& contacts,
                          const Rounding& rounding, const TimeTable& times);

}  // namespace dyop::view_internal
