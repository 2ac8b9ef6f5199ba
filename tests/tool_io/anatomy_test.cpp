// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/tool_io/anatomy.h"

#include <gtest/gtest.h>

#include "dyop/core/error.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop {
namespace {

void check_solid(const AnatomyMesh& made, std::size_t wanted) {
  const TriangleMesh mesh(made.vertices, made.triangles);
  EXPECT_NEAR(double(mesh.triangles().size()), double(wanted), 0.1 * double(wanted));
  EXPECT_TRUE(mesh.is_closed());
  EXPECT_EQ(mesh.part_vertices().size(), 1u);
  EXPECT_GT(mesh.compute_mass_properties(1).mass, 0);  // wound outwards
}

TEST(Anatomy, OrgansAndInstrumentsAreClosedAndOfTheSizeAskedFor) {
  for (const std::size_t triangles : {400, 3000, 30000}) {
    check_solid(make_liver(triangles), triangles);
    check_solid(make_vessel(triangles), triangles);
    check_solid(make_shaft(triangles, 2.5, 250), triangles);
    check_solid(make_jaw(triangles, 2.4, 18), triangles);
  }
}

TEST(Anatomy, TheWallIsAnOpenSheet) {
  const AnatomyMesh wall = make_wall(30000);
  const TriangleMesh mesh(wall.vertices, wall.triangles);
  EXPECT_NEAR(double(mesh.triangles().size()), 30000, 600);
  EXPECT_FALSE(mesh.is_closed());
}

TEST(Anatomy, RefusesTooFewTriangles) {
  EXPECT_THROW(make_liver(8), InvalidArgument);
  EXPECT_THROW(make_wall(0), InvalidArgument);
}

}  // namespace
}  // namespace dyop
