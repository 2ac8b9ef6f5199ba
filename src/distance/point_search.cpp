// SPDX-License-Identifier: BSD-3-Clause
#include "distance/point_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/compound_tree.h"

namespace dyop::distance_internal {
namespace {

struct OpenBox {
  Scalar gap_sq;  // lower bound, in units of the hierarchy's scale
  std::int32_t child;
};

constexpr int kGroupSize = BoxGroup::kWidth;

// Lower bounds on the squared distances of the boxes of a group to a point q, both in their frame,
// before rounding outward: |y| - h, with y the coordinates of the point along a box's axes, h
// its half extents.
//
// The stored axes A have single precision: AᵀA = I + E with entries of E below 2^-23. For any point
// c + A x of the box, |x_k| <= h_k, component k of Aᵀ times the difference to the point is y_k - x_k
// - (E x)_k, so it is at least |y_k| - h_k - 2^-23 (h_1 + h_2 + h_3), and Aᵀ stretches by less than 1
// + 2^-22. kPointBoxNoise, 2^-20, covers both and all rounding in double.
std::array<Scalar, kGroupSize> squared_gaps(const BoxGroup& boxes, const Vector3& q) {
  std::array<Scalar, kGroupSize> x, y, z, slack, sum{};
  for (int i = 0; i < kGroupSize; ++i) {
    const auto k = static_cast<std::size_t>(i);
    x[k] = q.x() - static_cast<Scalar>(boxes.rows[BoxGroup::kCenter][i]);
    y[k] = q.y() - static_cast<Scalar>(boxes.rows[BoxGroup::kCenter + 1][i]);
    z[k] = q.z() - static_cast<Scalar>(boxes.rows[BoxGroup::kCenter + 2][i]);
    slack[k] = kPointBoxNoise * (static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents][i]) +
                                 static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents + 1][i]) +
                                 static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents + 2][i]));
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto* row = boxes.rows + BoxGroup::kAxes + 3 * axis;
    const float* half = boxes.rows[BoxGroup::kHalfExtents + axis];
    for (int i = 0; i < kGroupSize; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Scalar along =
          std::abs(x[k] * static_cast<Scalar>(row[0][i]) + y[k] * static_cast<Scalar>(row[1][i]) +
                   z[k] * static_cast<Scalar>(row[2][i]));
      const Scalar beyond = along - static_cast<Scalar>(half[i]) - slack[k];
      const Scalar outside = beyond > 0 ? beyond : 0;
      sum[k] += outside * outside;
    }
  }
  return sum;
}

// A lower bound on a distance from a gap of a box.
Scalar proven_distance(Scalar gap_sq, Scalar scale) {
  return std::sqrt(gap_sq * (1 - 2 * kPointBoxNoise)) * scale;
}

class PointSearch {
 public:
  PointSearch(const TriangleMesh& mesh, const Vector3& p, Scalar limit)
      : mesh_(mesh), tree_(mesh.hierarchy()), p_(p), q_(tree_.frame().local(p)), limit_(limit) {}

  NearestToPoint run() {
    open(0);
    while (count_ > 0) {
      const OpenBox box = stack_[--count_];
      if (is_far(box.gap_sq)) continue;
      if (box.child >= 0) {
        open(box.child);
      } else {
        visit(-1 - box.child);
      }
    }
    result_.nearest.lower = std::min(lower_, result_.nearest.upper);
    return result_;
  }

 private:
  // Proven farther than what is known or sought. Squares err by much less than the noise.
  bool is_far(Scalar gap_sq) {
    const Scalar cutoff = std::min(result_.nearest.upper, limit_);
    const Scalar proven_sq = gap_sq * (1 - 2 * kPointBoxNoise);
    const Scalar in_units = cutoff / tree_.frame().scale;
    if (!(proven_sq > in_units * in_units)) return false;
    lower_ = std::min(lower_, std::max(cutoff, proven_distance(gap_sq, tree_.frame().scale)));
    return true;
  }

  // Pushes the boxes of a node, nearest on top.
  void open(std::int32_t number) {
    const MeshHierarchy::Node& node = tree_.nodes()[static_cast<std::size_t>(number)];
    const std::array<Scalar, kGroupSize> gaps = squared_gaps(node.boxes, q_);
    const std::size_t first = count_;
    const int count = node.count();
    for (int i = 0; i < count; ++i) {
      const Scalar gap = gaps[static_cast<std::size_t>(i)];
      if (is_far(gap)) continue;
      std::size_t place = count_++;
      for (; place > first && stack_[place - 1].gap_sq < gap; --place) {
        stack_[place] = stack_[place - 1];
      }
      stack_[place] = {gap, node.child[i]};
    }
  }

  void visit(std::int32_t triangle) {
    const PointTriangleDistance found = point_triangle_distance(p_, mesh_.triangle(triangle));
    lower_ = std::min(lower_, found.lower);
    if (!(found.upper < result_.nearest.upper)) return;
    result_.nearest = found;
    result_.triangle = triangle;
  }

