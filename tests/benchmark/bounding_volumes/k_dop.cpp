// SPDX-License-Identifier: BSD-3-Clause
#include "benchmark/bounding_volumes/k_dop.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dyop::testing {
namespace {

// Numbers of planes as in `reach`: along axis i, its diagonal with axis j or that of all three,
// with the signs of v.
int face_plane(const Vector3& v, int i) {
  return 2 * i + (v[i] < 0);
}

int edge_plane(const Vector3& v, int i, int j) {
  if (i > j) std::swap(i, j);
  const bool has_opposite_signs = (v[i] < 0) != (v[j] < 0);
  return 2 * (3 + 2 * (i + j - 1) + has_opposite_signs) + (v[i] < 0);
}

int corner_plane(const Vector3& v) {
  const bool is_negative = v[0] < 0;
  return 2 * (9 + 2 * ((v[1] < 0) != is_negative) + ((v[2] < 0) != is_negative)) + is_negative;
}

// The normal of plane 2 * axis.
Vector3 dop_direction(int axis) {
  static constexpr int kSigns[13][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 1, 0},  {1, -1, 0},
                                        {1, 0, 1},  {1, 0, -1}, {0, 1, 1},  {0, 1, -1}, {1, 1, 1},
                                        {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};
  return Eigen::Map<const Eigen::Vector3i>(kSigns[axis]).cast<Scalar>();
}

// The directions split the sphere into triangles, 48 for k = 26 and 32 for k = 18; v lies in one.
template <int k>
PlaneCone find_cone(const Vector3& v) {
  const Vector3 size = v.cwiseAbs();
  std::array<int, 3> order{0, 1, 2};
  if (size[order[0]] < size[order[1]]) std::swap(order[0], order[1]);
  if (size[order[1]] < size[order[2]]) std::swap(order[1], order[2]);
  if (size[order[0]] < size[order[1]]) std::swap(order[0], order[1]);
  const auto [i, j, l] = order;
  const Scalar x = size[i];
  const Scalar y = size[j];
  const Scalar z = size[l];
  if constexpr (k == 26) {
    return {{face_plane(v, i), edge_plane(v, i, j), corner_plane(v)}, {x - y, y - z, z}};
  } else if (x >= y + z) {
    return {{face_plane(v, i), edge_plane(v, i, j), edge_plane(v, i, l)}, {x - y - z, y, z}};
  } else {
    return {{edge_plane(v, i, j), edge_plane(v, i, l), edge_plane(v, j, l)},
            {(x + y - z) / 2, (x + z - y) / 2, (y + z - x) / 2}};
  }
}

template <int k>
Scalar reach_along(const Dop<k>& dop, const PlaneCone& cone) {
  Scalar sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    sum += cone.weights[int(i)] * dop.reach[std::size_t(cone.planes[i])];
  }
  return sum;
}

// Opposite planes are neighbours.
template <int k>
Scalar reach_against(const Dop<k>& dop, const PlaneCone& cone) {
  Scalar sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    sum += cone.weights[int(i)] * dop.reach[std::size_t(cone.planes[i] ^ 1)];
  }
  return sum;
}

}  // namespace

template <int k>
Dop<k> Dop<k>::fit(std::span<const Vector3> points) {
  Dop dop;
  for (std::size_t axis = 0; axis < std::size_t(kAxes); ++axis) {
    const Vector3 direction = dop_direction(int(axis));
    Scalar lo = kInfinity;
    Scalar hi = -kInfinity;
    for (const Vector3& p : points) {
      lo = std::min(lo, direction.dot(p));
      hi = std::max(hi, direction.dot(p));
    }
    dop.reach[2 * axis] = hi;
    dop.reach[2 * axis + 1] = -lo;
  }
  return dop;
}

template <int k>
Dop<k>::Placement::Placement(const RigidPose& pose) : X_AB(pose) {
  const Matrix3& R = X_AB.rotation();
  const Vector3& p = X_AB.translation();
  for (int axis = 0; axis < kAxes; ++axis) {
    const Vector3 normal = dop_direction(axis);
    const Vector3 normal_A = R * normal;
    const Scalar inverse_length = 1 / normal.norm();
    of_a[std::size_t(axis)] = {find_cone<k>(R.transpose() * normal), normal.dot(p), normal,
                               inverse_length};
    of_b[std::size_t(axis)] = {find_cone<k>(normal_A), normal_A.dot(p), normal_A, inverse_length};
  }
}

template <int k>
Separation separation(const typename Dop<k>::Placement& placement, const Dop<k>& a,
                      const Dop<k>& b) {
  const Matrix3& R = placement.X_AB.rotation();
  const Vector3 t = placement.X_AB * b.center() - a.center();
  Scalar gap = 0;
  const Vector3* normal = nullptr;
  Scalar sign = 1;
  const auto take = [&](const typename Dop<k>::Placement::Axis& axis, Scalar along,
                        Scalar against) {
    const Scalar axis_gap = std::max(along, against) * axis.inverse_length;
    if (axis_gap > gap) {
      gap = axis_gap;
      normal = &axis.normal_A;
      sign = std::copysign(axis.inverse_length, along - against);
    }
  };
  for (std::size_t i = 0; i < std::size_t(Dop<k>::kAxes); ++i) {
    const auto& of_a = placement.of_a[i];
    take(of_a, of_a.offset - reach_against(b, of_a.cone) - a.reach[2 * i],
         -of_a.offset - reach_along(b, of_a.cone) - a.reach[2 * i + 1]);
    const auto& of_b = placement.of_b[i];
    take(of_b, of_b.offset - reach_along(a, of_b.cone) - b.reach[2 * i + 1],
         -of_b.offset - reach_against(a, of_b.cone) - b.reach[2 * i]);
  }
  const Scalar center_gap =
      (t.dot(placement.X_AB.translation()) - reach_against(b, find_cone<k>(R.transpose() * t)) -
       reach_along(a, find_cone<k>(t))) /
      t.norm();
  if (center_gap > gap) return {center_gap, t.normalized()};
  return gap > 0 ? Separation{gap, sign * *normal} : Separation{};
}

template struct Dop<18>;
template struct Dop<26>;
template Separation separation(const Dop<18>::Placement&, const Dop<18>&, const Dop<18>&);
template Separation separation(const Dop<26>::Placement&, const Dop<26>&, const Dop<26>&);

}  // namespace dyop::testing
