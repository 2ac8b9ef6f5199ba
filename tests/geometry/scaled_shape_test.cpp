// SPDX-License-Identifier: BSD-3-Clause

// scaled() against the support function of a linear image, h(F d), and the volume |det F| V.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/ellipsoid.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using namespace testing;

Scalar support_of(const Shape& shape, const Vector3& d) {
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape)) {
    Scalar highest = -kInfinity;
    for (const Vector3& p : mesh->vertices()) highest = std::max(highest, d.dot(p));
    return highest;
  }
  if (const auto* compound = dynamic_cast<const CompoundShape*>(&shape)) {
    Scalar highest = -kInfinity;
    for (const CompoundChild& child : compound->children()) {
      const Vector3 d_S = child.X_CS.rotation().transpose() * d;
      highest = std::max(highest, support_of(*child.shape, d_S) + d.dot(child.X_CS.translation()));
    }
    return highest;
  }
  const auto& convex = dynamic_cast<const ConvexShape&>(shape);
  return d.dot(convex.core_support(d).point) + d.norm() * convex.rounding_radius();
}

void expect_scaled(const Shape& shape, const Vector3& factors, std::mt19937_64& random) {
  const std::shared_ptr<const Shape> result = scaled(shape, factors);
  const Scalar size = shape.bounding_radius() * factors.cwiseAbs().maxCoeff();
  for (int k = 0; k < 50; ++k) {
    const Vector3 d = random_vector(1, random).normalized();
    EXPECT_NEAR(support_of(*result, d), support_of(shape, factors.cwiseProduct(d)), 1e-12 * size)
        << "factors " << factors.transpose() << ", direction " << d.transpose();
  }
  const Scalar volume = shape.compute_mass_properties(1).mass;
  EXPECT_NEAR(result->compute_mass_properties(1).mass / volume, std::abs(factors.prod()),
              1e-9 * std::abs(factors.prod()));
}

std::vector<std::shared_ptr<const Shape>> shapes_of_any_factors() {
  return {std::make_shared<Sphere>(0.7), std::make_shared<Ellipsoid>(Vector3(1, 2, 3)),
          std::make_shared<Box>(Vector3(1, 2, 0.5)),
          std::make_shared<ConvexHull>(
              std::vector<Vector3>{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {1, 1, 1}}),
          std::make_shared<TriangleMesh>(box_mesh(Vector3(1, 2, 3)).mesh())};
}

std::vector<std::shared_ptr<const Shape>> round_shapes() {
  return {std::make_shared<Cylinder>(0.5, 2), std::make_shared<Cone>(0.5, 1)};
}

std::vector<std::shared_ptr<const Shape>> rounded_shapes() {
  return {std::make_shared<Capsule>(0.5, 1), std::make_shared<RoundedBox>(Vector3(1, 2, 3), 0.25),
          std::make_shared<RoundedCylinder>(1, 2, 0.25),
          std::make_shared<TaperedCapsule>(0.5, 0.25, 1),
          std::make_shared<ConvexHull>(
              std::vector<Vector3>{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}}, 0.25)};
}

TEST(ScaledShape, IsTheLinearImage) {
  std::mt19937_64 random(1);
  std::vector<std::shared_ptr<const Shape>> all = shapes_of_any_factors();
  for (const auto& shapes : {round_shapes(), rounded_shapes()}) {
    all.insert(all.end(), shapes.begin(), shapes.end());
  }
  for (const auto& shape : all) {
    for (const Scalar size : {1e-4, 0.5, 1.0, 1e4}) {
      for (int signs = 0; signs < 8; ++signs) {
        expect_scaled(*shape,
                      size * Vector3((signs & 1) != 0 ? -1 : 1, (signs & 2) != 0 ? -1 : 1,
                                     (signs & 4) != 0 ? -1 : 1),
                      random);
      }
    }
  }
  for (const auto& shape : shapes_of_any_factors()) {
    expect_scaled(*shape, {2, -0.5, 7}, random);
    expect_scaled(*shape, {-1e-3, -1, 1e3}, random);
  }
  for (const auto& shape : round_shapes()) {
    expect_scaled(*shape, {2, 2, 7}, random);
    expect_scaled(*shape, {-2, 2, -7}, random);
  }
}

