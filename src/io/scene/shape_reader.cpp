// SPDX-License-Identifier: BSD-3-Clause
#include "io/scene/shape_reader.h"

#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/occupancy.h"
#include "dyop/io/mesh_file.h"
#include "dyop/io/octree_file.h"
#include "geometry/shape_forms.h"

namespace dyop::io_internal {
namespace {

using geometry_internal::ShapeForm;
using geometry_internal::ShapeNumber;

ShapeReader::NamedShape read_form(const ShapeForm& form, const JsonNode& node) {
  std::vector<std::string_view> names;
  for (const ShapeNumber& number : form.numbers) names.push_back(number.name);
  node.require_object(names);
  std::vector<Scalar> values;
  for (const ShapeNumber& number : form.numbers) {
    const JsonNode value = node.at(number.name);
    if (number.count == 1) {
      values.push_back(value.number());
    } else {
      const Vector3 vector = value.vector3();
      values.insert(values.end(), vector.begin(), vector.end());
    }
  }
  // A single number is what is wrong; of several, the shape says which.
  const JsonNode place = names.size() == 1 ? node.at(names[0]) : node;
  return {place.guard([&] { return form.make(values); }), std::string(form.name)};
}

// A number for all axes, or one for each.
Vector3 factors_of(const JsonNode& scale) {
  if (scale.value().is_array()) return scale.vector3();
  return Vector3::Constant(scale.number());
}

}  // namespace

ShapeReader::NamedShape ShapeReader::read(const JsonNode& node, bool is_shell) {
  std::vector<std::string_view> kinds{"mesh", "hull"};
  for (const ShapeForm& form : geometry_internal::shape_forms()) kinds.push_back(form.name);
  kinds.insert(kinds.end(), {"octree", "point_cloud"});
  std::vector<std::string_view> keys = kinds;
  keys.insert(keys.end(), {"scale", "center"});
  node.require_object(keys);
  std::string names;
  std::string_view kind;
  int count = 0;
  for (const std::string_view name : kinds) {
    names.append(names.empty() ? "" : ", ").append(name);
    if (!node.has(name)) continue;
    kind = name;
    ++count;
  }
  if (count != 1)
    node.fail("expected exactly one of " + names + ", found " + std::to_string(count));
  return node.guard([&] {
    if (kind == "mesh") return read_mesh(node, is_shell);
    if (node.has("center")) node.at("center").fail("only a mesh can have this key");
    NamedShape result = read_of_kind(kind, node);
    if (node.has("scale")) {
      const JsonNode scale = node.at("scale");
      result.shape = scale.guard([&] { return scaled(*result.shape, factors_of(scale)); });
    }
    return result;
  });
}

ShapeReader::NamedShape ShapeReader::read_of_kind(std::string_view kind, const JsonNode& node) {
  if (kind == "hull") return read_hull(node.at(kind));
  if (kind == "octree") return read_octree(node.at(kind));
  if (kind == "point_cloud") return read_point_cloud(node.at(kind));
  return read_form(*geometry_internal::find_shape_form(kind), node.at(kind));
}

ShapeReader::NamedShape ShapeReader::read_mesh(const JsonNode& node, bool is_shell) {
  const auto mesh = std::make_shared<TriangleMesh>(read_placed_mesh(node, is_shell));
  return {mesh, "mesh " + std::filesystem::path(node.at("mesh").text()).filename().string() + ", " +
                    std::to_string(mesh->triangles().size()) + " triangles"};
}

ShapeReader::NamedShape ShapeReader::read_octree(const JsonNode& node) {
  const std::filesystem::path file = find(node, "octree");
  try {
    const std::vector<OccupiedCube> cubes = load_octree(file);
    return {std::make_shared<CompoundShape>(occupancy(cubes)),
            "octree " + file.filename().string() + ", " + std::to_string(cubes.size()) + " cubes"};
  } catch (const FileError& error) {
    node.fail(error.what());
  }
}

ShapeReader::NamedShape ShapeReader::read_point_cloud(const JsonNode& node) {
  node.require_object({"points", "radius"});
  std::vector<Vector3> points;
  for (const JsonNode& point : node.at("points").items(1)) points.push_back(point.vector3());
  const Scalar radius = node.at("radius").positive_number();
  return {std::make_shared<CompoundShape>(point_cloud(points, radius)),
          "point cloud, " + std::to_string(points.size()) + " points"};
}

ShapeReader::NamedShape ShapeReader::read_hull(const JsonNode& node) {
  node.require_object({"points", "mesh", "scale", "center", "radius"});
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
  const Scalar radius = node.has("radius") ? node.at("radius").positive_number() : 0;
  return node.guard([&]() -> NamedShape {
    return {std::make_shared<ConvexHull>(std::move(points), radius), "convex hull"};
  });
}

TriangleMesh ShapeReader::read_placed_mesh(const JsonNode& node, bool is_shell) {
  MeshPlacement placement;
  placement.is_shell = is_shell;
  std::shared_ptr<const TriangleMesh> stretched;
  if (node.has("scale")) {
    const JsonNode scale = node.at("scale");
    if (scale.value().is_array()) {
      stretched = scale.guard([&] {
        return std::static_pointer_cast<const TriangleMesh>(
            scaled(load(node.at("mesh")), scale.vector3()));
      });
    } else {
      placement.scale = scale.positive_number();
    }
  }
  if (node.has("center")) {
    placement.center = node.at("center").choice<MeshCenter>(
        {{"none", MeshCenter::None}, {"bounds", MeshCenter::Bounds}, {"mass", MeshCenter::Mass}});
  }
  return place_mesh(stretched ? *stretched : load(node.at("mesh")), placement);
}

const TriangleMesh& ShapeReader::load(const JsonNode& node) {
  const std::filesystem::path file = find(node, "mesh");
  const auto found = loaded_.find(file);
  if (found != loaded_.end()) return found->second;
  try {
    return loaded_.emplace(file, load_mesh(file, {}, vertices_)).first->second;
  } catch (const FileError& error) {
    node.fail(error.what());
  }
}

std::filesystem::path ShapeReader::find(const JsonNode& node, const std::string& kind) const {
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
  node.fail("no " + kind + " file " + wanted.filename().string() + " in " + places);
}

}  // namespace dyop::io_internal
