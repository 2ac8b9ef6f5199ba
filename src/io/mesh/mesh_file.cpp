// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/mesh_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <unordered_map>
#include <vector>

#include "dyop/io/file_error.h"
#include "io/file_bytes.h"
#include "io/mesh/mesh_reader.h"

namespace dyop {
namespace {

using io_internal::PolygonMesh;

// The formats with a reader of our own; all others are left to assimp.
struct MeshFormat {
  std::string_view extension;
  PolygonMesh (*read)(const std::filesystem::path& file, std::string_view bytes);
};
constexpr std::array kFormats{
    MeshFormat{".asc", &io_internal::read_asc}, MeshFormat{".obj", &io_internal::read_obj},
    MeshFormat{".off", &io_internal::read_off}, MeshFormat{".ply", &io_internal::read_ply},
    MeshFormat{".stl", &io_internal::read_stl}};

// Merges vertices at exactly the same place.
class VertexJoiner {
 public:
  explicit VertexJoiner(std::size_t count) { numbers_.reserve(count); }

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

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

PolygonMesh read_polygons(const std::filesystem::path& file, const MeshFileLimits& limits,
                          io_internal::UpAxis up) {
  const bool is_gzip = lower_case(file.extension().string()) == ".gz";
  const std::string extension =
      lower_case((is_gzip ? file.stem() : file.filename()).extension().string());
  const auto format = std::find_if(kFormats.begin(), kFormats.end(), [&](const MeshFormat& known) {
    return known.extension == extension;
  });
  const bool is_ours = format != kFormats.end();
  if (is_gzip && !is_ours) {
    throw FileError(
        file,
        "compressed meshes are supported only as .asc.gz, .obj.gz, .off.gz, .ply.gz and .stl.gz");
  }
  const std::string bytes = is_gzip ? io_internal::read_gzip_bytes(file, limits.most_unpacked_bytes)
                                    : io_internal::read_bytes(file);
  if (bytes.empty()) throw FileError(file, "the file is empty");
  return is_ours ? format->read(file, bytes) : io_internal::read_with_assimp(file, bytes, up);
}

TriangleMesh join_and_triangulate(PolygonMesh polygons) {
  constexpr auto kMostVertices = std::size_t(std::numeric_limits<std::int32_t>::max());
  DYOP_REQUIRE(polygons.vertices.size() <= kMostVertices, "the file has ", polygons.vertices.size(),
               " vertices; at most ", kMostVertices, " are supported");
  std::vector<std::int32_t> numbers;
  numbers.reserve(polygons.vertices.size());
  VertexJoiner joiner(polygons.vertices.size());
  for (const Vector3& p : polygons.vertices) numbers.push_back(joiner.add(p));

  std::vector<Vector3> vertices = joiner.take();
  std::vector<TriangleIndices> triangles;
  triangles.reserve(polygons.polygon_count());
  std::vector<std::int32_t> polygon;
  for (std::size_t k = 0; k < polygons.polygon_count(); ++k) {
    polygon.clear();
    for (const std::int32_t corner : polygons.polygon(k)) {
      polygon.push_back(numbers[std::size_t(corner)]);
    }
    io_internal::append_triangles(vertices, polygon, triangles);
  }
  return TriangleMesh(std::move(vertices), std::move(triangles));
}

TriangleMesh load(const std::filesystem::path& file, const MeshFileLimits& limits,
                  io_internal::UpAxis up, LoneVertices vertices) {
  PolygonMesh polygons = read_polygons(file, limits, up);
  if (polygons.polygon_count() == 0 && vertices == LoneVertices::Points) {
    for (std::size_t k = 0; k < polygons.vertices.size(); ++k) {
      polygons.begin_polygon();
      polygons.add_corner(std::int64_t(k));
    }
  }
  if (polygons.polygon_count() == 0) throw FileError(file, "the file has no triangles");
  try {
    return join_and_triangulate(std::move(polygons));
  } catch (const InvalidArgument& error) {
    throw FileError(file, error.what());
  }
}

}  // namespace

TriangleMesh load_mesh(const std::filesystem::path& file, const MeshFileLimits& limits,
                       LoneVertices vertices) {
  return load(file, limits, io_internal::UpAxis::Y, vertices);
}

TriangleMesh io_internal::load_mesh_as_written(const std::filesystem::path& file) {
  return load(file, {}, io_internal::UpAxis::AsWritten, LoneVertices::Refused);
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
