// SPDX-License-Identifier: BSD-3-Clause

// Assimp, in single precision, as a second opinion on the readers of our own.

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <assimp/Importer.hpp>
#include <cmath>

#include "dyop/io/mesh_file.h"
#include "support/inputs/cube_files.h"
#include "support/inputs/models.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

// The corners of all triangles of the file's first and only mesh.
std::vector<Vector3> assimp_corners(const std::filesystem::path& file) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_Triangulate);
  std::vector<Vector3> corners;
  if (scene == nullptr || scene->mNumMeshes != 1) return corners;
  const aiMesh& mesh = *scene->mMeshes[0];
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    for (unsigned k = 0; k < 3; ++k) {
      const aiVector3D& p = mesh.mVertices[mesh.mFaces[f].mIndices[k]];
      corners.emplace_back(Scalar(p.x), Scalar(p.y), Scalar(p.z));
    }
  }
  return corners;
}

// Assimp's conversion of decimals is off by some units in the last place of a float.
constexpr Scalar kFloatTolerance = 4 * 0x1p-23;

void expect_agreement(const std::filesystem::path& file) {
  const TriangleMesh mesh = load_mesh(file);
  const std::vector<Vector3> corners = assimp_corners(file);
  ASSERT_EQ(corners.size(), 3 * mesh.triangles().size()) << file;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vector3 p = mesh.triangle(std::int32_t(k / 3))[k % 3];
    const Scalar tolerance = kFloatTolerance * p.cwiseAbs().maxCoeff();
    ASSERT_LE((p - corners[k]).cwiseAbs().maxCoeff(), tolerance) << file << ", corner " << k;
  }
}

TEST(AssimpAgreement, HoldsForTheBunny) {
  const auto bunny = testing::find_model("bunny.obj");
  if (!bunny) GTEST_SKIP() << "bunny.obj is not there: apt-get install glmark2-data";
  expect_agreement(*bunny);
}

TEST(AssimpAgreement, HoldsForEveryFormat) {
  const testing::TemporaryDirectory directory;
  testing::Polygons mesh = testing::cube_polygons();
  for (Vector3& p : mesh.vertices) p = Vector3(0.1, 1.0 / 3, 7) + 1e-3 * p;
  expect_agreement(directory.write("a.obj", testing::obj_of(mesh)));
  expect_agreement(directory.write("a.off", testing::off_of(mesh)));
  expect_agreement(directory.write("a.stl", testing::stl_ascii_of(mesh)));
  expect_agreement(directory.write("b.stl", testing::stl_binary_of(mesh)));
  expect_agreement(directory.write("a.ply", testing::ply_ascii_of(mesh)));
  expect_agreement(directory.write("b.ply", testing::ply_binary_of<float>(mesh)));
}

}  // namespace
}  // namespace dyop
