// SPDX-License-Identifier: BSD-3-Clause
#include "motion/curve/bernstein.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dyop::motion_internal {
namespace {

// Pascal's triangle: C(n, k) at [n][k], exact, because all are below 2^53 for n <
// kMaxBernsteinCount.
constexpr auto kBinomials = [] {
  std::array<std::array<Scalar, kMaxBernsteinCount>, kMaxBernsteinCount> c{};
  for (std::size_t n = 0; n < kMaxBernsteinCount; ++n) {
    c[n][0] = 1;
    for (std::size_t k = 1; k <= n; ++k) c[n][k] = c[n - 1][k - 1] + c[n - 1][k];
  }
  return c;
}();

}  // namespace

Vector3 evaluate(BernsteinSpan b, Scalar s) {
  BernsteinBuffer x;
  std::copy(b.begin(), b.end(), x.begin());
  for (std::size_t count = b.size() - 1; count > 0; --count) {
    for (std::size_t k = 0; k < count; ++k) x[k] = mix(x[k], x[k + 1], s);
  }
  return x[0];
}

// Coefficient k of the part is the polar form at (degree - k) times s0 and k times s1: from the
// last coefficient to the first, each inserts s0 once more.
void restrict_to(BernsteinSpan b, Scalar s0, Scalar s1, std::span<Vector3> part) {
  if (s0 == 0 && s1 == 1) {
    std::copy(b.begin(), b.end(), part.begin());
    return;
  }
  BernsteinBuffer filled;
  std::copy(b.begin(), b.end(), filled.begin());
  for (std::size_t k = b.size(); k-- > 0;) {
    part[k] = evaluate(BernsteinSpan(filled.data(), k + 1), s1);
    for (std::size_t i = 0; i < k; ++i) filled[i] = mix(filled[i], filled[i + 1], s0);
  }
}

void derive(BernsteinSpan b, Scalar h, std::span<Vector3> rate) {
  const Scalar degree = static_cast<Scalar>(b.size() - 1);
  for (std::size_t k = 0; k + 1 < b.size(); ++k) rate[k] = degree * (b[k + 1] - b[k]) / h;
}

Scalar largest_norm(BernsteinSpan b) {
  Scalar largest_sq = 0;
  for (const Vector3& x : b) {
    const Scalar sq = x.squaredNorm();
    if (sq > largest_sq || std::isnan(sq)) largest_sq = sq;  // NaN stays: no sq is greater
  }
  // literal: below it squares may have underflowed, which would make the norm too small.
  if (!(largest_sq < 0x1p-900)) return std::sqrt(largest_sq);
  Scalar largest = 0;
  for (const Vector3& x : b) largest = std::max(largest, x.stableNorm());
  return largest;
}

// Coefficient k: sum over i + j = k of C(m, i) C(n, j) / C(m + n, k) x_i x y_j.
Scalar largest_cross_product(BernsteinSpan x, BernsteinSpan y) {
  const std::size_t m = x.size() - 1, n = y.size() - 1;
  BernsteinBuffer product;
  for (std::size_t k = 0; k <= m + n; ++k) {
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = k > n ? k - n : 0; i <= std::min(k, m); ++i) {
      sum += kBinomials[m][i] * kBinomials[n][k - i] * x[i].cross(y[k - i]);
    }
    product[k] = sum / kBinomials[m + n][k];
  }
  return largest_norm(BernsteinSpan(product.data(), m + n + 1));
}

namespace {

SpeedTree::Speeds larger_speeds(const SpeedTree::Speeds& x, const SpeedTree::Speeds& y) {
  return {std::max(x.linear, y.linear), std::max(x.angular, y.angular)};
}

}  // namespace

SpeedTree::SpeedTree(const std::vector<Speeds>& pieces) : nodes_(pieces.size()) {
  nodes_.insert(nodes_.end(), pieces.begin(), pieces.end());
  for (std::size_t i = pieces.size(); i-- > 1;) {
    nodes_[i] = larger_speeds(nodes_[2 * i], nodes_[2 * i + 1]);
  }
}

// Bottom up: at most two nodes of each level.
SpeedTree::Speeds SpeedTree::largest(std::size_t first, std::size_t last) const {
  Speeds largest;
  std::size_t begin = first + nodes_.size() / 2;
  std::size_t end = last + 1 + nodes_.size() / 2;
  for (; begin < end; begin /= 2, end /= 2) {
    if (begin % 2 == 1) largest = larger_speeds(largest, nodes_[begin++]);
    if (end % 2 == 1) largest = larger_speeds(largest, nodes_[--end]);
  }
  return largest;
}

}  // namespace dyop::motion_internal
