// SPDX-License-Identifier: BSD-3-Clause
#include <ccd/ccd.h>

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "distance/core_distance.h"
#include "dyop/distance/gjk.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop {
namespace {

static_assert(sizeof(ccd_real_t) == sizeof(Scalar), "libccd must be built with double precision");

// One shape as passed to libccd, in frame A and in units of the query's size, because libccd's
// tolerances are absolute.
struct CcdShape {
  const ConvexShape& shape;
  RigidPose X_AS;
  Scalar radius;  // of the ball that inflates the core
  Scalar scale;
  mutable int calls_left = kPenetrationSupportLimit;

  Vector3 center() const { return X_AS * shape.core_center() / scale; }

  Vector3 support(const Vector3& direction_A) const {
    // libccd's loops end when a support point brings nothing new: returning a fixed point ends them
    // all.
    if (--calls_left < 0 || !(direction_A.norm() > 0)) return center();
    const Vector3 nhat_A = direction_A.normalized();
    const Vector3 p_S = shape.core_support(X_AS.rotation().transpose() * nhat_A).point;
    return (X_AS * p_S + radius * nhat_A) / scale;
  }
};

ccd_vec3_t to_ccd(const Vector3& p) {
  return {{p.x(), p.y(), p.z()}};
}

Vector3 from_ccd(const ccd_vec3_t& p) {
  return {p.v[0], p.v[1], p.v[2]};
}

void support_of_shape(const void* shape, const ccd_vec3_t* direction, ccd_vec3_t* point) {
  *point = to_ccd(static_cast<const CcdShape*>(shape)->support(from_ccd(*direction)));
}

void center_callback(const void* shape, ccd_vec3_t* point) {
  *point = to_ccd(static_cast<const CcdShape*>(shape)->center());
}

// The direction along which two overlapping shapes must move the least to separate, kept as the
// best of several candidates. Each depth is measured with the support functions, so a poor
// candidate can be too deep but never fails to separate.
class DepthSearch {
 public:
  DepthSearch(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB)
      : a_(a),
        b_(b),
        X_AB_(X_AB),
        scale_(distance_internal::length_for_noise(X_AB.translation()) + a.bounding_radius() +
               b.bounding_radius()) {}

  void try_direction(const Vector3& direction_A) {
    const Scalar norm = direction_A.norm();
    if (!(norm > 0 && std::isfinite(norm))) return;
    const Vector3 nhat_A = direction_A / norm;
    const Vector3 nhat_B = X_AB_.rotation().transpose() * nhat_A;
    const Scalar depth = nhat_A.dot(a_.core_support(nhat_A).point) -
                         nhat_A.dot(X_AB_ * b_.core_support(-nhat_B).point) + a_.rounding_radius() +
                         b_.rounding_radius();
    // Rounded up, so that a shape moved by it is separated despite rounding.
    const Scalar rounded_up = depth + kPoseNoise * scale_;
    if (rounded_up > 0 && rounded_up < depth_) {
      depth_ = rounded_up;
      nhat_AB_A_ = nhat_A;
    }
  }

