// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "dyop/contact/contact_generator.h"
#include "dyop/core/export.h"

namespace dyop::contact_internal {

/// Where contacts are looked for, with B moved aside so that the surfaces do not cross there.
struct ContactPlace {
  Vector3 nhat_AB_W = Vector3::UnitX();  ///< which way they face, roughly
  Scalar lift = 0;                       ///< B is moved so far along it
  Scalar reach = 0;                      ///< up to which gap, with B where it is then
  ContactRegion region;                  ///< that holds their points of A
  Vector3 p_WCa = Vector3::Zero();       ///< points of the place: what is nearer to a point of
  Vector3 p_WCb = Vector3::Zero();       ///< another place belongs to that one
};

/// Two meshes at their poses, and all places.
struct PlacedSearch {
  const Shape& a;
  const RigidPose& X_WA;
  const Shape& b;
  const RigidPose& X_WB;
  std::span<const ContactPlace> places;
  /// One point of A for each place, and of others that nothing is looked for at.
  std::span<const Vector3> points_W;
  Interrupt* interrupt = nullptr;
};

/// Where B, posed at X_WB, is moved to for a place.
inline RigidPose lifted(const ContactPlace& place, const RigidPose& X_WB) {
  return RigidPose::from_trusted(X_WB.rotation(),
                                 X_WB.translation() + place.lift * place.nhat_AB_W);
}

/// Smallest cosine of a contact's normal to that of its place up to which all contacts are found.
inline constexpr Scalar kPlacedCosine = 0.85;

/// Calls take(number, contacts) for every place, with the contacts of its region that
/// generate_contacts() would find there, in that order: at least all whose points are one above the
/// other along a normal that leans from the place's by at most kPlacedCosine, and whose point of A
/// is not nearer to another place's point. One pass over the pieces that are near each other,
/// however many places there are.
/// @return False if it was interrupted: then nothing was taken.
DYOP_EXPORT bool generate_placed_contacts(
    const PlacedSearch& search, ContactWorkspace& workspace,
    const std::function<void(std::size_t, const std::vector<ContactPoint>&)>& take);

}  // namespace dyop::contact_internal
