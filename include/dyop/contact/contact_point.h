// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <optional>

#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

/// Identifies one side of a contact from step to step: the kind of feature, its number in the
/// shape's MeshTopology (vertex, edge or triangle), and the piece of a compound it belongs to.
struct FeatureKey {
  FeatureKind kind = FeatureKind::Smooth;
  std::int32_t piece = 0;
  /// For a smooth core 0, or the number of a place on the border of a flat part of its surface.
  std::int32_t number = 0;

  friend auto operator<=>(const FeatureKey&, const FeatureKey&) = default;
};

/// Both sides of a contact. Unique within one set of contacts, ordered, and unchanged for as long
/// as the same two features are in contact.
struct ContactKey {
  FeatureKey a;
  FeatureKey b;

  friend auto operator<=>(const ContactKey&, const ContactKey&) = default;
};

/// A place where the gap between two shapes has a local minimum
/// (docs/algorithms/contact_generation.md).
///
/// To first order in a relative displacement u of B at the contact, the gap becomes
/// gap + nhat_AB_W . u.
struct ContactPoint {
  Vector3 p_WCa = Vector3::Zero();       ///< witness point on A
  Vector3 p_WCb = Vector3::Zero();       ///< witness point on B
  Vector3 nhat_AB_W = Vector3::UnitX();  ///< unit, from A to B
  Scalar gap = 0;                        ///< nhat_AB_W . (p_WCb - p_WCa)
  /// Proven bounds on the distance between the two features, at the poses of generation. A contact
  /// reused by a ContactCache keeps them; only points, normal and gap are updated.
  Scalar lower = 0;
  Scalar upper = 0;

  Vector3 p_ACa = Vector3::Zero();  ///< the witness points, fixed in the two shapes
  Vector3 p_BCb = Vector3::Zero();
  /// Which shape the normal turns with, the one whose face gave it: true for B.
  bool normal_is_of_b = false;
  Vector3 nhat_AB_S = Vector3::UnitX();  ///< the normal in the frame of that shape

  ContactKey key;
  Feature feature_a;
  Feature feature_b;
  std::optional<std::int32_t> triangle_a;  ///< a triangle that holds the point, if A is a mesh
  std::optional<std::int32_t> triangle_b;

  /// Written by the caller after a solve: the impulse on B, world axes. ContactCache::refresh()
  /// passes it on to the contact that continues this one, turned with its normal, and prefers to
  /// keep contacts that have one.
  Vector3 impulse_W = Vector3::Zero();
  /// Written by reduce_contacts(): the length over which this contact stands for its neighbours on
  /// a curved surface, its points for those of a smooth one (see ContactMerging); 0: for itself.
  Scalar merged_way = 0;
  /// Index of the contact in the previous set that this one continues, by key, else by place.
  std::optional<std::int32_t> previous;
};

}  // namespace dyop
