// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "dynamics/body_record.h"
#include "dyop/contact/contact_cache.h"
#include "dyop/distance/distance.h"
#include "dyop/dynamics/pair_record.h"

namespace dyop::internal {

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
  Scalar target = 0;    // d*
  Scalar standoff = 0;  // s
  Scalar radius = 0;    // the smaller bounding radius
  Scalar rest_gap() const { return target + standoff; }
  Scalar tolerance() const;  // for time_of_impact(), a fraction of the standoff
};

/// What a World keeps about a near pair from step to step.
struct PairState {
  PairKey key;
  PairLengths lengths;
  DistanceCache distance_cache;
  ContactCache contacts;
  /// Proven lower bound on the distance, at the time that a step in progress has reached and at the
  /// World's time; negative: unknown.
  Scalar gap_lower = -1;
  Scalar gap_committed = -1;
  Scalar gap_upper = kInfinity;
  /// Set for a pair that began too near: less than `target`, the distance it must keep instead.
  std::optional<Scalar> granted;
  bool is_inner = false;  // belongs to an island of the current step, which proves it
  bool overlaps = false;  // the shapes overlapped at the start: no distance to keep
  // Of the last step.
  ProofKind proof = ProofKind::AtRest;
  std::int64_t advancement_steps = 0;
  Scalar residual = 0;
  std::vector<Vector3> impulses;  // one per contact
  bool has_contacts = false;      // `contacts` belong to the current poses
  Scalar reach = 0;               // up to which contacts were sought

  Scalar kept_distance() const { return granted.value_or(lengths.target); }
};

/// Updates contacts and gap of a pair at two poses: contacts up to `reach`.
/// Returns whether there are any.
bool refresh_contacts(PairState& pair, const BodyRecord& a, const RigidPose& X_WA,
                      const BodyRecord& b, const RigidPose& X_WB, Scalar reach,
                      ContactWorkspace& workspace);

/// Measures the gap at two poses unless its known bound already exceeds `enough`.
void measure_gap(PairState& pair, const BodyRecord& a, const RigidPose& X_WA, const BodyRecord& b,
                 const RigidPose& X_WB, Scalar enough);

}  // namespace dyop::internal
