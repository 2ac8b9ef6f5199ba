#include "dyop/motion/motion.h"

#include "dyop/core/error.h"

namespace dyop {

void require_defined(const Motion& motion, const TimeInterval& interval, const char* what) {
  const TimeInterval domain = motion.domain();
  DYOP_REQUIRE(domain.begin <= interval.begin && interval.end <= domain.end, what,
               " is defined on [", domain.begin, ", ", domain.end, "] only, not on all of [",
               interval.begin, ", ", interval.end, "]");
}

}  // namespace dyop
