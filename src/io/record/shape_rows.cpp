// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/shape_rows.h"

#include <algorithm>
#include <cstring>

#include "dyop/core/error.h"
#include "geometry/shape_forms.h"
#include "io/digest.h"

namespace dyop::io_internal {
namespace {

using geometry_internal::FormedShape;
using geometry_internal::ShapeForm;
using geometry_internal::ShapeNumber;
using geometry_internal::ShapeSink;
using geometry_internal::visit_shape;

template <typename Number>
void put(std::string& bytes, std::span<const Number> numbers) {
  if (numbers.empty()) return;
  bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
}

void put(std::string& bytes, const Vector3& v) {
  put(bytes, std::span<const Scalar>(v.data(), 3));
}

void put_mesh(std::string& bytes, std::span<const Vector3> vertices,
              std::span<const TriangleIndices> triangles) {
  for (const Vector3& v : vertices) put(bytes, v);
  for (const TriangleIndices& t : triangles) put(bytes, std::span<const std::int32_t>(t));
}

void put_pose(std::string& bytes, const RigidPose& X) {
  for (Eigen::Index i = 0; i < 3; ++i) put(bytes, Vector3(X.rotation().row(i)));
  put(bytes, X.translation());
}

// A key with all that defines a shape: equal for shapes that behave the same.
std::string content_of(const Shape& shape) {
  std::string bytes;
  visit_shape(shape, ShapeSink{[&](const TriangleMesh& mesh) {
                                 bytes = "mesh";
                                 put_mesh(bytes, mesh.vertices(), mesh.triangles());
                               },
                               [&](const ConvexHull& hull) {
                                 bytes = "hull";
                                 put_mesh(bytes, hull.vertices(), {});
                               },
                               [&](const CompoundShape& compound) {
                                 bytes = "compound";
                                 for (const CompoundChild& child : compound.children()) {
                                   bytes += content_of(*child.shape);
                                   put_pose(bytes, child.X_CS);
                                 }
                               },
                               [&](const FormedShape& formed) {
                                 bytes = formed.form->name;
                                 std::vector<Scalar> values = formed.values;
                                 values.resize(3 * ((values.size() + 2) / 3));  // whole vectors
                                 put(bytes, std::span<const Scalar>(values));
                               }});
  return bytes;
}

std::vector<Vector3> vertices_of(const Json& line, const ShapeRows& rows) {
  const auto first = line.at("first_vertex").get<std::size_t>();
  const auto count = line.at("vertex_count").get<std::size_t>();
  DYOP_REQUIRE(first <= rows.vertices.size() && count <= rows.vertices.size() - first,
               "the vertices of a shape are missing");
  std::vector<Vector3> vertices;
  vertices.reserve(count);
  for (std::size_t k = first; k < first + count; ++k) {
    vertices.emplace_back(rows.vertices[k][0], rows.vertices[k][1], rows.vertices[k][2]);
  }
  return vertices;
}

void put_form(Json& line, const FormedShape& formed) {
  line["kind"] = formed.form->name;
  formed.for_each_number([&](std::string_view name, std::span<const Scalar> values) {
    line[std::string(name)] = values.size() == 1
                                  ? Json(values[0])
                                  : Json(std::vector<Scalar>(values.begin(), values.end()));
  });
}

std::shared_ptr<const Shape> form_from(const ShapeForm& form, const Json& line) {
  std::vector<Scalar> values;
  for (const ShapeNumber& number : form.numbers) {
    const Json& json = line.at(std::string(number.name));
    for (std::size_t k = 0; k < number.count; ++k)
      values.push_back((number.count == 1 ? json : json.at(k)).get<Scalar>());
  }
  return form.make(values);
}

std::shared_ptr<const Shape> mesh_from(const Json& line, const ShapeRows& rows) {
  const auto first = line.at("first_triangle").get<std::size_t>();
  const auto count = line.at("triangle_count").get<std::size_t>();
  DYOP_REQUIRE(first <= rows.triangles.size() && count <= rows.triangles.size() - first,
               "the triangles of a shape are missing");
  std::vector<TriangleIndices> triangles(count);
  std::copy_n(rows.triangles.begin() + std::ptrdiff_t(first), count, triangles.begin());
  return std::make_shared<TriangleMesh>(vertices_of(line, rows), std::move(triangles));
}

}  // namespace

Json pose_numbers(const RigidPose& X) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) json.push_back(X.rotation()(i, j));
  }
  for (const Scalar x : X.translation()) json.push_back(x);
  return json;
}

