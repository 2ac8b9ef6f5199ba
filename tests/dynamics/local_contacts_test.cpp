#include "dynamics/local_contacts.h"

#include <gtest/gtest.h>

#include "dyop/geometry/triangle_mesh.h"

namespace dyop {
namespace {

const RigidPose kOrigin;

TriangleMesh point_at(Scalar x, Scalar y, Scalar z) {
  return TriangleMesh({Vector3(x, y, z)}, {{0, 0, 0}});
}

std::size_t count_found(const TriangleMesh& a, const TriangleMesh& b, Scalar reach) {
  return find_contacts(a, kOrigin, b, kOrigin, reach).size();
}

std::vector<Contact> local(const TriangleMesh& a, const TriangleMesh& b, Scalar reach) {
  return internal::local_contacts(find_contacts(a, kOrigin, b, kOrigin, reach), a, kOrigin, b,
                                  kOrigin, reach);
}

// Two triangles in the plane z = 0 with the edge y = 0 in common; the point is 0.2 above the first,
// 0.3 beside the edge: 0.36 from the second, along a normal that leans.
TEST(LocalContacts, AreNotOnTheFaceInFront) {
  const TriangleMesh floor({{-9, 0, 0}, {9, 0, 0}, {0, 9, 0}, {0, -9, 0}}, {{0, 1, 2}, {1, 0, 3}});
  const TriangleMesh above = point_at(0, 0.3, 0.2);
  ASSERT_EQ(count_found(floor, above, 0.5), 2u);
  for (const auto& contacts : {local(floor, above, 0.5), local(above, floor, 0.5)}) {
    ASSERT_EQ(contacts.size(), 1u);
    EXPECT_NEAR(std::abs(contacts[0].nhat_AB_W.z()), 1, 1e-12);
  }
}

// The same triangles folded up along that edge: both faces carry.
TEST(LocalContacts, AreOnBothWallsOfACorner) {
  const TriangleMesh corner({{-9, 0, 0}, {9, 0, 0}, {0, 9, 0}, {0, 0, 9}}, {{0, 1, 2}, {1, 0, 3}});
  const TriangleMesh inside = point_at(0, 0.3, 0.2);
  EXPECT_EQ(local(corner, inside, 0.5).size(), 2u);
}

// Folded down the edge is a ridge: beside it, the face below counts, and above it the edge itself.
TEST(LocalContacts, OfARidgeAreOne) {
  const TriangleMesh ridge({{-9, 0, 0}, {9, 0, 0}, {0, 9, 0}, {0, -1, -9}}, {{0, 1, 2}, {1, 0, 3}});
  EXPECT_EQ(local(ridge, point_at(0, 0.3, 0.2), 0.5).size(), 1u);
  EXPECT_EQ(local(ridge, point_at(0, -0.01, 0.2), 0.5).size(), 1u);
}

// Faces of separate parts do not know of each other.
TEST(LocalContacts, KeepWhatSharesNoVertex) {
  const TriangleMesh steps(
      {{-9, 0, 0}, {9, 0, 0}, {0, 9, 0}, {-9, -0.1, 0}, {9, -0.1, 0}, {0, -9, 0}},
      {{0, 1, 2}, {4, 3, 5}});
  EXPECT_EQ(local(steps, point_at(0, 0.3, 0.2), 0.5).size(), 2u);
}

}  // namespace
}  // namespace dyop
