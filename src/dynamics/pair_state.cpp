// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/pair_state.h"

#include <algorithm>

#include "core/tolerance.h"

namespace dyop::internal {

Scalar PairLengths::tolerance() const {
  return kCertifiedFraction * standoff;
}

bool refresh_contacts(PairState& pair, const BodyRecord& a, const RigidPose& X_WA,
                      const BodyRecord& b, const RigidPose& X_WB, Scalar reach,
                      ContactWorkspace& workspace) {
  ContactCacheOptions options;
  options.max_drift = kContactDriftFraction * pair.lengths.standoff;
  pair.contacts.refresh(*a.definition.shape, X_WA, *b.definition.shape, X_WB, reach, options,
                        workspace);
  return !pair.contacts.contacts().empty();
}

void measure_gap(PairState& pair, const BodyRecord& a, const RigidPose& X_WA, const BodyRecord& b,
                 const RigidPose& X_WB, Scalar enough) {
  if (pair.gap_lower > enough) return;
  DistanceOptions options;
  options.max_distance = enough;
  const DistanceResult result =
      distance(*a.definition.shape, X_WA, *b.definition.shape, X_WB, options, pair.distance_cache);
  pair.gap_lower = result.lower;
  pair.gap_upper = result.upper;
}

}  // namespace dyop::internal
