// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/namespaces.h"

// SIMD vectors as wide as the instruction set that this file is compiled for (x86 here, others in
// simd_portable.h), and a single number with the same interface. Only additions, multiplications,
// divisions, square roots, comparisons and selections: each lane has the same bits whatever the
// width.
//
// Included by the kernels that are compiled once per instruction set. They must not include
// anything with inline functions of external linkage (Eigen, the standard library): the linker
// might use the copy compiled for a newer processor everywhere. Hence the namespaces here.
#if defined(__AVX512F__)
#include <immintrin.h>
#define DYOP_LANES lanes_avx512
#define DYOP_KERNEL(name) name##_avx512
#elif defined(__AVX2__)
#include <immintrin.h>
#define DYOP_LANES lanes_avx2
#define DYOP_KERNEL(name) name##_avx2
#elif defined(__SSE2__)
#include <emmintrin.h>
#define DYOP_LANES lanes_baseline
#define DYOP_KERNEL(name) name##_baseline
#else
#define DYOP_LANES lanes_portable
#define DYOP_KERNEL(name) name##_baseline
#endif

#define DYOP_INLINE inline __attribute__((always_inline))

#if !defined(__SSE2__)
#include "core/simd_portable.h"
#endif

namespace dyop::core_internal {
inline namespace DYOP_LANES {

/// One lane.
struct OneLane {
  static constexpr int kCount = 1;
  struct Mask {
    bool m;
    friend DYOP_INLINE Mask operator&(Mask x, Mask y) { return {x.m && y.m}; }
    friend DYOP_INLINE Mask operator|(Mask x, Mask y) { return {x.m || y.m}; }
    /// x and not y
    friend DYOP_INLINE Mask without(Mask x, Mask y) { return {x.m && !y.m}; }
    /// One bit per lane.
    DYOP_INLINE unsigned bits() const { return m ? 1u : 0u; }
  };
  double v;

  OneLane() = default;
  DYOP_INLINE explicit OneLane(double x) : v(x) {}
  static DYOP_INLINE OneLane load(const float* from) { return OneLane(static_cast<double>(*from)); }
  DYOP_INLINE void store(double* to) const { *to = v; }

  friend DYOP_INLINE OneLane operator+(OneLane x, OneLane y) { return OneLane(x.v + y.v); }
  friend DYOP_INLINE OneLane operator-(OneLane x, OneLane y) { return OneLane(x.v - y.v); }
  friend DYOP_INLINE OneLane operator*(OneLane x, OneLane y) { return OneLane(x.v * y.v); }
  friend DYOP_INLINE OneLane operator/(OneLane x, OneLane y) { return OneLane(x.v / y.v); }
  /// y where x is NaN.
  friend DYOP_INLINE OneLane larger(OneLane x, OneLane y) { return OneLane(x.v > y.v ? x.v : y.v); }
  friend DYOP_INLINE OneLane smaller(OneLane x, OneLane y) {
    return OneLane(x.v < y.v ? x.v : y.v);
  }
  friend DYOP_INLINE OneLane magnitude(OneLane x) { return OneLane(__builtin_fabs(x.v)); }
  friend DYOP_INLINE OneLane sqrt(OneLane x) { return OneLane(__builtin_sqrt(x.v)); }
  /// False where either is NaN.
  friend DYOP_INLINE Mask operator>(OneLane x, OneLane y) { return {x.v > y.v}; }
  friend DYOP_INLINE Mask operator>=(OneLane x, OneLane y) { return {x.v >= y.v}; }
  /// x where the mask is set, else y.
  friend DYOP_INLINE OneLane select(Mask m, OneLane x, OneLane y) { return m.m ? x : y; }
};

/// One lane of single precision.
struct OneFloat {
  static constexpr int kCount = 1;
  struct Mask {
    bool m;
    friend DYOP_INLINE Mask operator&(Mask x, Mask y) { return {x.m && y.m}; }
  };
  float v;

  OneFloat() = default;
  DYOP_INLINE explicit OneFloat(float x) : v(x) {}
  static DYOP_INLINE OneFloat load(const float* from) { return OneFloat(*from); }
  DYOP_INLINE void store(float* to) const { *to = v; }

  friend DYOP_INLINE OneFloat operator+(OneFloat x, OneFloat y) { return OneFloat(x.v + y.v); }
  friend DYOP_INLINE OneFloat operator-(OneFloat x, OneFloat y) { return OneFloat(x.v - y.v); }
  friend DYOP_INLINE OneFloat operator*(OneFloat x, OneFloat y) { return OneFloat(x.v * y.v); }
  friend DYOP_INLINE OneFloat larger(OneFloat x, OneFloat y) {
    return OneFloat(x.v > y.v ? x.v : y.v);
  }
  friend DYOP_INLINE OneFloat magnitude(OneFloat x) { return OneFloat(__builtin_fabsf(x.v)); }
  friend DYOP_INLINE Mask operator>(OneFloat x, OneFloat y) { return {x.v > y.v}; }
  friend DYOP_INLINE Mask operator>=(OneFloat x, OneFloat y) { return {x.v >= y.v}; }
  friend DYOP_INLINE OneFloat select(Mask m, OneFloat x, OneFloat y) { return m.m ? x : y; }
};

#if defined(__AVX2__)  // and with AVX-512
struct FourLanes {
  static constexpr int kCount = 4;
  struct Mask {
    __m256d m;
    friend DYOP_INLINE Mask operator&(Mask x, Mask y) { return {_mm256_and_pd(x.m, y.m)}; }
    friend DYOP_INLINE Mask operator|(Mask x, Mask y) { return {_mm256_or_pd(x.m, y.m)}; }
    friend DYOP_INLINE Mask without(Mask x, Mask y) { return {_mm256_andnot_pd(y.m, x.m)}; }
    DYOP_INLINE unsigned bits() const { return unsigned(_mm256_movemask_pd(m)); }
  };
  __m256d v;

  FourLanes() = default;
  DYOP_INLINE FourLanes(__m256d x) : v(x) {}
  DYOP_INLINE explicit FourLanes(double x) : v(_mm256_set1_pd(x)) {}
  static DYOP_INLINE FourLanes load(const float* from) {
    return _mm256_cvtps_pd(_mm_loadu_ps(from));
  }
  static DYOP_INLINE FourLanes load(const double* from) { return _mm256_loadu_pd(from); }
  static DYOP_INLINE FourLanes gather(const double* from, const int* at) {
    return _mm256_set_pd(from[at[3]], from[at[2]], from[at[1]], from[at[0]]);
  }
  DYOP_INLINE void store(double* to) const { _mm256_storeu_pd(to, v); }
  DYOP_INLINE void scatter(double* to, const int* at) const {
    const __m128d low = _mm256_castpd256_pd128(v);
    const __m128d high = _mm256_extractf128_pd(v, 1);
    _mm_storel_pd(to + at[0], low);
    _mm_storeh_pd(to + at[1], low);
    _mm_storel_pd(to + at[2], high);
    _mm_storeh_pd(to + at[3], high);
  }

  friend DYOP_INLINE FourLanes operator+(FourLanes x, FourLanes y) {
    return _mm256_add_pd(x.v, y.v);
  }
  friend DYOP_INLINE FourLanes operator-(FourLanes x, FourLanes y) {
    return _mm256_sub_pd(x.v, y.v);
  }
  friend DYOP_INLINE FourLanes operator*(FourLanes x, FourLanes y) {
    return _mm256_mul_pd(x.v, y.v);
  }
  friend DYOP_INLINE FourLanes operator/(FourLanes x, FourLanes y) {
    return _mm256_div_pd(x.v, y.v);
  }
  friend DYOP_INLINE FourLanes larger(FourLanes x, FourLanes y) { return _mm256_max_pd(x.v, y.v); }
  friend DYOP_INLINE FourLanes smaller(FourLanes x, FourLanes y) { return _mm256_min_pd(x.v, y.v); }
  friend DYOP_INLINE FourLanes magnitude(FourLanes x) {
    return _mm256_andnot_pd(_mm256_set1_pd(-0.0), x.v);
  }
  friend DYOP_INLINE FourLanes sqrt(FourLanes x) { return _mm256_sqrt_pd(x.v); }
  friend DYOP_INLINE Mask operator>(FourLanes x, FourLanes y) {
    return {_mm256_cmp_pd(x.v, y.v, _CMP_GT_OQ)};
  }
  friend DYOP_INLINE Mask operator>=(FourLanes x, FourLanes y) {
    return {_mm256_cmp_pd(x.v, y.v, _CMP_GE_OQ)};
  }
  friend DYOP_INLINE FourLanes select(Mask m, FourLanes x, FourLanes y) {
    return _mm256_blendv_pd(y.v, x.v, m.m);
  }
};
#endif

#if defined(__AVX512F__)
struct Lanes {
  static constexpr int kCount = 8;
  struct Mask {
    __mmask8 m;
    friend DYOP_INLINE Mask operator&(Mask x, Mask y) { return {__mmask8(x.m & y.m)}; }
    friend DYOP_INLINE Mask operator|(Mask x, Mask y) { return {__mmask8(x.m | y.m)}; }
    friend DYOP_INLINE Mask without(Mask x, Mask y) { return {__mmask8(x.m & ~y.m)}; }
    DYOP_INLINE unsigned bits() const { return m; }
  };
  __m512d v;

  Lanes() = default;
  DYOP_INLINE Lanes(__m512d x) : v(x) {}
  DYOP_INLINE explicit Lanes(double x) : v(_mm512_set1_pd(x)) {}
  static DYOP_INLINE Lanes load(const float* from) {
    return _mm512_cvtps_pd(_mm256_loadu_ps(from));
  }
  static DYOP_INLINE Lanes load(const double* from) { return _mm512_loadu_pd(from); }
  DYOP_INLINE void store(double* to) const { _mm512_storeu_pd(to, v); }

  friend DYOP_INLINE Lanes operator+(Lanes x, Lanes y) { return _mm512_add_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes operator-(Lanes x, Lanes y) { return _mm512_sub_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes operator*(Lanes x, Lanes y) { return _mm512_mul_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes operator/(Lanes x, Lanes y) { return _mm512_div_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes larger(Lanes x, Lanes y) { return _mm512_max_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes smaller(Lanes x, Lanes y) { return _mm512_min_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes magnitude(Lanes x) { return _mm512_abs_pd(x.v); }
  friend DYOP_INLINE Lanes sqrt(Lanes x) { return _mm512_sqrt_pd(x.v); }
  friend DYOP_INLINE Mask operator>(Lanes x, Lanes y) {
    return {_mm512_cmp_pd_mask(x.v, y.v, _CMP_GT_OQ)};
  }
  friend DYOP_INLINE Mask operator>=(Lanes x, Lanes y) {
    return {_mm512_cmp_pd_mask(x.v, y.v, _CMP_GE_OQ)};
  }
  friend DYOP_INLINE Lanes select(Mask m, Lanes x, Lanes y) {
    return _mm512_mask_blend_pd(m.m, y.v, x.v);
  }
};
#elif defined(__AVX2__)
using Lanes = FourLanes;
#elif defined(__SSE2__)
struct Lanes {
  static constexpr int kCount = 2;
  struct Mask {
    __m128d m;
    friend DYOP_INLINE Mask operator&(Mask x, Mask y) { return {_mm_and_pd(x.m, y.m)}; }
    friend DYOP_INLINE Mask operator|(Mask x, Mask y) { return {_mm_or_pd(x.m, y.m)}; }
    friend DYOP_INLINE Mask without(Mask x, Mask y) { return {_mm_andnot_pd(y.m, x.m)}; }
    DYOP_INLINE unsigned bits() const { return unsigned(_mm_movemask_pd(m)); }
  };
  __m128d v;

  Lanes() = default;
  DYOP_INLINE Lanes(__m128d x) : v(x) {}
  DYOP_INLINE explicit Lanes(double x) : v(_mm_set1_pd(x)) {}
  static DYOP_INLINE Lanes load(const float* from) {
    return _mm_set_pd(static_cast<double>(from[1]), static_cast<double>(from[0]));
  }
  static DYOP_INLINE Lanes load(const double* from) { return _mm_loadu_pd(from); }
  static DYOP_INLINE Lanes gather(const double* from, const int* at) {
    return _mm_set_pd(from[at[1]], from[at[0]]);
  }
  DYOP_INLINE void store(double* to) const { _mm_storeu_pd(to, v); }
  DYOP_INLINE void scatter(double* to, const int* at) const {
    _mm_storel_pd(to + at[0], v);
    _mm_storeh_pd(to + at[1], v);
  }

  friend DYOP_INLINE Lanes operator+(Lanes x, Lanes y) { return _mm_add_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes operator-(Lanes x, Lanes y) { return _mm_sub_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes operator*(Lanes x, Lanes y) { return _mm_mul_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes operator/(Lanes x, Lanes y) { return _mm_div_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes larger(Lanes x, Lanes y) { return _mm_max_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes smaller(Lanes x, Lanes y) { return _mm_min_pd(x.v, y.v); }
  friend DYOP_INLINE Lanes magnitude(Lanes x) { return _mm_andnot_pd(_mm_set1_pd(-0.0), x.v); }
  friend DYOP_INLINE Lanes sqrt(Lanes x) { return _mm_sqrt_pd(x.v); }
  friend DYOP_INLINE Mask operator>(Lanes x, Lanes y) { return {_mm_cmpgt_pd(x.v, y.v)}; }
  friend DYOP_INLINE Mask operator>=(Lanes x, Lanes y) { return {_mm_cmpge_pd(x.v, y.v)}; }
  friend DYOP_INLINE Lanes select(Mask m, Lanes x, Lanes y) {
    return _mm_or_pd(_mm_and_pd(m.m, x.v), _mm_andnot_pd(m.m, y.v));
  }
};
#endif

#if defined(__AVX2__)  // and with AVX-512
struct FloatLanes {
  static constexpr int kCount = 8;
#if defined(__AVX512F__)
  struct Mask {
    __mmask8 m;
    friend DYOP_INLINE Mask operator&(Mask x, Mask y) { return {__mmask8(x.m & y.m)}; }
  };
#else
  struct Mask {
    __m256 m;
    friend DYOP_INLINE Mask operator&(Mask x, Mask y) { return {_mm256_and_ps(x.m, y.m)}; }
  };
#endif
  __m256 v;

  FloatLanes() = default;
  DYOP_INLINE FloatLanes(__m256 x) : v(x) {}
  DYOP_INLINE explicit FloatLanes(float x) : v(_mm256_set1_ps(x)) {}
  static DYOP_INLINE FloatLanes load(const float* from) {
    return _mm256_loadu_ps(from);
  }
  DYOP_INLINE void store(float* to) const {
    _mm256_storeu_ps(to, v);
  }

  friend DYOP_INLINE FloatLanes operator+(FloatLanes x, FloatLanes y) {
    return _mm256_add_ps(x.v, y.v);
  }
  friend DYOP_INLINE FloatLanes operator-(FloatLanes x, FloatLanes y) {
    return _mm256_sub_ps(x.v, y.v);
  }
  friend DYOP_INLINE FloatLanes operator*(FloatLanes x, FloatLanes y) {
    return _mm256_mul_ps(x.v, y.v);
  }
  friend DYOP_INLINE FloatLanes larger(FloatLanes x, FloatLanes y) {
    return _mm256_max_ps(x.v, y.v);
  }
  friend DYOP_INLINE FloatLanes magnitude(FloatLanes x) {
    return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), x.v);
  }
#if defined(__AVX512F__)
  friend DYOP_INLINE Mask operator>(FloatLanes x, FloatLanes y) {
    return {_mm256_cmp_ps_mask(x.v, y.v, _CMP_GT_OQ)};
  }
  friend DYOP_INLINE Mask operator>=(FloatLanes x, FloatLanes y) {
    return {_mm256_cmp_ps_mask(x.v, y.v, _CMP_GE_OQ)};
  }
  friend DYOP_INLINE FloatLanes select(Mask m, FloatLanes x, FloatLanes y) {
    return _mm256_mask_blend_ps(m.m, y.v, x.v);
  }
#else
  friend DYOP_INLINE Mask operator>(FloatLanes x, FloatLanes y) {
    return {_mm256_cmp_ps(x.v, y.v, _CMP_GT_OQ)};
  }
  friend DYOP_INLINE Mask operator>=(FloatLanes x, FloatLanes y) {
    return {_mm256_cmp_ps(x.v, y.v, _CMP_GE_OQ)};
  }
  friend DYOP_INLINE FloatLanes select(Mask m, FloatLanes x, FloatLanes y) {
    return _mm256_blendv_ps(y.v, x.v, m.m);
  }
#endif
};
#elif defined(__SSE2__)
struct FloatLanes {
  static constexpr int kCount = 4;
  struct Mask {
    __m128 m;
    friend DYOP_INLINE Mask operator&(Mask x, Mask y) { return {_mm_and_ps(x.m, y.m)}; }
  };
  __m128 v;

  FloatLanes() = default;
  DYOP_INLINE FloatLanes(__m128 x) : v(x) {}
  DYOP_INLINE explicit FloatLanes(float x) : v(_mm_set1_ps(x)) {}
  static DYOP_INLINE FloatLanes load(const float* from) { return _mm_loadu_ps(from); }
  DYOP_INLINE void store(float* to) const { _mm_storeu_ps(to, v); }

  friend DYOP_INLINE FloatLanes operator+(FloatLanes x, FloatLanes y) {
    return _mm_add_ps(x.v, y.v);
  }
  friend DYOP_INLINE FloatLanes operator-(FloatLanes x, FloatLanes y) {
    return _mm_sub_ps(x.v, y.v);
  }
  friend DYOP_INLINE FloatLanes operator*(FloatLanes x, FloatLanes y) {
    return _mm_mul_ps(x.v, y.v);
  }
  friend DYOP_INLINE FloatLanes larger(FloatLanes x, FloatLanes y) { return _mm_max_ps(x.v, y.v); }
  friend DYOP_INLINE FloatLanes magnitude(FloatLanes x) {
    return _mm_andnot_ps(_mm_set1_ps(-0.0f), x.v);
  }
  friend DYOP_INLINE Mask operator>(FloatLanes x, FloatLanes y) { return {_mm_cmpgt_ps(x.v, y.v)}; }
  friend DYOP_INLINE Mask operator>=(FloatLanes x, FloatLanes y) {
    return {_mm_cmpge_ps(x.v, y.v)};
  }
  friend DYOP_INLINE FloatLanes select(Mask m, FloatLanes x, FloatLanes y) {
    return _mm_or_ps(_mm_and_ps(m.m, x.v), _mm_andnot_ps(m.m, y.v));
  }
};
#endif

/// At most four lanes: what depends on how many numbers are taken together takes four, on any
/// processor.
#if defined(__AVX2__)
using FewLanes = FourLanes;
#else
using FewLanes = Lanes;
#endif

/// x with its sign flipped where s < 0 (+-0 counts as positive).
template <typename L>
DYOP_INLINE L flip_sign(L x, L s) {
  return select(s >= L(0), x, L(0) - x);
}

template <typename L>
DYOP_INLINE L dot(const L* x, const L* y) {
  return (x[0] * y[0] + x[1] * y[1]) + x[2] * y[2];
}

template <typename L>
DYOP_INLINE void cross(const L* x, const L* y, L* out) {
  out[0] = x[1] * y[2] - x[2] * y[1];
  out[1] = x[2] * y[0] - x[0] * y[2];
  out[2] = x[0] * y[1] - x[1] * y[0];
}

}  // namespace DYOP_LANES
}  // namespace dyop::core_internal

// Operations on the bits of lanes, and loads and stores of whole columns. For kernels that must
// match scalar code bit by bit, signs of zero included. Like simd.h, this must not include anything
// with inline functions of external linkage.

namespace dyop::core_internal {
inline namespace DYOP_LANES {

#if defined(__AVX512F__)
DYOP_INLINE Lanes loaded(const double* from) {
  return _mm512_loadu_pd(from);
}
/// x with its sign flipped where the sign bit of s is set.
DYOP_INLINE Lanes flip_sign_by_bit(Lanes x, Lanes s) {
  const __m512i sign = _mm512_and_si512(_mm512_castpd_si512(s.v),
                                        _mm512_set1_epi64(static_cast<long long>(1ULL << 63)));
  return _mm512_castsi512_pd(_mm512_xor_si512(_mm512_castpd_si512(x.v), sign));
}
/// x with its lowest four mantissa bits replaced by a code in 0..15.
DYOP_INLINE Lanes tagged(Lanes x, int code) {
  const __m512i high = _mm512_andnot_si512(_mm512_set1_epi64(15), _mm512_castpd_si512(x.v));
  return _mm512_castsi512_pd(_mm512_or_si512(high, _mm512_set1_epi64(code)));
}
DYOP_INLINE Lanes::Mask equal(Lanes x, Lanes y) {
  return {_mm512_cmp_pd_mask(x.v, y.v, _CMP_EQ_OQ)};
}
/// Integers from 0 to 127 as bytes.
DYOP_INLINE void store_bytes(Lanes x, unsigned char* to) {
  const __m128i bytes = _mm256_cvtepi32_epi8(_mm512_cvtpd_epi32(x.v));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(to), bytes);
}
#elif defined(__AVX2__)
DYOP_INLINE Lanes loaded(const double* from) {
  return _mm256_loadu_pd(from);
}
DYOP_INLINE Lanes flip_sign_by_bit(Lanes x, Lanes s) {
  return _mm256_xor_pd(x.v, _mm256_and_pd(s.v, _mm256_set1_pd(-0.0)));
}
DYOP_INLINE Lanes tagged(Lanes x, int code) {
  const __m256i high = _mm256_andnot_si256(_mm256_set1_epi64x(15), _mm256_castpd_si256(x.v));
  return _mm256_castsi256_pd(_mm256_or_si256(high, _mm256_set1_epi64x(code)));
}
DYOP_INLINE Lanes::Mask equal(Lanes x, Lanes y) {
  return {_mm256_cmp_pd(x.v, y.v, _CMP_EQ_OQ)};
}
DYOP_INLINE void store_bytes(Lanes x, unsigned char* to) {
  const __m128i words = _mm256_cvtpd_epi32(x.v);
  const __m128i bytes = _mm_packus_epi16(_mm_packs_epi32(words, words), words);
  const int four = _mm_cvtsi128_si32(bytes);
  __builtin_memcpy(to, &four, 4);
}
#elif defined(__SSE2__)
DYOP_INLINE Lanes loaded(const double* from) {
  return _mm_loadu_pd(from);
}
DYOP_INLINE Lanes flip_sign_by_bit(Lanes x, Lanes s) {
  return _mm_xor_pd(x.v, _mm_and_pd(s.v, _mm_set1_pd(-0.0)));
}
DYOP_INLINE Lanes tagged(Lanes x, int code) {
  const __m128i high = _mm_andnot_si128(_mm_set1_epi64x(15), _mm_castpd_si128(x.v));
  return _mm_castsi128_pd(_mm_or_si128(high, _mm_set1_epi64x(code)));
}
DYOP_INLINE Lanes::Mask equal(Lanes x, Lanes y) {
  return {_mm_cmpeq_pd(x.v, y.v)};
}
DYOP_INLINE void store_bytes(Lanes x, unsigned char* to) {
  const __m128i words = _mm_cvtpd_epi32(x.v);
  const __m128i bytes = _mm_packus_epi16(_mm_packs_epi32(words, words), words);
  const short two = static_cast<short>(_mm_cvtsi128_si32(bytes));
  __builtin_memcpy(to, &two, 2);
}
#else
DYOP_INLINE Lanes loaded(const double* from) {
  Lanes x;
  __builtin_memcpy(&x.v, from, sizeof(x.v));
  return x;
}
DYOP_INLINE Lanes flip_sign_by_bit(Lanes x, Lanes s) {
  return Lanes(x.as_bits() ^ (s.as_bits() & Lanes::sign()));
}
DYOP_INLINE Lanes tagged(Lanes x, int code) {
  return Lanes((x.as_bits() & ~15LL) | static_cast<long long>(code));
}
DYOP_INLINE Lanes::Mask equal(Lanes x, Lanes y) {
  return {x.v == y.v};
}
DYOP_INLINE void store_bytes(Lanes x, unsigned char* to) {
  for (int k = 0; k < Lanes::kCount; ++k) to[k] = static_cast<unsigned char>(x.v[k]);
}
#endif

DYOP_INLINE Lanes negated(Lanes x) {
  return flip_sign_by_bit(x, Lanes(-0.0));
}

}  // namespace DYOP_LANES
}  // namespace dyop::core_internal
