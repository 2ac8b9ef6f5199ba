// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

/// How an attempt at a contact substep was blocked.
struct BlockedSubstep {
  Scalar safe = 0;         // time from its start up to which it is proven
  bool must_land = false;  // at a hit to be resolved where it happens
  bool is_jammed = false;  // contacts contradict each other even if bodies may move along together
};

/// The length of the next attempt at a contact substep, after those that were blocked.
class Horizon {
 public:
  explicit Horizon(Scalar remaining) : tau_(remaining) {}

  Scalar tau() const { return tau_; }
  /// Whether the attempt ends at a hit to be resolved there.
  bool lands() const { return lands_; }
  /// Whether shorter substeps do not end a jam: the attempt only uses the room that is left.
  bool only_uses_room() const { return only_uses_room_; }

  void set(Scalar tau) { tau_ = tau; }
  void shorten(const BlockedSubstep& substep);

 private:
  Scalar tau_;
  bool lands_ = false;
  bool was_jammed_ = false;
  bool only_uses_room_ = false;
};

}  // namespace dyop::dynamics_internal
