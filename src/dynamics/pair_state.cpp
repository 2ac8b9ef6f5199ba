// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/pair_state.h"

#include <algorithm>

#include "contact/generation/contact_fit.h"
#include "contact/generation/contact_search.h"
#include "core/tolerance.h"

namespace dyop::dynamics_internal {
namespace {

// Bounds of a gap this near to each other, in rest offsets, are not worth another query. Those that
// a query gives differ by rounding; each step loosens them.
constexpr Scalar kKnownGap = 1e-3;  // literal: far below the tolerance of an impact query

// Target lifetime of a neighbour list, in steps at the current speed. Longer lists cost more to
// scan.
constexpr Scalar kNeighbourSteps = 6;

// A list that would not cover the proof of the next step is made anew: a search of whole trees
// there costs as much. Allow the next step to be this much longer than this one.
constexpr Scalar kNextTravel = 1.1;

// Builds to skip after a list overflowed.
constexpr int kSearchesToSkip = 64;

// A list for the end of a substep serves while the bodies come to lie elsewhere by this part of the
// reach.
constexpr Scalar kEndMargin = 0.5;

// Brings the list of neighbours up to date for queries up to `reach`, if the shapes are in contact.
void update_neighbours(PairState& pair, const Shape& a, const RigidPose& X_WA, const Shape& b,
                       const RigidPose& X_WB, Scalar reach, const Vector3& shift_W,
                       const Vector3& turn_W) {
  const bool is_convex = a.kind() == ShapeKind::Convex && b.kind() == ShapeKind::Convex;
  // The pieces of a compound belong to trees of their own where contacts are looked for.
  const bool is_compound = a.kind() == ShapeKind::Compound || b.kind() == ShapeKind::Compound;
  if (is_convex || is_compound) return;
  const Vector3& pivot_W = pair.pivot.p_W;
  const Scalar travel = (shift_W + turn_W.cross(pivot_W)).norm();
  const NearBound next{std::max(reach, pair.lengths.rest_gap() + kNextTravel * travel),
                       kNextTravel * turn_W.norm()};
  if (pair.neighbours.is_built() &&
      pair.neighbours.covers(pair.neighbours.place(a, X_WA, b, X_WB), next)) {
    return;
  }
  pair.neighbours.clear();
  if (pair.contacts.contacts().empty()) return;
  if (pair.searches_to_skip > 0) {
    --pair.searches_to_skip;
    return;
  }
  const NearBound bound{2 * reach + kNeighbourSteps * travel, kNeighbourSteps * turn_W.norm()};
  const bool is_listed = pair.neighbours.build(a, X_WA, b, X_WB, pivot_W, bound);
  pair.searches_to_skip = is_listed ? 0 : kSearchesToSkip;
}

}  // namespace

void list_end(PairState& pair, const Shape& a, const RigidPose& X_WA, const Shape& b,
              const RigidPose& X_WB) {
  if (pair.searches_to_skip == 0) return;
  const Scalar reach = pair.reach + kContactDriftFraction * pair.lengths.rest_offset;
  NeighbourList& list = pair.neighbours;
  if (list.is_built() && list.covers(list.place(a, X_WA, b, X_WB), {reach})) return;
  --pair.searches_to_skip;
  const Scalar margin = kEndMargin * reach;
  list.build(a, X_WA, b, X_WB, pair.pivot.p_W, {reach + margin, margin / pair.lengths.radius});
}

Scalar PairLengths::tolerance() const {
  return kCertifiedFraction * rest_offset;
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

bool PairState::list_near(const Shape& a, const RigidPose& X_WA, const Shape& b,
                          const RigidPose& X_WB, const NearBound& bound) {
  if (!neighbours.is_built()) return false;
  const NeighbourList::Placement placement = neighbours.place(a, X_WA, b, X_WB);
  if (!neighbours.covers(placement, bound)) return false;
  neighbours.collect(a, b, placement, bound, first_pairs);
  sort_farthest_first(first_pairs);
  return true;
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
  merging.active_gap =
      pair.lengths.rest_gap() + kContactMergedRestOffsets * pair.lengths.rest_offset;
  merging.gap_change = kContactMergedChange * pair.lengths.rest_offset;
  merging.most_sagitta = kContactFitRestOffsets * pair.lengths.rest_offset;
  options.reduction.merging = merging;
  options.max_drift = kContactDriftFraction * pair.lengths.rest_offset;
  pair.known_shortest_gap.reset();
  const Shape& shape_a = *a.definition.shape;
  const Shape& shape_b = *b.definition.shape;
  update_neighbours(pair, shape_a, X_WA, shape_b, X_WB, reach + options.max_drift, shift_W, turn_W);
  const ScopedUse use(workspace.impl().neighbours, pair.neighbours);
  pair.contacts.refresh(shape_a, X_WA, shape_b, X_WB, reach, options, workspace);
  return !pair.contacts.contacts().empty();
}

void measure_gap(PairState& pair, const BodyRecord& a, const RigidPose& X_WA, const BodyRecord& b,
                 const RigidPose& X_WB, Scalar enough, Scalar relative_tolerance) {
  const Scalar tolerance =
      std::max(kKnownGap * pair.lengths.rest_offset, relative_tolerance * pair.gap_upper);
  const bool is_known = pair.gap_lower >= 0 && pair.gap_upper < kInfinity &&
                        pair.gap_upper - pair.gap_lower <= tolerance;
  if (pair.gap_lower > enough || is_known) return;
  DistanceOptions options;
  options.max_distance = enough;
  options.relative_tolerance = relative_tolerance;
  const Shape& shape_a = *a.definition.shape;
  const Shape& shape_b = *b.definition.shape;
  const DistanceResult result =
      pair.list_near(shape_a, X_WA, shape_b, X_WB, {enough})
          ? listed_distance(shape_a, X_WA, shape_b, X_WB, options, pair.first_pairs, pair.seed)
          : seeded_distance(shape_a, X_WA, shape_b, X_WB, options, pair.seed);
  pair.gap_lower = result.lower;
  pair.gap_upper = result.upper;
}

}  // namespace dyop::dynamics_internal
