// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/triangle_mesh.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <optional>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "exact/orientation.h"
#include "geometry/mesh_topology.h"
#include "geometry/solid.h"

namespace dyop {
namespace {

void require_counts(std::size_t vertex_count, std::size_t triangle_count) {
  DYOP_REQUIRE(triangle_count > 0, "a mesh needs at least one triangle, not 0 (with ", vertex_count,
               " vertices)");
  DYOP_REQUIRE(triangle_count <= kLargestTriangleCount, "a mesh has at most ",
               kLargestTriangleCount, " triangles, not ", triangle_count);
  constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
  DYOP_REQUIRE(vertex_count <= kMost, "a mesh has at most ", kMost, " vertices, not ",
               vertex_count);
}

void require_index(std::size_t row, std::int64_t index, std::size_t vertex_count) {
  DYOP_REQUIRE(index >= 0 && index < std::int64_t(vertex_count), "triangle ", row,
               ": vertex number ", index, " is out of range, the mesh has ", vertex_count,
               " vertices");
}

void require_vertex(std::size_t row, const Vector3& p) {
  DYOP_REQUIRE(p.allFinite(), "vertex ", row, " is not finite: (", p.x(), ", ", p.y(), ", ", p.z(),
               ")");
  DYOP_REQUIRE(p.cwiseAbs().maxCoeff() <= kLargestCoordinate, "vertex ", row, " is beyond ",
               kLargestCoordinate, ": (", p.x(), ", ", p.y(), ", ", p.z(), ")");
}

template <typename Number>
void require_rows(const char* what, const StridedRows<Number>& rows) {
  DYOP_REQUIRE(rows.count == 0 || rows.data != nullptr, what, ": null data for ", rows.count,
               " rows");
  DYOP_REQUIRE(rows.count == 0 || rows.stride_bytes >= 3 * sizeof(Number), what, ": stride of ",
               rows.stride_bytes, " bytes is less than a row of ", 3 * sizeof(Number));
}

// Copied bytewise: rows of a packed buffer may be unaligned.
template <typename Number>
std::array<Number, 3> read_row(const StridedRows<Number>& rows, std::size_t row) {
  std::array<Number, 3> numbers;
  std::memcpy(numbers.data(),
              reinterpret_cast<const std::byte*>(rows.data) + row * rows.stride_bytes,
              sizeof(numbers));
  return numbers;
}

template <typename Number>
std::vector<Vector3> read_vertices(const StridedRows<Number>& rows) {
  require_rows("vertices", rows);
  std::vector<Vector3> vertices(rows.count);
  for (std::size_t row = 0; row < vertices.size(); ++row) {
    const std::array<Number, 3> p = read_row(rows, row);
    vertices[row] = Vector3(Scalar(p[0]), Scalar(p[1]), Scalar(p[2]));
  }
  return vertices;
}

template <typename Number, typename Index>
TriangleMesh mesh_from_rows(const StridedRows<Number>& vertex_rows,
                            const StridedRows<Index>& triangle_rows) {
  require_counts(vertex_rows.count, triangle_rows.count);
  require_rows("triangles", triangle_rows);
  std::vector<Vector3> vertices = read_vertices(vertex_rows);
  std::vector<TriangleIndices> triangles(triangle_rows.count);
  for (std::size_t row = 0; row < triangles.size(); ++row) {
    const std::array<Index, 3> indices = read_row(triangle_rows, row);
    for (std::size_t k = 0; k < 3; ++k) {
      // Checked before narrowing, so that the message shows a large unsigned number unchanged.
      require_index(row, std::int64_t(indices[k]), vertices.size());
      triangles[row][k] = std::int32_t(indices[k]);
    }
  }
  return TriangleMesh(std::move(vertices), std::move(triangles));
}

// Largest norm, rounded up: scaling, three squares and sums, and the root err by less than 8u; the
// final step up covers numbers below the normal range.
Scalar largest_norm(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles,
                    const AlignedBox& box) {
  const Scalar scale = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  if (scale == 0) return 0;
  Scalar largest_sq = 0;
  for (const TriangleIndices& t : triangles) {
    for (const std::int32_t v : t) {
      largest_sq = std::max(largest_sq, (vertices[std::size_t(v)] / scale).squaredNorm());
    }
  }
  const Scalar radius = scale * std::sqrt(largest_sq) * (1 + 16 * kUnitRoundoff);
  return std::nextafter(radius, kInfinity);
}

AlignedBox find_bounds(std::span<const Vector3> vertices,
                       std::span<const TriangleIndices> triangles) {
  AlignedBox box;
  for (const TriangleIndices& t : triangles) {
    for (const std::int32_t v : t) box.extend(vertices[std::size_t(v)]);
  }
  return box;
}

// Moments of order 0, 1 and 2 of a distribution of mass about a point.
struct Moments {
  Scalar mass = 0;
  Vector3 first = Vector3::Zero();
  Matrix3 second = Matrix3::Zero();
};

// Moves the moments to the centre of mass; `origin` is the point they were taken about.
MassProperties mass_properties_from(const Moments& moments, const Vector3& origin) {
  MassProperties properties;
  properties.mass = moments.mass;
  const Vector3 c = moments.first / moments.mass;
  properties.p_BoBcm = origin + c;
  const Matrix3 central = moments.second - moments.first * c.transpose();
  properties.I_BBcm = central.trace() * Matrix3::Identity() - central;
  properties.I_BBcm = (0.5 * (properties.I_BBcm + properties.I_BBcm.transpose())).eval();
  return geometry_internal::require_representable(properties);
}

// The sum of v v^T over the corners and over their sum: the integral of p p^T over a simplex with
// these corners (and, for a tetrahedron, the origin) is a multiple of it.
Matrix3 corner_products(const Triangle& p) {
  const Vector3 sum = p[0] + p[1] + p[2];
  return p[0] * p[0].transpose() + p[1] * p[1].transpose() + p[2] * p[2].transpose() +
         sum * sum.transpose();
}

// Out of line, so that data() is inlined.
[[noreturn]] void refuse_moved_from() {
  throw InvalidArgument("this TriangleMesh was moved from and holds no triangles");
}

}  // namespace

namespace geometry_internal {

// What follows from the vertex numbers alone, found on first use: distances and times of impact of
// surfaces need none of it. Shared by meshes that differ only in where their vertices are.
class MeshConnections {
 public:
  const MeshTopology& topology(std::size_t vertex_count,
                               std::span<const TriangleIndices> triangles) {
    std::call_once(has_topology_, [&] { topology_.emplace(vertex_count, triangles); });
    return *topology_;
  }
  std::span<const std::int32_t> part_vertices(std::size_t vertex_count,
                                              std::span<const TriangleIndices> triangles) {
    std::call_once(has_parts_, [&] {
      part_vertices_ = geometry_internal::part_vertices(vertex_count, triangles);
    });
    return part_vertices_;
  }

