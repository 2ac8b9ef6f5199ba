// SPDX-License-Identifier: BSD-3-Clause
#include "io/scene/shape_reader.h"

#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/sphere.h"
#include "dyop/io/mesh_file.h"

namespace dyop::io_internal {
namespace {

ShapeReader::NamedShape read_sphere(const JsonNode& node) {
  node.require_object({"radius"});
  return {std::make_shared<Sphere>(node.at("radius").positive_number()), "sphere"};
}

ShapeReader::NamedShape read_box(const JsonNode& node) {
  node.require_object({"half_extents"});
  const JsonNode extents = node.at("half_extents");
  const Vector3 half_extents = extents.vector3();
  return {extents.guard([&] { return std::make_shared<Box>(half_extents); }), "box"};
}

ShapeReader::NamedShape read_capsule(const JsonNode& node) {
  node.require_object({"radius", "half_length"});
  return {std::make_shared<Capsule>(node.at("radius").positive_number(),
                                    node.at("half_length").non_negative_number()),
          "capsule"};
}

}  // namespace

ShapeReader::NamedShape ShapeReader::read(const JsonNode& node, bool is_shell) {
  node.require_object({"mesh", "scale", "center", "sphere", "box", "capsule", "hull"});
  constexpr std::string_view kKinds = "mesh, sphere, box, capsule, hull";
  const int count = node.has("mesh") + node.has("sphere") + node.has("box") + node.has("capsule") +
                    node.has("hull");
  if (count != 1) {
    node.fail("expected exactly one of " + std::string(kKinds) + ", found " +
              std::to_string(count));
  }
  return node.guard([&] {
    if (node.has("mesh")) return read_mesh(node, is_shell);
    for (const std::string_view key : {"scale", "center"}) {
      if (node.has(key)) node.at(key).fail("only a mesh can have this key");
    }
    if (node.has("sphere")) return read_sphere(node.at("sphere"));
    if (node.has("box")) return read_box(node.at("box"));
    if (node.has("capsule")) return read_capsule(node.at("capsule"));
    return read_hull(node.at("hull"));
  });
}

ShapeReader::NamedShape ShapeReader::read_mesh(const JsonNode& node, bool is_shell) {
  const auto mesh = std::make_shared<TriangleMesh>(read_placed_mesh(node, is_shell));
  return {mesh, "mesh " + std::filesystem::path(node.at("mesh").text()).filename().string() + ", " +
                    std::to_string(mesh->triangles().size()) + " triangles"};
}

ShapeReader::NamedShape ShapeReader::read_hull(const JsonNode& node) {
  node.require_object({"points", "mesh", "scale", "center"});
  if (node.has("points") == node.has("mesh")) node.fail("expected either points or mesh");
  std::vector<Vector3> points;
  if (node.has("points")) {
    for (const std::string_view key : {"scale", "center"}) {
      if (node.has(key)) node.at(key).fail("only a mesh can have this key");
    }
    for (const JsonNode& point : node.at("points").items(1)) points.push_back(point.vector3());
  } else {
    const TriangleMesh mesh = read_placed_mesh(node, /*is_shell=*/false);
    points.assign(mesh.vertices().begin(), mesh.vertices().end());
  }
  return {std::make_shared<ConvexHull>(std::move(points)), "convex hull"};
}

TriangleMesh ShapeReader::read_placed_mesh(const JsonNode& node, bool is_shell) {
  MeshPlacement placement;
  placement.is_shell = is_shell;
  if (node.has("scale")) placement.scale = node.at("scale").positive_number();
  if (node.has("center")) {
    placement.center = node.at("center").choice<MeshCenter>(
        {{"none", MeshCenter::None}, {"bounds", MeshCenter::Bounds}, {"mass", MeshCenter::Mass}});
  }
  return place_mesh(load(node.at("mesh")), placement);
}

const TriangleMesh& ShapeReader::load(const JsonNode& node) {
  const std::filesystem::path file = find(node);
  const auto found = loaded_.find(file);
  if (found != loaded_.end()) return found->second;
  try {
    return loaded_.emplace(file, load_mesh(file)).first->second;
  } catch (const FileError& error) {
    node.fail(error.what());
  }
}

std::filesystem::path ShapeReader::find(const JsonNode& node) const {
  const std::filesystem::path wanted = node.text();
  std::string places;
  for (const std::filesystem::path& directory : directories_) {
    // Joining with an absolute path gives that path.
    const std::filesystem::path candidate = directory / wanted;
    std::error_code error;
    if (std::filesystem::exists(candidate, error)) return candidate;
    const std::string place =
        candidate.parent_path().empty() ? "." : candidate.parent_path().string();
    if (places.find(place) == std::string::npos) places += (places.empty() ? "" : ", ") + place;
  }
  node.fail("no mesh file " + wanted.filename().string() + " in " + places);
}

}  // namespace dyop::io_internal
