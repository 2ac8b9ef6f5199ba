// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/mesh_intersection_oracle.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>

#include <vector>

#include "support/oracles/triangle_oracle.h"

namespace dyop::testing {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

struct PosedTriangle {
  Triangle vertices;
  Kernel::Triangle_3 exact;
  bool is_degenerate;
};

using Box = CGAL::Box_intersection_d::Box_with_handle_d<double, 3, const PosedTriangle*>;

Kernel::Point_3 to_cgal(const Vector3& p) {
  return {p.x(), p.y(), p.z()};
}

std::vector<Vector3> posed_vertices(const TriangleMesh& mesh, const RigidPose& X_WM) {
  std::vector<Vector3> points;
  points.reserve(mesh.vertices().size());
  for (const Vector3& p : mesh.vertices()) points.push_back(X_WM * p);
  return points;
}

AlignedBox box_around(const std::vector<Vector3>& points) {
  AlignedBox box;
  for (const Vector3& p : points) box.extend(p);
  return box;
}

// The triangles that have a box in common with `near`.
std::vector<PosedTriangle> pose(const TriangleMesh& mesh, const std::vector<Vector3>& points,
                                const AlignedBox& near) {
  std::vector<PosedTriangle> triangles;
  for (const TriangleIndices& indices : mesh.triangles()) {
    Triangle t;
    AlignedBox box;
    for (std::size_t k = 0; k < 3; ++k) {
      t[k] = points[static_cast<std::size_t>(indices[k])];
      box.extend(t[k]);
    }
    if (!box.intersects(near)) continue;
    const Kernel::Triangle_3 exact(to_cgal(t[0]), to_cgal(t[1]), to_cgal(t[2]));
    triangles.push_back({t, exact, exact.is_degenerate()});
  }
  return triangles;
}

std::vector<Box> boxes_of(const std::vector<PosedTriangle>& triangles) {
  std::vector<Box> boxes;
  for (const PosedTriangle& t : triangles) boxes.emplace_back(t.exact.bbox(), &t);
  return boxes;
}

bool intersect(const PosedTriangle& a, const PosedTriangle& b) {
  if (a.is_degenerate || b.is_degenerate) return oracle_triangles_intersect(a.vertices, b.vertices);
  return CGAL::do_intersect(a.exact, b.exact);
}

}  // namespace

bool oracle_meshes_intersect(const TriangleMesh& a, const RigidPose& X_WA, const TriangleMesh& b,
                             const RigidPose& X_WB) {
  const std::vector<Vector3> points_a = posed_vertices(a, X_WA);
  const std::vector<Vector3> points_b = posed_vertices(b, X_WB);
  // A common point lies in both boxes.
  const AlignedBox near = box_around(points_a).intersection(box_around(points_b));
  if (near.isEmpty()) return false;
  const std::vector<PosedTriangle> triangles_a = pose(a, points_a, near);
  const std::vector<PosedTriangle> triangles_b = pose(b, points_b, near);
  std::vector<Box> boxes_a = boxes_of(triangles_a);
  std::vector<Box> boxes_b = boxes_of(triangles_b);
  bool is_found = false;
  // The algorithm cannot be stopped from its callback.
  CGAL::box_intersection_d(boxes_a.begin(), boxes_a.end(), boxes_b.begin(), boxes_b.end(),
                           [&](const Box& box_a, const Box& box_b) {
                             is_found = is_found || intersect(*box_a.handle(), *box_b.handle());
                           });
  return is_found;
}

}  // namespace dyop::testing
