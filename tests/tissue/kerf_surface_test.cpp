// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/kerf_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/inputs/curved_meshes.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/tissue_bars.h"
#include "support/oracles/difference_oracle.h"
#include "tissue/disjoint_sets.h"

namespace dyop::tissue_internal {
namespace {

using testing::MeshArrays;

TriangleMesh mesh_of(const MeshArrays& arrays) {
  return TriangleMesh(arrays.vertices, arrays.triangles);
}

// A lump with bumps, as organs are.
MeshArrays organ() {
  MeshArrays arrays = testing::icosphere(4);
  for (Vector3& p : arrays.vertices) {
    const Scalar bump = 1 + 0.15 * std::sin(4 * p.x()) * std::cos(5 * p.y() + p.z());
    p = bump * Vector3(1.2 * p.x(), 0.8 * p.y(), 0.6 * p.z() + 0.2 * p.x() * p.x());
  }
  return arrays;
}

// A wall of 0.2 around a lumen, along z.
MeshArrays tube() {
  MeshArrays arrays = testing::torus(0.6, 0.2, 40, 12);
  for (Vector3& p : arrays.vertices) p.z() *= 5;
  return arrays;
}

MeshArrays sheet() {
  return testing::divided_box({2, 2, 0.02}, {9, 9, 1},
                              RigidPose(Quaternion::Identity(), {-1, -1, 0}));
}

struct Result {
  CutStatus status;
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;

  TriangleMesh mesh() const { return TriangleMesh(vertices, triangles); }
};

Result less(const TriangleMesh& mesh, const TissueKerf& kerf, Scalar spacing = 0.1) {
  const std::vector<std::int32_t> parts(mesh.vertices().size(), 0);
  const KerfSurface surface = take_kerf({mesh.vertices(), mesh.triangles(), parts}, kerf, spacing);
  Result result{
      surface.status, {mesh.vertices().begin(), mesh.vertices().end()}, surface.triangles};
  result.vertices.insert(result.vertices.end(), surface.added_W.begin(), surface.added_W.end());
  return result;
}

Scalar volume_of(const TriangleMesh& mesh) {
  Scalar six = 0;
  for (const TriangleIndices& t : mesh.triangles()) {
    const auto at = [&](std::size_t k) { return mesh.vertices()[std::size_t(t[k])]; };
    six += at(0).dot(at(1).cross(at(2)));
  }
  return six / 6;
}

bool is_in(const TissueKerf& kerf, const Vector3& p_W, Scalar grown = 0) {
  const Vector3 p_K = kerf.X_WK.inverse() * p_W;
  return (p_K.cwiseAbs() - kerf.half_extents).maxCoeff() <= grown;
}

// Of random points: inside the body and not in the kerf.
void expect_same_inside(const TriangleMesh& mesh, const TissueKerf& kerf, const TriangleMesh& cut,
                        std::mt19937_64& random) {
  const AlignedBox box = mesh.bounding_box();
  std::uniform_real_distribution<Scalar> share(0, 1);
  for (int k = 0; k < 100; ++k) {
    Vector3 p = box.min();
    if (k % 2 == 0) {
      for (int axis = 0; axis < 3; ++axis) p[axis] += share(random) * box.sizes()[axis];
    } else {  // about the kerf
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] = (2.4 * share(random) - 1.2) * kerf.half_extents[axis];
      }
      p = kerf.X_WK * p;
    }
    if (is_in(kerf, p, 1e-6) != is_in(kerf, p, -1e-6)) continue;
    EXPECT_EQ(winding_number(cut, p), is_in(kerf, p) ? 0 : winding_number(mesh, p));
  }
}

TissueKerf random_kerf(std::mt19937_64& random, Scalar size) {
  std::uniform_real_distribution<Scalar> share(0, 1);
  TissueKerf kerf;
  kerf.X_WK = testing::random_pose(0.6 * size, random);
  kerf.half_extents = {size * std::pow(10, -2.5 * share(random)), size * 2 * share(random) + 0.01,
                       size * 1.5 * share(random) + 0.01};
  return kerf;
}

