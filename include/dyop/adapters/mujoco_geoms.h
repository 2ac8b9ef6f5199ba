// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/height_field.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"

/// Adapters are headers alone: they need their host, and link what the program links anyway.
namespace dyop::adapters {

/// The geoms of a MuJoCo model as shapes, for distances with proven bounds. Links dyop::dyop and
/// libmujoco. Made once per model; then const and thread-safe.
class MujocoGeoms {
 public:
  enum class Meshes {
    Hulls,    ///< as MuJoCo takes them
    Surfaces  ///< as they are
  };

  /// @throws InvalidArgument naming the geom if it has no shape here.
  explicit MujocoGeoms(const mjModel& model, Meshes meshes = Meshes::Hulls) {
    std::vector<std::shared_ptr<const Shape>> loaded(static_cast<std::size_t>(model.nmesh));
    for (int geom = 0; geom < model.ngeom; ++geom) {
      const int data = model.geom_dataid[geom];
      if (model.geom_type[geom] != mjGEOM_MESH) {
        shapes_.push_back(simple_shape(model, geom));
      } else {
        std::shared_ptr<const Shape>& mesh = loaded[static_cast<std::size_t>(data)];
        if (!mesh) mesh = mesh_shape(model, data, meshes);
        shapes_.push_back(mesh);
      }
    }
  }

  std::size_t count() const { return shapes_.size(); }
  /// In the frame of the geom.
  /// @throws InvalidArgument if there is no such geom.
  const Shape& shape(int geom) const {
    DYOP_REQUIRE(geom >= 0 && static_cast<std::size_t>(geom) < count(), "the model has ", count(),
                 " geoms, no geom ", geom);
    return *shapes_[static_cast<std::size_t>(geom)];
  }

  /// The pose of a geom in the world, as the last mj_kinematics() has left it.
  static RigidPose pose(const mjData& data, int geom) {
    const mjtNum* R = data.geom_xmat + 9 * geom;
    const mjtNum* p = data.geom_xpos + 3 * geom;
    Matrix3 R_WG;
    R_WG << R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8];
    return RigidPose(R_WG, Vector3(p[0], p[1], p[2]));
  }

  /// distance() of two geoms; height fields and closed meshes are solids.
  DistanceResult distance(const mjData& data, int geom1, int geom2,
                          DistanceOptions options = {}) const {
    const Shape& a = shape(geom1);
    const Shape& b = shape(geom2);
    options.solid_a = options.solid_a || is_closed_mesh(a);
    options.solid_b = options.solid_b || is_closed_mesh(b);
    return dyop::distance(a, pose(data, geom1), b, pose(data, geom2), options);
  }

  /// In place of MuJoCo's mj_geomDistance(): the signed distance of two geoms, at most `most`. Of
  /// geoms that are apart it is never above the true one. Of convex geoms that overlap it is minus
  /// the penetration depth (through libccd, without proof), of others that overlap 0.
  /// @param fromto Null, or six numbers: from a point on geom1 to one on geom2; zero if they are
  ///               farther apart than `most`.
  mjtNum signed_distance(const mjData& data, int geom1, int geom2, mjtNum most,
                         mjtNum* fromto) const {
    DYOP_REQUIRE(most >= 0, "signed_distance: the largest distance must be >= 0, not ", most);
    const DistanceResult found =
        distance(data, geom1, geom2, {.max_distance = most, .with_penetration = true});
    Vector3 from = found.p_WCa;
    Vector3 to = found.p_WCb;
    mjtNum result = std::min<mjtNum>(found.lower, most);
    if (found.status == DistanceStatus::FartherThanMaxDistance) {
      from = to = Vector3::Zero();
    } else if (found.penetration) {
      result = -found.penetration->depth;
      const Vector3 half = found.penetration->nhat_AB_W * (found.penetration->depth / 2);
      from = found.penetration->p_W + half;
      to = found.penetration->p_W - half;
    }
    for (int k = 0; fromto != nullptr && k < 3; ++k) {
      fromto[k] = from[k];
      fromto[k + 3] = to[k];
    }
    return result;
  }

 private:
  static bool is_closed_mesh(const Shape& shape) {
    const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
    return mesh != nullptr && mesh->is_closed();
  }

  static std::shared_ptr<const Shape> simple_shape(const mjModel& model, int geom) {
    const mjtNum* size = model.geom_size + 3 * geom;
    const Vector3 half(size[0], size[1], size[2]);
    switch (model.geom_type[geom]) {
      case mjGEOM_PLANE:
        return std::make_shared<HalfSpace>();
      case mjGEOM_SPHERE:
        return std::make_shared<Sphere>(size[0]);
      case mjGEOM_CAPSULE:
        return std::make_shared<Capsule>(size[0], size[1]);
      case mjGEOM_ELLIPSOID:
        return std::make_shared<Ellipsoid>(half);
      case mjGEOM_CYLINDER:
        return std::make_shared<Cylinder>(size[0], size[1]);
      case mjGEOM_BOX:
        return std::make_shared<Box>(half);
      case mjGEOM_HFIELD:
        return heights(model, model.geom_dataid[geom]);
      default:
        throw InvalidArgument(core_internal::compose_message(
            "geom ", geom, " has the type ", model.geom_type[geom], ", which has no shape"));
    }
  }

  static std::shared_ptr<const Shape> heights(const mjModel& model, int field) {
    const mjtNum* size = model.hfield_size + 4 * field;
    HeightGrid grid;
    grid.rows = static_cast<std::size_t>(model.hfield_nrow[field]);
    grid.columns = static_cast<std::size_t>(model.hfield_ncol[field]);
    const float* data = model.hfield_data + model.hfield_adr[field];
    for (std::size_t k = 0; k < grid.rows * grid.columns; ++k) {
      grid.heights.push_back(Scalar(data[k]) * size[2]);
    }
    grid.x = -size[0];
    grid.y = -size[1];
    grid.spacing_x = 2 * size[0] / Scalar(grid.columns - 1);
    grid.spacing_y = 2 * size[1] / Scalar(grid.rows - 1);
    grid.base = -size[3];
    return std::make_shared<TriangleMesh>(height_field(grid));
  }

  static std::shared_ptr<const Shape> mesh_shape(const mjModel& model, int mesh, Meshes meshes) {
    std::vector<Vector3> vertices;
    const float* p = model.mesh_vert + 3 * model.mesh_vertadr[mesh];
    for (int k = 0; k < model.mesh_vertnum[mesh]; ++k, p += 3) {
      vertices.emplace_back(Scalar(p[0]), Scalar(p[1]), Scalar(p[2]));
    }
    if (meshes == Meshes::Hulls) return std::make_shared<ConvexHull>(std::move(vertices));
    std::vector<TriangleIndices> triangles;
    const int* i = model.mesh_face + 3 * model.mesh_faceadr[mesh];
    for (int k = 0; k < model.mesh_facenum[mesh]; ++k, i += 3) {
      triangles.push_back({i[0], i[1], i[2]});
    }
    return std::make_shared<TriangleMesh>(std::move(vertices), std::move(triangles));
  }

  std::vector<std::shared_ptr<const Shape>> shapes_;
};

}  // namespace dyop::adapters
