// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dyop/core/types.h"

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

}  // namespace dyop::io_internal
