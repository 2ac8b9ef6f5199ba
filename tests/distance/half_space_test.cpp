// SPDX-License-Identifier: BSD-3-Clause

// Half-spaces in every query at rest, against the lowest point of the other shape by the textbook
// formula of each shape, or by going through all vertices, in extended precision.
#include "dyop/geometry/half_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/distance_derivatives.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/point_distance.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/geometry/compound_shape.h"
#include "geometry/all_shapes.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using namespace testing;

using Wide = long double;
using WideVector = Eigen::Matrix<Wide, 3, 1>;

// A shape and how high its lowest point is along a unit vector of its frame, from the origin on.
struct Measured {
  std::shared_ptr<const Shape> shape;
  std::function<Wide(const WideVector&)> lowest;
};

std::function<Wide(const WideVector&)> lowest_vertex(std::vector<Vector3> vertices, Scalar radius) {
  return [vertices = std::move(vertices), radius](const WideVector& n) {
    Wide least = Wide(kInfinity);
    for (const Vector3& v : vertices) least = std::min(least, n.dot(v.cast<Wide>()));
    return least - Wide(radius);
  };
}

Measured of_mesh(const MeshArrays& arrays) {
  return {std::make_shared<TriangleMesh>(arrays.vertices, arrays.triangles),
          lowest_vertex(arrays.vertices, 0)};
}

std::vector<Measured> measured_shapes(Scalar s) {
  const Vector3 half(s, 0.5 * s, 0.2 * s);
  const WideVector wide = half.cast<Wide>();
  const Wide r = Wide(0.3 * s);
  const Wide h = Wide(0.8 * s);
  const auto across = [](const WideVector& n) { return std::hypot(n.x(), n.y()); };
  std::vector<Measured> shapes{
      {std::make_shared<Sphere>(s), [=](const WideVector&) { return -Wide(s); }},
      {std::make_shared<Box>(half), [=](const WideVector& n) { return -n.cwiseAbs().dot(wide); }},
      {std::make_shared<RoundedBox>(half, Scalar(r)),
       [=](const WideVector& n) { return -n.cwiseAbs().dot(wide) - r; }},
      {std::make_shared<Capsule>(Scalar(r), Scalar(h)),
       [=](const WideVector& n) { return -h * std::abs(n.z()) - r; }},
      {std::make_shared<Cylinder>(Scalar(r), Scalar(h)),
       [=](const WideVector& n) { return -r * across(n) - h * std::abs(n.z()); }},
      {std::make_shared<Cone>(Scalar(r), Scalar(h)),
       [=](const WideVector& n) { return std::min(h * n.z(), -r * across(n) - h * n.z()); }},
      {std::make_shared<Ellipsoid>(half),
       [=](const WideVector& n) { return -n.cwiseProduct(wide).norm(); }},
      of_mesh(icosphere(3, s)),
      of_mesh(gear(12, 0.8 * s, s, 0.2 * s)),
      of_mesh(plate_grid(s, 2 * s, 3, 3)),
  };
  const std::vector<Vector3> points =
      point_cloud(60, 5).moved(Matrix3::Identity(), Vector3::Zero(), s).vertices;
  shapes.push_back({std::make_shared<ConvexHull>(points), lowest_vertex(points, 0)});
  const RigidPose aside(Vector3(2 * s, 0, 0));
  const CompoundChild ball{std::make_shared<Sphere>(s), RigidPose()};
  const CompoundChild mesh{of_mesh(icosphere(1, s)).shape, aside};
  const auto of_ball = shapes[0].lowest;
  const auto of_mesh_child = lowest_vertex(icosphere(1, s).vertices, 0);
  shapes.push_back(
      {std::make_shared<CompoundShape>(std::vector{ball, mesh}), [=](const WideVector& n) {
         return std::min(of_ball(n), of_mesh_child(n) + 2 * Wide(s) * n.x());
       }});
  return shapes;
}

// The height of a shape's lowest point above a posed half-space, and what rounding may change.
struct Height {
  Scalar exact;
  Scalar noise;
};

