// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/difference_oracle.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Surface_mesh.h>

#include <stdexcept>
#include <vector>

#include "support/inputs/mesh_generators.h"

namespace dyop::testing {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

Surface surface_of(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles) {
  Surface surface;
  std::vector<Surface::Vertex_index> places;
  for (const Vector3& p : vertices) places.push_back(surface.add_vertex({p.x(), p.y(), p.z()}));
  for (const TriangleIndices& t : triangles) {
    surface.add_face(places[std::size_t(t[0])], places[std::size_t(t[1])],
                     places[std::size_t(t[2])]);
  }
  return surface;
}

}  // namespace

Scalar oracle_volume_less_box(const TriangleMesh& mesh_W, const RigidPose& X_WK,
                              const Vector3& half_extents) {
  Surface body = surface_of(mesh_W.vertices(), mesh_W.triangles());
  MeshArrays box = box_mesh(half_extents);
  for (Vector3& p : box.vertices) p = X_WK * p;
  Surface kerf = surface_of(box.vertices, box.triangles);
  Surface rest;
  namespace pmp = CGAL::Polygon_mesh_processing;
  if (!pmp::corefine_and_compute_difference(body, kerf, rest)) {
    throw std::runtime_error("CGAL cannot compute this difference");
  }
  return CGAL::to_double(pmp::volume(rest));
}

}  // namespace dyop::testing
