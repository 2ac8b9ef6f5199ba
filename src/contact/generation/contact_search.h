// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contact/generation/contact_surface.h"
#include "distance/distance_traversal.h"
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

/// Appends the contacts of two surfaces with triangles; not all of them if it is interrupted.
void search_surfaces(const ContactQuery& query, BoxPairStack& stack,
                     std::vector<FoundContact>& found);

/// The contacts of a smooth core with each nearby triangle of a mesh, in either order.
void search_smooth(const ContactQuery& query, const Shape& a, const Shape& b, BoxPairStack& stack,
                   std::vector<FoundContact>& found);

}  // namespace dyop::contact_internal
