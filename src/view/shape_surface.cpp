// SPDX-License-Identifier: BSD-3-Clause
#include "view/shape_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/half_space.h"

namespace dyop::view_internal {
namespace {

ShapeSurface octahedron() {
  return {{Vector3::UnitX(), -Vector3::UnitX(), Vector3::UnitY(), -Vector3::UnitY(),
           Vector3::UnitZ(), -Vector3::UnitZ()},
          {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
}

// Each triangle becomes four, its new corners on the unit sphere.
ShapeSurface subdivided(const ShapeSurface& sphere) {
  ShapeSurface finer{sphere.vertices, {}};
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
  const auto middle = [&](std::int32_t i, std::int32_t j) {
    const auto [entry, is_new] =
        middles.try_emplace(std::minmax(i, j), std::int32_t(finer.vertices.size()));
    if (is_new) {
      finer.vertices.push_back(
          (sphere.vertices[std::size_t(i)] + sphere.vertices[std::size_t(j)]).normalized());
    }
    return entry->second;
  };
  for (const TriangleIndices& t : sphere.triangles) {
    const auto m = std::array{middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
    finer.triangles.push_back({t[0], m[0], m[2]});
    finer.triangles.push_back({m[0], t[1], m[1]});
    finer.triangles.push_back({m[2], m[1], t[2]});
    finer.triangles.push_back({m[0], m[1], m[2]});
  }
  return finer;
}

void add_part(const ShapeSurface& part, ShapeSurface& surface) {
  const auto first = std::int32_t(surface.vertices.size());
  surface.vertices.insert(surface.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (const TriangleIndices& t : part.triangles) {
    surface.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

// A rod with four sides and pointed ends; of no length, an octahedron.
ShapeSurface rod_between(const Vector3& a, const Vector3& b, Scalar radius) {
  const Vector3 along = b - a;
  const Vector3 z = along.norm() > 0 ? along.normalized() : Vector3::UnitZ();
  const Vector3 x = z.unitOrthogonal();
  const Vector3 y = z.cross(x);
  ShapeSurface rod;
  for (const Vector3& end : {a, b}) {
    for (const Vector3& side : {x, y, Vector3(-x), Vector3(-y)}) {
      rod.vertices.push_back(end + radius * side);
    }
  }
  rod.vertices.push_back(a - radius * z);
  rod.vertices.push_back(b + radius * z);
  for (std::int32_t k = 0; k < 4; ++k) {
    const std::int32_t next = (k + 1) % 4;
    rod.triangles.insert(
        rod.triangles.end(),
        {{k, next, k + 4}, {next, next + 4, k + 4}, {8, next, k}, {9, k + 4, next + 4}});
  }
  return rod;
}

// So thick, over the mesh, are segments and points drawn, which have no area.
constexpr Scalar kDrawnThickness = 0.01;

using Segment = std::pair<std::int32_t, std::int32_t>;

bool has_equal_corners(const Triangle& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

// The ends of triangles that have no area, each once.
std::set<Segment> segments_of(const TriangleMesh& mesh) {
  std::set<Segment> segments;
  for (std::size_t k = 0; k < mesh.triangles().size(); ++k) {
    const Triangle corners = mesh.triangle(std::int32_t(k));
    if (!has_equal_corners(corners)) continue;
    const TriangleIndices& t = mesh.triangles()[k];
    segments.insert(std::minmax({t[0], corners[0] == corners[1] ? t[2] : t[1]}));
  }
  return segments;
}

// Leaves out sides and corners of other triangles, as files of surfaces repeat them.
void drop_seen(const TriangleMesh& mesh, std::set<Segment>& segments) {
  for (std::size_t k = 0; k < mesh.triangles().size() && !segments.empty(); ++k) {
    if (has_equal_corners(mesh.triangle(std::int32_t(k)))) continue;
    const TriangleIndices& t = mesh.triangles()[k];
    for (std::size_t i = 0; i < 3; ++i) {
      segments.erase(std::minmax({t[i], t[(i + 1) % 3]}));
      segments.erase({t[i], t[i]});
    }
  }
}

// After the triangles themselves, which keep their numbers.
void add_wires(const TriangleMesh& mesh, ShapeSurface& surface) {
  std::set<Segment> segments = segments_of(mesh);
  drop_seen(mesh, segments);
  const Scalar size = mesh.bounding_box().sizes().norm();
  const Scalar radius = kDrawnThickness / 2 * (size > 0 ? size : 1);
  for (const auto& [a, b] : segments) {
    add_part(rod_between(mesh.vertices()[std::size_t(a)], mesh.vertices()[std::size_t(b)], radius),
             surface);
  }
}

ShapeSurface surface_of_mesh(const TriangleMesh& mesh) {
  ShapeSurface surface{{mesh.vertices().begin(), mesh.vertices().end()},
                       {mesh.triangles().begin(), mesh.triangles().end()}};
  add_wires(mesh, surface);
  return surface;
}

ShapeSurface surface_of_convex(const ConvexShape& shape, int fineness) {
  const TriangleMesh* core = shape.core_surface();
  if (core != nullptr && !(shape.rounding_radius() > 0)) return surface_of_mesh(*core);
  ShapeSurface surface = octahedron();
  for (int k = 0; k < fineness; ++k) surface = subdivided(surface);
  // Slightly tilted: no direction is exactly normal to an axis, where a support point is not
  // unique.
  const Matrix3 tilt = rotation_from_vector(Vector3(0.01, 0.013, 0.017));
  for (Vector3& v : surface.vertices) v = shape.support(tilt * v);
  return surface;
}

ShapeSurface plate_of(const HalfSpace& half_space, Scalar plate) {
  const Vector3 x = plate * half_space.normal().unitOrthogonal();
  const Vector3 y = half_space.normal().cross(x);
  const Vector3 middle = half_space.offset() * half_space.normal();
  return {{middle - x - y, middle + x - y, middle + x + y, middle - x + y}, {{0, 1, 2}, {0, 2, 3}}};
}

ShapeSurface surface_of_compound(const CompoundShape& compound, int fineness) {
  ShapeSurface all;
  for (const CompoundChild& child : compound.children()) {
    ShapeSurface part = surface_of(*child.shape, fineness, 0);
    for (Vector3& p : part.vertices) p = child.X_CS * p;
    add_part(part, all);
  }
  return all;
}

// Maps small differences of either sign, modulo 2^Bits, which the page undoes, to small numbers.
template <int Bits>
std::uint32_t zigzag(std::int32_t difference) {
  constexpr std::int32_t kHalf = std::int32_t{1} << (Bits - 1);
  std::int32_t d = difference;
  if (d >= kHalf) d -= 2 * kHalf;
  if (d < -kHalf) d += 2 * kHalf;
  return d < 0 ? 2 * std::uint32_t(-(d + 1)) + 1 : 2 * std::uint32_t(d);
}

template <int Bits, typename Number>
AlignedBox add_levels(ColumnBlock& block, const std::string& name,
                      std::span<const Vector3> vectors) {
  constexpr Scalar kLevels = (1 << Bits) - 1;
  AlignedBox box;
  for (const Vector3& p : vectors) box.extend(p);
  std::vector<Number> differences(3 * vectors.size());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Scalar width = box.sizes()[axis];
    std::int32_t last = 0;
    for (std::size_t k = 0; k < vectors.size(); ++k) {
      const Scalar part = width > 0 ? (vectors[k][axis] - box.min()[axis]) / width : 0;
      const auto level = std::int32_t(std::lround(part * kLevels));
      differences[std::size_t(axis) * vectors.size() + k] = Number(zigzag<Bits>(level - last));
      last = level;
    }
  }
  block.add(name, std::span<const Number>(differences));
  return box;
}

}  // namespace

Scalar plate_beside(std::span<const Shape* const> shapes) {
  constexpr Scalar kRadii = 50;
  Scalar largest = 0;
  for (const Shape* shape : shapes) {
    if (!as_half_space(*shape)) largest = std::max(largest, shape->bounding_radius());
  }
  return largest > 0 ? kRadii * largest : 1;
}

Scalar drawn_radius(const Shape& shape, Scalar plate) {
  const HalfSpace* half_space = as_half_space(shape);
  // The diagonal of half a square.
  return half_space ? 1.5 * plate + std::abs(half_space->offset()) : shape.bounding_radius();
}

ShapeSurface surface_of(const Shape& shape, int fineness, Scalar plate) {
  if (const HalfSpace* half_space = as_half_space(shape)) return plate_of(*half_space, plate);
  switch (shape.kind()) {
    case ShapeKind::TriangleMesh:
      return surface_of_mesh(static_cast<const TriangleMesh&>(shape));
    case ShapeKind::Convex:
      return surface_of_convex(static_cast<const ConvexShape&>(shape), fineness);
    case ShapeKind::Compound:
      return surface_of_compound(static_cast<const CompoundShape&>(shape), fineness);
  }
  throw InternalError("unknown kind of shape");
}

std::vector<std::int32_t> vertices_in_order(std::span<const TriangleIndices> triangles,
                                            std::size_t vertex_count) {
  std::vector<bool> is_used(vertex_count);
  std::vector<std::int32_t> order;
  for (const TriangleIndices& triangle : triangles) {
    for (const std::int32_t vertex : triangle) {
      if (is_used[std::size_t(vertex)]) continue;
      is_used[std::size_t(vertex)] = true;
      order.push_back(vertex);
    }
  }
  return order;
}

AlignedBox add_rounded(ColumnBlock& block, const std::string& name,
                       std::span<const Vector3> vectors) {
  return add_levels<16, std::uint16_t>(block, name, vectors);
}

nlohmann::json add_surface(ColumnBlock& block, const std::string& name,
                           const ShapeSurface& surface) {
  const std::vector<std::int32_t> order =
      vertices_in_order(surface.triangles, surface.vertices.size());
  std::vector<std::uint32_t> place(surface.vertices.size());
  std::vector<Vector3> used;
  used.reserve(order.size());
  for (const std::int32_t vertex : order) {
    place[std::size_t(vertex)] = std::uint32_t(used.size());
    used.push_back(surface.vertices[std::size_t(vertex)]);
  }
  std::vector<std::uint32_t> back;  // how far a vertex is before the next new one; 0: it is new
  back.reserve(3 * surface.triangles.size());
  std::uint32_t next = 0;
  for (const TriangleIndices& triangle : surface.triangles) {
    for (const std::int32_t vertex : triangle) {
      const std::uint32_t at = place[std::size_t(vertex)];
      back.push_back(next - at);
      next += at == next ? 1 : 0;
    }
  }
  const AlignedBox box = add_levels<24, std::uint32_t>(block, name + ".vertices", used);
  block.add(name + ".triangles", std::span<const std::uint32_t>(back));
  nlohmann::json json;
  json["vertices"] = used.size();
  json["triangles"] = surface.triangles.size();
  json["low"] = {box.min().x(), box.min().y(), box.min().z()};
  json["high"] = {box.max().x(), box.max().y(), box.max().z()};
  return json;
}

}  // namespace dyop::view_internal
