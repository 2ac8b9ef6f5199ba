// SPDX-License-Identifier: BSD-3-Clause

// 3. Where do two shapes touch? A box that rests on a face touches at more than one point.
#include <dyop/dyop.h>

#include <cstdio>

int main() {
  const dyop::Box table({5, 5, 0.5});
  const dyop::Box crate({1, 0.5, 0.25});
  const dyop::RigidPose X_WTable({0, 0, -0.5});   // the top is at height 0
  const dyop::RigidPose X_WCrate({0, 0, 0.251});  // a thousandth above it

  // All pairs of features at most 0.01 apart, once per place: the corners of the crate.
  for (const dyop::Contact& contact : dyop::find_contacts(table, X_WTable, crate, X_WCrate, 0.01)) {
    std::printf("at (%+.1f, %+.1f): gap %.6f, normal (%.1f, %.1f, %.1f)\n", contact.p_WCb.x(),
                contact.p_WCb.y(), contact.lower, contact.nhat_AB_W.x() + 0.0,
                contact.nhat_AB_W.y() + 0.0, contact.nhat_AB_W.z());
  }

  // The same at the end of a fall: time_of_impact returns all contacts of the impact.
  const dyop::RestMotion at_rest{X_WTable};
  const dyop::ConstantTwistMotion falling(dyop::RigidPose({0, 0, 2.25}), {{0, 0, -4}, {0, 0, 0}});
  dyop::ToiOptions options;
  options.with_contacts = true;
  const dyop::ToiResult hit = dyop::time_of_impact(table, at_rest, crate, falling, {0, 1}, options);
  std::printf("falls for %.4f, then %zu contacts, closing at %.1f\n", hit.t_safe,
              hit.contacts.size(), hit.contact->closing_speed);
}
// Prints:
// at (+1.0, +0.5): gap 0.001000, normal (0.0, 0.0, 1.0)
// at (+1.0, -0.5): gap 0.001000, normal (0.0, 0.0, 1.0)
// at (-1.0, +0.5): gap 0.001000, normal (0.0, 0.0, 1.0)
// at (-1.0, -0.5): gap 0.001000, normal (0.0, 0.0, 1.0)
// falls for 0.5000, then 4 contacts, closing at 4.0