  // The depth of two polytopes is that along the normal of a face of either, or of an edge of each:
  // these are the normals of the faces of their difference. For two boxes all of them are tried, so
  // that the depth is exact.
  void try_faces() {
    const Matrix3 axes_b = X_AB_.rotation();
    const bool is_box_a = a_.simple_core().kind == CoreKind::Box;
    const bool is_box_b = b_.simple_core().kind == CoreKind::Box;
    try_face_normals(a_, Matrix3::Identity());
    try_face_normals(b_, axes_b);
    if (!is_box_a || !is_box_b) return;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const Vector3 across = Vector3::Unit(i).cross(axes_b.col(j));
        // literal: squared sine; the normal of edges closer to parallel is that of faces.
        if (across.squaredNorm() > 1e-16) try_both_ways(across);
      }
    }
  }

  // The expanding polytope algorithm, or Minkowski portal refinement where that fails. For
  // polytopes it ends at a face of the difference of the cores; the ball adds its radius to the
  // depth and leaves the direction unchanged (parallel bodies of convex sets).
  void try_libccd(bool with_rounding) {
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.support1 = support_of_shape;
    ccd.support2 = support_of_shape;
    ccd.center1 = center_callback;
    ccd.center2 = center_callback;
    ccd.max_iterations = kPenetrationSupportLimit;
    ccd.epa_tolerance = kPenetrationTolerance;
    ccd.mpr_tolerance = kPenetrationTolerance;
    for (const auto algorithm : {ccdGJKPenetration, ccdMPRPenetration}) {
      const CcdShape a{a_, RigidPose(), with_rounding ? a_.rounding_radius() : 0, scale_};
      const CcdShape b{b_, X_AB_, with_rounding ? b_.rounding_radius() : 0, scale_};
      ccd_real_t depth = 0;
      ccd_vec3_t direction = to_ccd(Vector3::Zero());
      ccd_vec3_t position = to_ccd(Vector3::Zero());
      if (algorithm(&a, &b, &ccd, &depth, &direction, &position) == 0) {
        try_direction(from_ccd(direction));
      }
    }
  }

  // libccd may stop slightly before the right face. From just outside the overlap, GJK finds the
  // nearest face itself.
  void polish() {
    for (int i = 0; i < kPenetrationPolishLimit && has_direction(); ++i) {
      const Scalar previous = depth_;
      // An eighth more than needed: far enough out for an accurate direction.
      const RigidPose X_AB_apart = RigidPose::from_trusted(
          X_AB_.rotation(), X_AB_.translation() + 1.125 * depth_ * nhat_AB_A_);
      try_direction(gjk_distance(a_, b_, X_AB_apart).nhat_AB);
      if (!(depth_ < previous)) return;
    }
  }

  bool has_direction() const { return depth_ < kInfinity; }
  Scalar depth() const { return depth_; }
  const Vector3& nhat_AB_A() const { return nhat_AB_A_; }

 private:
  // More faces than this would take longer than everything else.
  static constexpr std::size_t kMostFaces = 128;

  void try_both_ways(const Vector3& direction_A) {
    try_direction(direction_A);
    try_direction(-direction_A);
  }

  // R_AS turns the shape's frame into that of A.
  void try_face_normals(const ConvexShape& shape, const Matrix3& R_AS) {
    if (shape.simple_core().kind == CoreKind::Box) {
      for (int k = 0; k < 3; ++k) try_both_ways(R_AS.col(k));
      return;
    }
    const TriangleMesh* surface = shape.core_surface();
    if (!surface || surface->triangles().size() > kMostFaces) return;
    for (std::size_t k = 0; k < surface->triangles().size(); ++k) {
      const Triangle t = surface->triangle(static_cast<std::int32_t>(k));
      const Vector3 normal_S = (t[1] - t[0]).cross(t[2] - t[0]);
      if (normal_S.squaredNorm() > 0) try_both_ways(R_AS * normal_S);
    }
  }

  const ConvexShape& a_;
  const ConvexShape& b_;
  const RigidPose& X_AB_;
  Scalar scale_;
  Scalar depth_ = kInfinity;
  Vector3 nhat_AB_A_ = Vector3::UnitX();
};

}  // namespace

std::optional<Penetration> find_penetration(const ConvexShape& a, const RigidPose& X_WA,
                                            const ConvexShape& b, const RigidPose& X_WB) {
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  const GjkResult gjk = gjk_distance(a, b, X_AB);
  if (!gjk.is_overlapping) return std::nullopt;

  if (const auto gap = distance_internal::half_space_gap(a, b, X_AB)) {
    const Vector3 nhat_AB = gap->is_of_b ? Vector3(-gap->normal) : gap->normal;
    return Penetration{std::max(Scalar(0), gap->noise - gap->height), X_WA.rotation() * nhat_AB,
                       X_WA * gap->lowest};
  }
  DepthSearch search(a, b, X_AB);
  search.try_direction(gjk.nhat_AB);
  const Scalar radii = a.rounding_radius() + b.rounding_radius();
  // Less than the radii: the cores are separated, and the direction of their distance is the
  // answer.
  const bool are_boxes =
      a.simple_core().kind == CoreKind::Box && b.simple_core().kind == CoreKind::Box;
  if (!(search.depth() < radii)) search.try_faces();
  if (!(search.depth() < radii) && !are_boxes) {
    search.try_libccd(false);
    // Cores with a flat difference (crossing segments, equal points) have no volume, which libccd
    // needs.
    if (radii > 0) search.try_libccd(true);
    search.polish();
  }
  if (!search.has_direction()) return std::nullopt;
  return Penetration{search.depth(), X_WA.rotation() * search.nhat_AB_A(),
                     X_WA * ((gjk.p_a + gjk.p_b) / 2)};
}

}  // namespace dyop
