// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/contact_search.h"

#include "contact/generation/feature_pairs.h"
#include "contact/generation/near_leaves.h"
#include "distance/piece_distance.h"

namespace dyop::contact_internal {
namespace {

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
  FeaturePairs pairs(query, found);
  const auto is_wanted = [](std::int32_t /*box_a*/) { return true; };
  visit_near_triangles(
      query, stack, is_wanted,
      [&](std::int32_t /*leaf_a*/, std::int32_t triangle_a, std::int32_t triangle_b) {
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

}  // namespace dyop::contact_internal