TEST(ScaledShape, ScalesChildrenAboutTheOriginOfTheCompound) {
  std::mt19937_64 random(2);
  const auto posed = [&](const std::shared_ptr<const Shape>& shape, const Matrix3& R) {
    return CompoundChild{shape, RigidPose(R, random_vector(3, random))};
  };
  for (int k = 0; k < 20; ++k) {
    std::vector<CompoundChild> children;
    for (const auto& shape : {shapes_of_any_factors()[0], shapes_of_any_factors()[2],
                              shapes_of_any_factors()[3], shapes_of_any_factors()[4]}) {
      children.push_back(posed(shape, rotation_from_vector(random_vector(3, random))));
    }
    // By a right angle: its axis is y then.
    const Scalar right = std::numbers::pi / 2;
    children.push_back(posed(round_shapes()[0], rotation_from_vector(Vector3(right, 0, 0))));
    expect_scaled(CompoundShape(children), {2, -3, 2}, random);
    for (const auto& shape : rounded_shapes()) {
      children.push_back(posed(shape, rotation_from_vector(random_vector(3, random))));
    }
    expect_scaled(CompoundShape(children), {-2, 2, 2}, random);
    expect_scaled(CompoundShape(children), {-2, -2, 2}, random);
  }
}

TEST(ScaledShape, KeepsTheOutsideOfAMesh) {
  const TriangleMesh mesh = box_mesh(Vector3(1, 2, 3)).mesh();
  const auto mirrored =
      std::static_pointer_cast<const TriangleMesh>(scaled(mesh, Vector3(-1, 1, 1)));
  EXPECT_TRUE(mirrored->is_closed());
  EXPECT_TRUE(contains(*mirrored, Vector3::Zero()));
  EXPECT_EQ(winding_number(*mirrored, Vector3::Zero()), winding_number(mesh, Vector3::Zero()));
}

TEST(ScaledShape, MovesTheFaceOfAHalfSpace) {
  const HalfSpace floor(Vector3(1, 0, 2), 3);
  const Vector3 factors(2, 5, -0.5);
  const auto result = std::static_pointer_cast<const HalfSpace>(scaled(floor, factors));
  std::mt19937_64 random(3);
  for (int k = 0; k < 100; ++k) {
    const Vector3 p = random_vector(10, random);
    const Vector3 q = factors.cwiseProduct(p);
    EXPECT_EQ(floor.normal().dot(p) <= floor.offset(), result->normal().dot(q) <= result->offset());
  }
}

TEST(ScaledShape, RefusesWhatItCannotKeep) {
  const auto message = [](const Shape& shape, const Vector3& factors) {
    return message_of([&] { scaled(shape, factors); });
  };
  const Sphere ball(1);
  EXPECT_NE(message(ball, {1, 0, 1}).find("not zero, not (1 0 1)"), std::string::npos);
  EXPECT_NE(message(ball, {1, std::nan(""), 1}).find("must be finite"), std::string::npos);
  EXPECT_NE(message(ball, {1e300, 1, 1}).find("1e+300"), std::string::npos);
  EXPECT_NE(message(Capsule(1, 2), {1, 1, 2}).find("cannot be scaled by (1 1 2)"),
            std::string::npos);
  EXPECT_NE(message(Cone(1, 2), {1, 2, 1}).find("cannot be scaled"), std::string::npos);
  const testing::UserEllipsoid own(Vector3(1, 2, 3));
  EXPECT_NE(message(own, {2, 2, 2}).find("a class of your own"), std::string::npos);
  const CompoundShape pair({{std::make_shared<Sphere>(1), RigidPose()},
                            {std::make_shared<Cylinder>(1, 2),
                             RigidPose(rotation_from_vector(Vector3(0.3, 0, 0)), {0, 0, 0})}});
  EXPECT_NE(message(pair, {1, 1, 2}).find("child 1"), std::string::npos);
}

}  // namespace
}  // namespace dyop
