// SPDX-License-Identifier: BSD-3-Clause
#include "io/robot/robot_shapes.h"

#include <algorithm>
#include <charconv>
#include <sstream>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "io/mesh/mesh_reader.h"

namespace dyop::io_internal {
namespace {

std::shared_ptr<const Shape> read_shape(const XmlNode& node, MeshFinder& meshes) {
  const std::string kind = node.name();
  if (kind == "mesh") {
    return meshes.load(node, "filename", node.text("filename"),
                       node.vector3_or("scale", Vector3::Ones()));
  }
  if (kind == "box") {
    const Vector3 size = node.vector3("size");
    if (!(size.array() > 0).all()) node.fail_expected("size", "three numbers > 0");
    return std::make_shared<Box>(Vector3(size / 2));
  }
  const Scalar radius = node.positive("radius");
  if (kind == "sphere") return std::make_shared<Sphere>(radius);
  const Scalar half_length = node.positive("length") / 2;
  if (kind == "capsule") return std::make_shared<Capsule>(radius, half_length);
  return std::make_shared<Cylinder>(radius, half_length);
}

std::shared_ptr<const Shape> read_collision(const XmlNode& collision, MeshFinder& meshes) {
  const XmlNode geometry = collision.at("geometry");
  std::vector<XmlNode> nodes;
  for (const char* kind : {"mesh", "box", "sphere", "cylinder", "capsule"}) {
    for (const XmlNode& node : geometry.all(kind)) nodes.push_back(node);
  }
  if (nodes.empty())
    geometry.fail("expected one of <mesh>, <box>, <sphere>, <cylinder>, <capsule>");
  if (nodes.size() > 1) geometry.fail("expected one shape: others need a <collision> each");
  try {
    return read_shape(nodes.front(), meshes);
  } catch (const InvalidArgument& error) {
    nodes.front().fail(error.what());
  }
}

bool is_identity(const RigidPose& X) {
  return X.rotation() == Matrix3::Identity() && X.translation() == Vector3::Zero();
}

}  // namespace

std::shared_ptr<const Shape> joined(const std::vector<CompoundChild>& children) {
  if (children.size() == 1 && is_identity(children[0].X_CS)) return children[0].shape;
  return std::make_shared<CompoundShape>(children);
}

LinkShape read_link_shape(const XmlNode& link, MeshFinder& meshes) {
  std::vector<CompoundChild> children;
  bool has_mesh = false;
  bool is_closed = true;
  for (const XmlNode& collision : link.all("collision")) {
    children.push_back({read_collision(collision, meshes), collision.origin()});
    if (const auto* mesh = dynamic_cast<const TriangleMesh*>(children.back().shape.get())) {
      has_mesh = true;
      is_closed = is_closed && mesh->is_closed();
    }
  }
  if (children.empty()) return {};
  try {
    return {joined(children), has_mesh && is_closed};
  } catch (const InvalidArgument& error) {
    link.fail(error.what());
  }
}

namespace {

using core_internal::compose_message;

// Folders above the robot's file that may hold its package: packages keep their robots one to three
// folders deep.
constexpr int kFoldersAbove = 5;
// Files looked at in the search for a mesh that is not where the robot's file says.
constexpr int kMostEntries = 20'000;

bool is_file(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

// Without the escapes of a URI, such as %20 for a blank.
std::string unescaped(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned char byte = 0;
    const char* const digits = text.data() + i + 1;
    const bool is_escape = text[i] == '%' && i + 2 < text.size() &&
                           std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2;
    result += is_escape ? char(byte) : text[i];
    if (is_escape) i += 2;
  }
  return result;
}

// How many of the last folders and names two paths have in common.
int common_end(const std::filesystem::path& a, const std::filesystem::path& b) {
  const std::vector<std::filesystem::path> parts_a(a.begin(), a.end());
  const std::vector<std::filesystem::path> parts_b(b.begin(), b.end());
  const auto [end, other] =
      std::mismatch(parts_a.rbegin(), parts_a.rend(), parts_b.rbegin(), parts_b.rend());
  return int(end - parts_a.rbegin());
}

}  // namespace

MeshFinder::MeshFinder(const std::filesystem::path& file,
                       std::vector<std::filesystem::path> package_paths)
    : folder_(std::filesystem::absolute(file).lexically_normal().parent_path()),
      paths_(std::move(package_paths)) {
  std::filesystem::path folder = folder_;
  for (int k = 0; k <= kFoldersAbove && !folder.empty(); ++k) {
    paths_.push_back(folder);
    if (folder == folder.parent_path()) break;
    folder = folder.parent_path();
  }
}

MeshFinder::MeshName MeshFinder::parse_name(const XmlNode& node, const char* attribute,
                                            const std::string& name) {
  const std::size_t scheme = name.find("://");
  if (scheme == std::string::npos) return {"", name};
  const std::string kind = name.substr(0, scheme);
  const std::string rest = name.substr(scheme + 3);
  if (kind == "file") return {"", rest};
  if (kind != "package" && kind != "model") {
    node.fail_expected(attribute, "a path, package:// or file://");
  }
  const std::size_t slash = rest.find('/');
  if (slash == std::string::npos) node.fail_expected(attribute, "package://NAME/PATH");
  return {rest.substr(0, slash), rest.substr(slash + 1)};
}

std::filesystem::path MeshFinder::find(const XmlNode& node, const char* attribute,
                                       const std::string& name) {
  const auto known = found_.find(name);
  if (known != found_.end()) return known->second;
  const MeshName wanted = parse_name(node, attribute, name);
  std::optional<std::filesystem::path> file = find_in_paths(wanted);
  const bool is_uri = name.find("://") != std::string::npos;
  if (!file && is_uri) file = find_in_paths(parse_name(node, attribute, unescaped(name)));
  if (!file) file = find_by_name(node, attribute, name, wanted.path);
  return found_[name] = *file;
}

std::optional<std::filesystem::path> MeshFinder::find_in_paths(const MeshName& wanted) const {
  if (wanted.path.is_absolute() && is_file(wanted.path)) return wanted.path;
  const std::filesystem::path relative = wanted.path.relative_path();
  for (const std::filesystem::path& folder : paths_) {
    for (const std::filesystem::path& file :
         {folder / wanted.package / relative, folder / relative}) {
      if (is_file(file)) return file;
    }
  }
  return std::nullopt;
}

// Below the robot's folder, the file of this name whose last folders agree best.
std::filesystem::path MeshFinder::find_by_name(const XmlNode& node, const char* attribute,
                                               const std::string& name,
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
    node.fail(compose_message(attribute, ": '", name, "' is in none of ", paths_.size(),
                              " search paths, nor below '", folder_.string(), "'"));
  }
  if (best.size() > 1) {
    std::sort(best.begin(), best.end());
    node.fail(compose_message(attribute, ": '", name, "' could be '", best[0].string(), "' or '",
                              best[1].string(), "'"));
  }
  notes_.push_back(compose_message("'", name, "' was found as '", best[0].string(), "'"));
  return best[0];
}

std::shared_ptr<const TriangleMesh> MeshFinder::load(const XmlNode& node, const char* attribute,
                                                     const std::string& name,
                                                     const Vector3& scale) {
  const std::filesystem::path file = find(node, attribute, name);
  if (!(scale.array() != 0).all()) node.fail_expected("scale", "three numbers other than 0");
  std::ostringstream key;
  key << std::hexfloat << file.string() << ' ' << scale.transpose();
  std::shared_ptr<const TriangleMesh>& mesh = loaded_[key.str()];
  if (mesh) return mesh;
  try {
    mesh = std::static_pointer_cast<const TriangleMesh>(scaled(load_mesh_as_written(file), scale));
  } catch (const FileError&) {
    throw;
  } catch (const InvalidArgument& error) {
    node.fail(error.what());
  }
  return mesh;
}

}  // namespace dyop::io_internal
