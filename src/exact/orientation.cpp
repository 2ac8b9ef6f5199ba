// SPDX-License-Identifier: BSD-3-Clause
#include "exact/orientation.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "core/tolerance.h"

namespace dyop::exact_internal {
namespace {

// A number as the sum of two doubles that do not overlap.
struct Pair {
  Scalar high = 0;
  Scalar low = 0;
};

// a + b exactly (Knuth).
Pair exact_sum(Scalar a, Scalar b) {
  const Scalar sum = a + b;
  const Scalar b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

// a b exactly.
Pair exact_product(Scalar a, Scalar b) {
  const Scalar product = a * b;
  return {product, std::fma(a, b, -product)};
}

// An exact sum of doubles, kept as an expansion: parts that do not overlap, by increasing size,
// none of them zero ("grow expansion" with elimination of zeros [Shewchuk1997]).
class Expansion {
 public:
  void add(Scalar value) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < size_; ++k) {
      const Pair sum = exact_sum(value, parts_[k]);
      if (sum.low != 0) parts_[kept++] = sum.low;
      value = sum.high;
    }
    if (value != 0) parts_[kept++] = value;
    size_ = kept;
  }

  void add_product(Scalar a, Scalar b) {
    const Pair product = exact_product(a, b);
    add(product.low);
    add(product.high);
  }

  void add_product(Scalar a, Scalar b, Scalar c) {
    const Pair product = exact_product(a, b);
    add_product(product.low, c);
    add_product(product.high, c);
  }

  // The largest part dominates the rest.
  int sign() const {
    if (size_ == 0) return 0;
    return parts_[size_ - 1] > 0 ? 1 : -1;
  }

 private:
  // A determinant adds 6 products of 3 pairs: 6 * 8 * 4 numbers.
  static constexpr std::size_t kCapacity = 192;
  std::array<Scalar, kCapacity> parts_;
  std::size_t size_ = 0;
};

using PairVector = std::array<Pair, 3>;

PairVector exact_difference(const Vector3& p, const Vector3& q) {
  return {exact_sum(p.x(), -q.x()), exact_sum(p.y(), -q.y()), exact_sum(p.z(), -q.z())};
}

std::array<Scalar, 2> parts_of(const Pair& pair) {
  return {pair.high, pair.low};
}

void add_triple(Expansion& sum, Scalar sign, const Pair& a, const Pair& b, const Pair& c) {
  for (const Scalar x : parts_of(a)) {
    if (x == 0) continue;
    for (const Scalar y : parts_of(b)) {
      if (y == 0) continue;
      for (const Scalar z : parts_of(c)) {
        if (z != 0) sum.add_product(sign * x, y, z);
      }
    }
  }
}

int exact_orientation(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const PairVector u = exact_difference(b, a);
  const PairVector v = exact_difference(c, a);
  const PairVector w = exact_difference(d, a);
  Expansion sum;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const std::size_t k = (i + 2) % 3;
    add_triple(sum, 1, u[i], v[j], w[k]);
    add_triple(sum, -1, u[i], v[k], w[j]);
  }
  return sum.sign();
}

}  // namespace

int orientation(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const Vector3 u = b - a;
  const Vector3 v = c - a;
  const Vector3 w = d - a;
  const Scalar determinant = u.cross(v).dot(w);
  const Scalar noise = kDeterminantNoise * u.lpNorm<1>() * v.lpNorm<1>() * w.lpNorm<1>();
  if (determinant > noise) return 1;
  if (determinant < -noise) return -1;
  return exact_orientation(a, b, c, d);
}

int orientation_along(int axis, const Vector3& a, const Vector3& b, const Vector3& c) {
  const PairVector u = exact_difference(b, a);
  const PairVector v = exact_difference(c, a);
  const auto i = std::size_t((axis + 1) % 3);
  const auto j = std::size_t((axis + 2) % 3);
  Expansion sum;
  for (const Scalar x : parts_of(u[i])) {
    for (const Scalar y : parts_of(v[j])) sum.add_product(x, y);
  }
  for (const Scalar x : parts_of(u[j])) {
    for (const Scalar y : parts_of(v[i])) sum.add_product(-x, y);
  }
  return sum.sign();
}

}  // namespace dyop::exact_internal
