// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/toi_result.h"

#include <ostream>

namespace dyop {

std::string_view name_of(ToiStatus status) {
  switch (status) {
    case ToiStatus::NotRun:
      return "NotRun";
    case ToiStatus::Separated:
      return "Separated";
    case ToiStatus::Impact:
      return "Impact";
    case ToiStatus::InitiallyWithinTarget:
      return "InitiallyWithinTarget";
    case ToiStatus::BudgetExhausted:
      return "BudgetExhausted";
    case ToiStatus::Cancelled:
      return "Cancelled";
    case ToiStatus::NumericalLimit:
      return "NumericalLimit";
  }
  return "NotRun";
}

std::ostream& operator<<(std::ostream& out, ToiStatus status) {
  return out << name_of(status);
}

std::ostream& operator<<(std::ostream& out, const ToiResult& result) {
  out << result.status << ": t_safe = " << result.t_safe;
  if (result.t_hit) out << ", t_hit = " << *result.t_hit;
  return out;
}

}  // namespace dyop
