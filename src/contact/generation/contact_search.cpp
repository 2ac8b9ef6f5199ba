// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/contact_search.h"

#include <array>

#include "contact/generation/feature_pairs.h"
#include "core/tolerance.h"
#include "distance/piece_distance.h"
#include "hierarchy/box_gaps.h"

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

// Calls visit(leaf_a, leaf_b) for all pairs of leaves within reach for which is_sought(box_a,
// box_b) holds on every level down to them.
template <typename IsSought, typename Visit>
void visit_leaf_pairs(const ShapeTree& tree_a, const ShapeTree& tree_b, const ContactQuery& query,
                      Scalar reach, std::vector<TreeBoxPair>& stack, const IsSought& is_sought,
                      const Visit& visit) {
  const BoxGapsKernel box_gaps = box_gaps_kernel(best_instruction_set());
  const Scalar box_noise = query.noise * (kStepNoise / kPoseNoise);
  stack.clear();
  if (is_sought(ShapeTree::kRoot, ShapeTree::kRoot)) {
    stack.emplace_back(ShapeTree::kRoot, ShapeTree::kRoot);
  }
  for (int popped = 0; !stack.empty(); ++popped) {
    const auto [box_a, box_b] = stack.back();
    // At a vertex of many triangles two leaves take as long as many boxes.
    const bool are_leaves = tree_a.is_leaf(box_a) && tree_b.is_leaf(box_b);
    if ((are_leaves || popped % kPairsBetweenPolls == 0) && is_over(query.interrupt)) return;
    stack.pop_back();
    if (are_leaves) {
      visit(box_a, box_b);
      continue;
    }
    const bool opens_a = opens_first(tree_a, box_a, tree_b, box_b);
    const ShapeTree& tree = opens_a ? tree_a : tree_b;
    const std::int32_t child = tree.child(opens_a ? box_a : box_b);
    const int count = tree.node(child).count();
    const FacingBox other = opens_a ? facing_box(tree_b.box(box_b), query.X_AB)
                                    : facing_box(tree_a.box(box_a), query.X_BA);
    std::array<Scalar, BoxGroup::kWidth> gaps;
    box_gaps(tree.rows(child), count, other, box_noise, gaps.data());
    for (int column = 0; column < count; ++column) {
      if (gaps[std::size_t(column)] > reach) continue;
      const std::int32_t part = ShapeTree::box_number(child, column);
      const TreeBoxPair pair = opens_a ? TreeBoxPair(part, box_b) : TreeBoxPair(box_a, part);
      if (is_sought(pair.first, pair.second)) stack.push_back(pair);
    }
  }
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

void search_surfaces(const ContactQuery& query, std::vector<TreeBoxPair>& stack,
                     std::vector<FoundContact>& found) {
  const ShapeTree tree_a(*query.a.mesh);
  const ShapeTree tree_b(*query.b.mesh);
  FeaturePairs pairs(query, found);
  const auto is_sought = [&](std::int32_t box_a, std::int32_t box_b) {
    return can_touch(below(*query.a.features, box_a), below(*query.b.features, box_b));
  };
  visit_leaf_pairs(tree_a, tree_b, query, query.reach, stack, is_sought,
                   [&](std::int32_t leaf_a, std::int32_t leaf_b) {
                     const std::int32_t triangle_a = tree_a.triangle(leaf_a);
                     const std::int32_t triangle_b = tree_b.triangle(leaf_b);
                     Triangle b = query.b.mesh->triangle(triangle_b);
                     for (Vector3& vertex : b) vertex = query.X_AB * vertex;
                     pairs.add_triangles(triangle_a, query.a.mesh->triangle(triangle_a), triangle_b,
                                         b);
                   });
}

void search_smooth(const ContactQuery& query, const Shape& a, const Shape& b,
                   std::vector<TreeBoxPair>& stack, std::vector<FoundContact>& found) {
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
  visit_leaf_pairs(
      tree_a, tree_b, query, query.reach, stack, [](std::int32_t, std::int32_t) { return true; },
      visit);
}

}  // namespace dyop::internal
