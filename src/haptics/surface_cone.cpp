// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/surface_cone.h"

namespace dyop::haptics_internal {
namespace {

bool rises(const Vector3& ray, const Vector3& n, Scalar sine) {
  const Scalar along = n.dot(ray);
  return along > 0 && along * along > sine * sine * ray.squaredNorm();
}

}  // namespace

// Within the sector the steepest direction is the projection of n on its plane, if that lies there.
bool sector_rises(const Vector3& e, const Vector3& f, const Vector3& n, Scalar sine) {
  if (rises(e, n, sine) || rises(f, n, sine)) return true;
  const Vector3 m = e.cross(f);
  const bool is_within = e.cross(n).dot(m) > 0 && n.cross(f).dot(m) > 0;
  return is_within && n.cross(m).squaredNorm() > sine * sine * m.squaredNorm();
}

bool side_rises(const Vector3& along, const Vector3& up, const Vector3& n, Scalar sine) {
  const Scalar length_sq = along.squaredNorm();
  if (!(length_sq > 0)) return rises(up, n, sine);
  return rises(up - along * (along.dot(up) / length_sq), n, sine);
}

}  // namespace dyop::haptics_internal
