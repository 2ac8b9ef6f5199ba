// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "distance/neighbour_list.h"
#include "distance/pivot_seed.h"
#include "dynamics/body_record.h"
#include "dynamics/step/separating_directions.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/core/export.h"
#include "dyop/dynamics/advance_report.h"

namespace dyop::dynamics_internal {

/// Slots of two bodies, a < b.
struct PairKey {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  friend auto operator<=>(const PairKey&, const PairKey&) = default;
};

inline PairKey ordered(std::uint32_t x, std::uint32_t y) {
  return x < y ? PairKey{x, y} : PairKey{y, x};
}

/// The lengths of one pair; see WorldOptions.
struct PairLengths {
  Scalar target = 0;       // d*
  Scalar rest_offset = 0;  // s; less than usual in a close fit, see fit_rest_offsets()
  Scalar radius = 0;       // the smaller size of its bodies
  Scalar usual_rest_offset = 0;
  Scalar rest_gap() const { return target + rest_offset; }
  Scalar tolerance() const;  // for time_of_impact(), a fraction of the rest offset
};

/// What a World keeps about a near pair from step to step.
struct PairState {
  PairKey key;
  PairLengths lengths;
  Material material;
  Pivot pivot;    // at the World's time
  PairSeed seed;  // from the pivot, then from the last query
  ContactCache contacts;
  NeighbourList neighbours;         // of meshes in contact: their queries begin with it
  BoxPairStack first_pairs;         // memory for these queries
  SeparatingDirections directions;  // of those that slide past each other
  int searches_to_skip = 0;         // before another list is tried, after one that was too long
  /// Proven bounds of the distance at the time that a step in progress has reached; the lower is -1
  /// if it is not known.
  Scalar gap_lower = -1;
  Scalar gap_upper = kInfinity;
  /// The same at the World's time.
  Scalar gap_committed = -1;
  Scalar gap_upper_committed = kInfinity;
  /// Less than `target` for a pair that began too near: what it must keep instead.
  std::optional<Scalar> uncertified_gap;
  bool is_inner = false;      // belongs to an island of the current step, which proves it
  bool was_too_near = false;  // reported so, and not yet as parted
  bool overlaps = false;      // the shapes overlapped at the start: no distance to keep
  std::vector<ContactPoint> overlap_contacts;     // then used in place of `contacts`: estimates
  Vector3 overlap_direction_W = Vector3::Zero();  // in which B is then pushed; zero: not yet known
  // From the last step.
  ProofKind proof = ProofKind::AtRest;
  std::int64_t advancement_steps = 0;
  Scalar residual = 0;
  std::vector<Vector3> impulses;    // one per contact
  Scalar answered_at = -kInfinity;  // time of an impact that a callback was asked about
  bool has_contacts = false;        // `contacts` belong to the current poses
  Scalar reach = 0;                 // up to which contacts were sought

  /// Contacts as they act.
  std::span<ContactPoint> points() {
    return overlaps ? std::span<ContactPoint>(overlap_contacts) : contacts.contacts();
  }
  std::span<const ContactPoint> points() const {
    return overlaps ? std::span<const ContactPoint>(overlap_contacts) : contacts.contacts();
  }
  /// Puts all pairs of pieces that are near at these poses into `first_pairs`. Returns false if the
  /// neighbours do not cover that.
  DYOP_EXPORT bool list_near(const Shape& a, const RigidPose& X_WA, const Shape& b,
                             const RigidPose& X_WB, const NearBound& bound);
  /// The shortest gap of points(); sought only where they have changed.
  Scalar shortest_gap();
  std::optional<Scalar> known_shortest_gap;  // reset when points() change
  Scalar kept_distance() const { return uncertified_gap.value_or(lengths.target); }
  /// A step in progress begins.
  void start_from_committed() {
    gap_lower = gap_committed;
    gap_upper = gap_upper_committed;
    advancement_steps = 0;
  }
  /// The gap may have changed by so much, either way.
  void loosen_bounds(Scalar travel) {
    gap_lower = gap_lower - travel < 0 ? -1 : gap_lower - travel;
    gap_upper += travel;
  }
  void commit_bounds() {
    gap_committed = gap_lower;
    gap_upper_committed = gap_upper;
  }
};

/// Moves the pivot to where the bodies are: the middle of the nearest contact's witness segment,
/// of the internal box while there is no contact. Where no query has left a better seed, the pivot
/// picks one.
void update_pivot(PairState& pair, const BodyRecord& a, const BodyRecord& b);

/// Brings contacts and gap of a pair up to date at two poses: contacts up to `reach`. B's point at
/// p_WC is expected to move by shift_W + turn_W x p_WC relative to A.
/// Returns whether there are any.
bool refresh_contacts(PairState& pair, const BodyRecord& a, const RigidPose& X_WA,
                      const BodyRecord& b, const RigidPose& X_WB, Scalar reach,
                      const Vector3& shift_W, const Vector3& turn_W, ContactWorkspace& workspace);

/// Where a list for several steps was too long, makes one for the poses at the end of a substep:
/// their contacts are sought there again after each solve, and at the start of the next substep.
DYOP_EXPORT void list_end(PairState& pair, const Shape& a, const RigidPose& X_WA, const Shape& b,
                          const RigidPose& X_WB);

/// Measures the gap at two poses unless its known bound already exceeds `enough`, or it is known:
/// in the rounds of a substep bodies start from the same poses again.
/// @param relative_tolerance How far apart its bounds may stay, relative to the upper one.
void measure_gap(PairState& pair, const BodyRecord& a, const RigidPose& X_WA, const BodyRecord& b,
                 const RigidPose& X_WB, Scalar enough, Scalar relative_tolerance = 0);

}  // namespace dyop::dynamics_internal
