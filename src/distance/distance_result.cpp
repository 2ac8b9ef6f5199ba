// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/distance_result.h"

#include <ostream>

namespace dyop {

std::string_view name_of(DistanceStatus status) {
  switch (status) {
    case DistanceStatus::NotRun:
      return "NotRun";
    case DistanceStatus::Separated:
      return "Separated";
    case DistanceStatus::Overlapping:
      return "Overlapping";
    case DistanceStatus::FartherThanMaxDistance:
      return "FartherThanMaxDistance";
    case DistanceStatus::Inconclusive:
      return "Inconclusive";
  }
  return "NotRun";
}

std::ostream& operator<<(std::ostream& out, DistanceStatus status) {
  return out << name_of(status);
}

std::ostream& operator<<(std::ostream& out, const DistanceResult& result) {
  return out << result.status << ": " << result.lower << " <= distance <= " << result.upper;
}

}  // namespace dyop
