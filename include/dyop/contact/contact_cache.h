// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_reduction.h"

namespace DYOP_EXPORT dyop {

struct ContactCacheOptions {
  ContactGeneratorOptions generator;
  ContactReductionOptions reduction;
  /// Contacts are reused until some point near them has moved farther than this relative to the
  /// other shape; length, >= 0. A fifth of the rest offset works well.
  Scalar max_drift = 0;
};

/// The contacts of one pair of shapes from step to step. The caller keeps one per pair, always
/// passes the shapes in the same order, and calls clear() if the shapes change.
class ContactCache {
 public:
  /// Updates the contacts to new poses.
  ///
  /// While the shapes have moved no more than `max_drift`, points move with their shapes, the
  /// normal turns with the shape it belongs to, and the gap is measured again: correct to first
  /// order in the drift. `lower` and `upper` keep their values from generation.
  ///
  /// Otherwise, or if the generator's options have changed or `reach` has changed by more than the
  /// drift allows, contacts are generated up to reach + max_drift, so that none within reach is
  /// missing later. Impulses are passed on by key, then by place, and the set is reduced.
  ///
  /// @return Whether the contacts were regenerated.
  /// @throws InvalidArgument as generate_contacts() and reduce_contacts() do, and for a max_drift
  ///         that is not finite and >= 0.
  bool refresh(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
               Scalar reach, const ContactCacheOptions& options, ContactWorkspace& workspace);

  /// Ordered by key. The caller may write the impulses.
  std::span<ContactPoint> contacts() { return contacts_; }
  std::span<const ContactPoint> contacts() const { return contacts_; }

  /// Upper bound on how far any point of the smaller shape has moved relative to the other shape
  /// since the contacts were generated.
  Scalar drift() const { return drift_; }

  void clear();

 private:
  bool serves(Scalar reach, const ContactCacheOptions& options) const;
  void carry(const RigidPose& X_WA, const RigidPose& X_WB);
  void hand_on_impulses(Scalar reach);

  std::vector<ContactPoint> contacts_;
  std::vector<ContactPoint> last_;
  std::vector<char> is_continued_;  // by contact of last_
  RigidPose X_AB_;                  // at generation
  Scalar generated_reach_ = -1;     // negative: nothing generated yet
  ContactGeneratorOptions generator_;
  Scalar drift_ = 0;
};

}  // namespace dyop
