// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "check/trusted/vec.h"

/// Shapes of the checker: support functions and a tree of boxes. TRUSTED.
namespace dyop_check {

/// A convex piece in the frame of its body: its core, and all that is within a radius of it.
struct Piece {
  enum class Kind {
    Points,     ///< the hull of `points`
    Discs,      ///< of two discs across the z axis of X: cylinders and cones
    Balls,      ///< of two balls on the z axis of X: tapered capsules
    Ellipsoid,  ///< with the axes of X
    HalfSpace   ///< normal.x <= offset; its body has no other piece
  };
  Kind kind = Kind::Points;
  double radius = 0;
  std::vector<Vec> points;
  Pose X;    ///< of a round core
  Vec size;  ///< Discs, Balls: radius below and above, half the length; Ellipsoid: semi-axes
  Vec normal;
  double offset = 0;

  /// The point of the core that is farthest along d.
  Vec core_support(const Vec& d) const;
  /// The largest d.x over the piece; of a half-space infinite, unless d is its normal.
  double support(const Vec& d) const;
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

/// The box of a node, or how it changes while its body deforms.
struct NodeBox {
  Vec center;
  Vec half;
};

/// A body's shape: convex pieces below a binary tree of boxes, node 0 at the top. It may be a surface
/// that deforms: then each corner of its triangles moves on a line, at a constant rate.
struct Body {
  std::vector<Piece> pieces;
  std::vector<Node> nodes;
  double size = 0;   ///< largest distance of a point from the frame's origin
  double reach = 0;  ///< the same from the centre of mass

  /// Of a surface that deforms: three vertices of each piece, where they set out, and how far they go.
  std::vector<std::int32_t> corners;
  std::vector<Vec> from;
  std::vector<Vec> moves;
  std::vector<NodeBox> box_moves;  ///< by node

  bool deforms() const { return !corners.empty(); }

  /// The half-space that the body is, or null.
  const Piece* half_space() const {
    return pieces.front().kind == Piece::Kind::HalfSpace ? &pieces.front() : nullptr;
  }

  /// Makes the tree. @param center_of_mass Of which the reaches are taken.
  void build(const Vec& center_of_mass);
  /// Its vertices go from one place to another. Keeps the tree.
  void deform(std::vector<Vec> places, const std::vector<Vec>& to);

  /// The point of a leaf's core that is farthest along d.
  /// @param part Of the way, if it deforms; from 0 to 1.
  Vec core_support(const Node& leaf, const Vec& d, double part) const;
  NodeBox box(const Node& node, double part) const {
    if (!deforms()) return {node.center, node.half};
    const NodeBox& move = box_moves[std::size_t(&node - nodes.data())];
    return {node.center + part * move.center, node.half + part * move.half};
  }
  /// The largest d.x over a node.
  double support(const Node& node, const Vec& d, double part) const {
    if (deforms()) return deformed_support(node, d, part);
    if (node.is_leaf()) return pieces[std::size_t(node.piece)].support(d);
    return dot(d, node.center) + dot(absolute(d), node.half);
  }

 private:
  double deformed_support(const Node& node, const Vec& d, double part) const;
};

}  // namespace dyop_check
