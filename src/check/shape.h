// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "check/vec.h"

/// Shapes of the checker: support functions and a tree of boxes. TRUSTED.
namespace dyop_check {

/// A convex piece in the frame of its body: its points, or a round shape at a pose, and a radius
/// around it.
struct Piece {
  enum class Kind { Points, Cylinder, Cone, Ellipsoid, TaperedCapsule, HalfSpace };
  Kind kind = Kind::Points;
  std::vector<Vec> points;  ///< Points
  double radius = 0;        ///< around the rest
  Vec size;                 ///< Cylinder, Cone: x radius, z half length; Ellipsoid: semi-axes;
                            ///< TaperedCapsule: bottom and top radius, half length
  Pose X;                   ///< of a round shape in the body's frame
  Vec normal;               ///< HalfSpace: unit, outwards; its body has no other piece
  double offset = 0;        ///< HalfSpace: height of its plane along the normal
  /// Triangles of one mesh that hang together have one number; -1: a solid.
  std::int64_t surface = -1;

  /// The point of the piece without its radius that is farthest along d.
  Vec core_support(const Vec& d) const;
  /// The largest d.x over the piece.
  double support(const Vec& d) const {
    if (kind == Kind::HalfSpace) return half_space_support(d);
    return dot(core_support(d), d) + radius * norm(d);
  }

  double half_space_support(const Vec& d) const;
};

struct Node {
  Vec center;
  Vec half;  ///< of the box that holds all pieces below
  /// Largest distance from the body's centre of mass of a point below whose height counts: of a
  /// leaf the points of its core, as a radius adds the same height at all times; else of its box.
  double reach = 0;
  double arm = 0;           ///< distance of `center` from the centre of mass
  std::int32_t left = -1;   ///< the right child is left + 1
  std::int32_t piece = -1;  ///< of a leaf

  bool is_leaf() const { return left < 0; }
};

/// A body's shape: convex pieces below a binary tree of boxes, node 0 at the top.
struct Body {
  std::vector<Piece> pieces;
  std::vector<Node> nodes;
  double size = 0;   ///< largest distance of a point from the frame's origin
  double reach = 0;  ///< the same from the centre of mass

  /// The half-space that the body is, or null.
  const Piece* half_space() const {
    return pieces.front().kind == Piece::Kind::HalfSpace ? &pieces.front() : nullptr;
  }

  /// @param center_of_mass Of which the reaches are taken.
  void build(const Vec& center_of_mass);
};

}  // namespace dyop_check
