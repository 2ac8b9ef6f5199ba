// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstdint>

#include "dyop/distance/triangle_distance.h"
#include "dyop/toi/toi_result.h"

/// Equality of bits: signs of zero count, and NaN equals itself.
namespace dyop::testing {

inline bool has_same_bits(Scalar x, Scalar y) {
  return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
}

inline bool has_same_bits(const Vector3& v, const Vector3& w) {
  return has_same_bits(v.x(), w.x()) && has_same_bits(v.y(), w.y()) && has_same_bits(v.z(), w.z());
}

inline bool has_same_bits(const RigidPose& X, const RigidPose& Y) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (!has_same_bits(Vector3(X.rotation().col(k)), Vector3(Y.rotation().col(k)))) return false;
  }
  return has_same_bits(X.translation(), Y.translation());
}

inline bool has_same_bits(const TriangleDistance& x, const TriangleDistance& y) {
  return has_same_bits(x.lower, y.lower) && has_same_bits(x.upper, y.upper) &&
         has_same_bits(x.p_a, y.p_a) && has_same_bits(x.p_b, y.p_b) &&
         has_same_bits(x.nhat_AB, y.nhat_AB) && x.feature_a == y.feature_a &&
         x.feature_b == y.feature_b && x.is_overlapping == y.is_overlapping;
}

/// The answers, whatever work they took.
inline bool has_same_bits(const ToiResult& x, const ToiResult& y) {
  if (x.status != y.status || !has_same_bits(x.t_safe, y.t_safe)) return false;
  if (x.t_hit.has_value() != y.t_hit.has_value()) return false;
  if (x.t_hit && !has_same_bits(*x.t_hit, *y.t_hit)) return false;
  if (!has_same_bits(x.X_WA, y.X_WA) || !has_same_bits(x.X_WB, y.X_WB)) return false;
  if (x.contact.has_value() != y.contact.has_value()) return false;
  return !x.contact || (has_same_bits(x.contact->p_WCa, y.contact->p_WCa) &&
                        has_same_bits(x.contact->p_WCb, y.contact->p_WCb) &&
                        has_same_bits(x.contact->nhat_AB_W, y.contact->nhat_AB_W) &&
                        has_same_bits(x.contact->lower, y.contact->lower) &&
                        has_same_bits(x.contact->upper, y.contact->upper) &&
                        x.contact->triangle_a == y.contact->triangle_a &&
                        x.contact->triangle_b == y.contact->triangle_b);
}

}  // namespace dyop::testing
