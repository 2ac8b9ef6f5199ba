// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/simd.h"

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
