// SPDX-License-Identifier: BSD-3-Clause

// Contacts on the flat parts of cylinders and cones, against the shapes' equations and distance().
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "dyop/contact/contact_generator.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using namespace testing;

// How far a point is outside a shape; negative inside. Of a mesh: how far it is from the surface.
Scalar outside(const Shape& shape, const Vector3& p) {
  const Scalar axial = std::abs(p.z());
  const Scalar radial = p.head<2>().norm();
  if (const auto* cylinder = dynamic_cast<const Cylinder*>(&shape)) {
    return std::max(radial - cylinder->radius(), axial - cylinder->half_length());
  }
  if (const auto* cone = dynamic_cast<const Cone*>(&shape)) {
    const Scalar h = cone->half_length();
    const Scalar at = cone->radius() * (h - p.z()) / (2 * h);
    return std::max(radial - at, -h - p.z());
  }
  return distance(shape, RigidPose(), Sphere(1e-9 * shape.bounding_radius()), RigidPose(p)).lower;
}

// Two shapes, B above A, and the turn that makes flat parts face each other.
struct Facing {
  std::shared_ptr<const Shape> a;
  std::shared_ptr<const Shape> b;
  Matrix3 R_B = Matrix3::Identity();
};

std::vector<Facing> facing_shapes(Scalar size) {
  const auto cylinder = std::make_shared<Cylinder>(0.5 * size, 0.7 * size);
  const auto disc = std::make_shared<Cylinder>(0.9 * size, 0.1 * size);
  const auto cone = std::make_shared<Cone>(0.6 * size, 0.4 * size);
  const auto box = std::make_shared<Box>(size * Vector3(0.6, 0.5, 0.3));
  const auto rounded = std::make_shared<RoundedBox>(size * Vector3(0.5, 0.4, 0.2), 0.1 * size);
  const auto capsule = std::make_shared<Capsule>(0.2 * size, 0.6 * size);
  const auto round = std::make_shared<RoundedCylinder>(0.5 * size, 0.4 * size, 0.1 * size);
  const MeshArrays grid = plate_grid(2 * size, 2 * size, 5, 7);
  const auto mesh = std::make_shared<TriangleMesh>(grid.vertices, grid.triangles);
  const MeshArrays gear_mesh = gear(7, 0.6, 0.8, 0.3);
  const auto hull = std::make_shared<ConvexHull>(
      gear_mesh.moved(Matrix3::Identity(), Vector3::Zero(), size).vertices);
  const Matrix3 lying = rotation_from_vector(Vector3(0, std::numbers::pi / 2, 0));
  return {{cylinder, cylinder},    {disc, cylinder},       {box, cylinder},
          {cylinder, box},         {hull, cone},           {cylinder, cone},
          {disc, rounded},         {mesh, cylinder},       {mesh, cone},
          {cylinder, mesh},        {box, cylinder, lying}, {disc, cylinder, lying},
          {mesh, cylinder, lying}, {disc, capsule, lying}, {box, round},
          {disc, round},           {mesh, round},          {box, round, lying},
          {cylinder, round, lying}};
}

class FlatContacts : public ::testing::TestWithParam<Scalar> {
 protected:
  // Lets B down on A from above, to a gap of `gap`.
  static RigidPose above(const Facing& pair, const Vector3& shift, const Matrix3& tilt,
                         Scalar gap) {
    RigidPose X(tilt * pair.R_B, shift + Vector3(0, 0, 10 * pair.a->bounding_radius()));
    for (int k = 0; k < 60; ++k) {
      const DistanceResult result = distance(*pair.a, RigidPose(), *pair.b, X);
      const Scalar down = result.lower - gap;
      X = RigidPose(X.rotation(), X.translation() - Vector3(0, 0, down));
      if (std::abs(down) < 1e-13 * pair.a->bounding_radius()) break;
    }
    return X;
  }
};

