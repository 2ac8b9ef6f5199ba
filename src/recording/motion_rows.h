// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "dyop/recording/recorded_run.h"

/// Motions as the numbers of docs/recording.md, and back with every bit.
namespace dyop::internal {

/// Lengths of the rows' numbers.
constexpr std::size_t kRestNumbers = 12;
constexpr std::size_t kTwistNumbers = 19;
constexpr std::size_t kHermiteNumbers = 35;
constexpr std::size_t kContinuedNumbers = 28;
constexpr std::size_t kGivenNumbers = 2;

/// The length of a row's numbers, except for one that continues another.
std::size_t number_count(SegmentKind kind);

/// A motion, its start and its latest end.
struct MotionPart {
  TimeInterval interval;
  std::shared_ptr<const Motion> motion;
};

/// The parts of a sequence, and of sequences in it, within an interval of positive length; any
/// other motion is one part.
std::vector<MotionPart> parts_of(const std::shared_ptr<const Motion>& motion,
                                 const TimeInterval& interval);

struct EncodedMotion {
  SegmentKind kind = SegmentKind::Absent;
  std::vector<Scalar> numbers;
  std::string given;
};

/// @param p_BoBcm The body's centre of mass if it is dynamic, else zero.
EncodedMotion encode(const MotionPart& part, const Vector3& p_BoBcm);

/// Null for Absent. Throws InvalidArgument if the numbers make no motion.
std::shared_ptr<const Motion> decode(const EncodedMotion& encoded, const Vector3& p_BoBcm);

/// True if the cubics `next` start at the time, position and velocity at which `before` end: then
/// continued_numbers() hold what is new.
bool continues(std::span<const Scalar> before, std::span<const Scalar> next);
std::vector<Scalar> continued_numbers(std::span<const Scalar> next);
/// The numbers of the whole cubic.
std::vector<Scalar> whole_numbers(std::span<const Scalar> end_of_before,
                                  std::span<const Scalar> continued);
/// Time, position and velocity at the end of the row, whole or continued.
std::span<const Scalar> end_of(std::span<const Scalar> hermite);

}  // namespace dyop::internal
