// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/hierarchy/mesh_hierarchy.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cstring>
#include <random>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/core/rigid_pose.h"
#include "support/inputs/mesh_generators.h"

namespace dyop {
namespace {

using testing::box_mesh;
using testing::gear;
using testing::icosphere;
using testing::MeshArrays;
using testing::needle;
using testing::plate_grid;
using testing::point_cloud;
using testing::random_soup;
using testing::torus;

using Wide = long double;  // 64 bits of mantissa: its own rounding is 2000 times smaller
using WideVector = Eigen::Matrix<Wide, 3, 1>;
using WideMatrix = Eigen::Matrix<Wide, 3, 3>;

struct Summary {
  int depth = 0;
  std::vector<int> uses;  // by triangle
};

// How much `half_extents` leaves beside x, after the rounding of a caller who evaluates
// center + axes * x: 4u (|center| + sqrt(3) |half_extents|).
Wide slack(const OrientedBox& box, const WideMatrix& inverse, const Vector3& p) {
  const WideVector x = inverse * (p.cast<Wide>() - box.center.cast<Wide>());
  const Wide evaluation =
      4 * Wide(kUnitRoundoff) *
      (box.center.cast<Wide>().norm() + std::sqrt(Wide(3)) * box.half_extents.cast<Wide>().norm());
  return (box.half_extents.cast<Wide>() - x.cwiseAbs()).minCoeff() - evaluation;
}

std::vector<std::int32_t> check_node(const MeshHierarchy& tree, const MeshArrays& mesh,
                                     std::int32_t index, int depth, Summary& summary);

// Checks that a box holds all triangles below it. Returns those triangles.
std::vector<std::int32_t> check_box(const MeshHierarchy& tree, const MeshArrays& mesh,
                                    std::int32_t index, int column, int depth, Summary& summary) {
  const MeshHierarchy::Node& node = tree.nodes()[std::size_t(index)];
  const std::int32_t child = node.child[column];
  std::vector<std::int32_t> triangles;
  if (child < 0) {
    triangles = {-1 - child};
    ++summary.uses[std::size_t(-1 - child)];
  } else {
    EXPECT_GT(child, index);  // so the walk ends
    triangles = check_node(tree, mesh, child, depth, summary);
  }
  const OrientedBox box = node.boxes.box(column, tree.frame());
  const WideMatrix axes = box.axes.cast<Wide>();
  EXPECT_LE((axes.transpose() * axes - WideMatrix::Identity()).cwiseAbs().maxCoeff(), 0x1p-22);
  const WideMatrix inverse = axes.inverse();
  for (const std::int32_t t : triangles) {
    for (const std::int32_t v : mesh.triangles[std::size_t(t)]) {
      EXPECT_GE(slack(box, inverse, mesh.vertices[std::size_t(v)]), 0) << "node " << index;
    }
  }
  return triangles;
}

std::vector<std::int32_t> check_node(const MeshHierarchy& tree, const MeshArrays& mesh,
                                     std::int32_t index, int depth, Summary& summary) {
  summary.depth = std::max(summary.depth, depth);
  const MeshHierarchy::Node& node = tree.nodes()[std::size_t(index)];
  EXPECT_GE(node.count(), index == 0 ? 1 : 2);
  std::vector<std::int32_t> triangles;
  for (int column = 0; column < node.count(); ++column) {
    const auto below = check_box(tree, mesh, index, column, depth + 1, summary);
    triangles.insert(triangles.end(), below.begin(), below.end());
  }
  return triangles;
}

int expect_sound(const MeshHierarchy& tree, const MeshArrays& mesh) {
  EXPECT_EQ(tree.nodes()[0].count(), 1);
  Summary summary;
  summary.uses.assign(mesh.triangles.size(), 0);
  check_node(tree, mesh, 0, 0, summary);
  for (const int uses : summary.uses) EXPECT_EQ(uses, 1);
  EXPECT_LE(summary.depth, MeshHierarchy::kMaxDepth);
  return summary.depth;
}

int expect_sound(const MeshArrays& mesh) {
  return expect_sound(MeshHierarchy(mesh.vertices, mesh.triangles), mesh);
}

bool is_same(const MeshHierarchy& one, const MeshHierarchy& two) {
  if (one.nodes().size() != two.nodes().size() || one.frame().scale != two.frame().scale)
    return false;
  for (std::size_t k = 0; k < one.nodes().size(); ++k) {
    const MeshHierarchy::Node& x = one.nodes()[k];
    const MeshHierarchy::Node& y = two.nodes()[k];
    if (!std::equal(std::begin(x.child), std::end(x.child), std::begin(y.child))) return false;
    if (std::memcmp(x.boxes.rows, y.boxes.rows, sizeof(x.boxes.rows)) != 0) return false;
  }
  return true;
}

OrientedBox root_box(const MeshArrays& mesh) {
  const MeshHierarchy tree(mesh.vertices, mesh.triangles);
  return tree.nodes()[0].boxes.box(0, tree.frame());
}

TEST(MeshHierarchy, ContainsItsTrianglesAtEveryScaleAndPlace) {
  const Matrix3 turn = rotation_from_vector(Vector3(0.5, 0.2, -0.9));
  const std::vector<MeshArrays> meshes{icosphere(3),           torus(1, 0.3, 24, 12),
                                       plate_grid(1, 2, 9, 7), needle(1, 100),
                                       point_cloud(200, 3),    random_soup(600, 0.2, 4),
                                       gear(15, 0.8, 1, 0.1),  box_mesh(Vector3(1, 2, 3))};
  for (const MeshArrays& mesh : meshes) {
    for (const Scalar scale : {1e-4, 1.0, 1e4}) {
      for (const Scalar distance : {0.0, 1e6}) {
        expect_sound(mesh.moved(turn, distance * Vector3(1, -0.7, 0.3), scale));
        expect_sound(mesh.moved(Matrix3::Identity(), distance * Vector3(1, -0.7, 0.3), scale));
      }
    }
  }
}

TEST(MeshHierarchy, ContainsItsTrianglesAtTheEndsOfTheRangeOfDouble) {
  const MeshArrays soup = random_soup(60, 0.5, 8);
  for (const Scalar scale : {1e-310, 1e-200, 1e59}) {
    expect_sound(soup.moved(Matrix3::Identity(), Vector3::Zero(), scale));
  }
}

TEST(MeshHierarchy, OfOneTriangleIsALeaf) {
  const MeshArrays mesh{{Vector3(1, 2, 3), Vector3(2, 2, 3), Vector3(1, 3, 3)}, {{0, 1, 2}}};
  const MeshHierarchy tree(mesh.vertices, mesh.triangles);
  ASSERT_EQ(tree.nodes().size(), 1u);
  EXPECT_EQ(tree.nodes()[0].count(), 1);
  EXPECT_EQ(tree.nodes()[0].child[0], -1);
}

TEST(MeshHierarchy, SplitsIdenticalTrianglesEvenly) {
  MeshArrays mesh = icosphere(0);
  mesh.triangles.assign(1024, mesh.triangles[0]);
  EXPECT_LE(expect_sound(mesh), 10);
  for (Vector3& p : mesh.vertices) p = Vector3(1, 2, 3);
  EXPECT_LE(expect_sound(mesh), 10);
}

// Each triangle half as far as the one before: every bin but one is empty, down to the smallest
// numbers of double.
TEST(MeshHierarchy, KeepsItsDepthForTrianglesAtGeometricDistances) {
  MeshArrays mesh;
  for (int k = 0; k < 1000; ++k) {
    const Scalar size = std::ldexp(1.0, -k);
    mesh.vertices.insert(mesh.vertices.end(), {size * Vector3(1, 0, 0), size * Vector3(1, 0.1, 0),
                                               size * Vector3(1, 0, 0.1)});
    mesh.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
  }
  expect_sound(mesh);
  // With growing powers the bins see one triangle at a time for hundreds of levels.
  for (int k = 0; k < 1000; ++k) {
    for (int c = 0; c < 3; ++c) {
      mesh.vertices[std::size_t(3 * k + c)] =
          Vector3(std::ldexp(1.0, -k), k % 2 == 0 ? 0 : std::ldexp(1.0, -k), 0);
    }
  }
  expect_sound(mesh);
}

TEST(MeshHierarchy, CopesWithSharedLongTriangles) {
  // A fan: all triangles share the far tip, and their boxes overlap.
  MeshArrays mesh;
  mesh.vertices.emplace_back(1000, 0, 0);
  for (int k = 0; k <= 500; ++k) mesh.vertices.emplace_back(0, Scalar(k) / 500, Scalar(k % 3));
  for (int k = 1; k <= 500; ++k) mesh.triangles.push_back({0, k, k + 1});
  EXPECT_LE(expect_sound(mesh), 40);
}

TEST(MeshHierarchy, BoxesFollowTheDirectionOfThinThings) {
  const Matrix3 turn = rotation_from_vector(Vector3(0.5, 0.7, -0.4));
  const MeshArrays mesh = needle(1, 64).moved(turn, Vector3::Zero());
  Vector3 half = root_box(mesh).half_extents;
  std::sort(half.begin(), half.end());
  EXPECT_NEAR(half[2], 0.5, 1e-6);
  EXPECT_LE(half[1], 1e-6);
}

// The box of a leaf touches its triangle, along the longest edge and the normal: a triangle with
// base 4 and height 1 is 4 x 1 x 0, rounded up by 2^-23 (|center| + |half extents|), less than
// 2^-23 (3 + 2.1), and to single precision.
TEST(MeshHierarchy, LeavesAreAlignedWithLongestEdgeAndNormal) {
  const Matrix3 turn = rotation_from_vector(Vector3(-0.5, 0.3, 0.4));
  const MeshArrays mesh{{turn * Vector3(0, 0, 0), turn * Vector3(4, 0, 0), turn * Vector3(3, 1, 0)},
                        {{2, 1, 0}}};
  Vector3 half = root_box(mesh).half_extents;
  std::sort(half.begin(), half.end());
  EXPECT_LE(half[0], 6 * kSinglePrecisionBoxNoise);
  EXPECT_NEAR(half[1], 0.5, 6 * kSinglePrecisionBoxNoise);
  EXPECT_NEAR(half[2], 2, 6 * kSinglePrecisionBoxNoise);
}

TEST(MeshHierarchy, BuildsALargeSphere) {
  const MeshArrays mesh = icosphere(6);
  const MeshHierarchy tree(mesh.vertices, mesh.triangles);
  // Full nodes would take a seventh; about balanced: 8^6 > 81920.
  EXPECT_LT(tree.nodes().size(), mesh.triangles.size() / 4);
  EXPECT_LE(expect_sound(mesh), 12);
}

TEST(MeshHierarchy, IsTheSameOnAnyNumberOfThreads) {
  for (const MeshArrays& mesh : {random_soup(500, 0.1, 11), icosphere(6)}) {
    std::vector<MeshHierarchy> trees;
    for (const std::size_t threads : {1u, 2u, 7u}) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      tbb::task_arena arena(int(threads), 1);
      arena.execute([&] { trees.emplace_back(mesh.vertices, mesh.triangles); });
    }
    EXPECT_TRUE(is_same(trees[0], trees[1]));
    EXPECT_TRUE(is_same(trees[0], trees[2]));
  }
}

TEST(MeshHierarchy, RefittedToTheSameVerticesIsTheSame) {
  for (const MeshArrays& mesh : {random_soup(500, 0.1, 12), torus(1, 0.3, 30, 20)}) {
    const MeshHierarchy tree(mesh.vertices, mesh.triangles);
    EXPECT_TRUE(is_same(tree.refitted(mesh.vertices, mesh.triangles), tree));
  }
}

TEST(MeshHierarchy, RefittedContainsItsTriangles) {
  Matrix3 shear = Matrix3::Identity();
  shear(0, 1) = 5;
  shear(2, 0) = -3;
  std::mt19937_64 random(13);
  std::uniform_real_distribution<Scalar> number(-1, 1);
  for (const MeshArrays& mesh : {icosphere(3), random_soup(600, 0.2, 4), needle(1, 100)}) {
    const MeshHierarchy tree(mesh.vertices, mesh.triangles);
    const auto expect_refit_sound = [&](const auto& moved) {
      MeshArrays other = mesh;
      for (Vector3& p : other.vertices) p = moved(p);
      expect_sound(tree.refitted(other.vertices, other.triangles), other);
    };
    expect_refit_sound([&](const Vector3& p) { return Vector3(shear * p); });
    expect_refit_sound([](const Vector3&) { return Vector3(0.1, 2, -3); });
    expect_refit_sound([](const Vector3&) { return Vector3(0, 0, 0); });
    expect_refit_sound([](const Vector3& p) { return Vector3(1e6 * p); });
    expect_refit_sound([](const Vector3& p) { return Vector3(1e-310 * p); });
    expect_refit_sound([](const Vector3& p) { return Vector3(1e59 * p); });
    expect_refit_sound([](const Vector3& p) { return Vector3(p + Vector3(1e6, -1e5, 3)); });
    expect_refit_sound([](const Vector3& p) { return Vector3(p.x(), std::sin(9 * p.x()), p.z()); });
    expect_refit_sound(
        [&](const Vector3&) { return Vector3(number(random), number(random), number(random)); });
  }
}

TEST(MeshHierarchy, RefusesNoTriangle) {
  EXPECT_THROW(MeshHierarchy(std::vector<Vector3>{}, std::vector<TriangleIndices>{}),
               InvalidArgument);
}

}  // namespace
}  // namespace dyop
