// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/compound_shape.h"

#include <gtest/gtest.h>

#include <random>
#include <thread>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "geometry/all_compounds.h"
#include "geometry/compound_tree.h"
#include "geometry/shape_tree.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using geometry_internal::LeafPiece;
using geometry_internal::ShapeTree;
using namespace testing;  // NOLINT: makers

std::vector<Scalar> sizes() {
  return {1e-4, 1, 1e4};
}

// Points of a child's surface, in its own frame.
std::vector<Vector3> surface_points(const Shape& shape, std::mt19937_64& random) {
  if (shape.kind() == ShapeKind::TriangleMesh) {
    const auto vertices = static_cast<const TriangleMesh&>(shape).vertices();
    return {vertices.begin(), vertices.end()};
  }
  std::vector<Vector3> points;
  for (int k = 0; k < 200; ++k) {
    points.push_back(
        static_cast<const ConvexShape&>(shape).support(testing::random_direction(random)));
  }
  return points;
}

TEST(CompoundShape, BoundsHoldEveryPointOfEveryChild) {
  std::mt19937_64 random(1);
  for (const CompoundMaker& maker : all_compounds()) {
    for (const Scalar size : sizes()) {
      const auto compound = maker.make(size);
      AlignedBox box = compound->bounding_box();
      Scalar farthest = 0;
      AlignedBox points;
      for (const CompoundChild& child : compound->children()) {
        for (const Vector3& p_S : surface_points(*child.shape, random)) {
          const Vector3 p_C = child.X_CS * p_S;
          points.extend(p_C);
          farthest = std::max(farthest, p_C.norm());
        }
      }
      const Scalar noise = kPoseNoise * compound->bounding_radius();
      box = AlignedBox(box.min().array() - noise, box.max().array() + noise);
      EXPECT_TRUE(box.contains(points)) << maker.name;
      EXPECT_LE(farthest, compound->bounding_radius() + noise) << maker.name;
      EXPECT_LE(compound->bounding_radius(), 2 * farthest) << maker.name;
    }
  }
}

// Every piece is at one leaf, inside all the boxes above it.
TEST(CompoundShape, TreeHoldsEveryPieceOnce) {
  for (const CompoundMaker& maker : all_compounds()) {
    const auto compound = maker.make(1);
    const ShapeTree tree(*compound);
    std::vector<std::vector<int>> seen;
    std::size_t piece_count = 0;
    for (const CompoundChild& child : compound->children()) {
      const bool is_mesh = child.shape->kind() == ShapeKind::TriangleMesh;
      seen.emplace_back(is_mesh ? static_cast<const TriangleMesh&>(*child.shape).triangles().size()
                                : 1);
      piece_count += seen.back().size();
    }
    const auto holds = [](const OrientedBox& box, const Vector3& p) {
      const Vector3 x = box.axes.inverse() * (p - box.center);
      return ((x.cwiseAbs() - box.half_extents).array() <= 1e-12).all();
    };
    std::vector<OrientedBox> above;
    const std::function<void(std::int32_t)> visit = [&](std::int32_t box) {
      above.push_back(tree.box(box));
      if (!tree.is_leaf(box)) {
        const std::int32_t node = tree.child(box);
        for (int i = 0; i < tree.node(node).count(); ++i) visit(ShapeTree::box_number(node, i));
      } else {
        EXPECT_TRUE(tree.has_leaf(box));
        const LeafPiece piece = tree.piece(box);
        ASSERT_TRUE(piece.child.has_value());
        ++seen[std::size_t(*piece.child)][std::size_t(piece.triangle)];
        std::vector<Vector3> points;
        const CompoundChild& child = compound->children()[std::size_t(*piece.child)];
        if (piece.mesh) {
          const auto& mesh = static_cast<const TriangleMesh&>(*child.shape);
          for (const Vector3& p_S : mesh.triangle(piece.triangle)) {
            points.push_back(child.X_CS * p_S);
          }
          EXPECT_EQ(piece.corners()[0], points[0]);
        } else {
          std::mt19937_64 random(3);
          for (const Vector3& p_S : surface_points(*child.shape, random)) {
            points.push_back(child.X_CS * p_S);
          }
        }
        for (const OrientedBox& outer : above) {
          for (const Vector3& p_C : points) EXPECT_TRUE(holds(outer, p_C)) << maker.name;
        }
      }
      above.pop_back();
    };
    EXPECT_EQ(tree.node(0).count(), 1);
    visit(ShapeTree::kRoot);
    for (const auto& child : seen) {
      EXPECT_TRUE(std::all_of(child.begin(), child.end(), [](int n) { return n == 1; }));
    }
    EXPECT_LT(compound->tree().nodes.size(), piece_count + 2);
    EXPECT_FALSE(tree.has_leaf(std::int32_t(8 * compound->tree().nodes.size())));
  }
}