TEST_P(FlatContacts, LieOnTheSurfacesAndBoundTheDistance) {
  std::mt19937 random(7);
  std::uniform_real_distribution<Scalar> unit(-1, 1);
  const Scalar size = GetParam();
  for (const Facing& pair : facing_shapes(size)) {
    for (int k = 0; k < 60; ++k) {
      const Vector3 shift(0.8 * size * unit(random), 0.8 * size * unit(random), 0);
      const Scalar tilt = k % 3 == 0 ? 0 : (k % 3 == 1 ? 1e-5 : 0.03);
      const Matrix3 turn =
          rotation_from_vector(Vector3(tilt * unit(random), tilt * unit(random), 0)) *
          rotation_from_vector(Vector3(0, 0, k == 0 ? 0 : 3 * unit(random)));
      const RigidPose X_B = above(pair, shift, turn, 1e-3 * size);
      const DistanceResult nearest = distance(*pair.a, RigidPose(), *pair.b, X_B);
      if (!(nearest.lower > 0) || nearest.upper > 2e-3 * size) continue;
      const Scalar reach = 2e-3 * size;
      const auto contacts = generate_contacts(*pair.a, RigidPose(), *pair.b, X_B, reach);
      ASSERT_FALSE(contacts.empty());
      const Scalar noise = 1e-11 * size;
      Scalar least = kInfinity;
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        const ContactPoint& c = contacts[i];
        if (i > 0) {
          EXPECT_LT(contacts[i - 1].key, c.key);
        }
        EXPECT_LE(outside(*pair.a, c.p_ACa), noise);
        EXPECT_LE(outside(*pair.b, c.p_BCb), noise);
        EXPECT_NEAR(c.nhat_AB_W.norm(), 1, 1e-12);
        EXPECT_LE(c.lower, (c.p_WCb - c.p_WCa).norm() + noise);
        EXPECT_GE(c.upper, nearest.lower);
        EXPECT_GE(c.gap, -noise);
        EXPECT_NEAR(c.gap, c.nhat_AB_W.dot(c.p_WCb - c.p_WCa), noise);
        least = std::min(least, c.gap);
      }
      // The nearest place is among them, up to what the normals' tolerance makes of it.
      EXPECT_LE(least, nearest.upper + 2e-3 * reach);
    }
  }
}

// Along x all are at least as wide as the narrowest of the shapes.
void expect_surrounding(const std::vector<ContactPoint>& contacts, Scalar size) {
  ASSERT_GE(contacts.size(), 2U);
  Vector3 low = Vector3::Constant(kInfinity);
  Vector3 high = -low;
  for (const ContactPoint& c : contacts) {
    EXPECT_NEAR(std::abs(c.nhat_AB_W.z()), 1, 1e-9);
    low = low.cwiseMin(c.p_WCa);
    high = high.cwiseMax(c.p_WCa);
  }
  EXPECT_LT(low.x(), -0.39 * size);
  EXPECT_GT(high.x(), 0.39 * size);
}

// The reaction of a body that stands at rest can be anywhere between its contacts.
TEST_P(FlatContacts, SurroundTheMiddleOfWhatTheyShare) {
  const Scalar size = GetParam();
  for (const Facing& pair : facing_shapes(size)) {
    const RigidPose X_B = above(pair, Vector3::Zero(), Matrix3::Identity(), 1e-3 * size);
    expect_surrounding(generate_contacts(*pair.a, RigidPose(), *pair.b, X_B, 2e-3 * size), size);
  }
}

// A compound of one child has the contacts of the child.
TEST_P(FlatContacts, AreTheSameOfACompound) {
  const Scalar size = GetParam();
  const RigidPose X_CS(size * Vector3(0.4, 0.7, -0.2));
  const Vector3 aside = size * Vector3(0.11, 0.037, 0);  // no place is nearest by rounding alone
  for (const Facing& pair : facing_shapes(size)) {
    const RigidPose X_B = above(pair, aside, Matrix3::Identity(), 1e-3 * size);
    const Scalar reach = 2e-3 * size;
    const auto expected = generate_contacts(*pair.a, RigidPose(), *pair.b, X_B, reach);
    const auto of_a =
        generate_contacts(CompoundShape({{pair.a, X_CS}}), X_CS.inverse(), *pair.b, X_B, reach);
    const auto of_b = generate_contacts(*pair.a, RigidPose(), CompoundShape({{pair.b, X_CS}}),
                                        X_B * X_CS.inverse(), reach);
    for (const auto& found : {of_a, of_b}) {
      EXPECT_EQ(found.size(), expected.size());
      for (const ContactPoint& contact : found) {
        EXPECT_TRUE(std::any_of(expected.begin(), expected.end(), [&](const ContactPoint& other) {
          return (contact.p_WCa - other.p_WCa).norm() < 1e-9 * size &&
                 (contact.p_WCb - other.p_WCb).norm() < 1e-9 * size;
        }));
      }
    }
  }
}

// Where a rim begins depends on the frame, so that its contacts may be others.
TEST_P(FlatContacts, OfATurnedChildSurroundTheMiddleToo) {
  const Scalar size = GetParam();
  const RigidPose X_CS(rotation_from_vector(Vector3(0.3, -1, 2)), size * Vector3(0.4, 0.7, -0.2));
  for (const Facing& pair : facing_shapes(size)) {
    const RigidPose X_B = above(pair, Vector3::Zero(), Matrix3::Identity(), 1e-3 * size);
    const CompoundShape b({{pair.b, X_CS}});
    expect_surrounding(
        generate_contacts(*pair.a, RigidPose(), b, X_B * X_CS.inverse(), 2e-3 * size), size);
  }
}

