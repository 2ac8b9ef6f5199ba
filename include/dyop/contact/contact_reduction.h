// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "dyop/contact/contact_point.h"

namespace DYOP_EXPORT dyop {

struct ContactReductionOptions {
  /// Contacts kept per cluster of normals, >= 1; more than three keep a face from tipping over.
  std::size_t points_per_cluster = 6;
  /// Two normals belong to one cluster if the cosine of their angle exceeds this, in [-1, 1].
  Scalar same_normal_cosine = 0.97;
};

/// Thins out the contacts of one pair. Normals are grouped into clusters; each keeps its nearest
/// contact and then, one by one, the contacts farthest from all kept so far. A contact with an
/// impulse counts as half as far again, so that a support point, once chosen, stays.
/// Keeps the order. The result depends on the contacts alone, not on their order.
/// @throws InvalidArgument if an option is out of its range or NaN.
void reduce_contacts(const ContactReductionOptions& options, std::vector<ContactPoint>& contacts);

}  // namespace dyop