// Surfaces of children are built when they are asked for, by any thread, once.
TEST(CompoundShape, SurfacesOfChildrenStandWhereTheChildrenDo) {
  const auto compound = all_compounds()[4].make(1);
  const auto& parts = compound->tree().parts;
  std::vector<std::vector<const TriangleMesh*>> seen(4);
  std::vector<std::thread> threads;
  for (auto& surfaces : seen) {
    threads.emplace_back([&] {
      for (const auto& part : parts) surfaces.push_back(part.convex->core_surface());
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(seen[1], seen[0]);
  EXPECT_EQ(seen[2], seen[0]);
  EXPECT_EQ(seen[3], seen[0]);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const CompoundChild& child = compound->children()[k];
    const TriangleMesh& own = *static_cast<const ConvexShape&>(*child.shape).core_surface();
    ASSERT_NE(seen[0][k], nullptr);
    for (std::size_t v = 0; v < own.vertices().size(); ++v) {
      EXPECT_EQ(seen[0][k]->vertices()[v], child.X_CS * own.vertices()[v]);
    }
  }
}

// A speck of 1e-50 beside a giant of 1e10: its numbers underflow in the giant's unit.
TEST(CompoundShape, BoxesHoldChildrenOfVeryDifferentSizes) {
  const auto speck =
      std::make_shared<TriangleMesh>(icosphere(1, 1e-50).mesh());  // literal: 2^-200 of the other
  const auto giant = std::make_shared<Box>(Vector3(1e10, 1e10, 1e10));
  const CompoundShape compound({{speck, RigidPose()}, {giant, RigidPose(Vector3(3e10, 0, 0))}});
  const ShapeTree tree(compound);
  const std::function<void(std::int32_t)> visit = [&](std::int32_t box) {
    if (!tree.is_leaf(box)) {
      const std::int32_t node = tree.child(box);
      for (int i = 0; i < tree.node(node).count(); ++i) visit(ShapeTree::box_number(node, i));
      return;
    }
    const LeafPiece piece = tree.piece(box);
    if (!piece.mesh) return;
    const OrientedBox outer = tree.box(box);
    for (const Vector3& p : piece.corners()) {
      const Vector3 x = outer.axes.inverse() * (p - outer.center);
      EXPECT_TRUE(((x.cwiseAbs() - outer.half_extents).array() <= 0).all());
    }
  };
  visit(ShapeTree::kRoot);
}

TEST(CompoundShape, FlattensWhatIsNested) {
  const auto ball = std::make_shared<Sphere>(1);
  const auto inner = std::make_shared<CompoundShape>(std::vector<CompoundChild>{
      {ball, RigidPose(Vector3(1, 0, 0))}, {ball, RigidPose(Vector3(2, 0, 0))}});
  const RigidPose X = turned_at({0, 0, 1}, {0, 0, 5});
  const CompoundShape outer({{inner, X}, {ball, RigidPose()}});
  ASSERT_EQ(outer.children().size(), 3u);
  EXPECT_EQ(outer.children()[1].shape, ball);
  EXPECT_EQ(outer.children()[1].X_CS.translation(), X * Vector3(2, 0, 0));
}

// Two halves of a box have its mass, center and inertia.
TEST(CompoundShape, MassIsThatOfTheParts) {
  const auto half = std::make_shared<Box>(Vector3(1, 2, 3));
  const RigidPose X = turned_at({0.3, -0.2, 1}, {4, 5, 6});
  const CompoundShape compound(
      {{half, X * RigidPose(Vector3(-1, 0, 0))}, {half, X * RigidPose(Vector3(1, 0, 0))}});
  const MassProperties whole = Box(Vector3(2, 2, 3)).compute_mass_properties(0.7);
  const MassProperties found = compound.compute_mass_properties(0.7);
  EXPECT_NEAR(found.mass, whole.mass, 1e-13 * whole.mass);
  EXPECT_LE((found.p_BoBcm - X.translation()).norm(), 1e-13);
  const Matrix3 expected = X.rotation() * whole.I_BBcm * X.rotation().transpose();
  EXPECT_LE((found.I_BBcm - expected).norm(), 1e-12 * expected.norm());
}

TEST(CompoundShape, RefusesWhatIsMissingByName) {
  EXPECT_EQ(testing::message_of([] { CompoundShape({}); }), "a compound needs at least one child");
  const auto ball = std::make_shared<Sphere>(1);
  const auto sheet = std::make_shared<TriangleMesh>(plate_grid(1, 1, 1, 1).mesh());
  EXPECT_NE(testing::message_of([&] {
              CompoundShape({{ball, {}}, {nullptr, {}}});
            }).find("child 1"),
            std::string::npos);
  const CompoundShape open({{ball, {}}, {sheet, {}}});
  EXPECT_NE(testing::message_of([&] { open.compute_mass_properties(1); }).find("child 1"),
            std::string::npos);
  EXPECT_NE(testing::message_of([&] {
              CompoundShape({{ball, {}}}).compute_mass_properties(-1);
            }).find("-1"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop
