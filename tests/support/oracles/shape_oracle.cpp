// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/shape_oracle.h"

#include <algorithm>
#include <cmath>

#include "dyop/core/error.h"
#include "dyop/geometry/convex_shape.h"

namespace dyop::testing {
namespace {

using QuadTriangles = std::vector<PointTriangle<Quad>>;

// A core whose center is nearer to a face than this times its size has no interior.
constexpr double kFlatness = 0x1p-60;
// Rounding of a face's normal in quad precision, relative to the product of two of its edges, also
// for poses far from the origin: long edges of a sliver cancel.
constexpr double kNormalRounding = 0x1p-90;
// Rounding of a quad vertex to double and of a box's gap; relative to the coordinates.
constexpr double kBoxRounding = 0x1p-49;
// Rounding of a pose in quad precision, relative to the coordinates.
constexpr long double kPosing = 0x1p-106L;
// What counts as contact, so that the search ends; relative to the size of the shapes.
constexpr long double kContact = 0x1p-93L;

Point<Quad> posed(const RigidPose& X, const Vector3& p) {
  const Matrix3& R = X.rotation();
  const Vector3& t = X.translation();
  const auto row = [&](int k) {
    return Quad(R(k, 0)) * Quad(p.x()) + Quad(R(k, 1)) * Quad(p.y()) + Quad(R(k, 2)) * Quad(p.z()) +
           Quad(t[k]);
  };
  return {row(0), row(1), row(2)};
}

Vector3 to_double(const Point<Quad>& p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
}

// Boxes as minima and maxima, enlarged by their rounding.
std::vector<AlignedBox> boxes_of(const QuadTriangles& triangles) {
  std::vector<AlignedBox> boxes;
  boxes.reserve(triangles.size());
  for (const PointTriangle<Quad>& t : triangles) {
    AlignedBox box;
    for (const Point<Quad>& p : t) box.extend(to_double(p));
    const double pad =
        kBoxRounding * box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
    boxes.emplace_back(box.min().array() - pad, box.max().array() + pad);
  }
  return boxes;
}

AlignedBox merged(const std::vector<AlignedBox>& boxes) {
  AlignedBox all;
  for (const AlignedBox& box : boxes) all.extend(box);
  return all;
}

double squared_gap(const AlignedBox& a, const AlignedBox& b) {
  const Vector3 gap = (a.min() - b.max()).cwiseMax(b.min() - a.max()).cwiseMax(0.0);
  return gap.squaredNorm() * (1 - kBoxRounding);
}

// A distance that is attained, to start with: the nearest first vertices.
double some_squared_distance(const std::vector<AlignedBox>& a, const std::vector<AlignedBox>& b) {
  const AlignedBox all_b = merged(b);
  double best = kInfinity;
  for (const AlignedBox& box_a : a) {
    if (squared_gap(box_a, all_b) >= best) continue;
    for (const AlignedBox& box_b : b) {
      // Farthest points of the two boxes: no pair of their triangles' points is farther apart.
      const Vector3 span = (box_a.max() - box_b.min()).cwiseMax(box_b.max() - box_a.min());
      best = std::min(best, span.squaredNorm());
    }
  }
  return best * (1 + kBoxRounding);
}

OracleDistance surface_distance(const QuadTriangles& a, const QuadTriangles& b) {
  const std::vector<AlignedBox> boxes_a = boxes_of(a);
  const std::vector<AlignedBox> boxes_b = boxes_of(b);
  const AlignedBox all_b = merged(boxes_b);
  AlignedBox everything = merged(boxes_a);
  everything.extend(all_b);
  const long double contact =
      kContact * static_cast<long double>(everything.sizes().lpNorm<Eigen::Infinity>());
  const long double posing =
      kPosing * static_cast<long double>(
                    everything.min().cwiseAbs().cwiseMax(everything.max().cwiseAbs()).maxCoeff());

  double limit = some_squared_distance(boxes_a, boxes_b);
  long double lower = static_cast<long double>(kInfinity);
  long double upper = lower;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (squared_gap(boxes_a[i], all_b) > limit) continue;
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (squared_gap(boxes_a[i], boxes_b[j]) > limit) continue;
      const OracleDistance d = oracle_triangle_distance(a[i], b[j]);
      lower = std::min(lower, d.lower());
      upper = std::min(upper, d.upper());
      if (upper <= contact) return {0, upper + posing};
      limit = std::min(limit, static_cast<double>(upper * upper) * (1 + kBoxRounding));
    }
  }
  return {lower + (upper - lower) / 2, (upper - lower) / 2 + posing};
}

// A plane through a face, and the side of it that contains the mean of the vertices. Independent of
// the orientation of the triangles.
struct InwardPlane {
  Point<Quad> point;
  Point<Quad> inward;
  bool is_at_center;  // as far as rounding can tell
};

