// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/contact_search.h"

#include "contact/generation/feature_pairs.h"
#include "contact/generation/flat_contacts.h"
#include "contact/generation/near_leaves.h"
#include "distance/piece_distance.h"

namespace dyop::contact_internal {
namespace {

// Whether the surface of `mesh` admits the normal at the foot of a smooth core's nearest point on
// this triangle. Everything is in the mesh's frame, the normal points outwards.
bool admits_smooth(const ContactQuery& query, const ContactSurface& mesh, std::int32_t triangle,
                   const Vector3& p_other, const Vector3& n, Scalar sine, FeatureKey& key) {
  const std::optional<TriangleFoot> foot =
      find_foot(mesh.mesh->triangle(triangle), p_other, kInfinity, query.options.border_tolerance,
                query.noise);
  if (!foot) return false;
  key = mesh.foot_key(triangle, *foot);
  return mesh.admits_at_foot(triangle, *foot, foot->point, n, sine, query.noise);
}

// Two shapes of which one has a smooth core.
class SmoothPair {
 public:
  SmoothPair(const ContactQuery& query, const Shape& a, const Shape& b)
      : query_(query), a_(a), b_(b), tree_a_(a), tree_b_(b) {}

  const ShapeTree& tree_a() const { return tree_a_; }
  const ShapeTree& tree_b() const { return tree_b_; }
  void add(std::int32_t leaf_a, std::int32_t leaf_b, std::vector<FoundContact>& found) const;

 private:
  FacingPart part(bool of_a, std::int32_t leaf, const Vector3& n) const;
  bool add_flat(std::int32_t leaf_a, std::int32_t leaf_b, const PieceDistance& piece,
                std::vector<FoundContact>& found) const;
  bool admits(std::int32_t leaf_a, std::int32_t leaf_b, FoundContact& contact) const;

  const ContactQuery& query_;
  const Shape& a_;
  const Shape& b_;
  ShapeTree tree_a_;
  ShapeTree tree_b_;
};

// What faces along n, which is from A to B or back.
FacingPart SmoothPair::part(bool of_a, std::int32_t leaf, const Vector3& n) const {
  const ContactSurface& surface = of_a ? query_.a : query_.b;
  const RigidPose X_AS = of_a ? RigidPose() : query_.X_AB;
  const Scalar sine = query_.options.cone_tolerance;
  if (surface.is_mesh) {
    return facing_part(surface, (of_a ? tree_a_ : tree_b_).triangle(leaf), X_AS, n, sine);
  }
  return facing_part(static_cast<const ConvexShape&>(of_a ? a_ : b_), X_AS, n, sine, query_.noise);
}

// Returns whether the nearest points need no contact of their own.
bool SmoothPair::add_flat(std::int32_t leaf_a, std::int32_t leaf_b, const PieceDistance& piece,
                          std::vector<FoundContact>& found) const {
  const bool a_is_smooth = query_.a.mesh == nullptr;
  const Vector3 n = a_is_smooth ? piece.nhat_AB : Vector3(-piece.nhat_AB);
  const std::int32_t leaf = a_is_smooth ? leaf_a : leaf_b;
  const std::int32_t other_leaf = a_is_smooth ? leaf_b : leaf_a;
  FacingPart smooth = part(a_is_smooth, leaf, n);
  if (smooth.kind == FacingPart::Kind::None) return false;
  const FacingPart other =
      part(!a_is_smooth, other_leaf, smooth.has_area() ? Vector3(-smooth.normal) : Vector3(-n));
  // Of a side, the line that faces the other's face and not only its nearest point.
  if (!smooth.has_area() && other.has_area()) smooth = part(a_is_smooth, leaf, -other.normal);
  return add_flat_contacts(query_, a_is_smooth ? smooth : other, a_is_smooth ? other : smooth,
                           piece, found);
}

// The normal of a flat part is that of a face, which may lean against what lies on it.
bool SmoothPair::admits(std::int32_t leaf_a, std::int32_t leaf_b, FoundContact& contact) const {
  const bool is_flat = contact.key.a.number > 0;
  const Scalar sine = is_flat ? query_.options.cone_tolerance : query_.options.border_tolerance;
  if (query_.a.is_mesh) {
    contact.triangle_a = tree_a_.triangle(leaf_a);
    if (!admits_smooth(query_, query_.a, contact.triangle_a, contact.p_b, contact.normal, sine,
                       contact.key.a)) {
      return false;
    }
  }
  if (!query_.b.is_mesh) return true;
  contact.triangle_b = tree_b_.triangle(leaf_b);
  return admits_smooth(query_, query_.b, contact.triangle_b, query_.X_BA * contact.p_a,
                       -(query_.X_BA.rotation() * contact.normal), sine, contact.key.b);
}

void SmoothPair::add(std::int32_t leaf_a, std::int32_t leaf_b,
                     std::vector<FoundContact>& found) const {
  const PieceDistance piece =
      piece_distance(tree_a_, leaf_a, tree_b_, leaf_b, query_.X_AB, query_.noise);
  if (piece.is_overlapping || piece.lower > query_.reach) return;
  const std::size_t first = found.size();
  if (!add_flat(leaf_a, leaf_b, piece, found)) {
    FoundContact contact;
    contact.p_a = piece.p_a;
    contact.p_b = piece.p_b;
    contact.normal = piece.nhat_AB;
    contact.lower = piece.lower;
    contact.upper = piece.upper;
    contact.normal_is_of_b = query_.b.is_mesh;
    found.push_back(contact);
  }
  std::size_t kept = first;
  for (std::size_t k = first; k < found.size(); ++k) {
    if (admits(leaf_a, leaf_b, found[k])) found[kept++] = found[k];
  }
  found.resize(kept);
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
  const SmoothPair pair(query, a, b);
  const auto visit = [&](std::int32_t leaf_a, std::int32_t leaf_b) {
    pair.add(leaf_a, leaf_b, found);
  };
  visit_near_leaves(
      pair.tree_a(), pair.tree_b(), query, stack, [](const BoxPair&) { return true; }, visit);
}

}  // namespace dyop::contact_internal
