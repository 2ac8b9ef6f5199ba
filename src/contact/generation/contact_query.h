// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contact/generation/contact_surface.h"
#include "distance/distance_traversal.h"
#include "distance/neighbour_list.h"
#include "dyop/contact/contact_generator.h"
#include "geometry/shape_tree.h"

namespace dyop::contact_internal {

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
};

/// The input of a search for one pair of pieces at two poses, from the roots of their trees.
/// @param reach As for generate_contacts().
ContactQuery contact_query(const ContactSurface& surface_a, const Shape& a, const RigidPose& X_WA,
                           const ContactSurface& surface_b, const Shape& b, const RigidPose& X_WB,
                           Scalar reach, const ContactGeneratorOptions& options);

/// How far apart two findings of one contact may be when it is `distance` from the other shape.
Scalar spread_of_doubles(const ContactQuery& query, Scalar distance);

/// Puts all pairs of leaves within reach into the workspace's `first_pairs`. Returns false if it
/// has no list of neighbours that covers that.
bool list_neighbours(ContactWorkspace& workspace, const Shape& a, const RigidPose& X_WA,
                     const Shape& b, const RigidPose& X_WB, Scalar reach);

/// Appends what was found as contacts, in the order of their keys: once each, in world, and only in
/// the query's region.
void finish_contacts(const ContactQuery& query, const RigidPose& X_WA,
                     std::vector<FoundContact>& found, ContactWorkspace& workspace,
                     std::vector<ContactPoint>& contacts, std::int32_t piece_a = 0,
                     std::int32_t piece_b = 0);

/// Whether the query is of a mesh and a convex shape with so few triangles, such as a box, that to
/// go through them all costs less than to open boxes around them.
bool has_small_surface(const ContactQuery& query);

/// Of the query's first pairs, which begin at the convex shape's root, those pairs of triangles
/// that may be in contact: bounds along the axes of the convex shape, and the sides of the mesh's
/// triangle, leave out most of the others.
/// @pre has_small_surface(query); the mesh's boxes are leaves.
void split_small_surface(const ContactQuery& query, BoxPairStack& pairs);

}  // namespace dyop::contact_internal

namespace dyop {

struct ContactWorkspace::Impl {
  distance_internal::BoxPairStack stack;
  std::vector<contact_internal::FoundContact> found;
  std::vector<char> is_double;
  distance_internal::BoxPairStack first_pairs;
  distance_internal::BoxPairStack split_pairs;
  /// Of the shapes of the next calls, neither a compound; null: none.
  distance_internal::NeighbourList* neighbours = nullptr;
};

namespace contact_internal {

/// While this lives, contacts of the two shapes of a neighbour list are looked for with it.
class UseOfNeighbours {
 public:
  UseOfNeighbours(ContactWorkspace& workspace, NeighbourList& neighbours) : workspace_(workspace) {
    workspace_.impl().neighbours = &neighbours;
  }
  ~UseOfNeighbours() { workspace_.impl().neighbours = nullptr; }
  UseOfNeighbours(const UseOfNeighbours&) = delete;
  UseOfNeighbours& operator=(const UseOfNeighbours&) = delete;

 private:
  ContactWorkspace& workspace_;
};

}  // namespace contact_internal
}  // namespace dyop
