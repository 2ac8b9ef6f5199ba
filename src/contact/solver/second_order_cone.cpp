// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/second_order_cone.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dyop::contact_internal {

Scalar cone_determinant(const Vector3& x) {
  const Scalar t = x.tail<2>().norm();
  return (x[0] - t) * (x[0] + t);
}

Vector3 cone_product(const Vector3& a, const Vector3& b) {
  return {a.dot(b), a[0] * b[1] + b[0] * a[1], a[0] * b[2] + b[0] * a[2]};
}

Vector3 cone_quotient(const Vector3& a, const Vector3& b) {
  const Scalar x = (a[0] * b[0] - a.tail<2>().dot(b.tail<2>())) / cone_determinant(a);
  return {x, (b[1] - x * a[1]) / a[0], (b[2] - x * a[2]) / a[0]};
}

Scalar way_to_cone(const Vector3& x, const Vector3& d) {
  const Scalar c = cone_determinant(x);
  const Scalar b = x[0] * d[0] - x.tail<2>().dot(d.tail<2>());
  const Scalar a = d[0] * d[0] - d.tail<2>().squaredNorm();
  Scalar way = d[0] < 0 ? -x[0] / d[0] : kInfinity;
  // Roots of a s^2 + 2 b s + c, without cancellation.
  const Scalar discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return way;
  const Scalar root = std::sqrt(discriminant);
  const Scalar q = b >= 0 ? -(b + root) : root - b;
  for (const Scalar s : {q / a, c / q}) {
    if (s > 0 && s < way) way = s;
  }
  return way;
}

ConeScaling::ConeScaling(const Vector3& z, const Vector3& x) {
  constexpr Scalar kLeast = std::numeric_limits<Scalar>::min();  // rounding may leave the cone
  const Scalar size_z = std::sqrt(std::max(cone_determinant(z), kLeast));
  const Scalar size_x = std::sqrt(std::max(cone_determinant(x), kLeast));
  const Scalar gain = std::sqrt(size_z / size_x);
  Vector3 w = z / size_z;
  w[0] += x[0] / size_x;
  w.tail<2>() -= x.tail<2>() / size_x;
  w /= std::sqrt(2 * (1 + z.dot(x) / (size_z * size_x)));  // determinant one
  const Vector2 t = w.tail<2>();
  const Eigen::Matrix2d block = Eigen::Matrix2d::Identity() + t * t.transpose() / (1 + w[0]);
  W << w[0], t.transpose(), t, block;
  inverse << w[0], -t.transpose(), -t, block;
  W *= gain;
  inverse /= gain;
  middle = W * x;
}

}  // namespace dyop::contact_internal