Height height_of(const Measured& other, const RigidPose& X_WB, const HalfSpace& plane,
                 const RigidPose& X_WA) {
  // Both rotations are orthonormal only up to rounding: what the double matrices say counts.
  const WideVector n_W = X_WA.rotation().cast<Wide>() * plane.normal().cast<Wide>();
  const WideVector p_AB_W = X_WB.translation().cast<Wide>() - X_WA.translation().cast<Wide>();
  const WideVector n_B = X_WB.rotation().cast<Wide>().transpose() * n_W;
  const Wide height = n_W.dot(p_AB_W) + other.lowest(n_B) - Wide(plane.offset());
  const Scalar size = X_WA.translation().norm() + X_WB.translation().norm() +
                      2 * other.shape->bounding_radius() + std::abs(plane.offset());
  return {Scalar(height), 4 * kPoseNoise * size};
}

// At four scales, near and far from the origin, above, touching and below, in both orders.
TEST(HalfSpace, DistanceHasBothBoundsAroundTheHeightOfTheLowestPoint) {
  std::mt19937_64 random(2);
  for (const Scalar size : {1e-4, 1e-1, 1e1, 1e4}) {
    for (const Measured& other : measured_shapes(size)) {
      for (int k = 0; k < 40; ++k) {
        const Scalar away = k % 4 == 3 ? 1e5 * size : 3 * size;
        const Vector3 axis = k % 3 == 0 ? Vector3::UnitZ() : random_direction(random);
        const HalfSpace plane(axis, random_number(-size, size, random));
        const RigidPose X_WA = k % 3 == 0 ? RigidPose() : random_pose(away, random);
        RigidPose X_WB(random_rotation(random), random_vector(away, random));
        if (k % 5 == 1) {  // on the plane, but for rounding
          const Scalar height = height_of(other, X_WB, plane, X_WA).exact;
          X_WB = RigidPose(X_WB.rotation(),
                           X_WB.translation() - height * (X_WA.rotation() * plane.normal()));
        }
        const auto [exact, noise] = height_of(other, X_WB, plane, X_WA);
        const Vector3 normal_W = X_WA.rotation() * plane.normal();
        for (const bool is_first : {true, false}) {
          const DistanceResult found = is_first ? distance(plane, X_WA, *other.shape, X_WB)
                                                : distance(*other.shape, X_WB, plane, X_WA);
          EXPECT_LE(found.lower, std::max(0.0, exact) + noise / 8);
          EXPECT_GE(found.upper, exact - noise / 8);
          EXPECT_GE(found.lower, exact - noise);
          EXPECT_LE(found.upper, std::max(0.0, exact) + noise);
          EXPECT_LE((found.nhat_AB_W - (is_first ? normal_W : Vector3(-normal_W))).norm(), 1e-14);
          if (exact > noise) {
            EXPECT_EQ(found.status, DistanceStatus::Separated);
            EXPECT_NEAR((found.p_WCb - found.p_WCa).norm(), exact, noise);
          }
          // A sheet or a mesh that is all below meets the solid nevertheless.
          if (exact < -noise) {
            EXPECT_EQ(found.status, DistanceStatus::Overlapping);
          }
        }
      }
    }
  }
}

TEST(HalfSpace, TwoOfThemAreApartOnlyIfTheyFaceEachOther) {
  const HalfSpace floor;
  const HalfSpace ceiling(-Vector3::UnitZ(), -2);  // z >= 2
  EXPECT_NEAR(distance(floor, RigidPose(), ceiling, RigidPose()).lower, 2, 1e-12);
  const RigidPose tilted(rotation_from_vector(Vector3(1e-9, 0, 0)), Vector3::Zero());
  EXPECT_EQ(distance(floor, RigidPose(), ceiling, tilted).status, DistanceStatus::Overlapping);
}

TEST(HalfSpace, PenetrationIsTheDepthOfTheLowestPoint) {
  std::mt19937_64 random(3);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    for (const Measured& other : measured_shapes(size)) {
      if (other.shape->kind() != ShapeKind::Convex) continue;
      const auto& convex = static_cast<const ConvexShape&>(*other.shape);
      for (int k = 0; k < 20; ++k) {
        const HalfSpace plane(random_direction(random), 0);
        const RigidPose X_WB(random_rotation(random), random_vector(2 * size, random));
        const auto [exact, noise] = height_of(other, X_WB, plane, RigidPose());
        const auto found = find_penetration(convex, X_WB, plane, RigidPose());
        ASSERT_EQ(found.has_value(), exact <= noise / 8) << exact;
        if (!found) continue;
        EXPECT_GE(found->depth, -exact);
        EXPECT_NEAR(found->depth, -exact, noise);
        EXPECT_LE((found->nhat_AB_W + plane.normal()).norm(), 1e-14);
      }
    }
  }
}

