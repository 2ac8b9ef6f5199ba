// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// A body as the contact solvers see it. Velocities are those of the centre of mass, world axes.
///
/// A body that cannot be moved (static, kinematic) has zero mobility, and its given velocity as
/// free velocity. A locked axis has zero mobility along it. Mobilities are symmetric and positive
/// semidefinite.
struct ContactBody {
  Matrix3 inverse_mass_W = Matrix3::Zero();     ///< linear mobility, 1 / mass
  Matrix3 inverse_inertia_W = Matrix3::Zero();  ///< angular mobility, 1 / (mass length^2)
  Vector3 free_v_W = Vector3::Zero();           ///< velocity without contacts, length per time
  Vector3 free_w_W = Vector3::Zero();           ///< radians per time
  Vector3 v_W = Vector3::Zero();                ///< out: velocity after all impulses
  Vector3 w_W = Vector3::Zero();                ///< out
};

/// Anisotropic friction: the tangential impulse (p along the axis, q across it) obeys (p /
/// friction)^2 + (q / across)^2 <= normal impulse^2 and dissipates as much energy as it can.
struct FrictionEllipse {
  Vector3 axis_W = Vector3::UnitX();  ///< any length; its normal part is ignored
  Scalar across = 0;                  ///< coefficient across the axis, >= 0
};

/// One touching point of bodies A and B.
///
/// With u = v_B + w_B x r_b - v_A - w_A x r_a, the velocity of B's point relative to A's, the laws
/// are: 0 <= impulse . n and u . n >= target, at least one of them an equality (Signorini); and
/// |tangential impulse| <= friction times normal impulse, opposite to the sliding velocity, the
/// tangential part of u - sticking_velocity_W, where that is not zero (Coulomb). Newton's
/// restitution is a target: target = -e times the approach velocity before the impact.
struct PointContact {
  std::size_t body_a = 0;                         ///< index into ContactProblem::bodies
  std::size_t body_b = 0;                         ///< a different one
  Vector3 r_a_W = Vector3::Zero();                ///< from A's centre of mass to the contact
  Vector3 r_b_W = Vector3::Zero();                ///< from B's centre of mass to the contact
  Vector3 nhat_AB_W = Vector3::UnitX();           ///< unit, from A to B
  Scalar target = 0;                              ///< least normal velocity, length per time
  Vector3 sticking_velocity_W = Vector3::Zero();  ///< of B's point to A's that does not slide
  Scalar friction = 0;                     ///< Coulomb's coefficient, >= 0; along ellipse->axis_W
  std::optional<FrictionEllipse> ellipse;  ///< none: the same friction in all directions
  /// Resistance to rolling and to spinning about the normal, lengths >= 0: |angular impulse across
  /// the normal| <= rolling times normal impulse, |along it| <= torsional times normal impulse.
  Scalar rolling_friction = 0;
  Scalar torsional_friction = 0;
  Vector3 impulse_W = Vector3::Zero();  ///< in: warm start; out: on B, at the contact; -this on A
  Vector3 angular_impulse_W = Vector3::Zero();  ///< the same for rolling and torsional friction
};

/// A further body that moves a contact's point on A or on B: the velocity there adds to that of
/// body A or B. So a coordinate of its own, such as the angle of a jaw beside the frame of its
/// tool, can be a body.
struct ContactCarrier {
  std::size_t contact = 0;        ///< index into ContactProblem::contacts
  std::size_t body = 0;           ///< neither A nor B, nor named before for this contact
  bool is_of_a = false;           ///< whether it moves A's point, or B's
  Vector3 r_W = Vector3::Zero();  ///< from the body's centre of mass to the contact
};

/// One row of a joint, limit or motor. With J v = j_av . v_A + j_aw . w_A + j_bv . v_B + j_bw . w_B
/// the law is J v + compliance * impulse = target, but >= target where the impulse is at its lower
/// bound and <= target where it is at its upper bound.
/// Equality: (-inf, inf). Limit: (0, inf). Motor: (-max, max).
/// Scale angular rows by a length, so that J v is a length per time like everything else.
struct JointRow {
  std::size_t body_a = 0;
  std::size_t body_b = 0;            ///< a different one
  Vector3 j_av_W = Vector3::Zero();  ///< along v of A
  Vector3 j_aw_W = Vector3::Zero();  ///< along w of A
  Vector3 j_bv_W = Vector3::Zero();  ///< along v of B
  Vector3 j_bw_W = Vector3::Zero();  ///< along w of B
  Scalar target = 0;                 ///< length per time
  Scalar lower = -kInfinity;         ///< of the impulse
  Scalar upper = kInfinity;
  Scalar compliance = 0;  ///< >= 0, velocity per impulse (1 / mass): a soft row
  Scalar impulse = 0;     ///< in: warm start; out: J^T impulse acts on the bodies
};

/// Coefficient of friction of a contact (given by index) that slides with velocity u_t (B's point
/// relative to A's, world axes, length per time). Must be finite, >= 0 and deterministic,
/// preferably continuous in u_t. For a contact with an ellipse this is its larger coefficient; the
/// ratio stays.
using FrictionLaw = std::function<Scalar(std::size_t contact, const Vector3& sliding_W)>;

/// Bodies connected by contacts and rows: one island, or several at once. Solvers write the
/// impulses and velocities. Sweeps visit the contacts in the given order; from the ground up works
/// best.
struct ContactProblem {
  std::vector<ContactBody> bodies;
  std::vector<PointContact> contacts;
  std::vector<ContactCarrier> carriers;  ///< ascending by contact
  std::vector<JointRow> rows;
  FrictionLaw friction_law;  ///< empty: PointContact::friction
};

}  // namespace dyop
