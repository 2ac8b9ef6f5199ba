#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "dyop/core/types.h"

// Vector polynomials by their Bernstein coefficients over s in [0, 1]: the polynomial lies in the
// convex hull of the coefficients, so the largest norm of a coefficient bounds the polynomial's.
namespace dyop::internal {

template <std::size_t N>
using Bernstein = std::array<Vector3, N>;  // degree N - 1

// Cubic through x0 and x1 with derivatives v0 and v1 with respect to t = h s.
Bernstein<4> cubic_hermite(const Vector3& x0, const Vector3& v0, const Vector3& x1,
                           const Vector3& v1, Scalar h);

// Exactly rounded at the ends: (1 - s) x + s y.
inline Vector3 mix(const Vector3& x, const Vector3& y, Scalar s) {
  return (1 - s) * x + s * y;
}

// By de Casteljau's algorithm.
template <std::size_t N>
Vector3 evaluate(Bernstein<N> b, Scalar s) {
  for (std::size_t count = N - 1; count > 0; --count) {
    for (std::size_t k = 0; k < count; ++k) b[k] = mix(b[k], b[k + 1], s);
  }
  return b[0];
}

// Coefficients of the same polynomial over s in [s0, s1]. Coefficient k is the polar form (blossom)
// at N - 1 - k times s0 and k times s1; all but the last take s0 once, so they are those of the
// polynomial whose polar form has this argument filled in.
template <std::size_t N>
Bernstein<N> restrict_to(const Bernstein<N>& b, Scalar s0, Scalar s1) {
  if constexpr (N == 1) {
    return b;
  } else {
    Bernstein<N - 1> filled;
    for (std::size_t k = 0; k + 1 < N; ++k) filled[k] = mix(b[k], b[k + 1], s0);
    const Bernstein<N - 1> head = restrict_to<N - 1>(filled, s0, s1);
    Bernstein<N> part;
    for (std::size_t k = 0; k + 1 < N; ++k) part[k] = head[k];
    part[N - 1] = evaluate<N>(b, s1);
    return part;
  }
}

// Derivative with respect to t = h s.
template <std::size_t N>
Bernstein<N - 1> derivative(const Bernstein<N>& b, Scalar h) {
  Bernstein<N - 1> d;
  for (std::size_t k = 0; k + 1 < N; ++k) d[k] = static_cast<Scalar>(N - 1) * (b[k + 1] - b[k]) / h;
  return d;
}

// max of the norms; NaN if a part is NaN.
inline Scalar largest_norm_of(std::span<const Vector3> b) {
  Scalar largest_sq = 0;
  for (const Vector3& x : b) {
    const Scalar sq = x.squaredNorm();
    if (sq > largest_sq || std::isnan(sq)) largest_sq = sq;  // a NaN stays: no sq is greater
  }
  // literal: below it squares of parts may have underflowed, which would make the norm too small.
  if (!(largest_sq < 0x1p-900)) return std::sqrt(largest_sq);
  Scalar largest = 0;
  for (const Vector3& x : b) largest = std::max(largest, x.stableNorm());
  return largest;
}

template <std::size_t N>
Scalar largest_norm(const Bernstein<N>& b) {
  return largest_norm_of(b);
}

// The quintic x(s) x y(s).
Bernstein<6> cross_product(const Bernstein<4>& x, const Bernstein<3>& y);

}  // namespace dyop::internal