 private:
  std::once_flag has_topology_;
  std::once_flag has_parts_;
  std::optional<const MeshTopology> topology_;
  std::vector<std::int32_t> part_vertices_;
};

}  // namespace geometry_internal

struct TriangleMesh::Data {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
  MeshHierarchy hierarchy;
  AlignedBox bounds;
  Scalar radius;

  Data(std::vector<Vector3> vertices_in, std::vector<TriangleIndices> triangles_in)
      : vertices(std::move(vertices_in)),
        triangles(std::move(triangles_in)),
        hierarchy(vertices, triangles),
        bounds(find_bounds(vertices, triangles)),
        radius(largest_norm(vertices, triangles, bounds)),
        connections_(std::make_shared<geometry_internal::MeshConnections>()) {}

  // The mesh `base` with different vertices.
  Data(const Data& base, std::vector<Vector3> vertices_in)
      : vertices(std::move(vertices_in)),
        triangles(base.triangles),
        hierarchy(base.hierarchy.refitted(vertices, triangles)),
        bounds(find_bounds(vertices, triangles)),
        radius(largest_norm(vertices, triangles, bounds)),
        connections_(base.connections_) {}

  const MeshTopology& topology() const {
    return connections_->topology(vertices.size(), triangles);
  }
  std::span<const std::int32_t> part_vertices() const {
    return connections_->part_vertices(vertices.size(), triangles);
  }
  // Computed on first use: only contacts need them.
  const ContactFeatures& contact_features() const {
    std::call_once(has_features_, [this] {
      features_ =
          std::make_unique<const ContactFeatures>(vertices, triangles, topology(), hierarchy);
    });
    return *features_;
  }

