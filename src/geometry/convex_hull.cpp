// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/convex_hull.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/primitives.h"
#include "geometry/hull/quickhull.h"
#include "geometry/solid.h"

namespace dyop {
namespace {

// With up to this many vertices a scan is faster than climbing.
constexpr std::size_t kLargestScan = 128;

TriangleMesh surface_mesh(const std::vector<Vector3>& points,
                          std::vector<TriangleIndices> triangles) {
  std::vector<std::int32_t> number(points.size(), -1);
  for (const TriangleIndices& t : triangles) {
    for (const std::int32_t v : t) number[std::size_t(v)] = 0;
  }
  std::vector<Vector3> vertices;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (number[k] < 0) continue;
    number[k] = std::int32_t(vertices.size());
    vertices.push_back(points[k]);
  }
  for (TriangleIndices& t : triangles) {
    for (std::int32_t& v : t) v = number[std::size_t(v)];
  }
  return TriangleMesh(std::move(vertices), std::move(triangles));
}

geometry_internal::HullSurface checked_quickhull(const std::vector<Vector3>& points) {
  constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
  DYOP_REQUIRE(!points.empty() && points.size() <= kMost, "a convex hull needs 1 to ", kMost,
               " points, not ", points.size());
  for (std::size_t row = 0; row < points.size(); ++row) {
    const Vector3& p = points[row];
    // False for NaN.
    DYOP_REQUIRE((p.array().abs() <= kLargestCoordinate).all(), "point ", row,
                 " is not finite or beyond ", kLargestCoordinate, ": (", p.x(), ", ", p.y(), ", ",
                 p.z(), ")");
  }
  return geometry_internal::quickhull(points);
}

Vector3 mean(std::span<const Vector3> points) {
  Vector3 sum = Vector3::Zero();
  for (const Vector3& p : points) sum += p / Scalar(points.size());
  return sum;
}

std::shared_ptr<const geometry_internal::HullClimber> climber_for(const TriangleMesh& surface,
                                                                  int dimension) {
  if (dimension < 3 || surface.vertices().size() <= kLargestScan) return nullptr;
  return std::make_shared<const geometry_internal::HullClimber>(surface);
}

}  // namespace

ConvexHull::ConvexHull(std::vector<Vector3> points, Scalar radius)
    : ConvexHull(points, checked_quickhull(points), radius) {
  DYOP_REQUIRE(radius >= 0 && radius <= kLargestCoordinate,
               "the radius of a convex hull must be >= 0 and at most ", kLargestCoordinate,
               ", not ", radius);
}

ConvexHull::ConvexHull(const std::vector<Vector3>& points, geometry_internal::HullSurface&& hull,
                       Scalar radius)
    : dimension_(hull.dimension),
      radius_(radius),
      surface_(surface_mesh(points, std::move(hull.triangles))),
      center_(mean(surface_.vertices())),
      scan_(std::make_shared<const geometry_internal::PointScan>(surface_.vertices())),
      climber_(climber_for(surface_, dimension_)) {}

SupportPoint ConvexHull::core_support(const Vector3& direction) const {
  const std::span<const Vector3> all = vertices();
  if (climber_) {
    const std::optional<std::int32_t> vertex = climber_->find(direction);
    if (vertex) return {all[std::size_t(*vertex)], *vertex};
  }
  const std::int32_t vertex = scan_->farthest(direction);
  return {all[std::size_t(vertex)], vertex};
}

Scalar ConvexHull::core_reach(const Vector3& direction) const {
  if (climber_) return ConvexShape::core_reach(direction);
  return scan_->reach(direction);
}

AlignedBox ConvexHull::bounding_box() const {
  const AlignedBox box = surface_.bounding_box();
  if (radius_ == 0) return box;
  // The sums round by u of themselves.
  const Vector3 size = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs());
  const Vector3 reach = ((size.array() + radius_) * (2 * kUnitRoundoff) + radius_).matrix();
  return {Vector3(box.min() - reach), Vector3(box.max() + reach)};
}

