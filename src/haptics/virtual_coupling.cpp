// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/virtual_coupling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dyop/core/error.h"

namespace dyop {
namespace {

void require_axes(const char* name, const Vector3& values, bool may_be_zero) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Scalar value = values[k];
    const bool is_valid = (may_be_zero ? value >= 0 : value > 0) && value < kInfinity;
    DYOP_REQUIRE(is_valid, "VirtualCoupling: ", name, " must be finite and ",
                 may_be_zero ? ">= 0" : "> 0", " along every axis, not ", value);
  }
}

// The rotation vector from A to B in world axes.
Vector3 turn_between(const RigidPose& X_WA, const RigidPose& X_WB) {
  return rotation_vector(X_WB.rotation() * X_WA.rotation().transpose());
}

// Periods after which a window of time in which the springs' energy is observed ends.
constexpr Scalar kWindowPeriods = 50;

// What springs hold that are stretched by x along their axes.
Scalar stored_in(const Vector3& stiffness, const Vector3& x) {
  return stiffness.dot(x.cwiseAbs2()) / 2;
}

Vector3 shortened(const Vector3& vector, Scalar longest) {
  const Scalar length = vector.norm();
  return length > longest ? Vector3(vector * (longest / length)) : vector;
}

}  // namespace

Scalar least_passive_damping(Scalar stiffness, Scalar damping, Scalar period) {
  return stiffness * period / 2 + std::abs(damping);
}

VirtualCoupling::VirtualCoupling(const CouplingOptions& options) {
  set_options(options);
}

void VirtualCoupling::set_options(const CouplingOptions& options) {
  require_axes("stiffness", options.stiffness, false);
  require_axes("damping", options.damping, true);
  require_axes("rotational_stiffness", options.rotational_stiffness, false);
  require_axes("rotational_damping", options.rotational_damping, true);
  DYOP_REQUIRE(options.largest_force > 0, "VirtualCoupling: largest_force must be > 0, not ",
               options.largest_force);
  DYOP_REQUIRE(options.largest_torque > 0, "VirtualCoupling: largest_torque must be > 0, not ",
               options.largest_torque);
  DYOP_REQUIRE(options.device_damping >= 0, "VirtualCoupling: device_damping must be >= 0, not ",
               options.device_damping);
  DYOP_REQUIRE(options.device_rotational_damping >= 0,
               "VirtualCoupling: device_rotational_damping must be >= 0, not ",
               options.device_rotational_damping);
  DYOP_REQUIRE(options.period > 0 && options.period < kInfinity,
               "VirtualCoupling: period must be finite and > 0, not ", options.period);
  options_ = options;
}

bool VirtualCoupling::is_passive() const {
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (!(options_.device_damping >
          least_passive_damping(options_.stiffness[k], options_.damping[k], options_.period))) {
      return false;
    }
    if (!(options_.device_rotational_damping >
          least_passive_damping(options_.rotational_stiffness[k], options_.rotational_damping[k],
                                options_.period))) {
      return false;
    }
  }
  return true;
}

// The wrench was constant while the device moved.
void VirtualCoupling::observe(const RigidPose& X_WD) {
  if (!last_) return;
  energy_returned_ += wrench_.force_W.dot(X_WD.translation() - last_->X_WD.translation()) +
                      wrench_.torque_W.dot(turn_between(last_->X_WD, X_WD));
}

// What is returned comes from the springs, so no more of it needs braking than they held of late. A
// sample of the device that is far off would otherwise be braked for the rest of the run.
void VirtualCoupling::forgive(Scalar stored, Scalar dt) {
  window_time_ += dt;
  if (window_time_ > kWindowPeriods * options_.period) {
    stored_before_ = std::exchange(stored_, 0);
    window_time_ = 0;
  }
  stored_ = std::max(stored_, stored);
  forgiven_ = std::max(forgiven_, energy_returned_ - std::max(stored_, stored_before_));
}

// Adds the damping that would dissipate the surplus energy within one period if the device keeps
// its velocity ([Hannaford2002]).
void VirtualCoupling::brake(Scalar dt, ToolWrench& wrench) const {
  const Scalar motion = (v_WD_.squaredNorm() + w_WD_.squaredNorm()) * dt;
  const Scalar surplus = energy_returned_ - forgiven_;
  if (!options_.bounds_energy || !(surplus > 0) || !(motion > 0)) return;
  const Scalar damping = surplus / motion;
  wrench.force_W -= damping * v_WD_;
  wrench.torque_W -= damping * w_WD_;
}

ToolWrench VirtualCoupling::update(const RigidPose& X_WD, const RigidPose& X_WP, Scalar dt,
                                   const AddedPull& added) {
  observe(X_WD);
  if (!last_) {
    v_WD_ = w_WD_ = v_WP_ = w_WP_ = Vector3::Zero();
  } else if (dt > 0) {
    v_WD_ = (X_WD.translation() - last_->X_WD.translation()) / dt;
    w_WD_ = turn_between(last_->X_WD, X_WD) / dt;
    v_WP_ = (X_WP.translation() - last_->X_WP.translation()) / dt;
    w_WP_ = turn_between(last_->X_WP, X_WP) / dt;
  }
  last_ = {X_WD, X_WP};
  const Vector3 stretch = X_WP.translation() - X_WD.translation();
  const Vector3 turn = turn_between(X_WD, X_WP);
  wrench_.force_W =
      options_.stiffness.cwiseProduct(stretch) + options_.damping.cwiseProduct(v_WP_ - v_WD_);
  wrench_.torque_W = options_.rotational_stiffness.cwiseProduct(turn) +
                     options_.rotational_damping.cwiseProduct(w_WP_ - w_WD_);
  wrench_.force_W += added.wrench.force_W;
  wrench_.torque_W += added.wrench.torque_W;
  forgive(added.stored + stored_in(options_.stiffness, stretch) +
              stored_in(options_.rotational_stiffness, turn),
          dt);
  brake(dt, wrench_);
  wrench_.force_W = shortened(wrench_.force_W, options_.largest_force);
  wrench_.torque_W = shortened(wrench_.torque_W, options_.largest_torque);
  return wrench_;
}

void VirtualCoupling::release() {
  last_.reset();
  wrench_ = {};
}

}  // namespace dyop