std::vector<InwardPlane> inward_planes(const QuadTriangles& faces) {
  Point<Quad> sum{};
  for (const PointTriangle<Quad>& face : faces) {
    for (const Point<Quad>& p : face) sum = sum + p;
  }
  const Point<Quad> center = (Quad(1) / Quad(3 * faces.size())) * sum;
  std::vector<InwardPlane> planes;
  for (const PointTriangle<Quad>& face : faces) {
    const Point<Quad> e = face[1] - face[0];
    const Point<Quad> f = face[2] - face[0];
    Point<Quad> n = cross(e, f);
    const Quad norm = square_root(dot(n, n));
    if (!(norm > 0)) continue;
    const Quad rounding = Quad(kNormalRounding) * square_root(dot(e, e) * dot(f, f));
    const Point<Quad> inward = center - face[0];
    const Quad height = dot(n, inward);
    const Quad size = square_root(dot(inward, inward));
    if (height < 0) n = Quad(-1) * n;
    const Quad magnitude = height < 0 ? -height : height;
    planes.push_back({face[0], n, !(magnitude > (Quad(kFlatness) * norm + rounding) * size)});
  }
  return planes;
}

// To be evaluated in the core's own frame: posing rounds, and destroys a sliver's normal.
bool has_inside(const TriangleMesh& core) {
  const std::vector<InwardPlane> planes = inward_planes(posed_triangles(core, RigidPose()));
  return !planes.empty() &&
         std::none_of(planes.begin(), planes.end(),
                      [](const InwardPlane& plane) { return plane.is_at_center; });
}

// @param core The same as `core_W`, in its own frame.
bool any_vertex_inside(const QuadTriangles& triangles, const QuadTriangles& core_W,
                       const TriangleMesh& core) {
  const AlignedBox box = merged(boxes_of(core_W));
  std::vector<Point<Quad>> candidates;
  for (const PointTriangle<Quad>& t : triangles) {
    for (const Point<Quad>& p : t) {
      if (box.contains(to_double(p))) candidates.push_back(p);
    }
  }
  if (candidates.empty() || !has_inside(core)) return false;
  const std::vector<InwardPlane> planes = inward_planes(core_W);
  return std::any_of(candidates.begin(), candidates.end(), [&](const Point<Quad>& p) {
    return std::all_of(planes.begin(), planes.end(), [&](const InwardPlane& plane) {
      return dot(plane.inward, p - plane.point) > 0;
    });
  });
}

}  // namespace

OracleSurface oracle_surface(const Shape& shape) {
  if (shape.kind() == ShapeKind::TriangleMesh) {
    return {&static_cast<const TriangleMesh&>(shape), 0, false};
  }
  const auto& convex = static_cast<const ConvexShape&>(shape);
  DYOP_REQUIRE(convex.core_surface() != nullptr, "the oracle needs a core with a surface");
  return {convex.core_surface(), convex.rounding_radius(), true};
}

QuadTriangles posed_triangles(const TriangleMesh& mesh, const RigidPose& X_WM) {
  std::vector<Point<Quad>> vertices;
  vertices.reserve(mesh.vertices().size());
  for (const Vector3& p : mesh.vertices()) vertices.push_back(posed(X_WM, p));
  QuadTriangles triangles;
  triangles.reserve(mesh.triangles().size());
  for (const TriangleIndices& t : mesh.triangles()) {
    triangles.push_back({vertices[static_cast<std::size_t>(t[0])],
                         vertices[static_cast<std::size_t>(t[1])],
                         vertices[static_cast<std::size_t>(t[2])]});
  }
  return triangles;
}

bool oracle_contains(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB) {
  const OracleSurface surface_a = oracle_surface(a);
  const OracleSurface surface_b = oracle_surface(b);
  if (!surface_a.is_solid && !surface_b.is_solid) return false;
  const QuadTriangles triangles_a = posed_triangles(*surface_a.triangles, X_WA);
  const QuadTriangles triangles_b = posed_triangles(*surface_b.triangles, X_WB);
  return (surface_b.is_solid &&
          any_vertex_inside(triangles_a, triangles_b, *surface_b.triangles)) ||
         (surface_a.is_solid && any_vertex_inside(triangles_b, triangles_a, *surface_a.triangles));
}

OracleDistance oracle_distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                               const RigidPose& X_WB) {
  const OracleSurface surface_a = oracle_surface(a);
  const OracleSurface surface_b = oracle_surface(b);
  if (oracle_contains(a, X_WA, b, X_WB)) return {};
  const OracleDistance cores = surface_distance(posed_triangles(*surface_a.triangles, X_WA),
                                                posed_triangles(*surface_b.triangles, X_WB));
  const long double radii = static_cast<long double>(surface_a.rounding_radius) +
                            static_cast<long double>(surface_b.rounding_radius);
  // The subtraction rounds once more.
  const long double rounding = 0x1p-62L * (cores.distance + radii);
  const long double lower = std::max(0.0L, cores.lower() - radii - rounding);
  const long double upper = std::max(0.0L, cores.upper() - radii + rounding);
  return {lower + (upper - lower) / 2, (upper - lower) / 2};
}

}  // namespace dyop::testing