  const TriangleMesh& mesh_;
  const MeshHierarchy& tree_;
  const Vector3 p_;
  const Vector3 q_;  // in the frame of the boxes
  const Scalar limit_;
  Scalar lower_ = kInfinity;  // of everything skipped or measured
  NearestToPoint result_;
  std::size_t count_ = 0;
  std::array<OpenBox, MeshHierarchy::kMaxDepth * kGroupSize + 1> stack_;
};

}  // namespace

NearestToPoint find_nearest_to_point(const TriangleMesh& mesh, const Vector3& p, Scalar limit) {
  return PointSearch(mesh, p, limit).run();
}

Scalar visit_parts_near_point(const geometry_internal::CompoundTree& tree, const Vector3& p,
                              Scalar limit, const std::function<Scalar(std::int32_t)>& visit) {
  const Vector3 q = tree.frame.local(p);
  Scalar left_out = kInfinity;
  struct Open {
    Scalar distance;
    std::int32_t box;
  };
  std::vector<Open> stack{{0, 0}};
  while (!stack.empty()) {
    const Open open = stack.back();
    stack.pop_back();
    if (open.distance > limit) {
      left_out = std::min(left_out, open.distance);
      continue;
    }
    if (tree.is_part(open.box)) {
      limit = std::min(limit, visit(tree.part_in(open.box)));
      continue;
    }
    const auto box = static_cast<std::size_t>(open.box);
    const std::int32_t number = tree.nodes[box / kGroupSize].child[box % kGroupSize];
    const MeshHierarchy::Node& node = tree.nodes[static_cast<std::size_t>(number)];
    const std::array<Scalar, kGroupSize> gaps = squared_gaps(node.boxes, q);
    const auto first = static_cast<std::ptrdiff_t>(stack.size());
    for (int i = 0; i < node.count(); ++i) {
      const Scalar gap = gaps[static_cast<std::size_t>(i)];
      stack.push_back({proven_distance(gap, tree.frame.scale), number * kGroupSize + i});
    }
    std::sort(stack.begin() + first, stack.end(),
              [](const Open& x, const Open& y) { return x.distance > y.distance; });
  }
  return left_out;
}

namespace {

// The weights of vertices 1 and 2 at the nearest point, and the feature it lies on.
struct Place {
  Scalar s = 0;
  Scalar t = 0;
  Feature feature{FeatureKind::Vertex, {0}};
};

// The place of the nearest point of a triangle with the edges e1 and e2 from vertex 0, which is at
// r from the point: by the Voronoi regions of its features ([Ericson2005] 5.1.5).
Place find_place(const Vector3& r, const Vector3& e1, const Vector3& e2) {
  const Scalar d1 = -e1.dot(r);
  const Scalar d2 = -e2.dot(r);
  if (d1 <= 0 && d2 <= 0) return {};
  const Vector3 r1 = r + e1;
  const Scalar d3 = -e1.dot(r1);
  const Scalar d4 = -e2.dot(r1);
  if (d3 >= 0 && d4 <= d3) return {1, 0, {FeatureKind::Vertex, {1}}};
  const Vector3 r2 = r + e2;
  const Scalar d5 = -e1.dot(r2);
  const Scalar d6 = -e2.dot(r2);
  if (d6 >= 0 && d5 <= d6) return {0, 1, {FeatureKind::Vertex, {2}}};
  const Scalar vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    return {d1 / (d1 - d3), 0, {FeatureKind::Edge, {0, 1}}};
  }
  const Scalar vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    return {0, d2 / (d2 - d6), {FeatureKind::Edge, {0, 2}}};
  }
  const Scalar va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const Scalar t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {1 - t, t, {FeatureKind::Edge, {1, 2}}};
  }
  const Scalar sum = va + vb + vc;
  const Scalar s = vb / sum;
  return {s, std::min(vc / sum, 1 - s), {FeatureKind::Face, {0, 1, 2}}};
}

// The direction from the point that should prove the distance; any length. Perpendicular to the
// feature, because rounding of the witness would tilt it.
Vector3 direction_of(const Place& place, const Vector3& r, const Vector3& e1, const Vector3& e2,
                     const Vector3& D) {
  switch (place.feature.kind) {
    case FeatureKind::Face: {
      const Vector3 n = e1.cross(e2);
      return n.dot(r) >= 0 ? n : Vector3(-n);
    }
    case FeatureKind::Edge: {
      const auto& ends = place.feature.vertices;
      const Vector3 edge = ends[0] == 1 ? Vector3(e2 - e1) : (ends[1] == 1 ? e1 : e2);
      return D - edge * (edge.dot(D) / edge.squaredNorm());
    }
    case FeatureKind::Vertex:
    case FeatureKind::Smooth:
      break;
  }
  return D;
}

