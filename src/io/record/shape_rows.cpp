// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/shape_rows.h"

#include <algorithm>
#include <cstring>

#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/sphere.h"

namespace dyop::io_internal {
namespace {

// FNV-1a, 64 bits.
std::uint64_t hash_of(const std::string& bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char byte : bytes) {
    hash ^= static_cast<unsigned char>(byte);
    hash *= 0x100000001b3u;
  }
  return hash;
}

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

// A key with all that defines a shape: equal for shapes that behave the same.
std::string content_of(const Shape& shape) {
  std::string bytes;
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape)) {
    bytes = "mesh";
    put_mesh(bytes, mesh->vertices(), mesh->triangles());
  } else if (const auto* hull = dynamic_cast<const ConvexHull*>(&shape)) {
    bytes = "hull";
    put_mesh(bytes, hull->vertices(), {});
  } else if (const auto* box = dynamic_cast<const Box*>(&shape)) {
    bytes = "box";
    put(bytes, box->half_extents());
  } else if (const auto* sphere = dynamic_cast<const Sphere*>(&shape)) {
    bytes = "sphere";
    put(bytes, Vector3(sphere->radius(), 0, 0));
  } else if (const auto* capsule = dynamic_cast<const Capsule*>(&shape)) {
    bytes = "capsule";
    put(bytes, Vector3(capsule->radius(), capsule->half_length(), 0));
  } else if (const auto* compound = dynamic_cast<const CompoundShape*>(&shape)) {
    bytes = "compound";
    for (const CompoundChild& child : compound->children()) {
      bytes += content_of(*child.shape);
      for (Eigen::Index i = 0; i < 3; ++i) put(bytes, Vector3(child.X_CS.rotation().row(i)));
      put(bytes, child.X_CS.translation());
    }
  } else {
    throw InvalidArgument("a shape that is none of dyop's own cannot be recorded");
  }
  return bytes;
}

std::string hex_digits(std::uint64_t value) {
  std::string digits(16, '0');
  for (std::size_t i = digits.size(); i-- > 0; value >>= 4)
    digits[i] = "0123456789abcdef"[value & 15u];
  return digits;
}

Json numbers_json(const Vector3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Vector3 vector_from(const Json& json) {
  return {json.at(0).get<Scalar>(), json.at(1).get<Scalar>(), json.at(2).get<Scalar>()};
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
  return hash_of(content_of(shape));
}

std::size_t ShapeWriter::add(const std::shared_ptr<const Shape>& shape, std::string& lines,
                             ShapeRows& rows) {
  const auto same = std::find_if(stored_.begin(), stored_.end(),
                                 [&](const Stored& stored) { return stored.shape == shape; });
  if (same != stored_.end()) return std::size_t(same - stored_.begin());
  const std::string content = content_of(*shape);
  const std::uint64_t hash = hash_of(content);
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
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(shape.get())) {
    put_surface("mesh", *mesh);
  } else if (const auto* hull = dynamic_cast<const ConvexHull*>(shape.get())) {
    put_surface("hull", *hull->core_surface());
  } else if (const auto* box = dynamic_cast<const Box*>(shape.get())) {
    line["kind"] = "box";
    line["half_extents"] = numbers_json(box->half_extents());
  } else if (const auto* sphere = dynamic_cast<const Sphere*>(shape.get())) {
    line["kind"] = "sphere";
    line["radius"] = sphere->radius();
  } else if (const auto* capsule = dynamic_cast<const Capsule*>(shape.get())) {
    line["kind"] = "capsule";
    line["radius"] = capsule->radius();
    line["half_length"] = capsule->half_length();
  } else {
    line["kind"] = "compound";
    line["children"] = Json::array();
    for (const CompoundChild& child : dynamic_cast<const CompoundShape&>(*shape).children()) {
      const std::size_t number = add(child.shape, lines, rows);
      line["children"].push_back({{"shape", number}, {"X_CS", pose_numbers(child.X_CS)}});
    }
  }
  lines += line.dump() + '\n';
  stored_.push_back({shape, hash});
  return stored_.size() - 1;
}

std::shared_ptr<const Shape> shape_from(const Json& line, const ShapeRows& rows,
                                        std::span<const std::shared_ptr<const Shape>> earlier) {
  const auto kind = line.at("kind").get<std::string>();
  if (kind == "mesh") return mesh_from(line, rows);
  if (kind == "hull") return std::make_shared<ConvexHull>(vertices_of(line, rows));
  if (kind == "box") return std::make_shared<Box>(vector_from(line.at("half_extents")));
  if (kind == "sphere") return std::make_shared<Sphere>(line.at("radius").get<Scalar>());
  if (kind == "capsule") {
    return std::make_shared<Capsule>(line.at("radius").get<Scalar>(),
                                     line.at("half_length").get<Scalar>());
  }
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
