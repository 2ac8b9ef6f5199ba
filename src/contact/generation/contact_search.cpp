// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/contact_search.h"

#include <cmath>

#include "contact/generation/feature_pairs.h"
#include "distance/leaf_pairs.h"
#include "distance/piece_distance.h"

namespace dyop::internal {
namespace {

// So that asking costs little.
constexpr int kPairsBetweenPolls = 8;

// The kinds of features below a box.
struct Below {
  bool vertices = true;
  bool edges = true;
};

Below below(const ContactFeatures& features, std::int32_t box) {
  const std::int32_t node = box / BoxGroup::kWidth;
  const int column = ShapeTree::column_of(box);
  return {(features.columns_with_vertices(node) >> column & 1) != 0,
          (features.columns_with_edges(node) >> column & 1) != 0};
}

// Vertices pair with anything, edges with edges.
bool can_touch(const Below& a, const Below& b) {
  return a.vertices || b.vertices || (a.edges && b.edges);
}

// Whether a box comes as near to a place; by the ball around it, which is enough to leave out most.
bool comes_near(const ShapeTree& tree, std::int32_t box, const Vector3& place, Scalar distance) {
  if (!(distance < kInfinity)) return true;
  const Scalar away = (tree.box(box).center - place).norm();
  return !(away > distance + (1 + kPointBoxNoise) * std::sqrt(tree.squared_half_diagonal(box)));
}

// Calls visit(leaf_a, leaf_b) for all pairs of leaves within reach, and at the query's place, below
// those that the query begins with.
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
  visit_leaf_pairs({tree_a, tree_b, query.X_AB, query.noise, query.reach}, stack, visit,
                   is_interrupted, is_wanted);
}

// Whether the surface of `mesh` admits the normal at the foot of a smooth core's nearest point on
// this triangle. Everything is in the mesh's frame, the normal points outwards.
bool admits_smooth(const ContactQuery& query, const ContactSurface& mesh, std::int32_t triangle,
                   const Vector3& p_other, const Vector3& n, FeatureKey& key) {
  const std::optional<TriangleFoot> foot =
      find_foot(mesh.mesh->triangle(triangle), p_other, kInfinity, query.options.border_tolerance,
                query.noise);
  if (!foot) return false;
  key = mesh.foot_key(triangle, *foot);
  return mesh.admits_at_foot(triangle, *foot, foot->point, n, query.options.border_tolerance,
                             query.noise);
}

}  // namespace

void search_surfaces(const ContactQuery& query, BoxPairStack& stack,
                     std::vector<FoundContact>& found) {
  const ShapeTree tree_a(*query.a.mesh);
  const ShapeTree tree_b(*query.b.mesh);
  FeaturePairs pairs(query, found);
  const auto is_sought = [&](const BoxPair& pair) {
    return can_touch(below(*query.a.features, pair.a), below(*query.b.features, pair.b));
  };
  visit_near_leaves(
      tree_a, tree_b, query, stack, is_sought, [&](std::int32_t leaf_a, std::int32_t leaf_b) {
        const std::int32_t triangle_a = tree_a.triangle(leaf_a);
        const std::int32_t triangle_b = tree_b.triangle(leaf_b);
        Triangle b = query.b.mesh->triangle(triangle_b);
        for (Vector3& vertex : b) vertex = query.X_AB * vertex;
        pairs.add_triangles(triangle_a, query.a.mesh->triangle(triangle_a), triangle_b, b);
      });
}

void search_smooth(const ContactQuery& query, const Shape& a, const Shape& b, BoxPairStack& stack,
                   std::vector<FoundContact>& found) {
  const ShapeTree tree_a(a);
  const ShapeTree tree_b(b);
  const auto visit = [&](std::int32_t leaf_a, std::int32_t leaf_b) {
    const PieceDistance piece =
        piece_distance(tree_a, leaf_a, tree_b, leaf_b, query.X_AB, query.noise);
    if (piece.is_overlapping || piece.lower > query.reach) return;
    FoundContact contact;
    contact.p_a = piece.p_a;
    contact.p_b = piece.p_b;
    contact.normal = piece.nhat_AB;
    contact.lower = piece.lower;
    contact.upper = piece.upper;
    if (query.a.is_mesh) {
      contact.triangle_a = tree_a.triangle(leaf_a);
      if (!admits_smooth(query, query.a, contact.triangle_a, contact.p_b, contact.normal,
                         contact.key.a)) {
        return;
      }
    }
    if (query.b.is_mesh) {
      contact.normal_is_of_b = true;
      contact.triangle_b = tree_b.triangle(leaf_b);
      if (!admits_smooth(query, query.b, contact.triangle_b, query.X_BA * contact.p_a,
                         -(query.X_BA.rotation() * contact.normal), contact.key.b)) {
        return;
      }
    }
    found.push_back(contact);
  };
  visit_near_leaves(
      tree_a, tree_b, query, stack, [](const BoxPair&) { return true; }, visit);
}

}  // namespace dyop::internal
