// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "dyop/contact/contact_point.h"

namespace DYOP_EXPORT dyop {

/// Contacts on the facets of a curved surface that rolls or slides belong together: in a step the
/// contact passes over several of them, and the impulse of one that touches only at the end would
/// act ahead of the others and brake. The nearest one of them stands for all.
///
/// A contact stands for those near it with nearly its normal that the contact can reach: in the
/// step their gaps change by as much as they differ. A flat face that slides stays on all its
/// corners.
struct ContactMerging {
  /// Displacement of B relative to A in the step to come: that of the point of B at a place p_WC is
  /// shift_W + turn_W x p_WC.
  Vector3 shift_W = Vector3::Zero();
  Vector3 turn_W = Vector3::Zero();
  Scalar radius = 0;  ///< of the smaller shape; merged contacts are within a part of it
  /// A contact with a larger gap stands for no other, and is thinned out before those with less.
  Scalar active_gap = 0;
  /// What points at the distance `radius` must move along the normal for a turn that merges.
  Scalar gap_change = 0;
  /// Contacts in a row, as along a rim, whose smooth curve dips below its chords by at most this
  /// act as one where that curve comes nearest, not at the nearest corner; a ContactCache treats a
  /// ball on the facets of a smooth surface alike. 0: none do.
  Scalar most_sagitta = 0;
};

struct ContactReductionOptions {
  /// Contacts kept per cluster of normals, >= 1; more than three keep a face from tipping over.
  std::size_t points_per_cluster = 6;
  /// Two normals belong to one cluster if the cosine of their angle exceeds this, in [-1, 1].
  Scalar same_normal_cosine = 0.97;
  /// Done before the clusters are thinned out. Default: nothing is merged.
  std::optional<ContactMerging> merging = std::nullopt;
};

/// Thins out the contacts of one pair. Normals are grouped into clusters; each keeps its nearest
/// contact and then, one by one, the contacts farthest from all kept so far. A contact with an
/// impulse counts as half as far again, so that a support point, once chosen, stays.
/// With `merging`, clusters keep those that may carry before the others.
/// Keeps the order. The result depends on the contacts alone, not on their order.
/// @throws InvalidArgument if an option is out of its range or NaN.
void reduce_contacts(const ContactReductionOptions& options, std::vector<ContactPoint>& contacts);

}  // namespace dyop