RigidPose pose_from_numbers(const Json& json) {
  const auto x = json.get<std::vector<Scalar>>();
  DYOP_REQUIRE(x.size() == 12, "a pose has 12 numbers, not ", x.size());
  Matrix3 R;
  for (std::size_t k = 0; k < 9; ++k) R(Eigen::Index(k / 3), Eigen::Index(k % 3)) = x[k];
  return RigidPose::from_trusted(R, Vector3(x[9], x[10], x[11]));
}

std::uint64_t content_hash(const Shape& shape) {
  return digest_of(content_of(shape));
}

std::size_t ShapeWriter::add(const std::shared_ptr<const Shape>& shape, std::string& lines,
                             ShapeRows& rows) {
  const auto same = std::find_if(stored_.begin(), stored_.end(),
                                 [&](const Stored& stored) { return stored.shape == shape; });
  if (same != stored_.end()) return std::size_t(same - stored_.begin());
  const std::string content = content_of(*shape);
  const std::uint64_t hash = digest_of(content);
  for (std::size_t k = 0; k < stored_.size(); ++k) {
    if (stored_[k].hash == hash && content_of(*stored_[k].shape) == content) return k;
  }
  Json line;
  line["hash"] = hex_digits(hash);
  const auto put_surface = [&](const char* kind, const TriangleMesh& surface) {
    line["kind"] = kind;
    line["first_vertex"] = vertex_count_;
    line["vertex_count"] = surface.vertices().size();
    line["first_triangle"] = triangle_count_;
    line["triangle_count"] = surface.triangles().size();
    for (const Vector3& v : surface.vertices()) rows.vertices.push_back({v.x(), v.y(), v.z()});
    rows.triangles.insert(rows.triangles.end(), surface.triangles().begin(),
                          surface.triangles().end());
    vertex_count_ += surface.vertices().size();
    triangle_count_ += surface.triangles().size();
  };
  visit_shape(
      *shape,
      ShapeSink{
          [&](const TriangleMesh& mesh) { put_surface("mesh", mesh); },
          [&](const ConvexHull& hull) { put_surface("hull", *hull.core_surface()); },
          [&](const CompoundShape& compound) {
            line["kind"] = "compound";
            line["children"] = Json::array();
            for (const CompoundChild& child : compound.children()) {
              const std::size_t number = add(child.shape, lines, rows);
              line["children"].push_back({{"shape", number}, {"X_CS", pose_numbers(child.X_CS)}});
            }
          },
          [&](const FormedShape& formed) { put_form(line, formed); }});
  lines += line.dump() + '\n';
  stored_.push_back({shape, hash});
  return stored_.size() - 1;
}

std::shared_ptr<const Shape> shape_from(const Json& line, const ShapeRows& rows,
                                        std::span<const std::shared_ptr<const Shape>> earlier) {
  const auto kind = line.at("kind").get<std::string>();
  if (kind == "mesh") return mesh_from(line, rows);
  if (kind == "hull") return std::make_shared<ConvexHull>(vertices_of(line, rows));
  if (const auto* form = geometry_internal::find_shape_form(kind)) return form_from(*form, line);
  DYOP_REQUIRE(kind == "compound", "unknown kind of shape ", kind);
  std::vector<CompoundChild> children;
  for (const Json& child : line.at("children")) {
    const auto number = child.at("shape").get<std::size_t>();
    DYOP_REQUIRE(number < earlier.size(), "a compound names the shape ", number,
                 ", which comes after it");
    children.push_back({earlier[number], pose_from_numbers(child.at("X_CS"))});
  }
  return std::make_shared<CompoundShape>(children);
}

}  // namespace dyop::io_internal