 private:
  std::shared_ptr<geometry_internal::MeshConnections> connections_;
  mutable std::once_flag has_features_;
  mutable std::unique_ptr<const ContactFeatures> features_;
};

TriangleMesh::TriangleMesh(std::vector<Vector3> vertices, std::vector<TriangleIndices> triangles) {
  require_counts(vertices.size(), triangles.size());
  for (std::size_t row = 0; row < vertices.size(); ++row) require_vertex(row, vertices[row]);
  for (std::size_t row = 0; row < triangles.size(); ++row) {
    for (const std::int32_t index : triangles[row]) require_index(row, index, vertices.size());
  }
  data_ = std::make_shared<const Data>(std::move(vertices), std::move(triangles));
}

TriangleMesh TriangleMesh::from_arrays(StridedRows<double> vertices,
                                       StridedRows<std::int32_t> triangles) {
  return mesh_from_rows(vertices, triangles);
}

TriangleMesh TriangleMesh::from_arrays(StridedRows<float> vertices,
                                       StridedRows<std::int32_t> triangles) {
  return mesh_from_rows(vertices, triangles);
}

TriangleMesh TriangleMesh::from_arrays(StridedRows<double> vertices,
                                       StridedRows<std::uint32_t> triangles) {
  return mesh_from_rows(vertices, triangles);
}

TriangleMesh TriangleMesh::from_arrays(StridedRows<float> vertices,
                                       StridedRows<std::uint32_t> triangles) {
  return mesh_from_rows(vertices, triangles);
}

const TriangleMesh::Data& TriangleMesh::data() const {
  if (!data_) [[unlikely]]
    refuse_moved_from();
  return *data_;
}

TriangleMesh TriangleMesh::with_vertices(std::vector<Vector3> vertices) const {
  DYOP_REQUIRE(vertices.size() == data().vertices.size(), "the mesh has ", data().vertices.size(),
               " vertices, but got ", vertices.size());
  for (std::size_t row = 0; row < vertices.size(); ++row) require_vertex(row, vertices[row]);
  return TriangleMesh(std::make_shared<const Data>(data(), std::move(vertices)));
}

TriangleMesh TriangleMesh::with_vertices(StridedRows<double> vertices) const {
  return with_vertices(read_vertices(vertices));
}

TriangleMesh TriangleMesh::with_vertices(StridedRows<float> vertices) const {
  return with_vertices(read_vertices(vertices));
}

std::span<const Vector3> TriangleMesh::vertices() const {
  return data().vertices;
}

std::span<const TriangleIndices> TriangleMesh::triangles() const {
  return data().triangles;
}

Triangle TriangleMesh::triangle(std::int32_t index) const {
  const Data& mesh = data();
  const TriangleIndices& t = mesh.triangles[std::size_t(index)];
  return {mesh.vertices[std::size_t(t[0])], mesh.vertices[std::size_t(t[1])],
          mesh.vertices[std::size_t(t[2])]};
}

const MeshHierarchy& TriangleMesh::hierarchy() const {
  return data().hierarchy;
}

const MeshTopology& TriangleMesh::topology() const {
  return data().topology();
}

const ContactFeatures& TriangleMesh::contact_features() const {
  return data().contact_features();
}

bool TriangleMesh::is_closed() const {
  return data().topology().is_closed();
}

std::span<const std::int32_t> TriangleMesh::part_vertices() const {
  return data().part_vertices();
}

AlignedBox TriangleMesh::bounding_box() const {
  return data().bounds;
}

Scalar TriangleMesh::bounding_radius() const {
  return data().radius;
}

MassProperties TriangleMesh::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  DYOP_REQUIRE(is_closed(), "a mesh of ", data().triangles.size(),
               " triangles is not closed and has no volume; use compute_shell_mass_properties()");
  const Vector3 origin = 0.5 * data().bounds.min() + 0.5 * data().bounds.max();
  // Signed tetrahedra from the origin to each triangle.
  Moments moments;
  Scalar noise = 0;
  for (std::size_t k = 0; k < data().triangles.size(); ++k) {
    const Triangle world = triangle(std::int32_t(k));
    const Vector3 edge_1 = world[1] - world[0];
    const Vector3 edge_2 = world[2] - world[0];
    const Triangle p{world[0] - origin, world[1] - origin, world[2] - origin};
    const Scalar determinant = p[0].dot(edge_1.cross(edge_2));
    noise += kDeterminantNoise * p[0].lpNorm<1>() * edge_1.lpNorm<1>() * edge_2.lpNorm<1>() / 6;
    moments.mass += determinant / 6;
    moments.first += determinant / 24 * (p[0] + p[1] + p[2]);
    moments.second += determinant / 120 * corner_products(p);
  }
  DYOP_REQUIRE(moments.mass > noise, "the enclosed signed volume must be > 0 (beyond rounding, ",
               noise, "), not ", moments.mass, "; do the triangles face inwards?");
  moments.mass *= density;
  moments.first *= density;
  moments.second *= density;
  return mass_properties_from(moments, origin);
}

