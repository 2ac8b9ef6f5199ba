// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/hierarchy/mesh_hierarchy.h"
#include "support/inputs/random_inputs.h"

// Boxes as their corners and faces, for the exact distance of triangles.
namespace dyop::testing {

using Corners = std::array<Vector3, 8>;

inline OrientedBox random_box(Scalar size, std::mt19937_64& random) {
  OrientedBox box;
  box.center = random_vector(size, random);
  box.axes = random_rotation(random).toRotationMatrix();
  for (Scalar& h : box.half_extents) h = size * random_number(0, 1, random);
  if (random_index(4, random) == 0) box.half_extents[random_index(3, random)] = 0;
  return box;
}

/// The corners in the frame that X leads to; they err by a few roundings.
inline Corners corners_of(const OrientedBox& box, const RigidPose& X) {
  Corners corners;
  for (std::size_t k = 0; k < 8; ++k) {
    const Vector3 x((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1);
    corners[k] = X * Vector3(box.center + box.axes * box.half_extents.cwiseProduct(x));
  }
  return corners;
}

inline std::vector<Triangle> faces_of(const Corners& c) {
  std::vector<Triangle> faces;
  for (const auto& [i, j, k, l] : {std::array<std::size_t, 4>{0, 1, 2, 3},
                                   {4, 5, 6, 7},
                                   {0, 1, 4, 5},
                                   {2, 3, 6, 7},
                                   {0, 2, 4, 6},
                                   {1, 3, 5, 7}}) {
    faces.push_back({c[i], c[j], c[k]});
    faces.push_back({c[j], c[k], c[l]});
  }
  return faces;
}

/// Distance of the surfaces, up to rounding; not below that of the boxes.
/// By the triangle kernel, whose bounds have an exact oracle of their own (triangle_oracle).
inline Scalar surface_distance(const Corners& a, const Corners& b) {
  Scalar least = kInfinity;
  for (const Triangle& face_a : faces_of(a)) {
    for (const Triangle& face_b : faces_of(b)) {
      least = std::min(least, triangle_distance(face_a, face_b).upper);
    }
  }
  return least;
}

}  // namespace dyop::testing
