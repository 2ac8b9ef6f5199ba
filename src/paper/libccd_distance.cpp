// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/libccd_distance.h"

#include <ccd/ccd.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/tolerance.h"

namespace dyop {
namespace {

static_assert(sizeof(ccd_real_t) == sizeof(Scalar), "libccd must be built with double precision");

using CcdTriangle = std::array<ccd_vec3_t, 3>;

void support_of_triangle(const void* triangle, const ccd_vec3_t* direction, ccd_vec3_t* point) {
  const auto& vertices = *static_cast<const CcdTriangle*>(triangle);
  const ccd_vec3_t* best = &vertices[0];
  for (const ccd_vec3_t& vertex : vertices) {
    if (ccdVec3Dot(&vertex, direction) > ccdVec3Dot(best, direction)) best = &vertex;
  }
  *point = *best;
}

// Up to four points of the Minkowski difference A - B, whose nearest point libccd finds.
class CcdSimplex {
 public:
  bool contains(const ccd_vec3_t& point) const {
    return std::any_of(points_.begin(), points_.begin() + count_,
                       [&](const ccd_vec3_t& p) { return ccdVec3Eq(&p, &point) != 0; });
  }

  void add(const ccd_vec3_t& point) { points_[static_cast<std::size_t>(count_++)] = point; }

  // Squared distance of the origin to the nearest point. Of four points, keeps the triangle that
  // has it; a tetrahedron around the origin has no such triangle at distance zero, so the loop ends
  // for lack of progress.
  Scalar reduce(ccd_vec3_t* nearest) {
    const auto& p = points_;
    switch (count_) {
      case 1:
        *nearest = p[0];
        return ccdVec3Len2(&p[0]);
      case 2:
        return ccdVec3PointSegmentDist2(ccd_vec3_origin, &p[0], &p[1], nearest);
      case 3:
        return ccdVec3PointTriDist2(ccd_vec3_origin, &p[0], &p[1], &p[2], nearest);
      default:
        return keep_nearest_triangle(nearest);
    }
  }

  // Whether the four points enclose the origin, which is then on the inner side of every face.
  bool holds_origin(const ccd_vec3_t& added) const {
    if (count_ < 3) return false;
    const std::array<ccd_vec3_t, 4> p{points_[0], points_[1], points_[2], added};
    constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
    for (const auto& face : kFaces) {
      const auto& corner = p[static_cast<std::size_t>(face[0])];
      ccd_vec3_t u, v, n, inner;
      ccdVec3Sub2(&u, &p[static_cast<std::size_t>(face[1])], &corner);
      ccdVec3Sub2(&v, &p[static_cast<std::size_t>(face[2])], &corner);
      ccdVec3Sub2(&inner, &p[static_cast<std::size_t>(face[3])], &corner);
      ccdVec3Cross(&n, &u, &v);
      if (!(-ccdVec3Dot(&n, &corner) * ccdVec3Dot(&n, &inner) > 0)) return false;
    }
    return true;
  }

 private:
  Scalar keep_nearest_triangle(ccd_vec3_t* nearest) {
    constexpr int kFaces[4][3] = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 1, 2}};
    const std::array<ccd_vec3_t, 4> p = points_;
    Scalar best = kInfinity;
    for (const auto& [i, j, k] : kFaces) {
      const std::array<ccd_vec3_t, 3> face{p[static_cast<std::size_t>(i)],
                                           p[static_cast<std::size_t>(j)],
                                           p[static_cast<std::size_t>(k)]};
      ccd_vec3_t point;
      const Scalar squared =
          ccdVec3PointTriDist2(ccd_vec3_origin, &face[0], &face[1], &face[2], &point);
      if (!(squared < best)) continue;
      best = squared;
      *nearest = point;
      std::copy(face.begin(), face.end(), points_.begin());
    }
    count_ = 3;
    return best;
  }

  std::array<ccd_vec3_t, 4> points_;
  int count_ = 0;
};

Scalar run_loop(const CcdTriangle& a, const CcdTriangle& b) {
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = support_of_triangle;
  ccd.support2 = support_of_triangle;
  CcdSimplex simplex;
  ccd_vec3_t nearest;
  ccdVec3Sub2(&nearest, &a[0], &b[0]);
  simplex.add(nearest);
  Scalar distance_sq = ccdVec3Len2(&nearest);
  for (int k = 0; k < kTextbookGjkLimit && distance_sq > 0; ++k) {
    ccd_vec3_t backwards = nearest;
    ccdVec3Scale(&backwards, -1);
    ccd_vec3_t on_a, on_b, added;
    ccd.support1(&a, &backwards, &on_a);
    ccd.support2(&b, &nearest, &on_b);
    ccdVec3Sub2(&added, &on_a, &on_b);
    const Scalar reach = ccdVec3Dot(&nearest, &added);  // positive only if they are apart
    const bool has_converged = distance_sq - reach <= kTextbookGjkConvergence * distance_sq;
    if (has_converged || simplex.contains(added)) break;
    if (!(reach > 0) && simplex.holds_origin(added)) return 0;
    simplex.add(added);
    const Scalar nearer_sq = simplex.reduce(&nearest);
    if (!(nearer_sq < distance_sq)) break;
    distance_sq = nearer_sq;
  }
  return std::sqrt(distance_sq);
}

// libccd's tolerances are absolute and meant for coordinates of about one.
template <typename AnyTriangle>
Scalar scaled_distance(const AnyTriangle& a, const AnyTriangle& b) {
  const auto origin = a[0];
  Scalar size = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    size = std::max(
        {size, (a[k] - origin).cwiseAbs().maxCoeff(), (b[k] - origin).cwiseAbs().maxCoeff()});
  }
  if (!(size > 0)) return 0;
  const Scalar inverse = 1 / size;
  CcdTriangle ccd_a{};
  CcdTriangle ccd_b{};
  for (std::size_t k = 0; k < 3; ++k) {
    for (Eigen::Index axis = 0; axis < origin.size(); ++axis) {
      ccd_a[k].v[axis] = (a[k][axis] - origin[axis]) * inverse;
      ccd_b[k].v[axis] = (b[k][axis] - origin[axis]) * inverse;
    }
  }
  return size * run_loop(ccd_a, ccd_b);
}

}  // namespace

Scalar libccd_distance(const Triangle& a, const Triangle& b) {
  return scaled_distance(a, b);
}

Scalar libccd_distance(const PlanarTriangle& a, const PlanarTriangle& b) {
  return scaled_distance(a, b);
}

}  // namespace dyop
