// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/distance.h"

#include <gtest/gtest.h>

#include <random>

#include "dyop/core/error.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/bodies.h"
#include "support/inputs/ellipsoid.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/shape_oracle.h"

namespace dyop {
namespace {

using testing::at;

TEST(Distance, OfAMeshFromABoxNamesTrianglesFeaturesAndPivot) {
  // The vertex (0, 0, 2) of a triangle hangs over the top z = 1 of a cube.
  const TriangleMesh triangle({{0, 0, 2}, {1, 0, 3}, {0, 1, 3}}, {{0, 1, 2}});
  const DistanceResult result = distance(Box({1, 1, 1}), RigidPose(), triangle, RigidPose());
  EXPECT_EQ(result.status, DistanceStatus::Separated);
  EXPECT_NEAR(result.lower, 1, 1e-12);
  EXPECT_NEAR(result.upper, 1, 1e-12);
  EXPECT_LT((result.nhat_AB_W - Vector3(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((result.p_WCb - Vector3(0, 0, 2)).norm(), 1e-12);
  EXPECT_LT((result.pivot_W() - Vector3(0, 0, 1.5)).norm(), 1e-12);
  EXPECT_EQ(result.feature_b.kind, FeatureKind::Vertex);
  EXPECT_EQ(result.feature_b.vertices[0], 0);
  EXPECT_EQ(result.triangle_b, 0);
  EXPECT_FALSE(result.triangle_a.has_value());
}

TEST(Distance, IsBracketedForEveryPairOfShapesAsTheOracleSays) {
  std::mt19937_64 random(23);
  std::vector<std::shared_ptr<const Shape>> shapes{
      std::make_shared<Sphere>(0.7), std::make_shared<Box>(Vector3(0.5, 0.8, 0.2)),
      std::make_shared<Capsule>(0.3, 0.6),
      std::make_shared<TriangleMesh>(testing::icosphere(1).mesh()),
      std::make_shared<TriangleMesh>(
          TriangleMesh({{0, 0, 0}, {1, 0.2, 0}, {0, 1, 0.4}}, {{0, 1, 1}, {2, 2, 2}, {0, 1, 2}}))};
  int separated = 0;
  int total = 0;
  for (const auto& a : shapes) {
    for (const auto& b : shapes) {
      for (int i = 0; i < 40; ++i) {
        const Scalar offset = i % 4 == 0 ? 1e6 : 0;
        const RigidPose X_WA(testing::random_rotation(random), Vector3::Constant(offset));
        const RigidPose X_WB(testing::random_rotation(random),
                             Vector3::Constant(offset) + testing::random_vector(2, random));
        const testing::OracleDistance truth = testing::oracle_distance(*a, X_WA, *b, X_WB);
        for (const bool is_swapped : {false, true}) {
          const DistanceResult result =
              is_swapped ? distance(*b, X_WB, *a, X_WA) : distance(*a, X_WA, *b, X_WB);
          EXPECT_LE(result.lower, truth.upper());
          EXPECT_GE(result.upper, truth.lower());
          const Scalar size = 4 + 2 * offset;
          EXPECT_LE(result.upper - result.lower, 1e-13 * size);
          EXPECT_NEAR((result.p_WCb - result.p_WCa).norm(), static_cast<Scalar>(truth.distance),
                      result.status == DistanceStatus::Separated ? 1e-13 * size : 4.0);
          separated += result.status == DistanceStatus::Separated;
          ++total;
        }
      }
    }
  }
  EXPECT_GT(separated, total * 3 / 10);
  EXPECT_LT(separated, total * 9 / 10);
}

TEST(Distance, StopsAtTheLimitWithAProof) {
  const auto mesh = testing::icosphere(4).mesh();
  DistanceOptions options;
  options.max_distance = 0.5;
  const DistanceResult far = distance(mesh, RigidPose(), mesh, at(4, 0, 0), options);
  EXPECT_EQ(far.status, DistanceStatus::FartherThanMaxDistance);
  EXPECT_GT(far.lower, 0.5);
  const DistanceResult full = distance(mesh, RigidPose(), mesh, at(4, 0, 0));
  EXPECT_LT(far.statistics.box_tests, full.statistics.box_tests);
  EXPECT_LE(far.lower, full.upper);
  EXPECT_EQ(distance(mesh, RigidPose(), mesh, at(2.2, 0, 0), options).status,
            DistanceStatus::Separated);
}

TEST(Distance, LeavesBoundsAsFarApartAsAllowed) {
  const auto a = testing::torus(0.8, 0.25, 60, 30).mesh();
  const auto b = testing::icosphere(4).mesh();
  std::mt19937_64 random(3);
  std::int64_t exact_work = 0;
  std::int64_t absolute_work = 0;
  std::int64_t relative_work = 0;
  int wider = 0;
  for (int k = 0; k < 200; ++k) {
    const RigidPose X_WB(testing::random_rotation(random), testing::random_number(1.5, 4, random) *
                                                               testing::random_direction(random));
    const DistanceResult exact = distance(a, RigidPose(), b, X_WB);
    const DistanceResult absolute = distance(a, RigidPose(), b, X_WB, {.absolute_tolerance = 0.05});
    const DistanceResult relative = distance(a, RigidPose(), b, X_WB, {.relative_tolerance = 0.1});
    for (const DistanceResult* x : {&absolute, &relative}) {
      EXPECT_LE(x->lower, exact.upper);
      EXPECT_GE(x->upper, exact.lower);
      EXPECT_NEAR((x->p_WCb - x->p_WCa).norm(), x->upper, 1e-12);
      wider += x->upper - x->lower > 1e-3;
    }
    EXPECT_LE(absolute.upper - absolute.lower, 0.05 + 1e-13);
    EXPECT_LE(relative.upper - relative.lower, 0.1 * relative.upper + 1e-13);
    exact_work += exact.statistics.leaf_tests;
    absolute_work += absolute.statistics.leaf_tests;
    relative_work += relative.statistics.leaf_tests;
  }
  EXPECT_GT(wider, 100);
  EXPECT_LT(absolute_work, exact_work / 2);
  EXPECT_LT(relative_work, exact_work / 2);
}

// With a tolerance above the distance nothing needs examining, and nothing is claimed.
TEST(Distance, IsInconclusiveWhereTheAllowanceHidesAnOverlap) {
  const auto mesh = testing::icosphere(3).mesh();
  const DistanceResult result =
      distance(mesh, RigidPose(), mesh, at(1, 0, 0), {.absolute_tolerance = 10});
  EXPECT_EQ(result.lower, 0);
  EXPECT_TRUE(result.status == DistanceStatus::Inconclusive ||
              result.status == DistanceStatus::Overlapping);
}

TEST(Distance, SaysOverlappingAndPenetrationOfConvexPairs) {
  DistanceOptions options;
  options.with_penetration = true;
  const DistanceResult spheres =
      distance(Sphere(1), RigidPose(), Sphere(1), at(1.5, 0, 0), options);
  EXPECT_EQ(spheres.status, DistanceStatus::Overlapping);
  EXPECT_EQ(spheres.lower, 0);
  ASSERT_TRUE(spheres.penetration.has_value());
  EXPECT_NEAR(spheres.penetration->depth, 0.5, 1e-6);
  EXPECT_LT((spheres.penetration->nhat_AB_W - Vector3(1, 0, 0)).norm(), 1e-3);
  const auto mesh = testing::icosphere(2).mesh();
  EXPECT_EQ(distance(mesh, RigidPose(), mesh, at(1, 0, 0)).status, DistanceStatus::Overlapping);
}

TEST(Distance, RefusesABadAllowance) {
  const auto refuses = [](const DistanceOptions& options) {
    EXPECT_THROW(distance(Sphere(1), RigidPose(), Sphere(1), at(3, 0, 0), options),
                 InvalidArgument);
  };
  refuses({.absolute_tolerance = -1});
  refuses({.absolute_tolerance = std::nan("")});
  refuses({.relative_tolerance = -0.1});
  refuses({.relative_tolerance = 1});
  refuses({.relative_tolerance = std::nan("")});
}

TEST(Distance, RefusesABadLimit) {
  DistanceOptions options;
  options.max_distance = -1;
  EXPECT_THROW(distance(Sphere(1), RigidPose(), Sphere(1), at(3, 0, 0), options), InvalidArgument);
  options.max_distance = std::nan("");
  EXPECT_THROW(distance(Sphere(1), RigidPose(), Sphere(1), at(3, 0, 0), options), InvalidArgument);
}

TEST(FindContacts, OfACubeOnAPlateAreItsCorners) {
  const Box plate({5, 5, 0.5});
  const Box cube({1, 1, 1});
  const std::vector<Contact> contacts =
      find_contacts(plate, RigidPose(), cube, at(0.3, 0.2, 1.5 + 1e-6), 2e-6);
  int corners = 0;
  for (const Contact& contact : contacts) {
    EXPECT_LT((contact.nhat_AB_W - Vector3(0, 0, 1)).norm(), 1e-6);
    EXPECT_LE(contact.lower, 1e-6);
    EXPECT_GE(contact.upper, 1e-6 - 1e-12);
    const Vector3 p = contact.p_WCb - Vector3(0.3, 0.2, 0);
    corners += std::abs(std::abs(p.x()) - 1) < 1e-9 && std::abs(std::abs(p.y()) - 1) < 1e-9;
  }
  EXPECT_EQ(corners, 4);
  EXPECT_EQ(contacts.size(), 4u);  // not where the diagonals of the faces cross
  EXPECT_TRUE(find_contacts(plate, RigidPose(), cube, at(0, 0, 1.6), 2e-6).empty());
}

// Plates that cover each other in part touch at the corners of the part they share, however they
// are turned: two squares of half side 1, turned by 45 degrees, share an octagon.
TEST(FindContacts, OfTurnedPlatesAreTheCornersOfWhatTheyShare) {
  const Scalar gap = 1e-6;
  for (const Scalar scale : {1e-3, 1.0, 1e3}) {
    const Box plate(scale * Vector3(1, 1, 0.5));
    const RigidPose X_WB(rotation_from_vector({0, 0, std::acos(0.0) / 2}),
                         {0, 0, scale * (1 + gap)});
    const std::vector<Contact> contacts =
        find_contacts(plate, RigidPose(), plate, X_WB, 2 * scale * gap);
    EXPECT_EQ(contacts.size(), 8u);
    for (const Contact& contact : contacts) {
      // A corner of the octagon: one coordinate is 1, the other tan(pi / 8).
      const Vector3 p = contact.p_WCa.cwiseAbs() / scale;
      EXPECT_NEAR(std::max(p.x(), p.y()), 1, 1e-9);
      EXPECT_NEAR(std::min(p.x(), p.y()), std::sqrt(2.0) - 1, 1e-9);
      EXPECT_EQ(contact.feature_a.kind, FeatureKind::Edge);
      EXPECT_EQ(contact.feature_b.kind, FeatureKind::Edge);
    }
  }
}

// A roof with a slope below kFlatEdgeSine under a bar across its ridge: the ridge is flat, but the
// ends of the flat area are a little farther away than the ridge.
TEST(FindContacts, AreNeverNoneAtTheNearestDistance) {
  constexpr Scalar kSlope = 1e-7;  // literal: a tenth of kFlatEdgeSine
  const TriangleMesh roof({{-1, -1, -kSlope},
                           {0, -1, 0},
                           {1, -1, -kSlope},
                           {-1, 1, -kSlope},
                           {0, 1, 0},
                           {1, 1, -kSlope}},
                          {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}});
  const Box bar({3, 0.2, 0.25});
  const RigidPose X_WB = at(0, 0, 0.5);
  const DistanceResult nearest = distance(roof, RigidPose(), bar, X_WB);
  const std::vector<Contact> contacts = find_contacts(roof, RigidPose(), bar, X_WB, nearest.upper);
  ASSERT_FALSE(contacts.empty());
  for (const Contact& contact : contacts) {
    EXPECT_NEAR(contact.p_WCa.x(), 0, 1e-9);
    EXPECT_NEAR(contact.upper, 0.25, 1e-12);
  }
}

TEST(FindContacts, OfRoundShapesAreOnTheirSurfaces) {
  const std::vector<Contact> spheres =
      find_contacts(Sphere(1), RigidPose(), Sphere(0.5), at(0, 0, 1.5 + 1e-6), 2e-6);
  ASSERT_EQ(spheres.size(), 1u);
  EXPECT_LT((spheres[0].p_WCa - Vector3(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((spheres[0].p_WCb - Vector3(0, 0, 1 + 1e-6)).norm(), 1e-12);
  // A lying capsule touches a plate along its length: both ends of its core.
  const RigidPose lying(Quaternion(Eigen::AngleAxisd(std::acos(0.0), Vector3::UnitY())),
                        Vector3(0, 0, 0.5 + 0.3 + 1e-6));
  EXPECT_GE(find_contacts(Box({5, 5, 0.5}), RigidPose(), Capsule(0.3, 1), lying, 2e-6).size(), 2u);
}

// A core without a surface of triangles has one contact, that of the nearest points.
TEST(FindContacts, OfASmoothShapeIsItsNearestPoint) {
  const testing::UserEllipsoid egg({1, 2, 0.5});
  const TriangleMesh plate = testing::plate_grid(8, 8, 4, 4).mesh();
  const Scalar gap = 1e-6;
  const std::vector<Contact> found =
      find_contacts(egg, at(0.3, 0.1, 0.5 + gap), plate, RigidPose(), 2 * gap);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LE(found[0].lower, gap);
  EXPECT_GE(found[0].upper, gap);
  EXPECT_LT(found[0].upper - found[0].lower, 1e-8);
  EXPECT_LT((found[0].p_WCb - Vector3(0.3, 0.1, 0)).norm(), 1e-3);
  EXPECT_LT((found[0].nhat_AB_W - Vector3(0, 0, -1)).norm(), 1e-3);
  EXPECT_TRUE(found[0].triangle_b.has_value());
  EXPECT_TRUE(find_contacts(egg, at(0, 0, 0.6), plate, RigidPose(), 0.05).empty());
}

TEST(DistanceCache, ChangesNoAnswerAndSavesWork) {
  const std::vector<TriangleMesh> meshes{testing::gear(15, 0.8, 1, 0.2).mesh(),
                                         testing::torus(0.8, 0.3, 48, 24).mesh(),
                                         testing::random_soup(300, 0.2, 3).mesh()};
  std::mt19937_64 random(12);
  std::int64_t cold_tests = 0;
  std::int64_t warm_tests = 0;
  for (const TriangleMesh& a : meshes) {
    for (const TriangleMesh& b : meshes) {
      DistanceCache cache;
      // Steps of about 1e-3, from apart through contact and overlap.
      const Vector3 path = testing::random_direction(random);
      const Vector3 turn = testing::random_direction(random);
      for (int k = 0; k < 300; ++k) {
        const RigidPose X_WB(rotation_from_vector(k * 1e-3 * turn), (2.1 - k * 4e-3) * path);
        const DistanceResult cold = distance(a, RigidPose(), b, X_WB);
        const DistanceResult warm = distance(a, RigidPose(), b, X_WB, {}, cache);
        ASSERT_EQ(warm.status, cold.status);
        // Both bracket the same distance; their widths are rounding.
        ASSERT_LE(warm.lower, cold.upper);
        ASSERT_LE(cold.lower, warm.upper);
        ASSERT_NEAR(warm.upper, cold.upper, 1e-12);
        ASSERT_NEAR(warm.lower, cold.lower, 1e-12);
        cold_tests += cold.statistics.box_tests;
        warm_tests += warm.statistics.box_tests;
      }
    }
  }
  EXPECT_LT(warm_tests, 0.7 * static_cast<Scalar>(cold_tests));
}

TEST(DistanceCache, OfOtherShapesIsHarmless) {
  const TriangleMesh large = testing::icosphere(3).mesh();
  const TriangleMesh small({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  DistanceCache cache;
  distance(large, RigidPose(), large, at(3, 0, 0), {}, cache);
  EXPECT_NEAR(distance(small, RigidPose(), small, at(0, 0, 2), {}, cache).upper, 2, 1e-12);
  cache.nearest->a = 1 << 30;
  EXPECT_EQ(distance(small, RigidPose(), Sphere(1), at(0, 0, 3), {}, cache).triangle_a, 0);
}

TEST(FindContacts, RefusesABadDistance) {
  EXPECT_THROW(find_contacts(Sphere(1), RigidPose(), Sphere(1), at(3, 0, 0), -1), InvalidArgument);
}

}  // namespace
}  // namespace dyop
