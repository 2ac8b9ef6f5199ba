// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "contact/generation/contact_query.h"
#include "contact/generation/contact_surface.h"
#include "distance/leaf_pairs.h"
#include "distance/near_features.h"

namespace dyop::contact_internal {

/// So that asking costs little.
inline constexpr int kPairsBetweenPolls = 8;

/// The kinds of features below a box.
struct Below {
  bool vertices = true;
  bool edges = true;
};

inline Below below(const ContactFeatures& features, std::int32_t box) {
  const std::int32_t node = box / BoxGroup::kWidth;
  const int column = ShapeTree::column_of(box);
  return {(features.columns_with_vertices(node) >> column & 1) != 0,
          (features.columns_with_edges(node) >> column & 1) != 0};
}

/// Vertices pair with anything, edges with edges.
inline bool can_touch(const Below& a, const Below& b) {
  return a.vertices || b.vertices || (a.edges && b.edges);
}

/// Whether a box comes as near to a place; by the ball around it, which is enough to leave out
/// most.
inline bool comes_near(const ShapeTree& tree, std::int32_t box, const Vector3& place,
                       Scalar distance) {
  if (!(distance < kInfinity)) return true;
  const Scalar away = (tree.box(box).center - place).norm();
  return !(away > distance + tree.rounding() +
                      (1 + kPointBoxNoise) * std::sqrt(tree.squared_half_diagonal(box)));
}

/// Calls visit(leaf_a, leaf_b) for all pairs of leaves within reach, and at the query's place,
/// below those that the query begins with, if is_sought(pair of boxes) holds on the way down.
template <typename IsSought, typename Visit>
void visit_near_leaves(const ShapeTree& tree_a, const ShapeTree& tree_b, const ContactQuery& query,
                       BoxPairStack& stack, const IsSought& is_sought, const Visit& visit) {
  stack.clear();
  const SearchPlace& place = query.place;
  const auto is_wanted = [&](const BoxPair& pair) {
    return comes_near(tree_a, pair.a, place.center_A, place.radius) &&
           comes_near(tree_b, pair.b, place.center_B, place.radius + query.reach) &&
           is_sought(pair);
  };
  for (const BoxPair& first : query.first_pairs) {
    if (is_wanted(first)) stack.push_back(first);
  }
  // At a vertex of many triangles two leaves take as long as many boxes.
  int asked = 0;
  const auto is_interrupted = [&](bool are_leaves) {
    const bool is_due = are_leaves || asked % kPairsBetweenPolls == 0;
    ++asked;
    return is_due && is_over(query.interrupt);
  };
  const auto visit_leaves = [&](const BoxPair& leaves) { visit(leaves.a, leaves.b); };
  visit_leaf_pairs({tree_a, tree_b, query.X_AB, query.noise, query.reach}, stack, visit_leaves,
                   is_interrupted, is_wanted);
}

/// Calls visit(leaf_a, triangle_a, triangle_b) for all pairs of triangles whose features may be in
/// contact, of the boxes of A that are wanted.
template <typename IsWanted, typename Visit>
void visit_near_triangles(const ContactQuery& query, BoxPairStack& stack, const IsWanted& is_wanted,
                          const Visit& visit) {
  const ShapeTree tree_a(*query.a.mesh);
  const ShapeTree tree_b(*query.b.mesh);
  const auto is_sought = [&](const BoxPair& pair) {
    return can_touch(below(*query.a.features, pair.a), below(*query.b.features, pair.b)) &&
           is_wanted(pair.a);
  };
  visit_near_leaves(tree_a, tree_b, query, stack, is_sought,
                    [&](std::int32_t leaf_a, std::int32_t leaf_b) {
                      visit(leaf_a, tree_a.triangle(leaf_a), tree_b.triangle(leaf_b));
                    });
}

/// Tests single pairs of features of two surfaces and keeps those that are contacts.
class FeaturePairs {
 public:
  FeaturePairs(const ContactQuery& query, std::vector<FoundContact>& found)
      : query_(query), found_(found) {}

  /// All pairs of features owned by the two triangles. Corners of `b` in frame A.
  void add_triangles(std::int32_t triangle_a, const Triangle& a, std::int32_t triangle_b,
                     const Triangle& b);

  /// All pairs of the gathered features of two convex polytopes.
  void add_convex(const NearFeatures& a, const NearFeatures& b);

 private:
  /// A vertex touching the other surface.
  struct VertexSide {
    std::int32_t vertex;
    std::int32_t triangle;
    Vector3 p;  // in frame A
    bool is_of_a;
  };
  struct EdgeSide {
    std::int32_t edge;
    std::int32_t triangle;
    Vector3 from;  // in frame A
    Vector3 to;
  };
  void add_vertices(bool of_a, const NearFeatures& own, const NearFeatures& other);
  void add_vertex(const VertexSide& vertex, std::int32_t triangle, const Triangle& t);
  bool admits_foot(const VertexSide& vertex, std::int32_t triangle, const TriangleFoot& foot,
                   const Vector3& normal) const;
  void add_edges(const EdgeSide& a, const EdgeSide& b);
  bool admits_crossing(const EdgeSide& a, const EdgeSide& b, const EdgeCrossing& crossing,
                       const Vector3& n) const;
  bool take_face_normal(const EdgeSide& a, const EdgeSide& b, const EdgeCrossing& crossing,
                        FoundContact& contact) const;
  void keep(FoundContact& contact, std::span<const Vector3> feature_a,
            std::span<const Vector3> feature_b, const Vector3& proof);

  /// The normal towards the other shape, in the frame of the given shape.
  Vector3 outward(bool of_a, const Vector3& nhat_AB_A) const {
    return of_a ? nhat_AB_A : Vector3(-(query_.X_BA.rotation() * nhat_AB_A));
  }
  Vector3 own_point(bool of_a, const Vector3& p_A) const { return of_a ? p_A : query_.X_BA * p_A; }
  const ContactSurface& surface(bool of_a) const { return of_a ? query_.a : query_.b; }

  const ContactQuery& query_;
  std::vector<FoundContact>& found_;
};

/// Appends the contacts of two convex polytopes, if they are small enough that all features within
/// reach are soon found; returns whether that is so. No order of the contacts is promised.
bool search_convex(const ContactQuery& query, const ConvexShape& a, const ConvexShape& b,
                   std::vector<FoundContact>& found);

/// Appends the contacts of two surfaces with triangles; not all of them if it is interrupted.
void search_surfaces(const ContactQuery& query, BoxPairStack& stack,
                     std::vector<FoundContact>& found);

/// The contacts of a smooth core with each nearby triangle of a mesh, in either order.
void search_smooth(const ContactQuery& query, const Shape& a, const Shape& b, BoxPairStack& stack,
                   std::vector<FoundContact>& found);

}  // namespace dyop::contact_internal
