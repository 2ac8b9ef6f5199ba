// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "dyop/contact/contact_point.h"

namespace DYOP_EXPORT dyop {

struct ContactReductionOptions {
  /// Contacts kept per cluster of normals, >= 1; more than three keep a face from tipping.
  std::size_t points_per_cluster = 6;
  /// Normals belong to one cluster if their cosine is above this, in [-1, 1].
  Scalar same_normal_cosine = 0.97;
};

/// Thins the contacts of one pair: normals are grouped into clusters, and each keeps its nearest
/// contact and then, one by one, those farthest from all kept so far. A contact with an impulse
/// counts as farther by half as much again, so that a support point, once chosen, stays.
/// Order is kept. The result depends on the contacts alone, not on their order.
/// @throws InvalidArgument if an option is out of its range or NaN.
void reduce_contacts(const ContactReductionOptions& options, std::vector<ContactPoint>& contacts);

}  // namespace dyop
