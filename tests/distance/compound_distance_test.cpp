// SPDX-License-Identifier: BSD-3-Clause

// Compounds in distance() and find_contacts(), against their children one by one.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/tolerance.h"
#include "distance/near_parts.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "geometry/all_compounds.h"
#include "support/inputs/bodies.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"
#include "support/oracles/shape_oracle.h"

namespace dyop {
namespace {

using namespace testing;  // NOLINT: makers
using testing::at;

std::vector<CompoundChild> children_of(const Shape& shape) {
  if (shape.kind() == ShapeKind::Compound) {
    const auto children = static_cast<const CompoundShape&>(shape).children();
    return {children.begin(), children.end()};
  }
  // Not owned.
  return {{std::shared_ptr<const Shape>(&shape, [](const Shape*) {}), RigidPose()}};
}

struct LeastOfChildren {
  double lower = kInfinity;
  double upper = kInfinity;
};

// Two children at their poses, and a bound below their distance: that of balls around their boxes.
struct ChildPair {
  std::shared_ptr<const Shape> a;
  RigidPose X_WA;
  std::shared_ptr<const Shape> b;
  RigidPose X_WB;
  Scalar at_least = 0;

  ChildPair(const CompoundChild& of_a, const RigidPose& X_WCa, const CompoundChild& of_b,
            const RigidPose& X_WCb)
      : a(of_a.shape), X_WA(X_WCa * of_a.X_CS), b(of_b.shape), X_WB(X_WCb * of_b.X_CS) {
    const AlignedBox box_a = a->bounding_box();
    const AlignedBox box_b = b->bounding_box();
    at_least = 0.99 * (X_WA * box_a.center() - X_WB * box_b.center()).norm() -
               0.51 * (box_a.sizes().norm() + box_b.sizes().norm());
  }
};

// The pairs that may be nearest are measured one by one, the nearest balls first.
LeastOfChildren least_of_children(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                  const RigidPose& X_WB) {
  std::vector<ChildPair> pairs;
  for (const CompoundChild& child_a : children_of(a)) {
    for (const CompoundChild& child_b : children_of(b)) {
      pairs.emplace_back(child_a, X_WA, child_b, X_WB);
    }
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const ChildPair& x, const ChildPair& y) { return x.at_least < y.at_least; });
  LeastOfChildren least;
  for (const ChildPair& pair : pairs) {
    if (pair.at_least > least.upper || least.upper == 0) break;
    const testing::OracleDistance d =
        testing::oracle_distance(*pair.a, pair.X_WA, *pair.b, pair.X_WB);
    least.lower = std::min(least.lower, double(d.lower()));
    least.upper = std::min(least.upper, double(d.upper()));
  }
  return least;
}

// Every compound against every other, and against single shapes of both kinds.
TEST(CompoundDistance, IsTheLeastOfTheChildren) {
  std::mt19937_64 random(5);
  int separated = 0;
  int overlapping = 0;
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    for (const Scalar far : {0.0, 1e5}) {
      if (size != 1 && far > 0) continue;
      std::vector<std::shared_ptr<const Shape>> shapes;
      for (const CompoundMaker& maker : all_compounds()) shapes.push_back(maker.make(size));
      const std::size_t compounds = shapes.size();
      shapes.push_back(std::make_shared<Box>(size * Vector3(1, 0.5, 0.2)));
      shapes.push_back(std::make_shared<TriangleMesh>(icosphere(1, size).mesh()));
      for (std::size_t i = 0; i < compounds; ++i) {
        for (const auto& b : shapes) {
          const RigidPose X_WA(
              testing::random_rotation(random),
              far * size * Vector3(1, 1, 0) + testing::random_vector(1.5 * size, random));
          const RigidPose X_WB(
              testing::random_rotation(random),
              far * size * Vector3(1, 1, 0) + testing::random_vector(1.5 * size, random));
          const DistanceResult d = distance(*shapes[i], X_WA, *b, X_WB);
          const LeastOfChildren least = least_of_children(*shapes[i], X_WA, *b, X_WB);
          // Rounding of the composed poses that the oracle is given.
          const Scalar noise = kPoseNoise * size * (far + 10);
          EXPECT_LE(d.lower, least.upper + noise);
          EXPECT_GE(d.upper, least.lower - noise);
          EXPECT_LE(d.upper - d.lower, 100 * noise);
          if (d.status == DistanceStatus::Overlapping) ++overlapping;
          if (d.status != DistanceStatus::Separated) continue;
          ++separated;
          // The child that is named is the nearest, and the witness point is on it.
          ASSERT_TRUE(d.child_a.has_value());
          EXPECT_EQ(d.child_b.has_value(), b->kind() == ShapeKind::Compound);
          const CompoundChild child_a = children_of(*shapes[i])[std::size_t(*d.child_a)];
          const CompoundChild child_b =
              children_of(*b)[d.child_b ? std::size_t(*d.child_b) : std::size_t{0}];
          const DistanceResult single =
              distance(*child_a.shape, X_WA * child_a.X_CS, *child_b.shape, X_WB * child_b.X_CS);
          EXPECT_LE(single.lower, d.upper + noise);
          EXPECT_GE(single.upper, d.lower - noise);
          EXPECT_EQ(d.triangle_a.has_value(), child_a.shape->kind() == ShapeKind::TriangleMesh);
          if (d.triangle_a) {
            const auto& mesh = static_cast<const TriangleMesh&>(*child_a.shape);
            ASSERT_LT(std::size_t(*d.triangle_a), mesh.triangles().size());
            const TriangleIndices& t = mesh.triangles()[std::size_t(*d.triangle_a)];
            for (std::size_t n = 0; n < d.feature_a.vertex_count(); ++n) {
              EXPECT_NE(std::find(t.begin(), t.end(), d.feature_a.vertices[n]), t.end());
            }
          }
          const TriangleMesh point({d.p_WCa}, {{0, 0, 0}});
          const DistanceResult on =
              distance(*child_a.shape, X_WA * child_a.X_CS, point, RigidPose());
          EXPECT_LE(on.lower, 10 * noise);
        }
      }
    }
  }
  EXPECT_GT(separated, 40);
  EXPECT_GT(overlapping, 15);
}

