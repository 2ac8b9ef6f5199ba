// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "dyop/contact/contact_point.h"
#include "dyop/core/interrupt.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

/// A ball, in world.
struct ContactRegion {
  Vector3 center_W = Vector3::Zero();
  Scalar radius = 0;  ///< >= 0
};

struct ContactGeneratorOptions {
  /// How steeply the surfaces may approach each other beside a contact: the sine of an angle, in
  /// [0, 0.5]. A larger value keeps more corners of a tilted face, and more contacts beside the
  /// true minimum.
  Scalar cone_tolerance = 0.02;
  /// The same for a vertex above an edge or another vertex, where the normal tilts with every
  /// sideways shift, in [0, 0.5].
  Scalar border_tolerance = 1e-3;
  /// Only contacts whose point of A is in this ball; the rest of the surfaces is not searched.
  /// None: all.
  std::optional<ContactRegion> region = std::nullopt;
};

/// Memory that the next call reuses: one per thread. Affects speed only.
class ContactWorkspace {
 public:
  ContactWorkspace();
  ~ContactWorkspace();
  ContactWorkspace(ContactWorkspace&&) noexcept;
  ContactWorkspace& operator=(ContactWorkspace&&) noexcept;

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// Finds all contacts of two shapes: pairs of features (vertex, edge, face) at most `reach` apart
/// where the distance between the two surfaces has a local minimum, up to the tolerances.
///
/// With n the unit normal from A to B, a pair is kept if n . t <= tolerance for every unit
/// direction t in which A's surface leaves its witness point, and -n . t <= tolerance for those of
/// B: no neighbouring piece of surface comes nearer. Inner edges and vertices of a flat area are
/// therefore not contacts, and a body that slides over them does not catch on them. A face resting
/// on a face gives the corners of their common polygon.
///
/// @param reach    Length, finite, >= 0: pairs proven to be farther apart are left out.
/// @param contacts Replaced by the contacts, ordered by key. `impulse_W` is zero, `previous` empty.
///
/// A mesh is a two-sided surface. The surfaces must not intersect: where they do, contacts say
/// nothing about depth. A convex shape without a core_surface() gives one contact, at the nearest
/// points, or one per triangle feature against a mesh; several where its flat_part() faces the
/// other shape: on the border of what each sees of the other.
///
/// @throws InvalidArgument if reach or an option is out of its range, or not finite.
/// Reads the shapes only; thread-safe for shared shapes. Allocates only while buffers grow.
/// @param interrupt Asked after every few pairs of boxes; null: never.
/// @return False if it said yes: then there are no contacts.
bool generate_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                       Scalar reach, const ContactGeneratorOptions& options,
                       ContactWorkspace& workspace, std::vector<ContactPoint>& contacts,
                       Interrupt* interrupt = nullptr);

/// The same with buffers of its own, for occasional use.
std::vector<ContactPoint> generate_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                            const RigidPose& X_WB, Scalar reach,
                                            const ContactGeneratorOptions& options = {});

}  // namespace dyop
