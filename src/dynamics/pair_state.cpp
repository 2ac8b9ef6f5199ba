// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/pair_state.h"

#include <algorithm>

#include "contact/generation/facet_fit.h"
#include "core/tolerance.h"

namespace dyop::internal {
namespace {

// Bounds of a gap this near to each other, in standoffs, are not worth another query. Those that a
// query gives differ by rounding; each step loosens them.
constexpr Scalar kKnownGap = 1e-3;  // literal: far below the tolerance of an impact query

}  // namespace

Scalar PairLengths::tolerance() const {
  return kCertifiedFraction * standoff;
}

void update_pivot(PairState& pair, const BodyRecord& a, const BodyRecord& b) {
  const auto points = pair.points();
  const auto nearest =
      std::min_element(points.begin(), points.end(),
                       [](const ContactPoint& x, const ContactPoint& y) { return x.gap < y.gap; });
  const RigidPose X_WA = a.X_WB();
  const RigidPose X_WB = b.X_WB();
  const Shape& shape_a = *a.definition.shape;
  const Shape& shape_b = *b.definition.shape;
  if (pair.has_contacts && nearest != points.end()) {
    pair.pivot = {(nearest->p_WCa + nearest->p_WCb) / 2, nearest->nhat_AB_W};
  } else {
    pair.pivot = internal_box_pivot(shape_a, X_WA, shape_b, X_WB);
  }
  const bool is_seeded = pair.seed.pieces.nearest || pair.seed.supports.count > 0;
  if (!is_seeded) pair.seed = seed_at(pair.pivot, shape_a, X_WA, shape_b, X_WB);
}

Scalar PairState::shortest_gap() {
  if (!known_shortest_gap) {
    known_shortest_gap = kInfinity;
    for (const ContactPoint& point : points()) {
      known_shortest_gap = std::min(*known_shortest_gap, point.gap);
    }
  }
  return *known_shortest_gap;
}

bool refresh_contacts(PairState& pair, const BodyRecord& a, const RigidPose& X_WA,
                      const BodyRecord& b, const RigidPose& X_WB, Scalar reach,
                      const Vector3& shift_W, const Vector3& turn_W, ContactWorkspace& workspace) {
  ContactCacheOptions options;
  ContactMerging merging{shift_W, turn_W, pair.lengths.radius};
  merging.active_gap = pair.lengths.rest_gap() + kContactMergedStandoffs * pair.lengths.standoff;
  merging.gap_change = kContactMergedChange * pair.lengths.standoff;
  merging.most_sagitta = kContactFitStandoffs * pair.lengths.standoff;
  options.reduction.merging = merging;
  options.max_drift = kContactDriftFraction * pair.lengths.standoff;
  pair.known_shortest_gap.reset();
  pair.contacts.refresh(*a.definition.shape, X_WA, *b.definition.shape, X_WB, reach, options,
                        workspace);
  return !pair.contacts.contacts().empty();
}

void measure_gap(PairState& pair, const BodyRecord& a, const RigidPose& X_WA, const BodyRecord& b,
                 const RigidPose& X_WB, Scalar enough) {
  const bool is_known =
      pair.gap_lower >= 0 && pair.gap_upper - pair.gap_lower <= kKnownGap * pair.lengths.standoff;
  if (pair.gap_lower > enough || is_known) return;
  DistanceOptions options;
  options.max_distance = enough;
  const DistanceResult result =
      seeded_distance(*a.definition.shape, X_WA, *b.definition.shape, X_WB, options, pair.seed);
  pair.gap_lower = result.lower;
  pair.gap_upper = result.upper;
}

}  // namespace dyop::internal
