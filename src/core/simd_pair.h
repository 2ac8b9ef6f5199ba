// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "dyop/core/types.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace dyop::core_internal {

/// Two doubles side by side: one SSE2 register, which every x86-64 has, elsewhere two numbers.
/// Every operation rounds as the scalar one does, so both give the same bits.
#if defined(__SSE2__)
struct LanePair {
  __m128d v;

  LanePair() = default;
  LanePair(__m128d value) : v(value) {}
  explicit LanePair(Scalar both) : v(_mm_set1_pd(both)) {}
  LanePair(Scalar low, Scalar high) : v(_mm_set_pd(high, low)) {}

  Scalar low() const { return _mm_cvtsd_f64(v); }
  Scalar high() const { return _mm_cvtsd_f64(_mm_unpackhi_pd(v, v)); }
  void store(Scalar* to) const { _mm_storeu_pd(to, v); }

  friend LanePair operator+(LanePair x, LanePair y) { return _mm_add_pd(x.v, y.v); }
  friend LanePair operator-(LanePair x, LanePair y) { return _mm_sub_pd(x.v, y.v); }
  friend LanePair operator*(LanePair x, LanePair y) { return _mm_mul_pd(x.v, y.v); }
  friend LanePair operator/(LanePair x, LanePair y) { return _mm_div_pd(x.v, y.v); }
  friend LanePair operator-(LanePair x) { return _mm_xor_pd(x.v, _mm_set1_pd(-0.0)); }
};

/// Lane by lane; y where x is NaN.
inline LanePair larger(LanePair x, LanePair y) {
  return _mm_max_pd(x.v, y.v);
}
inline LanePair smaller(LanePair x, LanePair y) {
  return _mm_min_pd(x.v, y.v);
}

/// x with the sign of one lane flipped.
inline LanePair low_negated(LanePair x) {
  return _mm_xor_pd(x.v, _mm_set_pd(0.0, -0.0));
}
inline LanePair high_negated(LanePair x) {
  return _mm_xor_pd(x.v, _mm_set_pd(-0.0, 0.0));
}

inline LanePair magnitude(LanePair x) {
  return _mm_andnot_pd(_mm_set1_pd(-0.0), x.v);
}

/// x with its sign flipped where y is negative.
inline LanePair flip_sign(LanePair x, LanePair y) {
  return _mm_xor_pd(x.v, _mm_and_pd(y.v, _mm_set1_pd(-0.0)));
}

inline LanePair sqrt(LanePair x) {
  return _mm_sqrt_pd(x.v);
}

/// Masks: all bits of a lane set where the condition holds, false for NaN; the sign bits of a mask
/// as an integer; x where the mask is set, else zero; x where it is set, else y.
inline LanePair above(LanePair x, LanePair y) {
  return _mm_cmpgt_pd(x.v, y.v);
}
inline LanePair equal(LanePair x, LanePair y) {
  return _mm_cmpeq_pd(x.v, y.v);
}
inline LanePair both(LanePair mask, LanePair other) {
  return _mm_and_pd(mask.v, other.v);
}
inline LanePair either(LanePair mask, LanePair other) {
  return _mm_or_pd(mask.v, other.v);
}
inline int bits(LanePair mask) {
  return _mm_movemask_pd(mask.v);
}
inline LanePair masked(LanePair mask, LanePair x) {
  return _mm_and_pd(mask.v, x.v);
}
inline LanePair selected(LanePair mask, LanePair x, LanePair y) {
  return _mm_or_pd(_mm_and_pd(mask.v, x.v), _mm_andnot_pd(mask.v, y.v));
}

/// (x low, y low), (x high, y high) and (x high, x low).
inline LanePair swapped(LanePair x) {
  return _mm_shuffle_pd(x.v, x.v, 1);
}
inline LanePair lows(LanePair x, LanePair y) {
  return _mm_unpacklo_pd(x.v, y.v);
}
inline LanePair highs(LanePair x, LanePair y) {
  return _mm_unpackhi_pd(x.v, y.v);
}

/// x with its lowest four mantissa bits replaced by a code in 0..15.
inline LanePair tagged(LanePair x, int low, int high) {
  const __m128i codes = _mm_set_epi64x(high, low);
  const __m128i mask = _mm_set1_epi64x(~std::int64_t{15});
  return _mm_castsi128_pd(_mm_or_si128(_mm_and_si128(_mm_castpd_si128(x.v), mask), codes));
}
#else
struct LanePair {
  Scalar l;
  Scalar h;

  LanePair() = default;
  explicit LanePair(Scalar both) : l(both), h(both) {}
  LanePair(Scalar low, Scalar high) : l(low), h(high) {}

  Scalar low() const { return l; }
  Scalar high() const { return h; }
  void store(Scalar* to) const {
    to[0] = l;
    to[1] = h;
  }

  friend LanePair operator+(LanePair x, LanePair y) { return {x.l + y.l, x.h + y.h}; }
  friend LanePair operator-(LanePair x, LanePair y) { return {x.l - y.l, x.h - y.h}; }
  friend LanePair operator*(LanePair x, LanePair y) { return {x.l * y.l, x.h * y.h}; }
  friend LanePair operator/(LanePair x, LanePair y) { return {x.l / y.l, x.h / y.h}; }
  friend LanePair operator-(LanePair x) { return {-x.l, -x.h}; }
};

inline LanePair larger(LanePair x, LanePair y) {
  return {x.l > y.l ? x.l : y.l, x.h > y.h ? x.h : y.h};
}
inline LanePair smaller(LanePair x, LanePair y) {
  return {x.l < y.l ? x.l : y.l, x.h < y.h ? x.h : y.h};
}