TEST(HalfSpace, PointDistanceIsTheHeight) {
  std::mt19937_64 random(4);
  PointDistanceOptions with_sign;
  with_sign.is_signed = true;
  for (int k = 0; k < 500; ++k) {
    const Scalar size = random_magnitude(-4, 4, random);
    const HalfSpace plane(random_direction(random), random_number(-size, size, random));
    const RigidPose X_WS = random_pose(size, random);
    const Vector3 p_W = random_vector(3 * size, random);
    const Scalar exact = plane.height(X_WS.inverse() * p_W);
    const Scalar noise = 4 * kPoseNoise * 10 * size;
    const PointDistance found = point_distance(plane, X_WS, p_W, with_sign);
    EXPECT_LE(found.lower, exact + noise / 16);
    EXPECT_GE(found.upper, exact - noise / 16);
    EXPECT_LE(found.upper - found.lower, noise);
    EXPECT_NEAR(plane.height(X_WS.inverse() * found.p_WC), 0, noise);
    const PointDistance plain = point_distance(plane, X_WS, p_W);
    EXPECT_NEAR(plain.upper, std::max(0.0, exact), noise);
    EXPECT_LE(plain.lower, std::max(0.0, exact) + noise / 16);
  }
}

// Never past the plane; exact where the ray is not nearly along it.
TEST(HalfSpace, RaysEndAtThePlane) {
  std::mt19937_64 random(5);
  int hits = 0;
  for (int k = 0; k < 1000; ++k) {
    const Scalar size = random_magnitude(-4, 4, random);
    const HalfSpace plane(random_direction(random), random_number(-size, size, random));
    const RigidPose X_WS = random_pose(size, random);
    Ray ray;
    ray.p_W = random_vector(5 * size, random);
    ray.direction_W = random_direction(random);
    ray.radius = k % 2 == 0 ? 0 : random_number(0, size, random);
    ray.length = k % 5 == 0 ? 4 * size : kInfinity;
    const Scalar height = plane.height(X_WS.inverse() * ray.p_W) - ray.radius;
    const Scalar rate = -(X_WS.rotation() * plane.normal()).dot(ray.direction_W);
    const RayHit hit = ray_cast(plane, X_WS, ray);
    if (height <= 0) {
      EXPECT_EQ(hit.status, RayStatus::InitiallyTouching);
    } else if (rate <= 0 || height / rate > ray.length) {
      EXPECT_EQ(hit.status, RayStatus::Miss);
    } else if (rate > 1e-3) {
      ++hits;
      const Scalar exact = height / rate;
      ASSERT_EQ(hit.status, RayStatus::Hit) << height << ' ' << rate;
      EXPECT_LE(hit.distance, exact * (1 + 1e-14));
      EXPECT_NEAR(hit.distance, exact, 1e-9 * (exact + size));
      EXPECT_LE((hit.nhat_W - X_WS.rotation() * plane.normal()).norm(), 1e-13);
    }
  }
  EXPECT_GT(hits, 200);
}

TEST(HalfSpace, DistanceHasADerivative) {
  const HalfSpace plane(Vector3(0, 1, 2), 0.3);
  const Ellipsoid egg(Vector3(1, 0.7, 0.4));
  const RigidPose X_WA(rotation_from_vector(Vector3(0.1, 0.2, 0.3)), Vector3(0.1, 0, 0));
  const RigidPose X_WB(rotation_from_vector(Vector3(0.4, -0.2, 1)), Vector3(0.5, 1, 3));
  const DistanceDerivatives found = distance_derivatives(plane, X_WA, egg, X_WB);
  const Vector3 normal_W = X_WA.rotation() * plane.normal();
  EXPECT_EQ(found.status, DerivativeStatus::Proven);
  EXPECT_LE((found.by_b.translation - normal_W).norm(), 1e-9);
  EXPECT_LE((found.by_a.translation + normal_W).norm(), 1e-9);
}

}  // namespace
}  // namespace dyop
