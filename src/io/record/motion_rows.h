// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "dyop/io/recorded_run.h"
#include "io/record/hermite_rows.h"

/// Motions as the numbers of docs/formats.md, and back with every bit.
namespace dyop::io_internal {

/// Lengths of the rows' numbers.
constexpr std::size_t kRestNumbers = 12;
constexpr std::size_t kTwistNumbers = 19;
constexpr std::size_t kGivenNumbers = 2;

/// The length of a row's numbers; of a cubic, made whole.
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

}  // namespace dyop::io_internal
