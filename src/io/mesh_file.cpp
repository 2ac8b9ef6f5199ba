#include "dyop/io/mesh_file.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "dyop/io/file_error.h"
#include "io/file_bytes.h"
#include "io/mesh_check.h"

namespace dyop {
namespace {

// Joins vertices at exactly the same place.
class VertexJoiner {
 public:
  std::int32_t add(const Vector3& p) {
    // Adding zero turns -0 into 0, which is the same place.
    const Key key{std::bit_cast<std::uint64_t>(p.x() + 0.0),
                  std::bit_cast<std::uint64_t>(p.y() + 0.0),
                  std::bit_cast<std::uint64_t>(p.z() + 0.0)};
    const auto [found, is_new] = numbers_.try_emplace(key, std::int32_t(vertices_.size()));
    if (is_new) vertices_.push_back(p);
    return found->second;
  }

  std::vector<Vector3> take() { return std::move(vertices_); }

 private:
  using Key = std::array<std::uint64_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0;
      // literal: the multiplier of Fibonacci hashing, 2^64 over the golden ratio
      for (const std::uint64_t word : key)
        hash = (std::rotl(hash, 23) ^ word) * 0x9E3779B97F4A7C15u;
      return std::size_t(hash ^ (hash >> 32));
    }
  };
  std::unordered_map<Key, std::int32_t, Hash> numbers_;
  std::vector<Vector3> vertices_;
};

struct MeshParts {
  VertexJoiner vertices;
  std::vector<TriangleIndices> triangles;
};

// Assimp ends the process when it triangulates a face without vertices, and does not check indices
// before that.
void require_faces(const aiScene& scene, const std::filesystem::path& file) {
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices == 0) {
        throw FileError(file, internal::compose_message("face ", f, " has no vertices"));
      }
      for (unsigned k = 0; k < face.mNumIndices; ++k) {
        if (face.mIndices[k] < mesh.mNumVertices) continue;
        throw FileError(
            file, internal::compose_message("face ", f, ": vertex index ", face.mIndices[k],
                                            " is out of range: the mesh has ", mesh.mNumVertices,
                                            " vertices"));
      }
    }
  }
}

// Appends one mesh of the file, placed by its node.
void append_mesh(const aiMesh& mesh, const aiMatrix4x4& X_WN, const std::filesystem::path& file,
                 MeshParts& parts) {
  std::vector<std::int32_t> numbers(mesh.mNumVertices);
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D p = X_WN * mesh.mVertices[v];
    const Vector3 p_W(Scalar(p.x), Scalar(p.y), Scalar(p.z));
    if (!p_W.allFinite()) {
      throw FileError(file,
                      internal::compose_message("vertex ", v, ": expected finite numbers, found (",
                                                p_W.x(), ", ", p_W.y(), ", ", p_W.z(), ")"));
    }
    numbers[v] = parts.vertices.add(p_W);
  }
  const bool is_mirrored = X_WN.Determinant() < 0;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    // A line or point repeats its last vertex.
    TriangleIndices triangle;
    for (unsigned k = 0; k < 3; ++k) {
      triangle[k] = numbers[face.mIndices[std::min(k, face.mNumIndices - 1)]];
    }
    if (is_mirrored) std::swap(triangle[1], triangle[2]);
    parts.triangles.push_back(triangle);
  }
}

void append_node(const aiScene& scene, const aiNode& node, const aiMatrix4x4& X_WP,
                 const std::filesystem::path& file, MeshParts& parts) {
  const aiMatrix4x4 X_WN = X_WP * node.mTransformation;
  for (unsigned k = 0; k < node.mNumMeshes; ++k) {
    append_mesh(*scene.mMeshes[node.mMeshes[k]], X_WN, file, parts);
  }
  for (unsigned k = 0; k < node.mNumChildren; ++k) {
    append_node(scene, *node.mChildren[k], X_WN, file, parts);
  }
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

void check_bytes(const std::filesystem::path& file, const std::string& extension,
                 const std::string& bytes) {
  if (bytes.empty()) throw FileError(file, "the file is empty");
  if (extension == ".obj") internal::check_obj(file, bytes);
  if (extension == ".off") internal::check_off(file, bytes);
  if (extension == ".stl") internal::check_stl(file, bytes);
  if (extension == ".ply") internal::check_ply(file, bytes);
}

std::string problem_of(std::string reason) {
  if (reason.find("contains no faces") != std::string::npos) return "the file has no triangles";
  std::replace_if(
      reason.begin(), reason.end(), [](unsigned char c) { return c < ' '; }, ' ');
  return "not understood as a mesh: " + (reason.empty() ? "no reason given" : reason);
}

}  // namespace

TriangleMesh load_mesh(const std::filesystem::path& file) {
  const bool is_gzip = lower_case(file.extension().string()) == ".gz";
  const std::string extension =
      lower_case((is_gzip ? file.stem() : file.filename()).extension().string());
  if (is_gzip && extension != ".ply") {
    throw FileError(file, "of compressed meshes only .ply.gz is supported");
  }
  const std::string bytes = is_gzip ? internal::read_gzip_bytes(file) : internal::read_bytes(file);
  check_bytes(file, extension, bytes);

  Assimp::Importer importer;
  constexpr unsigned kFlags = aiProcess_ValidateDataStructure;
  const aiScene* scene =
      is_gzip ? importer.ReadFileFromMemory(bytes.data(), bytes.size(), kFlags, "ply")
              : importer.ReadFile(file.string(), kFlags);
  if (scene != nullptr) {
    require_faces(*scene, file);
    scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  }
  if (scene == nullptr || scene->mRootNode == nullptr) {
    throw FileError(file, problem_of(importer.GetErrorString()));
  }
  MeshParts parts;
  append_node(*scene, *scene->mRootNode, aiMatrix4x4(), file, parts);
  if (parts.triangles.empty()) throw FileError(file, "the file has no triangles");
  try {
    return TriangleMesh(parts.vertices.take(), std::move(parts.triangles));
  } catch (const InvalidArgument& error) {
    throw FileError(file, error.what());
  }
}

TriangleMesh place_mesh(const TriangleMesh& mesh, const MeshPlacement& placement) {
  DYOP_REQUIRE(placement.scale > 0 && std::isfinite(placement.scale),
               "the scale of a mesh must be a number > 0, not ", placement.scale);
  const bool is_unchanged = placement.scale == 1 && placement.center == MeshCenter::None;
  if (is_unchanged) return mesh;
  Vector3 center = Vector3::Zero();
  if (placement.center == MeshCenter::Bounds) center = mesh.bounding_box().center();
  if (placement.center == MeshCenter::Mass) {
    center = (placement.is_shell ? mesh.compute_shell_mass_properties(1)
                                 : mesh.compute_mass_properties(1))
                 .p_BoBcm;
  }
  std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
  for (Vector3& p : vertices) p = placement.scale * (p - center);
  return TriangleMesh(std::move(vertices), {mesh.triangles().begin(), mesh.triangles().end()});
}

}  // namespace dyop
