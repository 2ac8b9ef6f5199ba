// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/row_barrier.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::contact_internal {
namespace {

// Of a row's mobility. Smaller ones lose digits where rows contradict each other; with larger ones
// loads that contacts and rows share move too slowly, and the run ends before they have arrived.
constexpr Scalar kRowSoftness = 1e-11;  // literal: found by measurement
// The start keeps at least this part of the way between two bounds from both.
constexpr Scalar kFromBounds = 0.1;

}  // namespace

Scalar ImpulseBound::product_after(Scalar way, Scalar room_step) const {
  if (!is_finite) return 0;
  return (room + way * room_step) * (speed + way * speed_step);
}

void ImpulseBound::set_step(Scalar room_step) {
  if (is_finite) speed_step = free_step() - slope() * room_step;
}

Scalar ImpulseBound::way(Scalar room_step) const {
  Scalar result = kInfinity;
  if (!is_finite) return result;
  if (room_step < 0) result = -room / room_step;
  if (speed_step < 0) result = std::min(result, -speed / speed_step);
  return result;
}

void ImpulseBound::go(Scalar way, Scalar room_step) {
  if (!is_finite) return;
  room += way * room_step;
  speed += way * speed_step;
}

void RowBarrier::begin(const Block& block, std::size_t index, Scalar u, Scalar residual) {
  *this = RowBarrier();
  block_ = index;
  softness_ = block.compliance + kRowSoftness * block.weight;
  impulse_ = block.lambda[0];
  is_fixed_ = !(block.lower < block.upper);
  if (is_fixed_) return;
  const Scalar inside =
      std::min(residual / block.weight, kFromBounds * (block.upper - block.lower));
  impulse_ = std::clamp(impulse_, block.lower + inside, block.upper - inside);
  lower_.is_finite = block.lower > -kInfinity;
  upper_.is_finite = block.upper < kInfinity;
  if (lower_.is_finite) {
    lower_.room = std::max(impulse_ - block.lower, inside);  // rounding may take it all
    lower_.speed = std::max(u, Scalar{0}) + residual;
  }
  if (upper_.is_finite) {
    upper_.room = std::max(block.upper - impulse_, inside);
    upper_.speed = std::max(-u, Scalar{0}) + residual;
  }
}

void RowBarrier::linearise() {
  const Scalar slope = softness_ + lower_.slope() + upper_.slope();
  stiffness_(0, 0) = is_fixed_ ? 0 : 1 / slope;
}

void RowBarrier::aim_at_zero() {
  lower_.wanted = -lower_.product();
  upper_.wanted = -upper_.product();
}

void RowBarrier::aim_at(Scalar product) {
  lower_.wanted = product - lower_.product() - impulse_step_ * lower_.speed_step;
  upper_.wanted = product - upper_.product() + impulse_step_ * upper_.speed_step;
}

// The velocity and the speeds are the same after the step:
//   gap + du + softness step = lower.free_step - upper.free_step - (both slopes) step.
void RowBarrier::set_impulse_step() {
  impulse_step_ = stiffness_(0, 0) * (lower_.free_step() - upper_.free_step() - gap_);
}

void RowBarrier::take_step(Scalar du) {
  impulse_step_ -= stiffness_(0, 0) * du;
  lower_.set_step(impulse_step_);
  upper_.set_step(-impulse_step_);
}

Scalar RowBarrier::way() const {
  return std::min(lower_.way(impulse_step_), upper_.way(-impulse_step_));
}

Scalar RowBarrier::product_after(Scalar way) const {
  return lower_.product_after(way, impulse_step_) + upper_.product_after(way, -impulse_step_);
}

void RowBarrier::go(Scalar way) {
  lower_.go(way, impulse_step_);
  upper_.go(way, -impulse_step_);
  impulse_ += way * impulse_step_;
}

}  // namespace dyop::contact_internal
