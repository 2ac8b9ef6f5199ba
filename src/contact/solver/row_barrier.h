// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact/solver/contact_law.h"
#include "dyop/core/types.h"

namespace dyop::contact_internal {

// One bound of a row's impulse. `room`, the way to the bound, and `speed`, what the row's velocity
// gives way where the impulse is at the bound, are positive, and at the solution one of them is
// zero.
struct ImpulseBound {
  bool is_finite = false;
  Scalar room = 0;
  Scalar speed = 0;
  Scalar wanted = 0;  // change of room times speed
  Scalar speed_step = 0;

  // How the speed changes with no change of the room, and with each change of it.
  Scalar free_step() const { return is_finite ? wanted / room : 0; }
  Scalar slope() const { return is_finite ? speed / room : 0; }

  Scalar product() const { return is_finite ? room * speed : 0; }
  Scalar product_after(Scalar way, Scalar room_step) const;
  void set_step(Scalar room_step);
  // How far room and speed may go until one of them is zero, in units of the step.
  Scalar way(Scalar room_step) const;
  void go(Scalar way, Scalar room_step);
};

// A row of a joint in an interior point method: its velocity, with compliance, is
//   u = lower.speed - upper.speed,
// and its impulse stays between the bounds. A row without bounds is an equation; it is solved with
// a softness that pulls towards the impulse before, so that redundant rows do not make the matrix
// singular, and that vanishes where the impulse stays.
class RowBarrier {
 public:
  // Begins at the block's impulse, moved inside its bounds. `residual`, a velocity, is how much is
  // missing.
  void begin(const Block& block, std::size_t index, Scalar u, Scalar residual);

  std::size_t block() const { return block_; }
  Scalar impulse() const { return impulse_; }
  int bounds() const { return int(lower_.is_finite) + int(upper_.is_finite); }
  Scalar product() const { return lower_.product() + upper_.product(); }

  // Takes the velocity that belongs to the bodies' and to the impulse.
  void set_velocity(Scalar u) { gap_ = u - lower_.speed + upper_.speed; }

  // Minus what the impulse changes per change of the velocity, in the first entry.
  const Matrix3& stiffness() const { return stiffness_; }
  void linearise();

  // What the products shall change by: to zero, or to `product` from where the last step leads.
  void aim_at_zero();
  void aim_at(Scalar product);

  // Sets the step of the impulse, first while bodies keep their velocities, then with their step.
  void set_impulse_step();
  void take_step(Scalar du);
  Scalar impulse_step() const { return impulse_step_; }

  Scalar way() const;
  Scalar product_after(Scalar way) const;
  void go(Scalar way);

 private:
  std::size_t block_ = 0;
  bool is_fixed_ = false;  // the bounds are one and the same
  ImpulseBound lower_, upper_;
  Scalar impulse_ = 0;
  Scalar gap_ = 0;  // what the speeds lack to be the velocity
  Scalar softness_ = 0;
  Scalar impulse_step_ = 0;
  Matrix3 stiffness_ = Matrix3::Zero();
};

}  // namespace dyop::contact_internal
