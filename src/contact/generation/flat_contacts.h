// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/generation/contact_search.h"
#include "dyop/core/export.h"
#include "dyop/distance/distance_result.h"

namespace dyop::contact_internal {

/// A part of a shape that faces another one, flat and at most that: the area within a circle or a
/// polygon, or a line. In frame A.
struct FacingPart {
  enum class Kind : std::uint8_t { None, Line, Polygon, Disc };
  Kind kind = Kind::None;
  bool is_side = false;              ///< the line of a curved side, which moves as the body rolls
  Vector3 normal = Vector3::Zero();  ///< of an area: unit, outwards
  Vector3 center = Vector3::Zero();  ///< of a disc; of a polygon any point of it
  Vector3 across = Vector3::Zero();  ///< of a disc: unit, in its plane, fixed in the shape
  Scalar radius = 0;                 ///< of a disc
  std::vector<Vector3> corners{};    ///< of a polygon, anticlockwise; of a line: its ends
  /// Corners, and sides that begin there, of a triangle that lie within a flat area: no contacts.
  std::uint8_t inner_corners = 0;
  std::uint8_t inner_sides = 0;

  bool is_inner_corner(std::size_t k) const { return k < 3 && (inner_corners >> k & 1) != 0; }
  bool is_inner_side(std::size_t k) const { return k < 3 && (inner_sides >> k & 1) != 0; }
  bool has_area() const { return kind == Kind::Polygon || kind == Kind::Disc; }
};

/// The part of a convex shape that faces a unit direction, up to an angle with this sine.
FacingPart facing_part(const ConvexShape& shape, const RigidPose& X_AS, const Vector3& direction_A,
                       Scalar sine, Scalar noise);

/// The same for a triangle of a mesh.
FacingPart facing_part(const ContactSurface& mesh, std::int32_t triangle, const RigidPose& X_AS,
                       const Vector3& direction_A, Scalar sine);

/// Appends the contacts of two such parts of shapes whose nearest points are given: the places on
/// the border of what each sees of the other along its normal. Every other contact of the two parts
/// lies between them. Both keys hold a number > 0 that tells the places apart.
/// @return Whether one of them, or a place that is left out within a flat area, is as near as the
///         nearest points.
bool add_flat_contacts(const ContactQuery& query, const FacingPart& a, const FacingPart& b,
                       const NearestPoints& nearest, std::vector<FoundContact>& found);

/// Whether a contact was found that way.
inline bool is_flat_contact(const ContactPoint& point) {
  const auto is_numbered = [](const FeatureKey& key) {
    return key.kind == FeatureKind::Smooth && key.number > 0;
  };
  return is_numbered(point.key.a) || is_numbered(point.key.b);
}

/// Two pieces of bodies and their poses when contacts were found, and later.
struct MovedPieces {
  const Shape& a;
  const Shape& b;
  RigidPose X_WA, X_WB;
  RigidPose X_WA_end, X_WB_end;
};

/// Where such a contact is when the bodies have moved. That on the line of a side stays where the
/// side faces the other shape; all others move with their bodies.
struct FlatEnd {
  Vector3 p_WCa = Vector3::Zero();
  Vector3 p_WCb = Vector3::Zero();
  Vector3 nhat_AB_W = Vector3::UnitX();
};
DYOP_EXPORT FlatEnd flat_end(const ContactPoint& point, const MovedPieces& pieces);

}  // namespace dyop::contact_internal
