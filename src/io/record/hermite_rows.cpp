// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/hermite_rows.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace dyop::io_internal {
namespace {

constexpr std::size_t kTurnNumbers = 6;  // theta and theta_rate, the last of a node

// As in docs/formats.md; the shortest first, so that the first one that serves is taken.
constexpr std::array<HermiteForm, 5> kForms{{{9, false, 0},
                                             {8, false, kTurnNumbers},
                                             {7, false, kNodeNumbers},
                                             {6, true, kTurnNumbers},
                                             {3, true, kNodeNumbers}}};

// Bits, not values: NaN and the sign of zero are kept.
bool are_same(std::span<const Scalar> a, std::span<const Scalar> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

}  // namespace

const HermiteForm* hermite_form(std::uint32_t kind) {
  const auto form = std::find_if(kForms.begin(), kForms.end(),
                                 [&](const HermiteForm& one) { return one.kind == kind; });
  return form == kForms.end() ? nullptr : &*form;
}

const HermiteForm& shortest_form(std::span<const Scalar> before, std::span<const Scalar> last_chart,
                                 std::span<const Scalar> whole) {
  const bool is_same_chart = are_same(last_chart, whole.first(kChartNumbers));
  const std::span<const Scalar> start = whole.subspan(kChartNumbers, kNodeNumbers);
  return *std::find_if(kForms.begin(), kForms.end(), [&](const HermiteForm& form) {
    if (!form.has_own_chart && !is_same_chart) return false;
    if (!form.continues()) return true;
    const std::size_t shared = kNodeNumbers - form.start_count;
    return !before.empty() &&
           are_same(before.last(kNodeNumbers).first(shared), start.first(shared));
  });
}

std::vector<Scalar> stored_numbers(const HermiteForm& form, std::uint64_t chart_place,
                                   std::span<const Scalar> whole) {
  std::vector<Scalar> numbers;
  if (form.has_own_chart) {
    numbers.assign(whole.begin(), whole.begin() + kChartNumbers);
  } else {
    numbers.push_back(static_cast<Scalar>(chart_place));
  }
  const auto rest = whole.last(form.start_count + kNodeNumbers);
  numbers.insert(numbers.end(), rest.begin(), rest.end());
  return numbers;
}

std::vector<Scalar> whole_numbers(const HermiteForm& form, std::span<const Scalar> chart,
                                  std::span<const Scalar> end_of_before,
                                  std::span<const Scalar> stored) {
  std::vector<Scalar> numbers(chart.begin(), chart.end());
  const auto shared = end_of_before.first(kNodeNumbers - form.start_count);
  numbers.insert(numbers.end(), shared.begin(), shared.end());
  const auto own = stored.subspan(form.chart_count());
  numbers.insert(numbers.end(), own.begin(), own.end());
  return numbers;
}

}  // namespace dyop::io_internal