inline LanePair low_negated(LanePair x) {
  return {-x.l, x.h};
}
inline LanePair high_negated(LanePair x) {
  return {x.l, -x.h};
}

inline LanePair magnitude(LanePair x) {
  return {std::abs(x.l), std::abs(x.h)};
}

inline LanePair flip_sign(LanePair x, LanePair y) {
  return {std::signbit(y.l) ? -x.l : x.l, std::signbit(y.h) ? -x.h : x.h};
}

inline LanePair sqrt(LanePair x) {
  return {std::sqrt(x.l), std::sqrt(x.h)};
}

inline std::uint64_t bits_of(Scalar x) {
  return std::bit_cast<std::uint64_t>(x);
}
inline Scalar mask_of(bool x) {
  return std::bit_cast<Scalar>(x ? ~std::uint64_t{0} : 0);
}
inline Scalar common(Scalar x, Scalar y) {
  return std::bit_cast<Scalar>(bits_of(x) & bits_of(y));
}

inline LanePair above(LanePair x, LanePair y) {
  return {mask_of(x.l > y.l), mask_of(x.h > y.h)};
}
inline LanePair equal(LanePair x, LanePair y) {
  return {mask_of(x.l == y.l), mask_of(x.h == y.h)};
}
inline LanePair both(LanePair mask, LanePair other) {
  return {common(mask.l, other.l), common(mask.h, other.h)};
}
inline LanePair either(LanePair mask, LanePair other) {
  return {mask_of((bits_of(mask.l) | bits_of(other.l)) != 0),
          mask_of((bits_of(mask.h) | bits_of(other.h)) != 0)};
}
inline int bits(LanePair mask) {
  return static_cast<int>(std::signbit(mask.l)) + 2 * static_cast<int>(std::signbit(mask.h));
}
inline LanePair masked(LanePair mask, LanePair x) {
  return both(mask, x);
}
inline LanePair selected(LanePair mask, LanePair x, LanePair y) {
  return {bits_of(mask.l) != 0 ? x.l : y.l, bits_of(mask.h) != 0 ? x.h : y.h};
}

inline LanePair swapped(LanePair x) {
  return {x.h, x.l};
}
inline LanePair lows(LanePair x, LanePair y) {
  return {x.l, y.l};
}
inline LanePair highs(LanePair x, LanePair y) {
  return {x.h, y.h};
}

inline LanePair tagged(LanePair x, int low, int high) {
  const auto tag = [](Scalar value, int code) {
    const std::uint64_t bits = std::bit_cast<std::uint64_t>(value) & ~std::uint64_t{15};
    return std::bit_cast<Scalar>(bits | static_cast<std::uint64_t>(code));
  };
  return {tag(x.l, low), tag(x.h, high)};
}
#endif

/// x limited to [0, 1]; NaN gives 0.
inline LanePair clamped(LanePair x) {
  return smaller(larger(x, LanePair(0)), LanePair(1));
}

/// Mask of the lanes strictly between 0 and 1.
inline LanePair is_inside_unit(LanePair x) {
  return both(above(x, LanePair(0)), above(LanePair(1), x));
}

/// Scalar product in the same order as VectorPair::dot(). Eigen's order depends on the instruction
/// set.
inline Scalar dot(const Vector3& v, const Vector3& w) {
  return (v.x() * w.x() + v.y() * w.y()) + v.z() * w.z();
}

/// Two vectors side by side.
struct VectorPair {
  LanePair x, y, z;

  VectorPair(LanePair x_in, LanePair y_in, LanePair z_in) : x(x_in), y(y_in), z(z_in) {}
  explicit VectorPair(const Vector3& both) : x(both.x()), y(both.y()), z(both.z()) {}
  VectorPair(const Vector3& low, const Vector3& high)
      : x(low.x(), high.x()), y(low.y(), high.y()), z(low.z(), high.z()) {}

  /// Either vector, in both lanes.
  VectorPair lows() const {
    return {core_internal::lows(x, x), core_internal::lows(y, y), core_internal::lows(z, z)};
  }
  VectorPair highs() const {
    return {core_internal::highs(x, x), core_internal::highs(y, y), core_internal::highs(z, z)};
  }
  Vector3 low() const { return {x.low(), y.low(), z.low()}; }
  Vector3 high() const { return {x.high(), y.high(), z.high()}; }

  friend VectorPair operator+(const VectorPair& v, const VectorPair& w) {
    return {v.x + w.x, v.y + w.y, v.z + w.z};
  }
  friend VectorPair operator-(const VectorPair& v, const VectorPair& w) {
    return {v.x - w.x, v.y - w.y, v.z - w.z};
  }
  friend VectorPair operator*(const VectorPair& v, LanePair s) {
    return {v.x * s, v.y * s, v.z * s};
  }

  LanePair dot(const VectorPair& o) const { return (x * o.x + y * o.y) + z * o.z; }
  VectorPair cross(const VectorPair& o) const {
    return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x};
  }
};

/// (v low, w low) and (v high, w high).
inline VectorPair lows(const VectorPair& v, const VectorPair& w) {
  return {lows(v.x, w.x), lows(v.y, w.y), lows(v.z, w.z)};
}
inline VectorPair highs(const VectorPair& v, const VectorPair& w) {
  return {highs(v.x, w.x), highs(v.y, w.y), highs(v.z, w.z)};
}

}  // namespace dyop::core_internal
