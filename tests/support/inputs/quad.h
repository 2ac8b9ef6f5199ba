// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

namespace dyop::testing {

/// 113 significant bits and the exponents of long double. The keyword keeps -Wpedantic quiet.
__extension__ typedef __float128 Quad;

inline double square_root(double x) {
  return std::sqrt(x);
}

/// Newton's iteration from the 64 bits of long double: two steps reach all 113.
inline Quad square_root(Quad x) {
  Quad y = static_cast<Quad>(std::sqrt(static_cast<long double>(x)));
  if (!(y > 0)) return 0;
  for (int k = 0; k < 2; ++k) y = (y + x / y) / 2;
  return y;
}

}  // namespace dyop::testing