namespace {

// The moments of triangles about an origin, by area.
void add_surface(const Triangle& p, Scalar density, Moments& moments) {
  const Scalar mass = density * (p[1] - p[0]).cross(p[2] - p[0]).norm() / 2;
  moments.mass += mass;
  moments.first += mass / 3 * (p[0] + p[1] + p[2]);
  moments.second += mass / 12 * corner_products(p);
}

// Of triangles without area, by the length of their longest side.
void add_wire(const Triangle& p, Scalar density, Moments& moments) {
  std::size_t longest = 0;
  const auto side = [&](std::size_t k) -> Vector3 { return p[(k + 1) % 3] - p[k]; };
  for (std::size_t k = 1; k < 3; ++k) {
    if (side(k).squaredNorm() > side(longest).squaredNorm()) longest = k;
  }
  const Vector3 middle = p[longest] + side(longest) / 2;
  const Scalar mass = density * side(longest).norm();
  moments.mass += mass;
  moments.first += mass * middle;
  moments.second +=
      mass * (middle * middle.transpose() + side(longest) * side(longest).transpose() / 12);
}

void add_point(const Triangle& p, Scalar density, Moments& moments) {
  moments.mass += density;
  moments.first += density * p[0];
  moments.second += density * p[0] * p[0].transpose();
}

// Of a rod, over its length.
constexpr Scalar kWireThickness = 0.01;

// What lies on a line has no inertia about it: it gets that of a rod.
void thicken(MassProperties& properties) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(properties.I_BBcm);
  const Vector3& principal = solver.eigenvalues();
  // Across, m l^2 / 12; along, m (thickness l / 2)^2 / 2.
  const Scalar least = 1.5 * kWireThickness * kWireThickness * principal[2];
  const Vector3 along = solver.eigenvectors().col(0);
  if (principal[0] < least) {
    properties.I_BBcm += (least - principal[0]) * along * along.transpose();
  }
}

}  // namespace

MassProperties TriangleMesh::compute_shell_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  const Vector3 origin = 0.5 * data().bounds.min() + 0.5 * data().bounds.max();
  for (const auto add : {add_surface, add_wire, add_point}) {
    Moments moments;
    for (std::size_t k = 0; k < data().triangles.size(); ++k) {
      const Triangle world = triangle(std::int32_t(k));
      add({world[0] - origin, world[1] - origin, world[2] - origin}, density, moments);
    }
    if (!(moments.mass > 0)) continue;
    MassProperties properties = mass_properties_from(moments, origin);
    if (add != add_surface) thicken(properties);
    DYOP_REQUIRE(properties.I_BBcm.trace() > 0, "a point has no inertia; give it a radius: Sphere");
    return properties;
  }
  throw InvalidArgument("the mass of the shell is beneath the smallest number");
}