TEST(CompoundDistance, CacheAndBatchGiveTheSame) {
  std::mt19937_64 random(6);
  const auto a = all_compounds()[2].make(1);
  const auto b = all_compounds()[4].make(1);
  std::vector<DistanceQuery> queries(20);
  std::vector<DistanceResult> results(queries.size());
  DistanceCache cache;
  for (DistanceQuery& query : queries) {
    query.a = a.get();
    query.b = b.get();
    query.X_WA = testing::random_pose(1, random);
    query.X_WB = testing::random_pose(2, random);
  }
  distance_batch(queries, results);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const DistanceResult warm =
        distance(*a, queries[i].X_WA, *b, queries[i].X_WB, DistanceOptions(), cache);
    EXPECT_EQ(warm.status, results[i].status);
    EXPECT_NEAR(warm.lower, results[i].lower, 1e-13);
    EXPECT_NEAR(warm.upper, results[i].upper, 1e-13);
  }
}

// A ball in the hollow of one of the children.
TEST(CompoundDistance, TakesChildrenForSolids) {
  const auto shell = std::make_shared<TriangleMesh>(icosphere(2).mesh());
  const auto sheet = std::make_shared<TriangleMesh>(plate_grid(1, 1, 2, 2).mesh());
  const auto ball = std::make_shared<Sphere>(0.1);
  const CompoundShape outer({{ball, at(9, 0, 0)}, {shell, at(3, 0, 0)}});
  const CompoundShape inner({{ball, at(-4, 0, 0)}, {ball, at(0.1, 0, 0)}});
  DistanceOptions options;
  EXPECT_GT(distance(outer, at(-3, 0, 0), inner, RigidPose(), options).lower, 0.5);
  options.solid_a = true;
  const DistanceResult inside = distance(outer, at(-3, 0, 0), inner, RigidPose(), options);
  EXPECT_EQ(inside.status, DistanceStatus::Overlapping);
  EXPECT_NEAR(inside.p_WCa.x(), 0.1, 1e-12);
  EXPECT_EQ(distance(outer, at(-3, 0, 50), inner, RigidPose(), options).status,
            DistanceStatus::Separated);
  const CompoundShape open({{shell, RigidPose()}, {sheet, at(3, 0, 0)}});
  const std::string message =
      testing::message_of([&] { distance(open, RigidPose(), inner, RigidPose(), options); });
  EXPECT_NE(message.find("solid_a"), std::string::npos) << message;
}

