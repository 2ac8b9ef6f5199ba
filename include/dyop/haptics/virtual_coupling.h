// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// Force and torque on the hand that holds the device, about the device's origin, world axes.
struct ToolWrench {
  Vector3 force_W = Vector3::Zero();
  Vector3 torque_W = Vector3::Zero();
};

/// Spring and damper between device and proxy, per axis of the world, in any consistent units.
struct CouplingOptions {
  Vector3 stiffness = Vector3::Zero();             ///< K, force per length, finite, > 0
  Vector3 damping = Vector3::Zero();               ///< B, force per velocity, >= 0
  Vector3 rotational_stiffness = Vector3::Zero();  ///< torque per radian, finite, > 0
  Vector3 rotational_damping = Vector3::Zero();    ///< torque per angular velocity, >= 0
  Scalar largest_force = kInfinity;                ///< force and torque are limited to these, > 0
  Scalar largest_torque = kInfinity;
  /// Damping of the device itself, b: force per velocity, torque per angular velocity, >= 0.
  /// Together with the period T of the loop it decides passivity.
  Scalar device_damping = 0;
  Scalar device_rotational_damping = 0;
  Scalar period = 1e-3;
  /// Brake the hand by the energy that was returned beyond what it put in (passivity control), as
  /// far as the springs held that much within the last 100 periods.
  bool bounds_energy = false;
};

/// The least damping b of a device with which a spring K and damper B, sampled every T and held in
/// between, are passive whatever holds the device: b > K T / 2 + |B| ([Colgate1997]).
Scalar least_passive_damping(Scalar stiffness, Scalar damping, Scalar period);

/// What else pulls the hand, as the springs of soft regions.
struct AddedPull {
  ToolWrench wrench;  ///< about the device's origin
  Scalar stored = 0;  ///< energy that its springs hold, >= 0
};

/// The force on the hand: towards the proxy, which is where the tool really is.
class VirtualCoupling {
 public:
  /// @throws InvalidArgument if an option is out of its range or NaN; the message names it.
  explicit VirtualCoupling(const CouplingOptions& options);

  const CouplingOptions& options() const { return options_; }
  /// Other springs from the next update on.
  /// @throws InvalidArgument as the constructor.
  void set_options(const CouplingOptions& options);

  /// Whether the device's damping suffices for all axes at the given period.
  bool is_passive() const;

  /// The wrench for a device at X_WD whose proxy is at X_WP, dt after the last call; assumed to be
  /// held until the next call. dt = 0 repeats the velocities of the last call. What is added counts
  /// for the limits and the energy like the springs' own.
  ToolWrench update(const RigidPose& X_WD, const RigidPose& X_WP, Scalar dt,
                    const AddedPull& added = {});

  /// The device's pose is unknown: no wrench; the next call starts without velocities.
  void release();

  /// The device is elsewhere without having been moved there by the hand: until the next call no
  /// work is done on it, and that one starts without velocities.
  void rebase() { last_.reset(); }

  /// The work done on the hand by all wrenches so far, from the device's displacement while each
  /// was held. At most zero over every closed stroke if the coupling is passive.
  Scalar energy_returned() const { return energy_returned_; }

 private:
  struct Poses {
    RigidPose X_WD;
    RigidPose X_WP;
  };
  void observe(const RigidPose& X_WD);
  void forgive(Scalar stored, Scalar dt);
  void brake(Scalar dt, ToolWrench& wrench) const;

  CouplingOptions options_;
  std::optional<Poses> last_;
  ToolWrench wrench_;
  Vector3 v_WD_ = Vector3::Zero();
  Vector3 w_WD_ = Vector3::Zero();
  Vector3 v_WP_ = Vector3::Zero();
  Vector3 w_WP_ = Vector3::Zero();
  Scalar energy_returned_ = 0;
  Scalar forgiven_ = 0;  // of it, no longer braked
  // The most that the springs held in the present window of time and in the one before it.
  Scalar stored_ = 0;
  Scalar stored_before_ = 0;
  Scalar window_time_ = 0;
};

}  // namespace dyop
