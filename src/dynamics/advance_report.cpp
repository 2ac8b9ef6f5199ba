// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/advance_report.h"

#include <ostream>

namespace dyop {

std::string_view name_of(AdvanceStatus status) {
  switch (status) {
    case AdvanceStatus::NotRun:
      return "NotRun";
    case AdvanceStatus::Completed:
      return "Completed";
    case AdvanceStatus::StoppedAtImpact:
      return "StoppedAtImpact";
    case AdvanceStatus::BudgetExhausted:
      return "BudgetExhausted";
    case AdvanceStatus::Blocked:
      return "Blocked";
    case AdvanceStatus::Cancelled:
      return "Cancelled";
    case AdvanceStatus::NumericalLimit:
      return "NumericalLimit";
  }
  return "NotRun";
}

std::ostream& operator<<(std::ostream& out, AdvanceStatus status) {
  return out << name_of(status);
}

std::ostream& operator<<(std::ostream& out, const AdvanceReport& report) {
  return out << report.status << ": t = " << report.t << ", " << report.steps.size() << " steps, "
             << report.impacts.size() << " impacts";
}

}  // namespace dyop
