// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "contact/generation/contact_surface.h"
#include "distance/distance_traversal.h"
#include "distance/leaf_pairs.h"
#include "distance/near_boxes.h"
#include "distance/near_features.h"
#include "distance/near_parts.h"
#include "distance/neighbour_list.h"
#include "dyop/contact/contact_generator.h"
#include "geometry/shape_tree.h"
#include "toi/deforming/expected_approach.h"

namespace dyop::contact_internal {

using toi_internal::ExpectedApproach;

/// A pair of features that passed the test, in frame A; the cores without their radii.
struct FoundContact {
  Vector3 p_a = Vector3::Zero();
  Vector3 p_b = Vector3::Zero();
  Vector3 normal = Vector3::UnitX();  ///< unit, from A to B
  Scalar lower = 0;                   ///< on the cores' distance, without the rounding of poses
  Scalar upper = 0;
  bool normal_is_of_b = false;
  int rank = 0;  ///< of duplicates the lowest rank is kept
  ContactKey key;
  std::int32_t triangle_a = -1;
  std::int32_t triangle_b = -1;
};

/// Where A's cores are searched, in the frames of both shapes.
struct SearchPlace {
  Vector3 center_A = Vector3::Zero();
  Vector3 center_B = Vector3::Zero();
  Scalar radius = kInfinity;
};

/// The input of a search for one pair of pieces.
struct ContactQuery {
  const ContactSurface& a;
  const ContactSurface& b;
  RigidPose X_AB;
  RigidPose X_BA;
  Scalar reach = 0;  ///< for the cores
  Scalar noise = 0;  ///< allowance for rounding in a distance, length
  ContactGeneratorOptions options;
  Interrupt* interrupt = nullptr;
  std::span<const BoxPair> first_pairs{&kRootPair, 1};
  SearchPlace place = {};
  std::optional<ExpectedApproach> approach_A = {};  ///< of the cores, in frame A; none: all matter
};

/// The input of a search for one pair of pieces at two poses, from the roots of their trees.
/// @param reach As for generate_contacts().
ContactQuery contact_query(const ContactSurface& surface_a, const Shape& a, const RigidPose& X_WA,
                           const ContactSurface& surface_b, const Shape& b, const RigidPose& X_WB,
                           Scalar reach, const ContactGeneratorOptions& options);

/// Limits a query to what matters for an approach of B in world, of the surfaces: the cores inflated
/// by radii of this sum.
void expect(const ExpectedApproach& approach, const RigidPose& X_WA, Scalar radii,
            ContactQuery& query);

/// How far apart two findings of one contact may be when it is `distance` from the other shape.
Scalar spread_of_doubles(const ContactQuery& query, Scalar distance);

/// Puts all pairs of leaves within reach into the workspace's `first_pairs`. Returns false if it
/// has no list of neighbours that covers that.
bool list_neighbours(ContactWorkspace& workspace, const Shape& a, const RigidPose& X_WA,
                     const Shape& b, const RigidPose& X_WB, Scalar reach);

/// Appends what was found as contacts, in the order of their keys: once each, in world, and only in
/// the query's region.
void finish_contacts(const ContactQuery& query, const RigidPose& X_WA,
                     const std::vector<FoundContact>& found, ContactWorkspace& workspace,
                     std::vector<ContactPoint>& contacts, std::int32_t piece_a = 0,
                     std::int32_t piece_b = 0);

/// Whether the query is of a mesh and a convex shape with so few triangles, such as a box, that to
/// go through them all costs less than to open boxes around them.
bool has_small_surface(const ContactQuery& query);

/// Replaces the query's first pairs, which begin at the convex shape's root, by the pairs of
/// triangles that may be in contact: bounds along the axes of the convex shape, and the sides of
/// the mesh's triangle, leave out most of the others.
/// @pre has_small_surface(query); the mesh's boxes are leaves.
void split_small_surface(const ContactQuery& query, BoxPairStack& pairs);

}  // namespace dyop::contact_internal

namespace dyop {

struct ContactWorkspace::Impl {
  distance_internal::BoxPairStack stack;
  std::vector<contact_internal::FoundContact> found;
  std::vector<char> is_double;
  std::vector<std::uint32_t> order;  // of `found`
  distance_internal::BoxPairStack first_pairs;
  distance_internal::BoxPairStack split_pairs;
  std::vector<distance_internal::PartPair> parts;
  /// Neighbour list of the shapes of the next calls, neither a compound; null: none.
  distance_internal::NeighbourList* neighbours = nullptr;
  /// Of B in the next calls, in world; null: contacts matter however the shapes move.
  const contact_internal::ExpectedApproach* approach = nullptr;
};

namespace contact_internal {

/// While this lives, calls with a workspace use something besides: its `neighbours` or `approach`.
template <typename Used>
class ScopedUse {
 public:
  ScopedUse(Used*& place, std::type_identity_t<Used>& used) : place_(place) { place_ = &used; }
  ~ScopedUse() { place_ = nullptr; }
  ScopedUse(const ScopedUse&) = delete;
  ScopedUse& operator=(const ScopedUse&) = delete;

 private:
  Used*& place_;
};

}  // namespace contact_internal
}  // namespace dyop

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

/// Whether a pair of boxes with this gap matters for the query's approach.
bool matters(const ContactQuery& query, const ShapeTree& tree_a, const ShapeTree& tree_b,
             const BoxPair& pair);

/// Calls visit(leaf_a, leaf_b) for all pairs of leaves within reach, and at the query's place, that
/// matter, below those that the query begins with, if is_sought(pair of boxes) holds on the way down.
template <typename IsSought, typename Visit>
void visit_near_leaves(const ShapeTree& tree_a, const ShapeTree& tree_b, const ContactQuery& query,
                       BoxPairStack& stack, const IsSought& is_sought, const Visit& visit) {
  stack.clear();
  const SearchPlace& place = query.place;
  const auto is_wanted = [&](const BoxPair& pair) {
    return comes_near(tree_a, pair.a, place.center_A, place.radius) &&
           comes_near(tree_b, pair.b, place.center_B, place.radius + query.reach) &&
           is_sought(pair) && (!query.approach_A || matters(query, tree_a, tree_b, pair));
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
  visit_leaf_pairs(LeafPairSearch{tree_a, tree_b, query.X_AB, query.noise, query.reach}, stack,
                   visit_leaves, is_interrupted, is_wanted);
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

  /// All pairs of features of two boxes that are near.
  void add_boxes(const NearBoxes& near);

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
  /// @param is_admitted Both surfaces are known to admit the edges' common normal.
  void add_edges(const EdgeSide& a, const EdgeSide& b, bool is_admitted = false);
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
