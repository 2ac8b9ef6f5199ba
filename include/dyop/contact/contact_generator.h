// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "dyop/contact/contact_point.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

struct ContactGeneratorOptions {
  /// How much the surfaces may approach one another beside a contact: sine of an angle, in
  /// [0, 0.5]. A larger value keeps more corners of a tilted face, and more contacts beside the
  /// true minimum.
  Scalar cone_tolerance = 0.02;
  /// The same for a vertex over an edge or another vertex, whose normal leans with every shift to
  /// the side, in [0, 0.5].
  Scalar border_tolerance = 1e-3;
};

/// Memory reused by the next call: one per thread. Affects speed only.
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

/// Finds every contact of two shapes: all pairs of features (vertex, edge, face) at most `reach`
/// apart whose distance is a local minimum of the distance of the two surfaces, up to the
/// tolerances.
///
/// With n the unit normal from A to B, a pair is kept if n . t <= tolerance for every unit
/// direction t in which A's surface leaves its witness point, and -n . t <= tolerance for those of
/// B: no neighbouring piece of surface comes nearer. Inner edges and vertices of a flat area are
/// therefore not contacts, and a body that slides over them does not catch on them. A face at rest
/// on a face gives the corners of their common polygon.
///
/// @param reach    Length, finite, >= 0: pairs whose distance is proven greater are left out.
/// @param contacts Replaced by the contacts, ordered by key. `impulse_W` is zero, `previous` empty.
///
/// A mesh is a surface with two sides; the surfaces must not cross: where they do, contacts say
/// nothing about depth. Convex shapes without a core_surface() give the one contact of their
/// nearest points, or one per triangle feature of a mesh.
///
/// @throws InvalidArgument if reach or an option is out of its range or NaN.
/// Const and thread-safe in the shapes. Allocates only while buffers grow.
void generate_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                       Scalar reach, const ContactGeneratorOptions& options,
                       ContactWorkspace& workspace, std::vector<ContactPoint>& contacts);

/// The same with its own buffers, for occasional use.
std::vector<ContactPoint> generate_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                            const RigidPose& X_WB, Scalar reach,
                                            const ContactGeneratorOptions& options = {});

}  // namespace dyop