TEST(FlatContactsOfDiscs, AreTheTipsOfTheirLensAndItsMiddles) {
  const Cylinder a(1, 1);
  const auto contacts =
      generate_contacts(a, RigidPose(), a, RigidPose(Vector3(1.6, 0, 2.001)), 0.01);
  // The tips at x = 0.8, y = +-0.6; the rims cross the line of the middles at 0.6 and 1.
  const auto has = [&](Scalar x, Scalar y) {
    for (const ContactPoint& c : contacts) {
      if ((c.p_WCa - Vector3(x, y, 1)).norm() < 1e-12) return true;
    }
    return false;
  };
  EXPECT_TRUE(has(0.8, 0.6));
  EXPECT_TRUE(has(0.8, -0.6));
  EXPECT_TRUE(has(0.6, 0));
  EXPECT_TRUE(has(1, 0));
}

TEST(FlatContactsOfCylinders, AreTheEndsOfTheLineThatTheyShare) {
  const Cylinder a(1, 2);
  const auto contacts =
      generate_contacts(a, RigidPose(), a, RigidPose(Vector3(1.2, 1.6001, 3)), 0.01);
  ASSERT_EQ(contacts.size(), 2U);
  for (const ContactPoint& c : contacts) {
    EXPECT_TRUE(c.nhat_AB_W.isApprox(Vector3(0.6, 0.8, 0), 1e-4));
    EXPECT_TRUE(std::abs(c.p_WCa.z() - 1) < 1e-9 || std::abs(c.p_WCa.z() - 2) < 1e-9);
  }
}

// --- on a half-space ----------------------------------------------------------------------------

// Of a shape 0.01 above the floor z = 0, in both orders.
void expect_contacts_on_floor(const Shape& shape, const RigidPose& X_WB, std::size_t count) {
  const HalfSpace floor;
  const RigidPose X_WA;
  for (const bool is_first : {true, false}) {
    const std::vector<ContactPoint> found = is_first
                                                ? generate_contacts(floor, X_WA, shape, X_WB, 0.05)
                                                : generate_contacts(shape, X_WB, floor, X_WA, 0.05);
    EXPECT_EQ(found.size(), count);
    for (const ContactPoint& contact : found) {
      EXPECT_NEAR(contact.gap, 0.01, 1e-12);
      EXPECT_EQ(contact.normal_is_of_b, !is_first);
      EXPECT_NEAR(contact.nhat_AB_W.z(), is_first ? 1 : -1, 1e-14);
      EXPECT_NEAR(is_first ? contact.p_WCa.z() : contact.p_WCb.z(), 0, 1e-12);
    }
  }
}

TEST(HalfSpaceContacts, AreTheCornersOfWhatLiesOnIt) {
  const RigidPose upright(Vector3(100, -70, 0.51));
  const RigidPose lying(rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0)),
                        upright.translation());
  expect_contacts_on_floor(Box(Vector3(0.5, 0.4, 0.5)), upright, 4);
  expect_contacts_on_floor(RoundedBox(Vector3(0.4, 0.3, 0.4), 0.1), upright, 4);
  expect_contacts_on_floor(box_mesh(Vector3(0.5, 0.4, 0.5)).mesh(), upright, 4);
  expect_contacts_on_floor(Sphere(0.5), upright, 1);
  expect_contacts_on_floor(Capsule(0.5, 1), lying, 2);
  expect_contacts_on_floor(Cylinder(0.5, 1), lying, 2);
  expect_contacts_on_floor(Cylinder(1, 0.5), upright, 6);
}

TEST(HalfSpaceContacts, OfAMeshOnATiltedPlaneAreItsLowVertices) {
  const TriangleMesh mesh = gear(9, 0.8, 1, 0.3).mesh();
  std::mt19937_64 random(6);
  for (int k = 0; k < 30; ++k) {
    const HalfSpace plane(random_direction(random), random_number(-1, 1, random));
    const Matrix3 R = random_rotation(random).toRotationMatrix();
    const Vector3 p = random_vector(50, random);
    Scalar least = kInfinity;
    for (const Vector3& v : mesh.vertices()) least = std::min(least, plane.height(R * v + p));
    const RigidPose X_WB(R, p + (0.01 - least) * plane.normal());
    const std::vector<ContactPoint> found = generate_contacts(plane, RigidPose(), mesh, X_WB, 0.02);
    ASSERT_FALSE(found.empty());
    Scalar nearest = kInfinity;
    for (const ContactPoint& contact : found) {
      nearest = std::min(nearest, contact.gap);
      EXPECT_NEAR(plane.height(contact.p_WCb), contact.gap, 1e-12);
    }
    EXPECT_NEAR(nearest, 0.01, 1e-12);
    const std::vector<Contact> near = find_contacts(plane, RigidPose(), mesh, X_WB, 0.02);
    ASSERT_FALSE(near.empty());
    EXPECT_NEAR(near.front().upper, 0.01, 1e-11);
  }
}

INSTANTIATE_TEST_SUITE_P(Scales, FlatContacts, ::testing::Values(1e-4, 1.0, 1e4));

}  // namespace
}  // namespace dyop
