// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/height_field.h"
#include "dyop/geometry/occupancy.h"
#include "geometry/all_shapes.h"

namespace dyop::testing {

/// A compound of about the given size, for tests that hold for every shape.
struct CompoundMaker {
  std::string name;
  std::function<std::shared_ptr<CompoundShape>(Scalar size)> make;
};

inline RigidPose turned_at(const Vector3& turn, const Vector3& place) {
  return RigidPose(rotation_from_vector(turn), place);
}

inline std::vector<CompoundMaker> all_compounds() {
  const auto mesh = [](const MeshArrays& arrays, Scalar size) {
    return std::make_shared<TriangleMesh>(
        arrays.moved(Matrix3::Identity(), Vector3::Zero(), size).mesh());
  };
  const auto mixed = [mesh](Scalar size) {
    return std::make_shared<CompoundShape>(std::vector<CompoundChild>{
        {mesh(torus(1, 0.3, 12, 6), 0.5 * size),
         turned_at({0.3, 0.2, -0.4}, size * Vector3(0.4, 0, 0.1))},
        {std::make_shared<Sphere>(0.3 * size), turned_at({1, 0, 0}, size * Vector3(-0.5, 0.2, 0))},
        {std::make_shared<Box>(size * Vector3(0.2, 0.1, 0.4)),
         turned_at({0.1, 2, 0}, size * Vector3(0, 0.7, -0.3))}});
  };
  return {
      {"single_mesh",
       [mesh](Scalar size) {
         return std::make_shared<CompoundShape>(std::vector<CompoundChild>{
             {mesh(icosphere(1), size), turned_at({1, 2, 3}, {0, 0, 0})}});
       }},
      {"single_capsule",
       [](Scalar size) {
         return std::make_shared<CompoundShape>(
             std::vector<CompoundChild>{{std::make_shared<Capsule>(0.2 * size, size),
                                         turned_at({1, 0.5, 0}, size * Vector3(0.1, 0.1, 0))}});
       }},
      {"mixed", mixed},
      {"nested",
       [mixed](Scalar size) {
         return std::make_shared<CompoundShape>(std::vector<CompoundChild>{
             {std::make_shared<Sphere>(0.2 * size), RigidPose(size * Vector3(0, 0, 0.9))},
             {mixed(0.7 * size), turned_at({0.5, -0.5, 1}, size * Vector3(0, -0.3, 0))}});
       }},
      {"thirty_boxes",
       [](Scalar size) {
         std::vector<CompoundChild> boxes;
         for (int k = 0; k < 30; ++k) {
           boxes.push_back(
               {std::make_shared<Box>(size * Vector3(0.05, 0.08, 0.02 + 0.005 * k)),
                turned_at(
                    {0.3 * k, 0.1, 0},
                    size * Vector3(std::sin(2.4 * k), std::cos(1.7 * k), std::sin(k)) * 0.6)});
         }
         return std::make_shared<CompoundShape>(boxes);
       }},
      {"occupancy",
       [](Scalar size) {
         std::vector<OccupiedCube> cubes;
         for (const Vector3& cell : {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(1, 1, 0),
                                     Vector3(0, 0, 2), Vector3(-2, 1, 1)}) {
           cubes.push_back({0.3 * size * cell, 0.3 * size});
         }
         cubes.push_back({size * Vector3(0.45, -0.45, 0.3), 0.6 * size});  // a larger leaf
         return std::make_shared<CompoundShape>(occupancy(cubes));
       }},
      {"point_cloud",
       [](Scalar size) {
         std::vector<Vector3> points;
         for (int k = 0; k < 8; ++k) {
           points.push_back(size * Vector3(std::sin(2.4 * k), std::cos(1.7 * k), std::sin(k)));
         }
         return std::make_shared<CompoundShape>(dyop::point_cloud(points, 0.2 * size));
       }},
      {"height_field",
       [](Scalar size) {
         const HeightGrid grid{.rows = 3,
                               .columns = 3,
                               .heights = {0.2 * size, 0.1 * size, 0.3 * size, 0.4 * size, 0,
                                           0.2 * size, 0.1 * size, 0.3 * size, 0.3 * size},
                               .x = -0.6 * size,
                               .y = -0.5 * size,
                               .spacing_x = 0.6 * size,
                               .spacing_y = 0.5 * size};
         return std::make_shared<CompoundShape>(std::vector<CompoundChild>{
             {std::make_shared<TriangleMesh>(height_field(grid)), RigidPose()},
             {std::make_shared<Sphere>(0.2 * size), RigidPose(size * Vector3(0, 0, 0.5))}});
       }},
  };
}

}  // namespace dyop::testing
