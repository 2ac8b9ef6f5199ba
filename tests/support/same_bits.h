#pragma once

#include <bit>
#include <cstdint>

#include "dyop/distance/triangle_distance.h"

/// Equality of bits: signs of zero count, and NaN equals itself.
namespace dyop::testing {

inline bool has_same_bits(Scalar x, Scalar y) {
  return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
}

inline bool has_same_bits(const Vector3& v, const Vector3& w) {
  return has_same_bits(v.x(), w.x()) && has_same_bits(v.y(), w.y()) && has_same_bits(v.z(), w.z());
}

inline bool has_same_bits(const TriangleDistance& x, const TriangleDistance& y) {
  return has_same_bits(x.lower, y.lower) && has_same_bits(x.upper, y.upper) &&
         has_same_bits(x.p_a, y.p_a) && has_same_bits(x.p_b, y.p_b) &&
         has_same_bits(x.normal, y.normal) && x.feature_a == y.feature_a &&
         x.feature_b == y.feature_b && x.is_crossing == y.is_crossing;
}

}  // namespace dyop::testing