Scalar ConvexHull::bounding_radius() const {
  if (radius_ == 0) return surface_.bounding_radius();
  return (surface_.bounding_radius() + radius_) * (1 + 4 * kUnitRoundoff);
}

namespace {

Matrix3 both_ways(const Vector3& x, const Vector3& y) {
  return x * y.transpose() + y * x.transpose();
}

// Volume, and the integrals of x and x x^T, over the parts of a solid.
class SolidMoments {
 public:
  // Of a solid with these mass properties at density one.
  void add_solid(const MassProperties& solid) {
    const Vector3& c = solid.p_BoBcm;
    volume_ += solid.mass;
    first_ += solid.mass * c;
    second_ += solid.I_BBcm.trace() / 2 * Matrix3::Identity() - solid.I_BBcm +
               solid.mass * c * c.transpose();
  }

  // The prism over a triangle, of height r along its unit normal n.
  void add_prism(const Triangle& t, const Vector3& n, Scalar r) {
    const Scalar area = (t[1] - t[0]).cross(t[2] - t[0]).norm() / 2;
    const Vector3 c = (t[0] + t[1] + t[2]) / 3;
    Matrix3 squares = 9 * c * c.transpose();
    for (const Vector3& v : t) squares += v * v.transpose();
    volume_ += area * r;
    first_ += area * r * (c + r / 2 * n);
    second_ +=
        area * (r / 12 * squares + r * r / 2 * both_ways(c, n) + r * r * r / 3 * n * n.transpose());
  }

  // The part of a cylinder of radius r about the edge from a to b, half the angle on either side
  // of a unit direction m.
  void add_wedge(const Vector3& a, const Vector3& b, const Vector3& m, Scalar angle, Scalar r) {
    const Scalar length = (b - a).norm();
    const Vector3 c = (a + b) / 2;
    const Vector3 k = (b - a).cross(m).normalized();
    const Scalar sine = 2 * std::sin(angle / 2);
    const Matrix3 along = c * c.transpose() + (b - a) * (b - a).transpose() / 12;
    const Matrix3 around = (angle + std::sin(angle)) / 2 * m * m.transpose() +
                           (angle - std::sin(angle)) / 2 * k * k.transpose();
    volume_ += length * r * r * angle / 2;
    first_ += length * (r * r * angle / 2 * c + r * r * r / 3 * sine * m);
    second_ += length * (r * r * angle / 2 * along + r * r * r / 3 * sine * both_ways(c, m) +
                         r * r * r * r / 4 * around);
  }

  // The part of a ball about v in the directions of a cone, given the integrals of 1, n and n n^T
  // over the cone's unit directions n.
  void add_sector(const Vector3& v, Scalar angle, const Vector3& n, const Matrix3& nn, Scalar r) {
    const Scalar r_cubed = r * r * r;
    volume_ += r_cubed / 3 * angle;
    first_ += r_cubed * (angle / 3 * v + r / 4 * n);
    second_ += r_cubed * (angle / 3 * v * v.transpose() + r / 4 * both_ways(v, n) + r * r / 5 * nn);
  }

  MassProperties mass_properties(Scalar density, const Vector3& origin) const {
    const Vector3 c = first_ / volume_;
    const Matrix3 central = second_ - volume_ * c * c.transpose();
    MassProperties properties;
    properties.mass = density * volume_;
    properties.p_BoBcm = origin + c;
    properties.I_BBcm = density * (central.trace() * Matrix3::Identity() - central);
    return geometry_internal::require_representable(properties);
  }

 private:
  Scalar volume_ = 0;
  Vector3 first_ = Vector3::Zero();
  Matrix3 second_ = Matrix3::Zero();
};

// The directions in which a vertex is farthest: a spherical polygon, whose sides are arcs between
// the normals of faces that share an edge. Its area is 2 pi less the corners of the faces. With the
// divergence theorem on the cone over it, every arc of angle t and middle m, whose plane has the
// outward normal e along the edge, takes t e / 2 from the integral of n, and 2/3 sin(t/2) e m^T from
// that of n n^T, a third of the area times the identity.
struct NormalCone {
  Scalar area = 2 * std::numbers::pi;
  Vector3 first = Vector3::Zero();
  Matrix3 second = Matrix3::Zero();

