// SPDX-License-Identifier: BSD-3-Clause
#include "io/query/record_shape.h"

#include <array>

#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/sphere.h"
#include "dyop/geometry/triangle_mesh.h"
#include "io/hex_json.h"

namespace dyop::io_internal {
namespace {

Json points_json(std::span<const Vector3> points) {
  Json json = Json::array();
  for (const Vector3& p : points) json.push_back(hex_json(p));
  return json;
}

std::vector<Vector3> points_from(const JsonNode& node) {
  std::vector<Vector3> points;
  for (const JsonNode& item : node.items(1)) points.push_back(hex_vector(item));
  return points;
}

std::int32_t vertex_number(const Json& json, const JsonNode& node) {
  const bool fits = json.is_number_integer() && json >= 0 && json < (std::int64_t{1} << 31);
  if (!fits) node.fail_expected("three vertex numbers");
  return json.get<std::int32_t>();
}

TriangleIndices triangle_from(const JsonNode& node) {
  const Json& json = node.value();
  if (!json.is_array() || json.size() != 3) node.fail_expected("three vertex numbers");
  return {vertex_number(json[0], node), vertex_number(json[1], node), vertex_number(json[2], node)};
}

std::shared_ptr<const Shape> recorded_mesh(const JsonNode& node) {
  node.require_object({"kind", "vertices", "triangles"});
  std::vector<TriangleIndices> triangles;
  for (const JsonNode& item : node.at("triangles").items(1)) {
    triangles.push_back(triangle_from(item));
  }
  return std::make_shared<TriangleMesh>(points_from(node.at("vertices")), std::move(triangles));
}

std::shared_ptr<const Shape> recorded_hull(const JsonNode& node) {
  node.require_object({"kind", "points"});
  return std::make_shared<ConvexHull>(points_from(node.at("points")));
}

std::shared_ptr<const Shape> recorded_box(const JsonNode& node) {
  node.require_object({"kind", "half_extents"});
  return std::make_shared<Box>(hex_vector(node.at("half_extents")));
}

std::shared_ptr<const Shape> recorded_sphere(const JsonNode& node) {
  node.require_object({"kind", "radius"});
  return std::make_shared<Sphere>(hex_number(node.at("radius")));
}

std::shared_ptr<const Shape> recorded_capsule(const JsonNode& node) {
  node.require_object({"kind", "radius", "half_length"});
  return std::make_shared<Capsule>(hex_number(node.at("radius")),
                                   hex_number(node.at("half_length")));
}

}  // namespace

Json record_shape(const Shape& shape) {
  Json json;
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape)) {
    json["kind"] = "mesh";
    json["vertices"] = points_json(mesh->vertices());
    json["triangles"] = Json::array();
    for (const TriangleIndices& t : mesh->triangles()) json["triangles"].push_back(Json(t));
  } else if (const auto* hull = dynamic_cast<const ConvexHull*>(&shape)) {
    json["kind"] = "hull";
    json["points"] = points_json(hull->vertices());
  } else if (const auto* box = dynamic_cast<const Box*>(&shape)) {
    json["kind"] = "box";
    json["half_extents"] = hex_json(box->half_extents());
  } else if (const auto* sphere = dynamic_cast<const Sphere*>(&shape)) {
    json["kind"] = "sphere";
    json["radius"] = hex_json(sphere->radius());
  } else if (const auto* capsule = dynamic_cast<const Capsule*>(&shape)) {
    json["kind"] = "capsule";
    json["radius"] = hex_json(capsule->radius());
    json["half_length"] = hex_json(capsule->half_length());
  } else {
    throw InvalidArgument(
        "a shape that is not a mesh, hull, box, sphere or capsule of dyop cannot be recorded");
  }
  return json;
}

std::shared_ptr<const Shape> recorded_shape(const JsonNode& node) {
  using Read = std::shared_ptr<const Shape> (*)(const JsonNode&);
  const Read read = node.at("kind").choice<Read>({{"mesh", &recorded_mesh},
                                                  {"hull", &recorded_hull},
                                                  {"box", &recorded_box},
                                                  {"sphere", &recorded_sphere},
                                                  {"capsule", &recorded_capsule}});
  return node.guard([&] { return read(node); });
}

}  // namespace dyop::io_internal