// How many kerfs were of use; each result is closed and encloses CGAL's volume.
int compare_with_oracle(const MeshArrays& arrays, std::uint64_t seed, int count) {
  std::mt19937_64 random(seed);
  const TriangleMesh mesh = mesh_of(arrays);
  const Scalar whole = volume_of(mesh);
  int cuts = 0;
  for (int k = 0; k < count; ++k) {
    const TissueKerf kerf = random_kerf(random, 1);
    const Result result = less(mesh, kerf);
    const Scalar volume = testing::oracle_volume_less_box(mesh, kerf.X_WK, kerf.half_extents);
    switch (result.status) {
      case CutStatus::Cut:
        ++cuts;
        EXPECT_TRUE(result.mesh().is_closed());
        EXPECT_NEAR(volume_of(result.mesh()), volume, 1e-9 * whole) << "kerf " << k;
        expect_same_inside(mesh, kerf, result.mesh(), random);
        break;
      case CutStatus::Missed:
        EXPECT_NEAR(volume, whole, 1e-12 * whole);
        break;
      case CutStatus::NothingLeft:
        EXPECT_EQ(volume, 0);
        break;
      default:
        ADD_FAILURE() << "kerf " << k << " was refused";
    }
  }
  return cuts;
}

TEST(KerfSurface, EnclosesWhatAnExactBooleanDoesOfABall) {
  EXPECT_GT(compare_with_oracle(testing::icosphere(3), 1, 100), 50);
}
TEST(KerfSurface, EnclosesWhatAnExactBooleanDoesOfAnOrgan) {
  EXPECT_GT(compare_with_oracle(organ(), 2, 60), 30);
}
TEST(KerfSurface, EnclosesWhatAnExactBooleanDoesOfATube) {
  EXPECT_GT(compare_with_oracle(tube(), 3, 100), 50);
}
TEST(KerfSurface, EnclosesWhatAnExactBooleanDoesOfASheet) {
  EXPECT_GT(compare_with_oracle(sheet(), 4, 100), 50);
}

// Planes through vertices and along faces: what lies in them is settled by a slightly larger kerf.
TEST(KerfSurface, CutsThroughVerticesAndAlongFaces) {
  const TriangleMesh box =
      mesh_of(testing::divided_box({4, 2, 2}, {4, 2, 2}, RigidPose(Vector3(-2, -1, -1))));
  struct Case {
    Vector3 middle, half_extents;
    Scalar left;
  };
  for (const auto& [middle, half, left] :
       {Case{{0, 0, 0}, {1, 1, 1}, 8}, Case{{0, 0, 0}, {1, 2, 2}, 8},
        Case{{2, 0, 0}, {1, 1, 1}, 12}, Case{{0, 0, 1}, {1, 1, 1}, 12},
        Case{{-2, -1, -1}, {1, 1, 1}, 15}, Case{{0, 0, 0}, {0.5, 0.5, 0.5}, 15},
        Case{{0, 0, 3}, {1, 1, 2}, 16}}) {
    const Result result = less(box, {RigidPose(Quaternion::Identity(), middle), half}, 0.5);
    ASSERT_EQ(result.status, CutStatus::Cut);
    EXPECT_TRUE(result.mesh().is_closed());
    EXPECT_NEAR(volume_of(result.mesh()), left, 1e-6);
  }
}

TEST(KerfSurface, TellsWhatItMissesAndWhatItHolds) {
  const TriangleMesh ball = mesh_of(testing::icosphere(3));
  const auto status = [&](const Vector3& middle, Scalar half) {
    return less(ball, {RigidPose(Quaternion::Identity(), middle), Vector3::Constant(half)}).status;
  };
  EXPECT_EQ(status({0, 0, 3}, 1), CutStatus::Missed);
  EXPECT_EQ(status({0.9, 0.9, 0.9}, 0.3), CutStatus::Missed);  // within its box
  EXPECT_EQ(status({0, 0, 0}, 2), CutStatus::NothingLeft);
  EXPECT_EQ(status({0, 0, 0}, 0.1), CutStatus::Cut);  // a cavity
}

