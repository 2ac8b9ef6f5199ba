// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/contact/contact_point.h"
#include "dyop/core/batch_options.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

/// Contacts on the facets of a curved surface that rolls or slides belong together: in a step the
/// contact passes over several of them, and the impulse of one that touches only at the end would
/// act ahead of the others and brake. The nearest one of them stands for all.
///
/// A contact stands for those near it with nearly its normal that the contact can reach: in the
/// step their gaps change by as much as they differ. A flat face that slides stays on all its
/// corners.
struct ContactMerging {
  /// Displacement of B relative to A in the step to come: that of the point of B at a place p_WC is
  /// shift_W + turn_W x p_WC.
  Vector3 shift_W = Vector3::Zero();
  Vector3 turn_W = Vector3::Zero();
  Scalar radius = 0;  ///< of the smaller shape; merged contacts are within a part of it
  /// A contact with a larger gap stands for no other, and is thinned out before those with less.
  Scalar active_gap = 0;
  /// A turn merges contacts if it moves points at the distance `radius` by at least this along the
  /// normal.
  Scalar gap_change = 0;
  /// Contacts in a row, as along a rim, whose smooth curve dips below its chords by at most this
  /// act as one where that curve comes nearest, not at the nearest corner; a ContactCache treats a
  /// ball on the facets of a smooth surface alike. 0: none do.
  Scalar most_sagitta = 0;
};

struct ContactReductionOptions {
  /// Contacts kept per cluster of normals, >= 1; more than three keep a face from tipping over.
  std::size_t points_per_cluster = 6;
  /// Two normals belong to one cluster if the cosine of their angle exceeds this, in [-1, 1].
  Scalar same_normal_cosine = 0.97;
  /// Merges contacts before the clusters are thinned out. Default: nothing is merged.
  std::optional<ContactMerging> merging = std::nullopt;
};

/// Thins out the contacts of one pair. Normals are grouped into clusters; each keeps its nearest
/// contact and then, one by one, the contacts farthest from all kept so far. A contact with an
/// impulse counts as half as far again, so that a support point, once chosen, stays.
/// With `merging`, clusters keep those that may carry before the others.
/// Keeps the order. The result depends on the contacts alone, not on their order.
/// @throws InvalidArgument if an option is out of its range or NaN.
void reduce_contacts(const ContactReductionOptions& options, std::vector<ContactPoint>& contacts);

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
  /// Limits the search to contacts whose point of A is in this ball; none: no limit.
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

struct ContactCacheOptions {
  ContactGeneratorOptions generator = {};
  ContactReductionOptions reduction = {};
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
