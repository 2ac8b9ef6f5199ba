// SPDX-License-Identifier: BSD-3-Clause

// ToiOptions::with_contacts: all contacts at the impact.

#include <gtest/gtest.h>

#include <numbers>
#include <optional>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/bodies.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/nearest_points.h"

namespace dyop {
namespace {

using testing::at;
using testing::box_mesh;
using testing::gear;
using testing::MeshArrays;
using testing::plate_grid;
using testing::Point;
using testing::PointTriangle;

constexpr Scalar kPi = std::numbers::pi;

RigidPose turned(const Vector3& axis, Scalar angle, const Vector3& p) {
  return RigidPose(Quaternion(Eigen::AngleAxisd(angle, axis.normalized())), p);
}

// b falls along -z at unit speed onto a, which rests with its top face in the plane z = 0.
ToiResult drop(const Shape& a, const Shape& b, const RigidPose& X_WB,
               ToiOptions options = {.distance_tolerance = 1e-6}) {
  options.with_contacts = true;
  const RestMotion floor(at(0, 0, 0));
  const ConstantTwistMotion falling(X_WB, {Vector3(0, 0, -1), Vector3::Zero()});
  ToiResult result = time_of_impact(a, floor, b, falling, {0, 2 * X_WB.translation().z()}, options);
  EXPECT_EQ(result.status, ToiStatus::Impact);
  return result;
}

// What holds for every contact of every impact.
void check_contacts(const ToiResult& result, const ToiOptions& options) {
  ASSERT_FALSE(result.contacts.empty());
  const Scalar noise = 4 * result.rounding_allowance;
  const Scalar reach = result.contact->upper + options.distance_tolerance.value();
  // The first contact of the search is the nearest place, or as near.
  EXPECT_LE(result.contacts.front().lower, result.contact->upper + noise);
  Scalar last = 0;
  for (const Contact& contact : result.contacts) {
    const Vector3 step = contact.p_WCb - contact.p_WCa;
    EXPECT_GE(contact.lower, last);  // sorted
    last = contact.lower;
    EXPECT_LE(contact.lower, reach + noise);
    EXPECT_NEAR(step.norm(), contact.upper, noise);
    EXPECT_NEAR(contact.nhat_AB_W.norm(), 1, 1e-12);
    EXPECT_LE((step - step.norm() * contact.nhat_AB_W).norm(), noise);
  }
}

// How many contacts lie on B within `allowance` of a point, seen along z.
int contacts_at(const ToiResult& result, const Vector3& p_W, Scalar allowance) {
  int count = 0;
  for (const Contact& contact : result.contacts) {
    count += (contact.p_WCb - p_W).head<2>().norm() <= allowance;
  }
  return count;
}

TEST(ImpactContacts, AreGatheredOnlyIfAskedForAndChangeNothingElse) {
  const Box floor({5, 5, 0.5});
  const Box cube({1, 1, 1});
  const RestMotion rest(at(0, 0, -0.5));
  const ConstantTwistMotion falling(at(0.3, 0.2, 5), {Vector3(0, 0, -1), Vector3::Zero()});
  ToiOptions options{.distance_tolerance = 1e-6};
  const ToiResult plain = time_of_impact(floor, rest, cube, falling, {0, 10}, options);
  EXPECT_TRUE(plain.contacts.empty());
  options.with_contacts = true;
  const ToiResult full = time_of_impact(floor, rest, cube, falling, {0, 10}, options);
  EXPECT_FALSE(full.contacts.empty());
  EXPECT_EQ(full.t_safe, plain.t_safe);
  EXPECT_EQ(full.t_hit, plain.t_hit);
  EXPECT_EQ(full.contact->p_WCa, plain.contact->p_WCa);
  // No impact, or one from the start: nothing to gather.
  EXPECT_TRUE(time_of_impact(floor, rest, cube, falling, {0, 3}, options).contacts.empty());
  EXPECT_TRUE(time_of_impact(floor, rest, cube, falling, {6, 7}, options).contacts.empty());
}

// A cube of half extent s that lands on its face touches with the four corners (±s, ±s) of that
// face, each once; other contacts are crossings of edges of the two triangulations, within it.
TEST(ImpactContacts, OfACubeOnItsFaceAreItsCorners) {
  for (const Scalar s : {1e-4, 1.0, 1e4}) {
    for (const Scalar away : {0.0, 1e3}) {
      const Vector3 middle = s * Vector3(away + 0.3, 0.2 - away, 0);
      const TriangleMesh floor_mesh = box_mesh(s * Vector3(5, 5, 1))
                                          .moved(Matrix3::Identity(), middle - s * Vector3::UnitZ())
                                          .mesh();
      const Box box(s * Vector3(1, 1, 1));
      const TriangleMesh cube_mesh = box_mesh(s * Vector3(1, 1, 1)).mesh();
      ToiOptions options{.distance_tolerance = 1e-6};
      options.distance_tolerance = 1e-6 * s;
      for (const Shape* cube :
           {static_cast<const Shape*>(&box), static_cast<const Shape*>(&cube_mesh)}) {
        options.distance_tolerance = 1e-6 * s;
        const ToiResult result =
            drop(floor_mesh, *cube, RigidPose(middle + Vector3(0, 0, 1.5 * s)), options);
        check_contacts(result, options);
        for (const Scalar x : {-s, s}) {
          for (const Scalar y : {-s, s}) {
            EXPECT_EQ(contacts_at(result, middle + Vector3(x, y, 0), 1e-9 * s * (1 + away)), 1);
          }
        }
        for (const Contact& contact : result.contacts) {
          EXPECT_LT((contact.nhat_AB_W - Vector3(0, 0, 1)).norm(), 1e-4);
          const Vector3 p = contact.p_WCb - middle;
          EXPECT_LE(p.head<2>().cwiseAbs().maxCoeff(), s * (1 + 1e-9 * (1 + away)));
        }
      }
    }
  }
}

// Tilted by an angle φ about y, the corners at x = 1 are 2 sin φ lower than those at x = -1: they
// all touch if that is less than the tolerance, and only two do if it is more than twice that.
TEST(ImpactContacts, AreThoseWithinTheToleranceOfTheFirst) {
  const TriangleMesh floor = plate_grid(10, 10, 1, 1).mesh();
  const Box cube({1, 1, 1});
  ToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 1e-5;
  for (const auto& [rise, corners] : {std::pair(0.9e-5, 4), std::pair(2.1e-5, 2)}) {
    const ToiResult result =
        drop(floor, cube, turned(Vector3::UnitY(), std::asin(rise / 2), {0.3, 0.1, 2}), options);
    check_contacts(result, options);
    int found = 0;
    for (const Scalar x : {-1, 1}) {
      for (const Scalar y : {-1, 1}) {
        found += contacts_at(result, Vector3(0.3 + x, 0.1 + y, 0), 1e-4);
      }
    }
    EXPECT_EQ(found, corners);
  }
}

TEST(ImpactContacts, OfACubeOnItsEdgeAreTheEndsAndOnItsCornerThatOne) {
  const TriangleMesh floor = plate_grid(10, 10, 3, 3).mesh();
  const TriangleMesh cube = box_mesh({1, 1, 1}).mesh();
  const ToiResult on_edge = drop(floor, cube, turned(Vector3::UnitX(), kPi / 4, {0.3, 0.1, 3}));
  check_contacts(on_edge, {.distance_tolerance = 1e-6});
  EXPECT_EQ(contacts_at(on_edge, Vector3(-0.7, 0.1, 0), 1e-9), 1);
  EXPECT_EQ(contacts_at(on_edge, Vector3(1.3, 0.1, 0), 1e-9), 1);
  for (const Contact& contact : on_edge.contacts) EXPECT_NEAR(contact.p_WCb.y(), 0.1, 1e-9);
  // The diagonal (1, 1, 1) turned to -z.
  const RigidPose on_its_corner(rotation_between(Vector3(1, 1, 1), Vector3(0, 0, -1)),
                                Vector3(0.3, 0.1, 3));
  const ToiResult on_corner = drop(floor, cube, on_its_corner);
  check_contacts(on_corner, {.distance_tolerance = 1e-6});
  ASSERT_EQ(on_corner.contacts.size(), 1u);
  EXPECT_EQ(contacts_at(on_corner, Vector3(0.3, 0.1, 0), 1e-9), 1);
  EXPECT_EQ(on_corner.contacts[0].feature_b.kind, FeatureKind::Vertex);
}

// A prism with a regular polygon as its section, along x.
MeshArrays cylinder(int sides, Scalar radius, Scalar half_length) {
  MeshArrays mesh;
  for (const Scalar x : {-half_length, half_length}) {
    for (int k = 0; k < sides; ++k) {
      const Scalar angle = 2 * kPi * k / sides;
      mesh.vertices.emplace_back(x, radius * std::sin(angle), -radius * std::cos(angle));
    }
    mesh.vertices.emplace_back(x, 0, 0);
  }
  const std::int32_t other = sides + 1;
  for (int k = 0; k < sides; ++k) {
    const int next = (k + 1) % sides;
    mesh.triangles.push_back({k, next, other + next});
    mesh.triangles.push_back({k, other + next, other + k});
    mesh.triangles.push_back({sides, k, next});
    mesh.triangles.push_back({other + sides, other + k, other + next});
  }
  return mesh;
}

TEST(ImpactContacts, OfACylinderOnItsSideAreTheEndsOfALineOrTheCornersOfAFacet) {
  const TriangleMesh floor = box_mesh({8, 8, 1}).moved(Matrix3::Identity(), {0, 0, -1}).mesh();
  const int sides = 48;
  const TriangleMesh lying = cylinder(sides, 0.5, 2).mesh();
  // As made, one of its lines is lowest.
  const ToiResult on_line = drop(floor, lying, at(0.3, 0.1, 2));
  check_contacts(on_line, {.distance_tolerance = 1e-6});
  EXPECT_EQ(contacts_at(on_line, Vector3(-1.7, 0.1, 0), 1e-9), 1);
  EXPECT_EQ(contacts_at(on_line, Vector3(2.3, 0.1, 0), 1e-9), 1);
  for (const Contact& contact : on_line.contacts) EXPECT_NEAR(contact.p_WCb.y(), 0.1, 1e-9);
  // Turned by half a side, a facet of the width 2 r sin(π / sides) is.
  const ToiResult on_facet =
      drop(floor, lying, turned(Vector3::UnitX(), kPi / sides, {0.3, 0.1, 2}));
  check_contacts(on_facet, {.distance_tolerance = 1e-6});
  const Scalar half_width = 0.5 * std::sin(kPi / sides);
  for (const Scalar x : {-1.7, 2.3}) {
    for (const Scalar y : {0.1 - half_width, 0.1 + half_width}) {
      EXPECT_EQ(contacts_at(on_facet, Vector3(x, y, 0), 1e-9), 1);
    }
  }
  // Standing on its end it touches with all corners of that.
  const ToiResult on_end = drop(floor, lying, turned(Vector3::UnitY(), kPi / 2, {0.3, 0.1, 4}));
  check_contacts(on_end, {.distance_tolerance = 1e-6});
  for (int k = 0; k < sides; ++k) {
    const Scalar angle = 2 * kPi * k / sides;
    const Vector3 corner(0.3 - 0.5 * std::cos(angle), 0.1 + 0.5 * std::sin(angle), 0);
    EXPECT_EQ(contacts_at(on_end, corner, 1e-9), 1) << k;
  }
}

// The places do not merge because the target is large: a cube smaller than it has its corners.
TEST(ImpactContacts, AreDistinctPlacesForALargeTargetToo) {
  const TriangleMesh floor = plate_grid(10, 10, 1, 1).mesh();
  const Box cube({0.5, 0.5, 0.5});
  ToiOptions options{.distance_tolerance = 1e-6};
  options.target_distance = 3;
  const ToiResult result = drop(floor, cube, at(0.3, 0.1, 8), options);
  check_contacts(result, options);
  for (const Scalar x : {-0.5, 0.5}) {
    for (const Scalar y : {-0.5, 0.5}) {
      EXPECT_EQ(contacts_at(result, Vector3(0.3 + x, 0.1 + y, 0), 1e-9), 1);
    }
  }
}

TEST(ImpactContacts, OfRoundShapesAreOnTheirSurfaces) {
  const Box floor({5, 5, 1});
  const ToiResult ball = drop(floor, Sphere(0.5), at(0.3, 0.1, 4));
  check_contacts(ball, {.distance_tolerance = 1e-6});
  EXPECT_EQ(ball.contacts.size(), 1u);
  // A lying capsule: both ends of its line.
  const ToiResult capsule =
      drop(floor, Capsule(0.3, 1), turned(Vector3::UnitY(), kPi / 2, {0.3, 0.1, 4}));
  check_contacts(capsule, {.distance_tolerance = 1e-6});
  EXPECT_EQ(contacts_at(capsule, Vector3(-0.7, 0.1, 0), 1e-9), 1);
  EXPECT_EQ(contacts_at(capsule, Vector3(1.3, 0.1, 0), 1e-9), 1);
}

// --- against all pairs of features of two small meshes

Point<Scalar> point(const Vector3& p) {
  return {p.x(), p.y(), p.z()};
}

PointTriangle<Scalar> triangle(const TriangleMesh& mesh, std::size_t k, const RigidPose& X_WM) {
  PointTriangle<Scalar> result;
  for (std::size_t c = 0; c < 3; ++c) {
    result[c] = point(X_WM * mesh.vertices()[std::size_t(mesh.triangles()[k][c])]);
  }
  return result;
}

struct NearPair {
  Vector3 p;
  Vector3 q;
};

// The nearest points of all triangle pairs that are within `reach`.
std::vector<NearPair> near_pairs(const TriangleMesh& a, const TriangleMesh& b,
                                 const ToiResult& result, Scalar reach) {
  std::vector<NearPair> pairs;
  for (std::size_t i = 0; i < a.triangles().size(); ++i) {
    for (std::size_t j = 0; j < b.triangles().size(); ++j) {
      const auto nearest =
          testing::nearest_points(triangle(a, i, result.X_WA), triangle(b, j, result.X_WB));
      if (nearest.squared_distance > reach * reach) continue;
      const auto& p = nearest.on_a;
      const auto& q = nearest.on_b;
      pairs.push_back({{p.x, p.y, p.z}, {q.x, q.y, q.z}});
    }
  }
  return pairs;
}

Vector3 unit_normal(const TriangleMesh& mesh, std::int32_t triangle) {
  const Triangle t = mesh.triangle(triangle);
  return (t[1] - t[0]).cross(t[2] - t[0]).normalized();
}

// The normal of the plane if the point is on an edge between two triangles of one plane.
std::optional<Vector3> flat_normal_at(const TriangleMesh& mesh, const Vector3& p) {
  constexpr Scalar kClose = 1e-9;  // literal: above rounding, below any difference of the meshes
  const MeshTopology& topology = mesh.topology();
  for (std::int32_t edge = 0; edge < topology.edge_count(); ++edge) {
    const auto sides = topology.sides_of_edge(edge);
    if (sides.size() != 2) continue;
    const Vector3 n = unit_normal(mesh, sides[0] / 3);
    if (n.cross(unit_normal(mesh, sides[1] / 3)).norm() > kClose) continue;
    const Vector3& from = mesh.vertices()[std::size_t(topology.edge(edge)[0])];
    const Vector3& to = mesh.vertices()[std::size_t(topology.edge(edge)[1])];
    if ((p - from).norm() + (p - to).norm() <= (to - from).norm() + kClose) return n;
  }
  return std::nullopt;
}

// A tolerance of a tenth of the size puts many pieces within reach of the first contact. Each has a
// contact of its place, which may be as far from it as places of one gap can be: along the surface
// sqrt(reach² - gap²); and turned by 8 degrees at most, which is not asked here. A pair inside a
// flat area of A has none of its own where another one of that area is at least as near.
TEST(ImpactContacts, LeaveNoNearPairOfTrianglesOut) {
  const TriangleMesh a = gear(7, 0.8, 1, 0.3).mesh();
  const TriangleMesh b = testing::icosphere(1, 0.7).mesh();
  std::mt19937_64 random(5);
  ToiOptions options{.distance_tolerance = 1e-6};
  options.with_contacts = true;
  options.distance_tolerance = 0.05;
  int impacts = 0;
  std::size_t pairs = 0;
  std::size_t inner = 0;
  for (int k = 0; k < 60; ++k) {
    const Vector3 from = 4 * testing::random_direction(random);
    const Vector3 v = testing::random_vector(0.5, random) - from;
    const ConstantTwistMotion X_WA(RigidPose(),
                                   {Vector3::Zero(), testing::random_vector(2, random)});
    const Vector3 w_B = testing::random_vector(2, random);
    const ConstantTwistMotion X_WB(RigidPose(testing::random_rotation(random), from), {v, w_B});
    const ToiResult result = time_of_impact(a, X_WA, b, X_WB, {0, 1}, options);
    if (result.status != ToiStatus::Impact) continue;
    ++impacts;
    check_contacts(result, options);
    const Scalar least = result.contacts.front().lower;
    const Scalar reach = result.contact->upper + options.distance_tolerance.value();
    const Scalar radius = std::sqrt(reach * reach - least * least) * (1 + 1e-9);
    for (const NearPair& pair : near_pairs(a, b, result, reach * (1 - 1e-9))) {
      ++pairs;
      bool has_contact = false;
      for (const Contact& contact : result.contacts) {
        has_contact = has_contact || ((contact.p_WCa - pair.p).norm() <= radius &&
                                      (contact.p_WCb - pair.q).norm() <= radius);
      }
      if (has_contact) continue;
      ++inner;
      const auto n = flat_normal_at(a, result.X_WA.inverse() * pair.p);
      ASSERT_TRUE(n.has_value()) << k;
      const Vector3 n_W = result.X_WA.rotation() * *n;
      for (const Contact& contact : result.contacts) {
        const bool is_in_plane = std::abs(n_W.dot(contact.p_WCa - pair.p)) <= 1e-9;
        has_contact =
            has_contact || (is_in_plane && contact.lower <= (pair.p - pair.q).norm() * (1 + 1e-9));
      }
      EXPECT_TRUE(has_contact) << k;
    }
  }
  EXPECT_GT(impacts, 30);
  EXPECT_LT(inner * 10, pairs);
  EXPECT_GT(pairs, 500u);
}

}  // namespace
}  // namespace dyop
