// SPDX-License-Identifier: BSD-3-Clause
#include "io/robot/mesh_finder.h"

#include <algorithm>
#include <sstream>

#include "io/mesh/mesh_reader.h"

namespace dyop::io_internal {
namespace {

using core_internal::compose_message;

// Folders above the robot's file that may hold its package: packages keep their robots one to three
// folders deep.
constexpr int kFoldersAbove = 5;
// Files looked at in the search for a mesh that is not where the robot's file says.
constexpr int kMostEntries = 20'000;

// The path below a package, and the package; "file://" and no prefix at all have no package.
struct MeshName {
  std::string package;
  std::filesystem::path path;
};

MeshName parse_name(const XmlNode& node, const std::string& name) {
  const std::size_t scheme = name.find("://");
  if (scheme == std::string::npos) return {"", name};
  const std::string kind = name.substr(0, scheme);
  const std::string rest = name.substr(scheme + 3);
  if (kind == "file") return {"", rest};
  if (kind != "package" && kind != "model") {
    node.fail_expected("filename", "a path, package:// or file://");
  }
  const std::size_t slash = rest.find('/');
  if (slash == std::string::npos) node.fail_expected("filename", "package://NAME/PATH");
  return {rest.substr(0, slash), rest.substr(slash + 1)};
}

bool is_file(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

// How many of the last folders and names two paths have in common.
int common_end(const std::filesystem::path& a, const std::filesystem::path& b) {
  const std::vector<std::filesystem::path> parts_a(a.begin(), a.end());
  const std::vector<std::filesystem::path> parts_b(b.begin(), b.end());
  const auto [end, other] =
      std::mismatch(parts_a.rbegin(), parts_a.rend(), parts_b.rbegin(), parts_b.rend());
  return int(end - parts_a.rbegin());
}

// A mesh that is turned inside out by a mirroring scale faces outward again.
TriangleMesh scaled(const TriangleMesh& mesh, const Vector3& scale) {
  if (scale == Vector3::Ones()) return mesh;
  std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
  for (Vector3& p : vertices) p = p.cwiseProduct(scale);
  std::vector<TriangleIndices> triangles(mesh.triangles().begin(), mesh.triangles().end());
  if (scale.prod() < 0) {
    for (TriangleIndices& triangle : triangles) std::swap(triangle[1], triangle[2]);
  }
  return TriangleMesh(std::move(vertices), std::move(triangles));
}

}  // namespace

MeshFinder::MeshFinder(const std::filesystem::path& urdf,
                       std::vector<std::filesystem::path> package_paths)
    : folder_(std::filesystem::absolute(urdf).lexically_normal().parent_path()),
      paths_(std::move(package_paths)) {
  std::filesystem::path folder = folder_;
  for (int k = 0; k <= kFoldersAbove && !folder.empty(); ++k) {
    paths_.push_back(folder);
    if (folder == folder.parent_path()) break;
    folder = folder.parent_path();
  }
}

std::filesystem::path MeshFinder::find(const XmlNode& node) {
  const std::string name = node.text("filename");
  const auto known = found_.find(name);
  if (known != found_.end()) return known->second;
  const MeshName wanted = parse_name(node, name);
  if (wanted.path.is_absolute() && is_file(wanted.path)) return found_[name] = wanted.path;
  for (const std::filesystem::path& folder : paths_) {
    const std::filesystem::path relative = wanted.path.relative_path();
    for (const std::filesystem::path& file :
         {folder / wanted.package / relative, folder / relative}) {
      if (is_file(file)) return found_[name] = file;
    }
  }
  return found_[name] = find_by_name(node, wanted.path);
}

// Below the robot's folder, the file of this name whose last folders agree best.
std::filesystem::path MeshFinder::find_by_name(const XmlNode& node,
                                               const std::filesystem::path& wanted) {
  std::vector<std::filesystem::path> best;
  int most = 1;
  std::error_code error;
  int seen = 0;
  for (std::filesystem::recursive_directory_iterator entry(folder_, error), end;
       !error && entry != end && seen < kMostEntries; entry.increment(error), ++seen) {
    if (entry->path().filename() != wanted.filename() || !is_file(entry->path())) continue;
    const int common = common_end(entry->path(), wanted);
    if (common > most) best.clear();
    if (common >= most) best.push_back(entry->path());
    most = std::max(most, common);
  }
  if (best.empty()) {
    node.fail(compose_message("filename: '", node.text("filename"), "' is in none of ",
                              paths_.size(), " search paths, nor below '", folder_.string(), "'"));
  }
  if (best.size() > 1) {
    std::sort(best.begin(), best.end());
    node.fail(compose_message("filename: '", node.text("filename"), "' could be '",
                              best[0].string(), "' or '", best[1].string(), "'"));
  }
  notes_.push_back(
      compose_message("mesh '", node.text("filename"), "' was found as '", best[0].string(), "'"));
  return best[0];
}

std::shared_ptr<const TriangleMesh> MeshFinder::load(const XmlNode& node) {
  const std::filesystem::path file = find(node);
  const Vector3 scale = node.vector3_or("scale", Vector3::Ones());
  if (!(scale.array() != 0).all()) node.fail_expected("scale", "three numbers other than 0");
  std::ostringstream key;
  key << std::hexfloat << file.string() << ' ' << scale.transpose();
  std::shared_ptr<const TriangleMesh>& mesh = loaded_[key.str()];
  if (mesh) return mesh;
  try {
    mesh = std::make_shared<TriangleMesh>(scaled(load_mesh_as_written(file), scale));
  } catch (const FileError&) {
    throw;
  } catch (const InvalidArgument& error) {
    node.fail(error.what());
  }
  return mesh;
}

}  // namespace dyop::io_internal