std::vector<distance_internal::PartPair> near_parts(const Shape& a, const RigidPose& X_WA,
                                                    const Shape& b, const RigidPose& X_WB,
                                                    Scalar noise, Scalar reach) {
  distance_internal::BoxPairStack stack;
  std::vector<distance_internal::PartPair> pairs;
  distance_internal::find_near_parts(a, X_WA, b, X_WB, noise, reach, stack, pairs);
  return pairs;
}

// All pairs of children within reach are listed, and of a large cloud few others.
TEST(CompoundDistance, ListsTheChildrenThatAreNear) {
  std::mt19937_64 random(5);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    std::vector<std::shared_ptr<const Shape>> shapes{
        std::make_shared<Box>(Vector3(1, 2, 0.5) * size)};
    for (const CompoundMaker& maker : all_compounds()) shapes.push_back(maker.make(size));
    for (const auto& a : shapes) {
      for (const auto& b : shapes) {
        const RigidPose X_WA(random_rotation(random), size * random_direction(random));
        const RigidPose X_WB(random_rotation(random), 3 * size * random_direction(random));
        const Scalar reach = 0.3 * size;
        const auto near = near_parts(*a, X_WA, *b, X_WB, 1e-9 * size, reach);
        std::size_t needed = 0;
        const std::vector<CompoundChild> of_a = children_of(*a);
        const std::vector<CompoundChild> of_b = children_of(*b);
        for (std::size_t i = 0; i < of_a.size(); ++i) {
          for (std::size_t k = 0; k < of_b.size(); ++k) {
            const ChildPair pair(of_a[i], X_WA, of_b[k], X_WB);
            if (pair.at_least > reach) continue;
            if (distance(*pair.a, pair.X_WA, *pair.b, pair.X_WB).upper > reach) continue;
            ++needed;
            EXPECT_EQ(std::count_if(near.begin(), near.end(),
                                    [&](const distance_internal::PartPair& found) {
                                      return found.a == int(i) && found.b == int(k);
                                    }),
                      1);
          }
        }
        EXPECT_GE(near.size(), needed);
      }
    }
  }
  std::vector<Vector3> points;
  for (int i = 0; i < 3000; ++i) points.push_back(random_direction(random));
  const CompoundShape cloud = point_cloud(points, 0.01);
  EXPECT_TRUE(near_parts(cloud, RigidPose(), cloud, at(3, 0, 0), 1e-9, 0.1).empty());
  EXPECT_LT(near_parts(cloud, RigidPose(), Sphere(0.01), at(1, 0, 0), 1e-9, 0.01).size(), 20U);
}

// A table on four legs stands on the floor with the corners of its legs.
TEST(CompoundDistance, FindsContactsOfEveryChild) {
  const auto leg = std::make_shared<Box>(Vector3(0.1, 0.1, 0.5));
  const auto foot = std::make_shared<Sphere>(0.2);
  const auto top = std::make_shared<TriangleMesh>(box_mesh(Vector3(1, 1, 0.05)).mesh());
  const CompoundShape table({{leg, at(0.8, 0.8, 0.5)},
                             {leg, at(-0.8, 0.8, 0.5)},
                             {leg, at(-0.8, -0.8, 0.5)},
                             {leg, at(0.8, -0.8, 0.5)},
                             {top, at(0, 0, 1.05)},
                             {foot, at(0, 0, 0.2)}});
  const Box ground(Vector3(5, 5, 1));
  const std::vector<Contact> contacts =
      find_contacts(table, at(0, 0, 0.01), ground, at(0, 0, -1), 0.02);
  std::vector<int> count(6);
  for (const Contact& contact : contacts) {
    ASSERT_TRUE(contact.child_a.has_value());
    EXPECT_FALSE(contact.child_b.has_value());
    ++count[std::size_t(*contact.child_a)];
    EXPECT_NEAR(contact.p_WCa.z(), 0.01, 1e-12);
    EXPECT_NEAR(contact.p_WCb.z(), 0, 1e-12);
    EXPECT_LE(contact.lower, 0.01 + 1e-12);
    EXPECT_GE(contact.upper, 0.01 - 1e-12);
  }
  EXPECT_EQ(count, (std::vector<int>{4, 4, 4, 4, 0, 1}));
}

}  // namespace
}  // namespace dyop
