// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/winding_number.h"

#include <array>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "exact/orientation.h"

namespace dyop {
namespace {

constexpr int kAlong = 2;  // the ray's axis

// Whether the ray may hit what is in this column of the group. The axis-aligned box around the
// oriented one is exact up to the rounding of three products and two sums.
bool may_meet(const BoxGroup& boxes, int column, Scalar scale, const Vector3& p) {
  const Scalar up = 1 + 8 * kUnitRoundoff;
  for (int i = 0; i < 3; ++i) {
    Scalar extent = 0;
    for (int k = 0; k < 3; ++k) {
      extent += std::abs(static_cast<Scalar>(boxes.rows[BoxGroup::kAxes + 3 * k + i][column])) *
                static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents + k][column]);
    }
    extent *= scale * up;
    const Scalar offset =
        p[i] - scale * static_cast<Scalar>(boxes.rows[BoxGroup::kCenter + i][column]);
    if (offset > extent || (i != kAlong && offset < -extent)) return false;
  }
  return true;
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
  const int exponent = std::ilogb(tree.scale());  // larger than all coordinates of the mesh
  const Vector3 p = scaled(p_B, exponent);
  int winding = 0;
  std::array<std::int32_t, MeshHierarchy::kMaxDepth * MeshHierarchy::kWidth + 1> open;
  std::size_t open_count = 0;
  open[open_count++] = 0;
  while (open_count > 0) {
    const MeshHierarchy::Node& node = tree.nodes()[static_cast<std::size_t>(open[--open_count])];
    const int count = node.count();
    for (int column = 0; column < count; ++column) {
      if (!may_meet(node.boxes, column, tree.scale(), p_B)) continue;
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
