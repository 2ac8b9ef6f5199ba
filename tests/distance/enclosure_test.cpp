// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "distance/point_search.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::box_mesh;
using testing::icosphere;
using testing::plate_grid;
using testing::torus;

const RigidPose kOrigin;

TEST(Enclosure, ABodyInsideASolidMeshOverlapsIt) {
  const TriangleMesh organ = icosphere(3, 2).mesh();
  const TriangleMesh tool = box_mesh(Vector3(0.2, 0.1, 0.1)).mesh();
  const RigidPose X_WA(Vector3(0.5, 0, 0));
  const DistanceResult surfaces = distance(tool, X_WA, organ, kOrigin);
  EXPECT_EQ(surfaces.status, DistanceStatus::Separated);
  EXPECT_GT(surfaces.lower, 1);
  const DistanceResult solid = distance(tool, X_WA, organ, kOrigin, {.solid_b = true});
  EXPECT_EQ(solid.status, DistanceStatus::Overlapping);
  EXPECT_EQ(solid.lower, 0);
  EXPECT_EQ(solid.upper, 0);
  EXPECT_LT((solid.p_WCa - X_WA.translation()).norm(), 0.3);
  EXPECT_EQ(distance(organ, kOrigin, tool, X_WA, {.solid_a = true}).status,
            DistanceStatus::Overlapping);
  // The tool is not around the organ.
  EXPECT_EQ(distance(tool, X_WA, organ, kOrigin, {.solid_a = true}).status,
            DistanceStatus::Separated);
}

TEST(Enclosure, AHoleIsOutsideAndALimitDoesNotHideAnEnclosure) {
  const TriangleMesh ring = torus(1, 0.3, 48, 24).mesh();
  const Sphere ball(0.1);
  EXPECT_EQ(distance(ball, kOrigin, ring, kOrigin, {.solid_b = true}).status,
            DistanceStatus::Separated);
  const RigidPose in_ring(Vector3(0, 1, 0));
  const DistanceOptions near{.max_distance = 0.01, .solid_b = true};
  EXPECT_EQ(distance(ball, in_ring, ring, kOrigin, {.max_distance = 0.01}).status,
            DistanceStatus::FartherThanMaxDistance);
  EXPECT_EQ(distance(ball, in_ring, ring, kOrigin, near).status, DistanceStatus::Overlapping);
}

TEST(Enclosure, EveryPartCounts) {
  auto parts = box_mesh(Vector3(0.1, 0.1, 0.1)).moved(Matrix3::Identity(), Vector3(5, 0, 0));
  const auto inner = box_mesh(Vector3(0.1, 0.1, 0.1));
  const auto offset = std::int32_t(parts.vertices.size());
  parts.vertices.insert(parts.vertices.end(), inner.vertices.begin(), inner.vertices.end());
  for (const TriangleIndices& t : inner.triangles) {
    parts.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  }
  const TriangleMesh organ = icosphere(2).mesh();
  EXPECT_EQ(distance(parts.mesh(), kOrigin, organ, kOrigin, {.solid_b = true}).status,
            DistanceStatus::Overlapping);
}

TEST(Enclosure, RefusesASolidThatIsNotClosed) {
  const TriangleMesh sheet = plate_grid(1, 1, 2, 2).mesh();
  const Sphere ball(0.1);
  EXPECT_EQ(
      testing::message_of([&] { distance(ball, kOrigin, sheet, kOrigin, {.solid_b = true}); }),
      "distance: solid_b is set, but the mesh B is not closed");
}

}  // namespace
}  // namespace dyop