// Parts that lie in each other are cut each for itself, also where one mesh holds both.
TEST(KerfSurface, CutsPartsThatOverlap) {
  MeshArrays two = testing::icosphere(2);
  const std::size_t count = two.vertices.size(), triangles = two.triangles.size();
  for (std::size_t k = 0; k < count; ++k) {
    two.vertices.push_back(two.vertices[k] + Vector3(0.5, 0.1, 0.2));
  }
  for (std::size_t t = 0; t < triangles; ++t) {
    TriangleIndices other = two.triangles[t];
    for (std::int32_t& vertex : other) vertex += std::int32_t(count);
    two.triangles.push_back(other);
  }
  std::vector<std::int32_t> parts(two.vertices.size(), 0);
  const TissueKerf kerf{RigidPose(Quaternion::Identity(), {0.2, 0, 0}), {0.013, 0.7, 2}};
  const auto volume = [&] {
    const KerfSurface surface = take_kerf({two.vertices, two.triangles, parts}, kerf, 0.1);
    EXPECT_EQ(surface.status, CutStatus::Cut);
    std::vector<Vector3> vertices = two.vertices;
    vertices.insert(vertices.end(), surface.added_W.begin(), surface.added_W.end());
    const TriangleMesh mesh(vertices, surface.triangles);
    EXPECT_TRUE(mesh.is_closed());
    return volume_of(mesh);
  };
  const Scalar together = volume();
  std::fill(parts.begin() + std::ptrdiff_t(count), parts.end(), 1);
  EXPECT_NEAR(volume(), together, 1e-9);
}

// Two balls of one mesh, a host's cube is the ball's number.
class TwoBalls final : public BodySheets {
 public:
  TwoBalls(std::size_t triangles, const Vector3& middle, Scalar radius)
      : triangles_(triangles), middle_(middle), radius_(radius) {}

  std::optional<Host> on_surface(std::int32_t triangle, const Vector3&) const override {
    return Host{std::size_t(triangle) < triangles_ ? 0 : 1, Vector3::Zero()};
  }
  std::vector<Host> inside(std::int32_t, const Vector3& p_W) const override {
    std::vector<Host> hosts;
    if ((p_W - middle_).norm() < radius_) hosts.push_back({1, Vector3::Zero()});
    if (p_W.norm() < 1) hosts.push_back({0, Vector3::Zero()});
    return hosts;
  }
  Scalar miss(const Host& from, const Vector3&, const Host& to, const Vector3&) const override {
    return from.cube == to.cube ? 0 : kInfinity;
  }

 private:
  std::size_t triangles_;
  Vector3 middle_;
  Scalar radius_;
};

// One lies in the other: what begins first on a kerf's edge does not end first, and both may cover
// a corner.
TEST(KerfSurface, KeepsSidesApartThatLieOverEachOther) {
  const Vector3 middle(0.3, 0.2, 0.1);
  MeshArrays two = testing::icosphere(3);
  const std::size_t count = two.vertices.size(), triangles = two.triangles.size();
  for (std::size_t k = 0; k < count; ++k) two.vertices.push_back(middle + 0.5 * two.vertices[k]);
  for (std::size_t t = 0; t < triangles; ++t) {
    TriangleIndices other = two.triangles[t];
    for (std::int32_t& vertex : other) vertex += std::int32_t(count);
    two.triangles.push_back(other);
  }
  const std::vector<std::int32_t> parts(two.vertices.size(), 0);
  const TwoBalls sheets(triangles, middle, 0.5);
  for (const Vector3& half :
       {Vector3(0.013, 0.3, 2), Vector3(0.013, 0.2, 0.3), Vector3(0.1, 0.25, 0.8)}) {
    const TissueKerf kerf{RigidPose(Quaternion::Identity(), {0.2, 0.1, 0}), half};
    const KerfSurface surface = take_kerf({two.vertices, two.triangles, parts}, kerf, 0.1, &sheets);
    ASSERT_EQ(surface.status, CutStatus::Cut);
    DisjointSets sides(two.vertices.size() + surface.added_W.size());
    for (const TriangleIndices& t : surface.triangles) {
      sides.join(std::size_t(t[0]), std::size_t(t[1]));
      sides.join(std::size_t(t[0]), std::size_t(t[2]));
    }
    for (std::size_t v = 0; v < count; ++v) {
      for (std::size_t w : {count, count + 40}) EXPECT_NE(sides.find(v), sides.find(w));
    }
  }
}

}  // namespace
}  // namespace dyop::tissue_internal
