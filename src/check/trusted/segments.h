// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "check/trusted/json.h"
#include "check/trusted/motion.h"

/// The motions of a file. TRUSTED.
namespace dyop_check {

/// Radians between two recorded rotations: near pi the axis is uncertain.
inline constexpr double kLargestTurn = 2.5;

/// Three of the numbers.
Vec vector_of(const std::vector<double>& x, std::size_t at = 0);
/// Nine of the numbers.
/// @throws BadFile unless they are a rotation.
Mat matrix_of(const std::vector<double>& x, std::size_t at = 0);
/// Twelve numbers: a rotation, row by row, and a position.
/// @throws BadFile
Pose pose_of(const Json& json);

/// At all times.
Segment at_rest(const Pose& X);
/// The point of the body that is at p at t0 moves by v, and the body turns about it by w, both in the
/// world.
Segment twist(const Mat& R, const Vec& p, const Vec& v, const Vec& w, double t0);

/// A prescribed motion (docs/formats.md, "Query records") from a time on. Rotations between two
/// samples by nearly half a turn are unsupported, as their axis is uncertain.
/// @param center_of_mass Of the body, in its frame.
std::vector<Segment> prescribed(const Json& motion, double begin, const Vec& center_of_mass);

/// Rows of /segments, whose cubics may go on where the body's last one ended.
class SegmentReader {
 public:
  SegmentReader(std::vector<double> numbers, std::string given, std::size_t bodies)
      : numbers_(std::move(numbers)), given_(std::move(given)), previous_(bodies) {}

  /// One segment, or more if it is a prescribed motion of several parts.
  std::vector<Segment> read(std::uint64_t kind, std::uint64_t first, std::size_t body, double begin,
                            const Vec& center_of_mass);

 private:
  std::vector<double> take(std::uint64_t first, std::size_t count) const;
  std::vector<double> whole_cubic(std::uint64_t kind, std::uint64_t first, std::size_t body) const;
  Json given(const std::vector<double>& place) const;

  std::vector<double> numbers_;
  std::string given_;
  std::vector<std::vector<double>> previous_;  // the last 13 numbers of a body's last cubic
};

}  // namespace dyop_check
