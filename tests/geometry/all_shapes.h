// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"

namespace dyop::testing {

/// A convex shape of about the given size, for tests that hold for every shape.
struct ShapeMaker {
  std::string name;
  std::function<std::unique_ptr<ConvexShape>(Scalar size)> make;
  bool has_volume = true;
};

template <typename Shape, typename... Arguments>
std::unique_ptr<ConvexShape> make_shape(Arguments&&... arguments) {
  return std::make_unique<Shape>(std::forward<Arguments>(arguments)...);
}

/// Every convex shape of the library: a new one needs one line here.
inline std::vector<ShapeMaker> all_shapes() {
  const auto hull = [](const MeshArrays& mesh) {
    return [mesh](Scalar size) {
      const Matrix3 turn = rotation_from_vector(Vector3(0.4, -0.3, 0.8));
      return make_shape<ConvexHull>(mesh.moved(turn, size * Vector3(0.1, 0.2, 0.3), size).vertices);
    };
  };
  return {
      {"sphere", [](Scalar size) { return make_shape<Sphere>(size); }},
      {"box", [](Scalar size) { return make_shape<Box>(size * Vector3(1, 0.5, 0.2)); }},
      {"capsule", [](Scalar size) { return make_shape<Capsule>(0.3 * size, size); }},
      {"rounded_box",
       [](Scalar size) {
         return make_shape<RoundedBox>(size * Vector3(0.8, 0.4, 0.1), 0.2 * size);
       }},
      {"cylinder", [](Scalar size) { return make_shape<Cylinder>(0.5 * size, 0.8 * size); }},
      {"disc", [](Scalar size) { return make_shape<Cylinder>(size, 0.01 * size); }},
      {"cone", [](Scalar size) { return make_shape<Cone>(0.5 * size, 0.8 * size); }},
      {"ellipsoid", [](Scalar size) { return make_shape<Ellipsoid>(size * Vector3(1, 0.8, 0.6)); }},
      {"rounded_cylinder",
       [](Scalar size) { return make_shape<RoundedCylinder>(0.4 * size, 0.5 * size, 0.2 * size); }},
      {"tapered_capsule",
       [](Scalar size) { return make_shape<TaperedCapsule>(0.5 * size, 0.2 * size, 0.6 * size); }},
      {"rounded_hull",
       [](Scalar size) {
         return make_shape<ConvexHull>(
             point_cloud(40, 3).moved(Matrix3::Identity(), Vector3::Zero(), 0.7 * size).vertices,
             0.2 * size);
       }},
      {"hull_of_cloud", hull(point_cloud(200, 7))},
      {"hull_of_ball", hull(icosphere(3))},
      {"hull_of_gear", hull(gear(12, 0.8, 1, 0.2))},
      {"polygon",
       [](Scalar size) {
         return make_shape<ConvexHull>(plate_grid(size, 2 * size, 3, 3).vertices);
       },
       false},
      {"segment", [](Scalar size) { return make_shape<ConvexHull>(needle(size, 4).vertices); },
       false},
      {"point",
       [](Scalar size) {
         return make_shape<ConvexHull>(std::vector<Vector3>{size * Vector3(1, 2, 3)});
       },
       false},
  };
}

}  // namespace dyop::testing
