// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The wide types of simd.h through the vector extensions of g++ and clang++, for processors that
// have no section there. Sixteen bytes: one register of NEON, SSE2, AltiVec or WebAssembly;
// elsewhere the compiler splits it. Included by simd.h only, with the same restrictions.

#if defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace dyop::core_internal {
inline namespace DYOP_LANES {

using Doubles = double __attribute__((vector_size(16)));
using DoubleBits = long long __attribute__((vector_size(16)));
using Floats = float __attribute__((vector_size(16)));
using FloatBits = int __attribute__((vector_size(16)));
using TwoFloats = float __attribute__((vector_size(8)));

#if defined(__aarch64__)
DYOP_INLINE Doubles vector_sqrt(Doubles x) {
  return vsqrtq_f64(x);
}
#else
DYOP_INLINE Doubles vector_sqrt(Doubles x) {
  return Doubles{__builtin_sqrt(x[0]), __builtin_sqrt(x[1])};
}
#endif

/// A register of numbers, `Bits` of the same register as integers, and as many numbers in single
/// precision.
template <typename Real, typename Vector, typename BitVector, typename Loaded>
struct VectorLanes {
  static constexpr int kCount = 16 / sizeof(Real);

  struct Mask {
    BitVector m;  ///< all bits of a lane, or none
    friend DYOP_INLINE Mask operator&(Mask x, Mask y) { return {x.m & y.m}; }
    friend DYOP_INLINE Mask operator|(Mask x, Mask y) { return {x.m | y.m}; }
    friend DYOP_INLINE Mask without(Mask x, Mask y) { return {x.m & ~y.m}; }
    DYOP_INLINE unsigned bits() const {
      unsigned set = 0;
      for (int k = 0; k < kCount; ++k) set |= (m[k] != 0 ? 1u : 0u) << k;
      return set;
    }
  };
  Vector v;

  VectorLanes() = default;
  DYOP_INLINE VectorLanes(Vector x) : v(x) {}
  DYOP_INLINE explicit VectorLanes(BitVector x) : v(reinterpret_cast<Vector>(x)) {}
  DYOP_INLINE explicit VectorLanes(Real x) : v(x - Vector{}) {}
  static DYOP_INLINE VectorLanes load(const float* from) {
    Loaded x;
    __builtin_memcpy(&x, from, sizeof(x));
    return __builtin_convertvector(x, Vector);
  }
  static DYOP_INLINE VectorLanes load(const double* from) {
    VectorLanes x;
    for (int k = 0; k < kCount; ++k) x.v[k] = static_cast<Real>(from[k]);
    return x;
  }
  static DYOP_INLINE VectorLanes gather(const Real* from, const int* at) {
    VectorLanes x;
    for (int k = 0; k < kCount; ++k) x.v[k] = from[at[k]];
    return x;
  }
  DYOP_INLINE void store(Real* to) const { __builtin_memcpy(to, &v, sizeof(v)); }
  DYOP_INLINE void scatter(Real* to, const int* at) const {
    for (int k = 0; k < kCount; ++k) to[at[k]] = v[k];
  }
  static DYOP_INLINE BitVector sign() { return VectorLanes(Real(-0.0)).as_bits(); }
  DYOP_INLINE BitVector as_bits() const { return reinterpret_cast<BitVector>(v); }

  friend DYOP_INLINE VectorLanes operator+(VectorLanes x, VectorLanes y) { return x.v + y.v; }
  friend DYOP_INLINE VectorLanes operator-(VectorLanes x, VectorLanes y) { return x.v - y.v; }
  friend DYOP_INLINE VectorLanes operator*(VectorLanes x, VectorLanes y) { return x.v * y.v; }
  friend DYOP_INLINE VectorLanes operator/(VectorLanes x, VectorLanes y) { return x.v / y.v; }
  /// y where x is NaN, as on x86, unlike the maximum of NEON.
  friend DYOP_INLINE VectorLanes larger(VectorLanes x, VectorLanes y) {
    return select(x > y, x, y);
  }
  friend DYOP_INLINE VectorLanes smaller(VectorLanes x, VectorLanes y) {
    return select(y > x, x, y);
  }
  friend DYOP_INLINE VectorLanes magnitude(VectorLanes x) {
    return VectorLanes(x.as_bits() & ~sign());
  }
  friend DYOP_INLINE VectorLanes sqrt(VectorLanes x) { return vector_sqrt(x.v); }
  friend DYOP_INLINE Mask operator>(VectorLanes x, VectorLanes y) { return {x.v > y.v}; }
  friend DYOP_INLINE Mask operator>=(VectorLanes x, VectorLanes y) { return {x.v >= y.v}; }
  friend DYOP_INLINE VectorLanes select(Mask m, VectorLanes x, VectorLanes y) {
    return VectorLanes((x.as_bits() & m.m) | (y.as_bits() & ~m.m));
  }
};

using Lanes = VectorLanes<double, Doubles, DoubleBits, TwoFloats>;
using FloatLanes = VectorLanes<float, Floats, FloatBits, Floats>;

}  // namespace DYOP_LANES
}  // namespace dyop::core_internal
