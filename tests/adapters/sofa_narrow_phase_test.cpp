// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/adapters/sofa_narrow_phase.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop {
namespace {

using adapters::SofaNarrowPhase;
using Triangles = SofaNarrowPhase::Triangles;

struct Proximity : sofa::core::collision::Intersection {
  double alarm = 0.3;
  double contact = 0.1;
  double getAlarmDistance() const override { return alarm; }
  double getContactDistance() const override { return contact; }
};

/// A cube of edge 1 with a corner at a point.
Triangles cube(const std::string& name, const Vector3& corner) {
  Triangles::VecCoord x;
  for (unsigned k = 0; k < 8; ++k)
    x.push_back({corner.x() + (k & 1U), corner.y() + (k >> 1 & 1U), corner.z() + (k >> 2 & 1U)});
  return Triangles(name, x,
                   {{0, 2, 1},
                    {1, 2, 3},
                    {4, 5, 6},
                    {5, 7, 6},
                    {0, 1, 4},
                    {1, 5, 4},
                    {2, 6, 3},
                    {3, 6, 7},
                    {0, 4, 2},
                    {2, 4, 6},
                    {1, 3, 5},
                    {3, 7, 5}});
}

TriangleMesh mesh_of(const Triangles& model) {
  std::vector<Vector3> vertices;
  for (const auto& x : model.getX()) vertices.emplace_back(x[0], x[1], x[2]);
  std::vector<TriangleIndices> triangles;
  for (const auto& t : model.getTriangles()) triangles.push_back({int(t[0]), int(t[1]), int(t[2])});
  return TriangleMesh(vertices, triangles);
}

using Outputs = sofa::core::collision::TDetectionOutputVector<Triangles, Triangles>;

const Outputs& contacts(SofaNarrowPhase& phase, Triangles& a, Triangles& b) {
  phase.beginNarrowPhase();
  phase.addCollisionPair({&a, &b});
  static const Outputs kNone;
  const auto* found = dynamic_cast<const Outputs*>(phase.getDetectionOutputs(&a, &b));
  return found != nullptr ? *found : kNone;
}

TEST(SofaNarrowPhase, GivesAllContactsWithinTheAlarmDistance) {
  SofaNarrowPhase phase;
  Proximity proximity;
  phase.setIntersectionMethod(&proximity);
  Triangles low = cube("low", Vector3(0, 0, 0));
  Triangles high = cube("high", Vector3(0.3, 0.2, 1.25));
  const Outputs& found = contacts(phase, low, high);
  ASSERT_GE(found.size(), 4U);  // the corners of the patch
  const double least = distance(mesh_of(low), RigidPose(), mesh_of(high), RigidPose()).lower;
  for (const auto& contact : found) {
    EXPECT_NEAR(contact.value, least - 0.1, 1e-12);
    EXPECT_NEAR(contact.normal[2], 1, 1e-12);
    EXPECT_NEAR(contact.point[0][2], 1, 1e-12);
    EXPECT_NEAR(contact.point[1][2], 1.25, 1e-12);
    EXPECT_EQ(contact.elem.first.getCollisionModel(), &low);
    EXPECT_EQ(contact.elem.second.getCollisionModel(), &high);
    EXPECT_LT(contact.elem.first.getIndex(), 12U);
  }
  EXPECT_EQ(phase.unproven_pairs(), 0U);
  proximity.alarm = 0.24;
  EXPECT_EQ(contacts(phase, low, high).size(), 0U);
  low.stub_set_contact_distance(0.02);  // counts towards both distances
  ASSERT_GE(contacts(phase, low, high).size(), 4U);
  EXPECT_NEAR(contacts(phase, low, high).front().value, 0.25 - 0.12, 1e-12);
}

TEST(SofaNarrowPhase, FollowsModelsThatMoveAndNamesContactsApart) {
  SofaNarrowPhase phase;
  Proximity proximity;
  phase.setIntersectionMethod(&proximity);
  Triangles low = cube("low", Vector3(0, 0, 0));
  Triangles high = cube("high", Vector3(0.3, 0.2, 2));
  EXPECT_EQ(contacts(phase, low, high).size(), 0U);
  for (auto& x : high.stub_x()) x[2] -= 0.9;
  const Outputs& found = contacts(phase, low, high);
  ASSERT_FALSE(found.size() == 0);
  EXPECT_NEAR(found.front().value, 0, 1e-12);
  for (const auto& contact : found) {
    EXPECT_EQ(contact.id, 12 * std::int64_t(contact.elem.first.getIndex()) +
                              std::int64_t(contact.elem.second.getIndex()));
  }
  for (auto& x : high.stub_x()) x[2] -= 0.2;  // the surfaces cross
  const Outputs& crossing = contacts(phase, low, high);
  ASSERT_FALSE(crossing.size() == 0);
  double least = 1;
  for (const auto& contact : crossing) least = std::min(least, contact.value);
  EXPECT_EQ(least, -0.1);
}

TEST(SofaNarrowPhase, LeavesTheRestToSofa) {
  SofaNarrowPhase phase;
  Proximity proximity;
  phase.setIntersectionMethod(&proximity);
  Triangles a = cube("a", Vector3(0, 0, 0));
  Triangles b = cube("b", Vector3(0, 0, 1.1));
  sofa::core::CollisionModel empty("empty");
  phase.addCollisionPair({&a, &empty});
  EXPECT_EQ(phase.stub_own_tests, 0);
  phase.addCollisionPair({&a, &a});
  EXPECT_EQ(phase.stub_own_tests, 1);
  EXPECT_EQ(phase.unproven_pairs(), 1U);
  auto& errors = sofa::helper::logging::stub::errors();
  errors.clear();
  b.stub_x()[3][1] = std::numeric_limits<double>::quiet_NaN();
  phase.addCollisionPair({&a, &b});
  EXPECT_EQ(phase.stub_own_tests, 2);
  EXPECT_EQ(phase.unproven_pairs(), 2U);
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_NE(errors.front().find("\"b\""), std::string::npos);
  EXPECT_NE(errors.front().find("nan"), std::string::npos);
  phase.beginNarrowPhase();
  EXPECT_EQ(phase.unproven_pairs(), 0U);
  a.setSimulated(false);
  b.setSimulated(false);
  phase.addCollisionPair({&a, &b});
  EXPECT_EQ(phase.unproven_pairs(), 0U);
}

}  // namespace
}  // namespace dyop
