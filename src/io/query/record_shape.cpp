// SPDX-License-Identifier: BSD-3-Clause
#include "io/query/record_shape.h"

#include "dyop/core/error.h"
#include "geometry/shape_forms.h"
#include "io/hex_json.h"

namespace dyop::io_internal {
namespace {

using geometry_internal::FormedShape;
using geometry_internal::ShapeForm;
using geometry_internal::ShapeNumber;
using geometry_internal::ShapeSink;

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

Json form_json(const FormedShape& shape) {
  Json json{{"kind", shape.form->name}};
  shape.for_each_number([&](std::string_view name, std::span<const Scalar> values) {
    json[std::string(name)] = values.size() == 1
                                  ? hex_json(values[0])
                                  : hex_json(Vector3(values[0], values[1], values[2]));
  });
  return json;
}

std::shared_ptr<const Shape> recorded_form(const ShapeForm& form, const JsonNode& node) {
  std::vector<std::string_view> keys{"kind"};
  for (const ShapeNumber& number : form.numbers) keys.push_back(number.name);
  node.require_object(keys);
  std::vector<Scalar> values;
  for (const ShapeNumber& number : form.numbers) {
    if (number.count == 1) {
      values.push_back(hex_number(node.at(number.name)));
    } else {
      const Vector3 vector = hex_vector(node.at(number.name));
      values.insert(values.end(), vector.begin(), vector.end());
    }
  }
  return form.make(values);
}

}  // namespace

Json record_shape(const Shape& shape) {
  return geometry_internal::visit_shape(
      shape, ShapeSink{[](const TriangleMesh& mesh) {
                         Json json{{"kind", "mesh"}, {"vertices", points_json(mesh.vertices())}};
                         json["triangles"] = Json::array();
                         for (const TriangleIndices& t : mesh.triangles())
                           json["triangles"].push_back(Json(t));
                         return json;
                       },
                       [](const ConvexHull& hull) {
                         return Json{{"kind", "hull"}, {"points", points_json(hull.vertices())}};
                       },
                       [](const CompoundShape&) -> Json {
                         throw InvalidArgument("a compound cannot be recorded in a query");
                       },
                       [](const FormedShape& formed) { return form_json(formed); }});
}

std::shared_ptr<const Shape> recorded_shape(const JsonNode& node) {
  const JsonNode kind = node.at("kind");
  const std::string name = kind.text();
  return node.guard([&]() -> std::shared_ptr<const Shape> {
    if (name == "mesh") return recorded_mesh(node);
    if (name == "hull") return recorded_hull(node);
    if (const ShapeForm* form = geometry_internal::find_shape_form(name))
      return recorded_form(*form, node);
    std::string names = "one of mesh, hull";
    for (const ShapeForm& form : geometry_internal::shape_forms())
      names.append(", ").append(form.name);
    kind.fail_expected(names);
  });
}

}  // namespace dyop::io_internal
