// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_generator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/curved_meshes.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/contact_generation_oracle.h"

namespace dyop {
namespace {

using testing::MeshArrays;

// The common polygon of two rectangles about the z axis, by clipping one with the sides of the
// other.
std::vector<Vector2> clip(std::vector<Vector2> polygon, const std::vector<Vector2>& window) {
  for (std::size_t k = 0; k < window.size(); ++k) {
    const Vector2 from = window[k];
    const Vector2 along = window[(k + 1) % window.size()] - from;
    const auto height = [&](const Vector2& p) {
      return along.x() * (p.y() - from.y()) - along.y() * (p.x() - from.x());
    };
    std::vector<Vector2> inside;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector2& p = polygon[i];
      const Vector2& q = polygon[(i + 1) % polygon.size()];
      if (height(p) >= 0) inside.push_back(p);
      if ((height(p) > 0 && height(q) < 0) || (height(p) < 0 && height(q) > 0)) {
        inside.push_back(p + height(p) / (height(p) - height(q)) * (q - p));
      }
    }
    polygon = inside;
  }
  return polygon;
}

std::vector<Vector2> rectangle(Scalar x, Scalar y, Scalar turn, const Vector2& center) {
  std::vector<Vector2> corners;
  const Eigen::Rotation2Dd R(turn);
  for (const Vector2& p : {Vector2(-x, -y), Vector2(x, -y), Vector2(x, y), Vector2(-x, y)}) {
    corners.push_back(R * p + center);
  }
  return corners;
}

RigidPose turned_about_z(Scalar turn, const Vector3& place) {
  return RigidPose(Quaternion(Eigen::AngleAxisd(turn, Vector3::UnitZ())), place);
}

// Every contact is a corner of the polygon, with the normal of the faces, and every corner one.
void expect_corners(const std::vector<ContactPoint>& contacts, const std::vector<Vector2>& corners,
                    Scalar gap) {
  EXPECT_EQ(contacts.size(), corners.size());
  const auto is_near = [](const ContactPoint& contact, const Vector2& corner) {
    return (contact.p_WCa.head<2>() - corner).norm() < 1e-9;
  };
  for (const Vector2& corner : corners) {
    EXPECT_TRUE(std::any_of(contacts.begin(), contacts.end(), [&](const ContactPoint& contact) {
      return is_near(contact, corner);
    })) << corner.transpose();
  }
  for (const ContactPoint& contact : contacts) {
    EXPECT_NEAR(contact.nhat_AB_W.z(), 1, 1e-12);
    EXPECT_NEAR(contact.gap, gap, 1e-12);
    EXPECT_LE(contact.lower, contact.gap);
    EXPECT_GE(contact.upper, contact.gap);
  }
}

TEST(ContactGenerator, FaceOnFaceGivesTheCornersOfTheirCommonPolygon) {
  const Scalar gap = 1e-3;
  for (const Scalar degrees : {0.0, 0.5, 5.0, 7.0, 15.0, 30.0, 45.0, 90.0}) {
    for (const Vector2& shift : {Vector2(0, 0), Vector2(0.13, -0.21), Vector2(0.9, 0.8)}) {
      SCOPED_TRACE(::testing::Message() << degrees << " degrees, " << shift.transpose());
      const Scalar turn = degrees * std::numbers::pi / 180;
      const Box a(Vector3(1, 0.8, 0.5));
      const Box b(Vector3(0.9, 0.7, 0.4));
      const RigidPose X_WB = turned_about_z(turn, Vector3(shift.x(), shift.y(), 0.9 + gap));
      const auto corners =
          clip(rectangle(0.9, 0.7, turn, shift), rectangle(1, 0.8, 0, Vector2::Zero()));
      expect_corners(generate_contacts(a, RigidPose(), b, X_WB, 4 * gap), corners, gap);
      const TriangleMesh mesh = testing::box_mesh(Vector3(1, 0.8, 0.5)).mesh();
      expect_corners(generate_contacts(mesh, RigidPose(), b, X_WB, 4 * gap), corners, gap);
    }
  }
}

TEST(ContactGenerator, EqualBoxesOnOneAnotherTouchAtFourCorners) {
  const Box box(Vector3(0.5, 0.5, 0.5));
  const auto corners = rectangle(0.5, 0.5, 0, Vector2::Zero());
  expect_corners(generate_contacts(box, RigidPose(), box, RigidPose(Vector3(0, 0, 1.001)), 0.01),
                 corners, 0.001);
}

TEST(ContactGenerator, FaceOfManyTrianglesGivesTheSameCorners) {
  const auto sheet = testing::plate_grid(2, 2, 12, 12).mesh();
  const auto turned = testing::plate_grid(2, 2, 9, 9).mesh();
  const Scalar turn = 0.4;
  const auto corners =
      clip(rectangle(1, 1, turn, Vector2(0.1, 0)), rectangle(1, 1, 0, Vector2::Zero()));
  std::vector<ContactPoint> contacts = generate_contacts(
      sheet, RigidPose(), turned, turned_about_z(turn, Vector3(0.1, 0, 1e-3)), 4e-3);
  // Between its ends the border of a sheet has vertices, at which it touches too.
  Scalar left = kInfinity;
  for (const Vector2& corner : corners) {
    left = kInfinity;
    for (const ContactPoint& contact : contacts) {
      left = std::min(left, (contact.p_WCa.head<2>() - corner).norm());
    }
    EXPECT_LT(left, 1e-9);
  }
  for (const ContactPoint& contact : contacts) EXPECT_NEAR(contact.nhat_AB_W.z(), 1, 1e-12);
}

TEST(ContactGenerator, ACapsuleLyingOnABoxTouchesAtItsEnds) {
  const Box floor(Vector3(5, 5, 1));
  const Capsule capsule(0.2, 0.7);
  const RigidPose X_WB(rotation_between(Vector3::UnitZ(), Vector3(1, 2, 0).normalized()),
                       Vector3(0.3, 0.1, 1.2 + 1e-4));
  const auto contacts = generate_contacts(floor, RigidPose(), capsule, X_WB, 1e-3);
  ASSERT_EQ(contacts.size(), 2u);
  for (const ContactPoint& contact : contacts) {
    EXPECT_NEAR(contact.nhat_AB_W.z(), 1, 1e-12);
    EXPECT_NEAR(contact.gap, 1e-4, 1e-12);
    EXPECT_NEAR((contact.p_WCb - Vector3(0.3, 0.1, 1)).head<2>().norm(), 0.7, 1e-9);
  }
}

TEST(ContactGenerator, ABallInAGrooveTouchesBothSides) {
  MeshArrays groove;
  groove.vertices = {Vector3(-3, 0, 0), Vector3(3, 0, 0),   Vector3(-3, 2, 2),
                     Vector3(3, 2, 2),  Vector3(-3, -2, 1), Vector3(3, -2, 1)};
  groove.triangles = {{0, 1, 2}, {1, 3, 2}, {0, 4, 1}, {1, 4, 5}};
  // The middle of a ball that touches both planes is on the line that halves their angle.
  const Vector3 n_left = Vector3(0, -1, 1).normalized();
  const Vector3 n_right = Vector3(0, 1, 2).normalized();
  const Vector3 middle = 1.01 * (n_left + n_right) / (1 + n_left.dot(n_right));
  const auto contacts = generate_contacts(groove.mesh(), RigidPose(), Sphere(1),
                                          RigidPose(Vector3(0.2, 0, 0) + middle), 0.05);
  ASSERT_EQ(contacts.size(), 2u);
  for (const ContactPoint& contact : contacts) {
    EXPECT_NEAR(contact.gap, 0.01, 1e-12);
    EXPECT_GT(std::max(contact.nhat_AB_W.dot(n_left), contact.nhat_AB_W.dot(n_right)), 1 - 1e-12);
  }
}

TEST(ContactGenerator, ABallInABowlTouchesWhereItsFacesAreNearest) {
  // Inside a closed sphere of flat faces: the nearest face, and no edge, as all are hollow here.
  const TriangleMesh bowl = testing::icosphere(2).mesh();
  const Sphere ball(0.6);
  std::mt19937_64 random(5);
  for (int k = 0; k < 100; ++k) {
    const RigidPose X_WB(Vector3(0.35 * testing::random_direction(random)));
    const DistanceResult nearest = distance(bowl, RigidPose(), ball, X_WB);
    const auto contacts = generate_contacts(bowl, RigidPose(), ball, X_WB, nearest.upper + 0.02);
    ASSERT_FALSE(contacts.empty());
    Scalar least = kInfinity;
    for (const ContactPoint& contact : contacts) {
      least = std::min(least, contact.gap);
      EXPECT_EQ(contact.feature_a.kind, FeatureKind::Face);
    }
    EXPECT_NEAR(least, nearest.upper, 1e-12);
  }
}

// The tolerance at the borders of facets, relative to the ball's radius, covers several of them.
TEST(ContactGenerator, ABallOnFineFacetsGetsTheNormalOfTheNearest) {
  constexpr int kStrips = 4096;
  const TriangleMesh hollow = testing::trough(1, 0.5, 0.7, kStrips).mesh();
  const Scalar facet = 1.4 / kStrips;  // angle
  for (const Scalar angle : {-0.31, 0.0, 0.123, 0.3}) {
    for (const Scalar place : {0.1, 0.5, 0.9}) {
      const Scalar middle = (std::floor(angle / facet) + place) * facet;
      const Vector3 down(std::sin(middle), 0, -std::cos(middle));
      const RigidPose X_WB(0.749 * down);
      const auto contacts = generate_contacts(hollow, RigidPose(), Sphere(0.25), X_WB, 0.002);
      ASSERT_EQ(contacts.size(), 1u);
      EXPECT_LT(contacts[0].nhat_AB_W.cross(down).norm(), 0.501 * facet) << angle << ' ' << place;
    }
  }
}

TEST(ContactGenerator, ABallOnAnEdgeBetweenTrianglesTouchesOnce) {
  const TriangleMesh sheet = testing::plate_grid(2, 2, 4, 4).mesh();
  for (const Vector2& place : {Vector2(0, 0), Vector2(0.5, 0.1), Vector2(0.25, 0.25)}) {
    for (const Scalar off : {0.0, 1e-15, -1e-12, 1e-7, 3e-4}) {
      const RigidPose X_WB(Vector3(place.x() + off, place.y(), 0.3 + 1e-4));
      const auto contacts = generate_contacts(sheet, RigidPose(), Sphere(0.3), X_WB, 1e-3);
      ASSERT_EQ(contacts.size(), 1u) << place.transpose() << ' ' << off;
      EXPECT_NEAR(contacts[0].nhat_AB_W.z(), 1, 1e-6);
      EXPECT_NEAR(contacts[0].gap, 1e-4, 1e-9);
    }
  }
}

TEST(ContactGenerator, ASmoothCoreGivesOneContactPerPlace) {
  // A smooth convex shape without a core surface.
  class Ellipsoid final : public ConvexShape {
   public:
    SupportPoint core_support(const Vector3& direction) const override {
      const Vector3 scaled = direction.cwiseProduct(half_axes_);
      const Scalar length = scaled.norm();
      if (!(length > 0)) return {half_axes_.cwiseProduct(Vector3::UnitX()), {}};
      return {half_axes_.cwiseProduct(scaled) / length, {}};
    }
    Vector3 core_center() const override { return Vector3::Zero(); }
    AlignedBox bounding_box() const override { return {-half_axes_, half_axes_}; }
    Scalar bounding_radius() const override { return half_axes_.maxCoeff() * (1 + 1e-12); }
    MassProperties compute_mass_properties(Scalar) const override { return {}; }

   private:
    Vector3 half_axes_{0.5, 0.4, 0.3};
  };
  const Ellipsoid body;
  const TriangleMesh sheet = testing::plate_grid(2, 2, 4, 4).mesh();
  for (const Vector2& place : {Vector2(0, 0), Vector2(0.5, 0.1), Vector2(0.13, 0.22)}) {
    const RigidPose X_WB(Vector3(place.x(), place.y(), 0.301));
    for (const bool is_first : {true, false}) {
      const auto contacts = is_first ? generate_contacts(body, X_WB, sheet, RigidPose(), 0.01)
                                     : generate_contacts(sheet, RigidPose(), body, X_WB, 0.01);
      ASSERT_EQ(contacts.size(), 1u);
      EXPECT_NEAR(contacts[0].nhat_AB_W.z(), is_first ? -1 : 1, 1e-4);
      EXPECT_NEAR(contacts[0].gap, 0.001, 1e-6);
    }
  }
  const auto contacts = generate_contacts(body, RigidPose(), Box(Vector3(1, 1, 1)),
                                          RigidPose(Vector3(0, 0, 1.301)), 0.01);
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_NEAR(contacts[0].gap, 0.001, 1e-6);
}

TEST(ContactGenerator, NeedsNoMemoryOnceItsBuffersAreLargeEnough) {
  const Box box(Vector3(1, 1, 1));
  ContactWorkspace workspace;
  std::vector<ContactPoint> contacts;
  const RigidPose above(Vector3(0.1, 0.2, 2.001));
  generate_contacts(box, RigidPose(), box, above, 0.01, {}, workspace, contacts);
  const ContactPoint* first = contacts.data();
  const std::size_t count = contacts.size();
  generate_contacts(box, RigidPose(), box, above, 0.01, {}, workspace, contacts);
  EXPECT_EQ(contacts.data(), first);
  EXPECT_EQ(contacts.size(), count);
}

TEST(ContactGenerator, RefusesWhatIsOutOfRange) {
  const Sphere ball(1);
  const auto generate = [&](Scalar reach, ContactGeneratorOptions options) {
    return generate_contacts(ball, RigidPose(), ball, RigidPose(Vector3(3, 0, 0)), reach, options);
  };
  EXPECT_THROW(generate(-1, {}), InvalidArgument);
  EXPECT_THROW(generate(kInfinity, {}), InvalidArgument);
  EXPECT_THROW(generate(1, {.cone_tolerance = -0.1}), InvalidArgument);
  EXPECT_THROW(generate(1, {.cone_tolerance = 0.6}), InvalidArgument);
  EXPECT_THROW(generate(1, {.border_tolerance = std::nan("")}), InvalidArgument);
}

TEST(ContactGenerator, FindsContactsOfEveryPieceOfACompound) {
  // A table of two substeps on a floor: four corners each, named by their substep.
  const auto substep = std::make_shared<const Box>(Vector3(0.1, 0.1, 0.5));
  const CompoundShape table(
      {{substep, RigidPose(Vector3(-1, 0, 0))}, {substep, RigidPose(Vector3(1, 0, 0))}});
  const Box floor({5, 5, 0.5});
  const std::vector<ContactPoint> contacts = generate_contacts(
      floor, RigidPose(Vector3(0, 0, -0.5)), table, RigidPose(Vector3(0, 0, 0.501)), 0.01);
  ASSERT_EQ(contacts.size(), 8u);
  int of_second = 0;
  for (const ContactPoint& contact : contacts) {
    EXPECT_NEAR(contact.gap, 0.001, 1e-12);
    EXPECT_EQ(contact.p_WCb.x() > 0, contact.key.b.piece == 1);
    of_second += contact.key.b.piece;
  }
  EXPECT_EQ(of_second, 4);
}

}  // namespace
}  // namespace dyop
