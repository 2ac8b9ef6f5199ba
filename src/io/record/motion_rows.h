// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/io/recording.h"

/// How the cubics of a flight are stored: without what earlier rows of the body hold already. The
/// numbers of a whole row are R_WC 9, then for both ends t, p 3, v 3, theta 3, theta_rate 3.
namespace dyop::io_internal {

constexpr std::size_t kChartNumbers = 9;
constexpr std::size_t kNodeNumbers = 13;
constexpr std::size_t kHermiteNumbers = kChartNumbers + 2 * kNodeNumbers;

/// One of the forms in which a row of cubics is stored.
struct HermiteForm {
  std::uint32_t kind;       ///< of the row
  bool has_own_chart;       ///< false: the place in /numbers of the R_WC of an earlier row
  std::size_t start_count;  ///< how many numbers of its start are stored, its last ones

  std::size_t chart_count() const { return has_own_chart ? kChartNumbers : 1; }
  std::size_t count() const { return chart_count() + start_count + kNodeNumbers; }
  bool continues() const { return start_count < kNodeNumbers; }
};

/// Null for a kind of row that is no cubic of a flight.
const HermiteForm* hermite_form(std::uint32_t kind);

/// The shortest form of a whole row of cubics.
/// @param before     The last row of the body if it was a cubic, made whole; else empty.
/// @param last_chart R_WC of the body's last cubic; empty if there was none.
const HermiteForm& shortest_form(std::span<const Scalar> before, std::span<const Scalar> last_chart,
                                 std::span<const Scalar> whole);

/// What a form stores of a whole row. @param chart_place Of the last chart in /numbers.
std::vector<Scalar> stored_numbers(const HermiteForm& form, std::uint64_t chart_place,
                                   std::span<const Scalar> whole);

/// The whole row again.
/// @param end_of_before The last numbers of the row before; used if the form continues it.
std::vector<Scalar> whole_numbers(const HermiteForm& form, std::span<const Scalar> chart,
                                  std::span<const Scalar> end_of_before,
                                  std::span<const Scalar> stored);

// Motions as the numbers of docs/formats.md, and back with every bit.

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
