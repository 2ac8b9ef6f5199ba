// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "dyop/dynamics/world.h"
#include "dyop/geometry/primitives.h"

namespace dyop::testing {

inline constexpr Scalar kGravity = 9.81;

/// Metres, kilograms, seconds; z is up.
inline WorldOptions earth_options() {
  WorldOptions options;
  options.gravity_W = Vector3(0, 0, -kGravity);
  return options;
}

inline BodyDefinition dynamic_body(const std::string& name, std::shared_ptr<const Shape> shape,
                                   const Vector3& p, const Vector3& v = Vector3::Zero(),
                                   const Vector3& w = Vector3::Zero()) {
  BodyDefinition body;
  body.name = name;
  body.shape = std::move(shape);
  body.mass_properties = body.shape->compute_mass_properties(1000);
  body.initial = {RigidPose(p), Twist{v, w}};
  return body;
}

/// The top is z = 0.
inline BodyDefinition floor_body(Scalar friction, Scalar restitution = 0) {
  BodyDefinition body;
  body.name = "floor";
  body.kind = BodyKind::Static;
  body.shape = std::make_shared<Box>(Vector3(20, 20, 1));
  body.initial.X_WB = RigidPose(Vector3(0, 0, -1));
  body.friction = friction;
  body.restitution = restitution;
  return body;
}

/// The gap at which bodies of these bounding radii rest by default.
inline Scalar rest_gap(Scalar smaller_radius) {
  return 5e-4 * smaller_radius;
}

/// A cube of half extent 0.5 lying at its rest gap on a support that ends at height z.
inline BodyDefinition resting_cube(Scalar x, Scalar y, Scalar z, Scalar friction = 0.5) {
  const auto shape = std::make_shared<Box>(Vector3(0.5, 0.5, 0.5));
  BodyDefinition body =
      dynamic_body("cube", shape, {x, y, z + 0.5 + rest_gap(shape->bounding_radius())});
  body.friction = friction;
  body.restitution = 0;
  return body;
}

/// `count` columns of cubes in a square, each of `height` cubes.
inline void add_columns(World& world, int columns, int height) {
  world.add_body(floor_body(0.5));
  const int side = static_cast<int>(std::ceil(std::sqrt(Scalar(columns))));
  for (int k = 0; k < columns; ++k) {
    Scalar z = 0;
    for (int i = 0; i < height; ++i) {
      const BodyDefinition cube = resting_cube(1.5 * (k % side), 1.5 * (k / side), z);
      z = cube.initial.X_WB.translation().z() + 0.5;
      world.add_body(cube);
    }
  }
}

/// A pyramid of cubes in one plane with this many in its lowest row.
inline void add_pyramid(World& world, int rows) {
  world.add_body(floor_body(0.5));
  Scalar z = 0;
  for (int row = 0; row < rows; ++row) {
    Scalar top = 0;
    for (int k = 0; k < rows - row; ++k) {
      const BodyDefinition cube = resting_cube(1.05 * (k + 0.5 * row), 0, z);
      top = cube.initial.X_WB.translation().z() + 0.5;
      world.add_body(cube);
    }
    z = top;
  }
}

/// A wall of bricks, each above the joint of two, all touching their neighbours.
inline void add_bricks(World& world, int courses, int per_course) {
  world.add_body(floor_body(0.5));
  const auto shape = std::make_shared<Box>(Vector3(0.5, 0.25, 0.25));
  const Scalar gap = rest_gap(shape->bounding_radius());
  for (int course = 0; course < courses; ++course) {
    for (int k = 0; k < per_course; ++k) {
      const Scalar x = (1 + gap) * (k - Scalar(per_course) / 2 + (course % 2 == 0 ? 0 : 0.5));
      BodyDefinition brick =
          dynamic_body("brick", shape, {x, 0, 0.25 + gap + course * (0.5 + gap)});
      brick.friction = 0.5;
      brick.restitution = 0;
      world.add_body(brick);
    }
  }
}

/// side^3 boxes that fall on a floor, each turned a little.
inline void add_pile(World& world, int side) {
  world.add_body(floor_body(0.5));
  const auto shape = std::make_shared<Box>(Vector3(0.5, 0.5, 0.5));
  for (int i = 0; i < side * side * side; ++i) {
    const int x = i % side;
    const int y = i / side % side;
    const int z = i / side / side;
    BodyDefinition body =
        dynamic_body("box", shape, {1.6 * x + 0.13 * z, 1.6 * y - 0.11 * z, 1 + 1.8 * z});
    body.initial.X_WB =
        RigidPose(rotation_from_vector(Vector3(0.05 * ((i * 7) % 5 - 2), 0.04 * ((i * 3) % 5 - 2),
                                               0.3 * ((i * 11) % 7))),
                  body.initial.X_WB.translation());
    body.restitution = 0;
    world.add_body(body);
  }
}

/// `count` spinning boxes on a grid, far apart, without gravity: they never meet.
inline void add_free_bodies(World& world, int count) {
  const auto shape = std::make_shared<Box>(Vector3(0.3, 0.2, 0.1));
  const int side = static_cast<int>(std::ceil(std::cbrt(Scalar(count))));
  for (int i = 0; i < count; ++i) {
    const Vector3 p(3.0 * (i % side), 3.0 * (i / side % side), 3.0 * (i / side / side));
    world.add_body(dynamic_body("free", shape, p, {0.1 * (i % 3), 0.05 * (i % 5), 0},
                                {0.3 * (i % 7), 1.0 + 0.1 * (i % 4), 0.2 * (i % 3)}));
  }
}

}  // namespace dyop::testing