PointTriangleDistance by_triangles(const Vector3& p, const Triangle& triangle) {
  const TriangleDistance kernel = triangle_distance({p, p, p}, triangle);
  return {kernel.lower, kernel.upper, kernel.p_b, -kernel.nhat_AB, kernel.feature_b};
}

}  // namespace

PointTriangleDistance point_triangle_distance(const Vector3& p, const Triangle& triangle) {
  const Vector3 r = triangle[0] - p;
  const Vector3 e1 = triangle[1] - triangle[0];
  const Vector3 e2 = triangle[2] - triangle[0];
  // At least |r| plus the longest edge.
  const Scalar size = r.norm() + e1.norm() + e2.norm();
  // NaN and infinity take the slow path too.
  if (!(size >= kSmallestTriangleSize && size <= kLargestTriangleSize)) {
    return by_triangles(p, triangle);
  }
  const Place place = find_place(r, e1, e2);
  const Vector3 along = place.s * e1 + place.t * e2;
  const Vector3 D = r + along;
  const Vector3 m = direction_of(place, r, e1, e2, D);
  const Scalar norm_sq = m.squaredNorm();
  if (!(norm_sq > kSmallestSquaredDirection)) return by_triangles(p, triangle);
  // The operations of prove() in triangle_pair.h, with a point for A: the same slack covers them.
  const Scalar norm = std::sqrt(norm_sq);
  const Scalar gap = (m.dot(r) + std::min(0.0, std::min(m.dot(e1), m.dot(e2)))) / norm;
  const Scalar length = D.norm();
  const Scalar size_slack = kTriangleSizeSlack * size;
  PointTriangleDistance result;
  result.lower = std::max(0.0, gap - (kTriangleRelativeSlack * std::abs(gap) + size_slack));
  result.upper = length + (kTriangleRelativeSlack * length + size_slack);
  // Also if the weights are NaN, or not those of a point of the triangle.
  if (!(result.upper - result.lower <= kTriangleNoise * size)) return by_triangles(p, triangle);
  result.p_C = triangle[0] + along;
  result.nhat_C = m / -norm;
  result.feature = place.feature;
  return result;
}

namespace {

const TriangleMesh* as_mesh(const Shape& shape) {
  return shape.kind() == ShapeKind::TriangleMesh ? static_cast<const TriangleMesh*>(&shape)
                                                 : nullptr;
}

// Calls `visit` with the meshes and convex shapes that a shape consists of, in its frame, until one
// call returns true; returns whether one did.
template <typename Visit>
bool visit_parts(const Shape& shape, const Visit& visit) {
  if (shape.kind() != ShapeKind::Compound) return visit(shape);
  const auto& parts = static_cast<const CompoundShape&>(shape).tree().parts;
  return std::any_of(parts.begin(), parts.end(),
                     [&](const CompoundPart& part) { return visit(part.shape()); });
}

// A connected part is either all inside or all outside.
std::optional<Vector3> find_inside_mesh(const TriangleMesh& solid, const RigidPose& X_WS,
                                        const Shape& shape, const RigidPose& X_WP) {
  const RigidPose X_SP = X_WS.inverse() * X_WP;
  if (const TriangleMesh* mesh = as_mesh(shape)) {
    for (const std::int32_t v : mesh->part_vertices()) {
      const Vector3& p = mesh->vertices()[std::size_t(v)];
      if (contains(solid, X_SP * p)) return X_WP * p;
    }
    return std::nullopt;
  }
  const Vector3 p = static_cast<const ConvexShape&>(shape).core_center();
  if (contains(solid, X_SP * p)) return X_WP * p;
  return std::nullopt;
}

std::optional<Vector3> find_inside(const Shape& solid, const RigidPose& X_WS, const Shape& shape,
                                   const RigidPose& X_WP) {
  std::optional<Vector3> found;
  visit_parts(solid, [&](const Shape& outer) {
    const TriangleMesh* mesh = as_mesh(outer);
    return mesh && visit_parts(shape, [&](const Shape& inner) {
             found = find_inside_mesh(*mesh, X_WS, inner, X_WP);
             return found.has_value();
           });
  });
  return found;
}

}  // namespace

void require_closed(const char* query, const Shape& a, const Shape& b, const Solids& solids) {
  const auto is_sound = [](const Shape& shape) {
    return !visit_parts(shape, [](const Shape& part) {
      const TriangleMesh* mesh = as_mesh(part);
      return mesh && !mesh->is_closed();
    });
  };
  DYOP_REQUIRE(!solids.a || is_sound(a), query, ": solid_a is set, but the mesh A is not closed");
  DYOP_REQUIRE(!solids.b || is_sound(b), query, ": solid_b is set, but the mesh B is not closed");
}

std::optional<Vector3> find_enclosed_point(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                           const RigidPose& X_WB, const Solids& solids) {
  if (solids.b) {
    if (const auto p_W = find_inside(b, X_WB, a, X_WA)) return p_W;
  }
  if (solids.a) return find_inside(a, X_WA, b, X_WB);
  return std::nullopt;
}

}  // namespace dyop::distance_internal