namespace {

constexpr int kAlong = 2;  // the ray's axis

// Whether the ray may hit what is in this column of the group. The axis-aligned box around the
// oriented one is exact up to the rounding of three products and two sums.
bool may_meet(const BoxGroup& boxes, int column, const BoxFrame& frame, const Vector3& p) {
  const Scalar up = 1 + 8 * kUnitRoundoff;
  for (int i = 0; i < 3; ++i) {
    Scalar extent = 0;
    for (int k = 0; k < 3; ++k) {
      extent += std::abs(static_cast<Scalar>(boxes.rows[BoxGroup::kAxes + 3 * k + i][column])) *
                static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents + k][column]);
    }
    extent *= frame.scale * up;
    const Scalar offset =
        p[i] - frame.origin[i] -
        frame.scale * static_cast<Scalar>(boxes.rows[BoxGroup::kCenter + i][column]);
    if (offset > extent || (i != kAlong && offset < -extent)) return false;
  }
  return true;
}

// Of a power of two that is larger than all coordinates of the box.
int exponent_above(const AlignedBox& box) {
  int exponent = 0;
  std::frexp(std::max(box.min().lpNorm<Eigen::Infinity>(), box.max().lpNorm<Eigen::Infinity>()),
             &exponent);
  return exponent;
}

// Coordinates as the exact predicates require them: of size 2^-200 to 1, or zero.
Vector3 scaled(const Vector3& p, int exponent) {
  Vector3 q;
  for (int i = 0; i < 3; ++i) {
    q[i] = std::ldexp(p[i], -exponent);
    if (std::abs(q[i]) < kSmallestHullCoordinate) q[i] = 0;
  }
  return q;
}

// How often the edge from a to b passes the half line from p along the first of the two axes across
// the ray, upwards in the second. Half open, so that it is the negative of the edge from b to a,
// and every closed loop gives an integer, the winding number of a point beside p.
int passes(const Vector3& a, const Vector3& b, const Vector3& p) {
  constexpr int kAcross = (kAlong + 2) % 3;
  const bool is_a_below = a[kAcross] <= p[kAcross];
  const bool is_b_below = b[kAcross] <= p[kAcross];
  if (is_a_below == is_b_below) return 0;
  const int side = exact_internal::orientation_along(kAlong, a, b, p);
  if (is_a_below) return side > 0 ? 1 : 0;
  return side < 0 ? -1 : 0;
}

int crossing(const Triangle& triangle, const Vector3& p, int exponent) {
  const Vector3 a = scaled(triangle[0], exponent);
  const Vector3 b = scaled(triangle[1], exponent);
  const Vector3 c = scaled(triangle[2], exponent);
  const int turn = passes(a, b, p) + passes(b, c, p) + passes(c, a, p);
  if (turn == 0) return 0;
  // The point is below the triangle if it lies on the side from which the triangle appears to turn
  // the opposite way than from the tip of the ray. On its plane it counts as above.
  return exact_internal::orientation(a, b, c, p) == -turn ? turn : 0;
}

}  // namespace

int winding_number(const TriangleMesh& mesh, const Vector3& p_B) {
  DYOP_REQUIRE(mesh.is_closed(),
               "only a closed mesh has an inside: this one has an edge that is not "
               "used exactly once in each direction");
  DYOP_REQUIRE(p_B.allFinite(), "point must be finite, not (", p_B.transpose(), ")");
  // Outside the box nothing is inside, and the exact predicates need points of the mesh's size.
  if (!mesh.bounding_box().contains(p_B)) return 0;
  const MeshHierarchy& tree = mesh.hierarchy();
  const int exponent = exponent_above(mesh.bounding_box());
  const Vector3 p = scaled(p_B, exponent);
  int winding = 0;
  std::array<std::int32_t, MeshHierarchy::kMaxDepth * MeshHierarchy::kWidth + 1> open;
  std::size_t open_count = 0;
  open[open_count++] = 0;
  while (open_count > 0) {
    const MeshHierarchy::Node& node = tree.nodes()[static_cast<std::size_t>(open[--open_count])];
    const int count = node.count();
    for (int column = 0; column < count; ++column) {
      if (!may_meet(node.boxes, column, tree.frame(), p_B)) continue;
      const std::int32_t child = node.child[column];
      if (child >= 0) {
        open[open_count++] = child;
      } else {
        winding += crossing(mesh.triangle(-1 - child), p, exponent);
      }
    }
  }
  return winding;
}

bool contains(const TriangleMesh& mesh, const Vector3& p_B) {
  return winding_number(mesh, p_B) != 0;
}

}  // namespace dyop