  void add_arc(const Vector3& outwards, const Vector3& middle, Scalar angle) {
    first -= angle / 2 * outwards;
    // Symmetric only in sum, and up to rounding.
    second -= std::sin(angle / 2) / 3 * both_ways(outwards, middle);
  }
};

// The angle between two vectors.
Scalar angle_of(const Vector3& x, const Vector3& y) {
  return std::atan2(x.cross(y).norm(), x.dot(y));
}

MassProperties rounded_mass(const TriangleMesh& surface, const Vector3& origin, Scalar r,
                            Scalar density) {
  SolidMoments moments;
  MassProperties core = surface.compute_mass_properties(1);
  core.p_BoBcm -= origin;
  moments.add_solid(core);
  std::vector<Vector3> normals;
  std::vector<NormalCone> cones(surface.vertices().size());
  const auto vertex = [&](std::int32_t number) -> Vector3 {
    return surface.vertices()[std::size_t(number)] - origin;
  };
  for (std::size_t k = 0; k < surface.triangles().size(); ++k) {
    const TriangleIndices& indices = surface.triangles()[k];
    const Triangle t{vertex(indices[0]), vertex(indices[1]), vertex(indices[2])};
    normals.push_back((t[1] - t[0]).cross(t[2] - t[0]).normalized());
    moments.add_prism(t, normals.back(), r);
    for (std::size_t i = 0; i < 3; ++i) {
      cones[std::size_t(indices[i])].area -= angle_of(t[(i + 1) % 3] - t[i], t[(i + 2) % 3] - t[i]);
    }
  }
  const MeshTopology& topology = surface.topology();
  for (std::int32_t e = 0; e < topology.edge_count(); ++e) {
    const auto& [from, to] = topology.edge(e);
    const auto sides = topology.sides_of_edge(e);
    const Vector3& n0 = normals[std::size_t(sides[0] / 3)];
    const Vector3& n1 = normals[std::size_t(sides[1] / 3)];
    const Scalar angle = angle_of(n0, n1);
    const Vector3 middle = (n0 + n1).normalized();
    const Vector3 along = (vertex(to) - vertex(from)).normalized();
    moments.add_wedge(vertex(from), vertex(to), middle, angle, r);
    cones[std::size_t(from)].add_arc(along, middle, angle);
    cones[std::size_t(to)].add_arc(-along, middle, angle);
  }
  for (std::size_t v = 0; v < cones.size(); ++v) {
    const NormalCone& cone = cones[v];
    moments.add_sector(vertex(std::int32_t(v)), cone.area, cone.first,
                       cone.second + cone.area / 3 * Matrix3::Identity(), r);
  }
  return moments.mass_properties(density, origin);
}

}  // namespace

MassProperties ConvexHull::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  if (radius_ > 0 && dimension_ == 0) {
    MassProperties ball = Sphere(radius_).compute_mass_properties(density);
    ball.p_BoBcm = center_;
    return ball;
  }
  if (radius_ > 0 && dimension_ == 1) {
    const AlignedBox box = surface_.bounding_box();
    const Vector3 half = surface_.vertices()[0] - box.center();
    const MassProperties capsule = Capsule(radius_, half.norm()).compute_mass_properties(density);
    const Matrix3 R = rotation_between(Vector3::UnitZ(), half).toRotationMatrix();
    return {capsule.mass, box.center(), R * capsule.I_BBcm * R.transpose()};
  }
  DYOP_REQUIRE(dimension_ == 3, "a convex hull of dimension ", dimension_,
               " encloses no volume and has no mass");
  if (radius_ > 0) return rounded_mass(surface_, center_, radius_, density);
  return surface_.compute_mass_properties(density);
}

}  // namespace dyop
