// SPDX-License-Identifier: BSD-3-Clause
#include "exact/polynomial.h"

#include <algorithm>
#include <utility>

#include "dyop/core/error.h"

namespace dyop::exact_internal {
namespace {

// A cubic, or less, on an interval [k, k + 1] / 2^level, given by its Bernstein coefficients times
// a positive factor.
struct Piece {
  std::vector<BigInteger> b;
  BigInteger k;
  int level = 0;
};

int sign_at_fraction(const ExactPolynomial& p, const BigInteger& numerator,
                     const BigInteger& denominator) {
  const int degree = p.degree();
  if (degree < 0) return 0;
  BigInteger value = p.c[static_cast<std::size_t>(degree)];
  BigInteger power = 1;
  for (int i = degree - 1; i >= 0; --i) {
    power = power * denominator;
    value = value * numerator + p.c[static_cast<std::size_t>(i)] * power;
  }
  return value.sign();
}

int sign_at_dyadic(const ExactPolynomial& p, const BigInteger& k, int level) {
  const int degree = p.degree();
  if (degree < 0) return 0;
  BigInteger value = p.c[static_cast<std::size_t>(degree)];
  for (int i = degree - 1; i >= 0; --i) {
    value = value * k + (p.c[static_cast<std::size_t>(i)] << (level * (degree - i)));
  }
  return value.sign();
}

// Appends the fraction if it lies in [0, 1].
void append_fraction(BigInteger numerator, BigInteger denominator, std::vector<ExactRoot>& roots) {
  if (denominator.sign() < 0) {
    numerator = -numerator;
    denominator = -denominator;
  }
  if (numerator.sign() < 0 || (denominator - numerator).sign() < 0) return;
  ExactRoot root;
  root.numerator = std::move(numerator);
  root.denominator = std::move(denominator);
  roots.push_back(std::move(root));
}

// Six times the Bernstein coefficients on [0, 1].
Piece whole_interval(const ExactPolynomial& p) {
  Piece piece;
  if (p.degree() == 3) {
    piece.b = {6 * p.c[0], 6 * p.c[0] + 2 * p.c[1], 6 * p.c[0] + 4 * p.c[1] + 2 * p.c[2],
               6 * (p.c[0] + p.c[1] + p.c[2] + p.c[3])};
  } else {
    piece.b = {6 * p.c[0], 6 * p.c[0] + 3 * p.c[1], 6 * (p.c[0] + p.c[1] + p.c[2])};
  }
  return piece;
}

// De Casteljau's algorithm at the middle, all coefficients times 2^degree.
std::pair<Piece, Piece> split(const Piece& piece) {
  const std::size_t count = piece.b.size();
  Piece left{piece.b, piece.k + piece.k, piece.level + 1};
  Piece right{piece.b, left.k + 1, piece.level + 1};
  std::vector<BigInteger> row = piece.b;
  const int degree = static_cast<int>(count) - 1;
  for (std::size_t r = 0; r < count; ++r) {
    const int shift = degree - static_cast<int>(r);
    left.b[r] = row.front() << shift;
    right.b[count - 1 - r] = row.back() << shift;
    for (std::size_t i = 0; i + 1 < row.size(); ++i) row[i] = row[i] + row[i + 1];
    row.pop_back();
  }
  return {std::move(left), std::move(right)};
}

template <typename Coefficients>
int count_variations(const Coefficients& b) {
  int variations = 0;
  int last = 0;
  for (const BigInteger& coefficient : b) {
    const int sign = coefficient.sign();
    if (sign == 0) continue;
    if (last != 0 && sign != last) ++variations;
    last = sign;
  }
  return variations;
}

int first_sign(const std::vector<BigInteger>& b) {
  for (const BigInteger& coefficient : b) {
    if (!coefficient.is_zero()) return coefficient.sign();
  }
  return 0;
}

// Roots of a square-free polynomial by Descartes' rule on Bernstein coefficients: no sign variation
// means no root inside, one means one root. The depth is bounded by the distance of the two nearest
// roots, 2^-O(bits).
void isolate(const ExactPolynomial& p, std::vector<ExactRoot>& roots) {
  const int deepest = 16 * p.bit_length() + 64;
  std::vector<Piece> stack{whole_interval(p)};
  if (stack.back().b.front().is_zero()) append_fraction(0, 1, roots);
  if (stack.back().b.back().is_zero()) append_fraction(1, 1, roots);
  while (!stack.empty()) {
    const Piece piece = std::move(stack.back());
    stack.pop_back();
    const int variations = count_variations(piece.b);
    if (variations == 0) continue;
    if (variations == 1) {
      ExactRoot root;
      root.is_fraction = false;
      root.numerator = piece.k;
      root.level = piece.level;
      root.sign_at_begin = first_sign(piece.b);
      roots.push_back(std::move(root));
      continue;
    }
    if (piece.level > deepest)
      throw InternalError("could not isolate the roots of a square-free cubic");
    auto [left, right] = split(piece);
    if (left.b.back().is_zero()) append_fraction(right.k, BigInteger(1) << right.level, roots);
    stack.push_back(std::move(right));
    stack.push_back(std::move(left));
  }
}

// A cubic with a double root and integer coefficients has rational roots.
void append_cubic_roots(const ExactPolynomial& p, std::vector<ExactRoot>& roots) {
  const auto& [d, c, b, a] = p.c;
  const BigInteger b_sq = b * b;
  const BigInteger ac = a * c;
  const BigInteger discriminant =
      b_sq * c * c - 4 * (ac * c * c + b_sq * b * d) - 27 * (a * a * d * d) + 18 * (ac * b * d);
  if (!discriminant.is_zero()) return isolate(p, roots);
  const BigInteger delta = b_sq - 3 * ac;
  if (delta.is_zero()) return append_fraction(-b, 3 * a, roots);
  append_fraction(9 * (a * d) - b * c, 2 * delta, roots);
  append_fraction(4 * (ac * b) - 9 * (a * a * d) - b_sq * b, a * delta, roots);
}

void append_quadratic_roots(const ExactPolynomial& p, std::vector<ExactRoot>& roots) {
  const int discriminant = (p.c[1] * p.c[1] - 4 * (p.c[0] * p.c[2])).sign();
  if (discriminant > 0) return isolate(p, roots);
  if (discriminant == 0) append_fraction(-p.c[1], 2 * p.c[2], roots);
}

// Twice 4^level times the Bernstein coefficients of a quadratic on the root's interval.
std::array<BigInteger, 3> bernstein_around(const ExactPolynomial& q, const ExactRoot& root) {
  const BigInteger& k = root.numerator;
  const BigInteger next = k + 1;
  const BigInteger c0 = q.c[0] << (2 * root.level + 1);
  const BigInteger c1 = q.c[1] << root.level;
  return {c0 + 2 * (c1 * k + q.c[2] * k * k), c0 + c1 * (k + next) + 2 * (q.c[2] * k * next),
          c0 + 2 * (c1 * next + q.c[2] * next * next)};
}

bool is_inside(const BigInteger& numerator, const BigInteger& denominator, const ExactRoot& root) {
  const BigInteger scaled = numerator << root.level;
  const BigInteger from_begin = scaled - root.numerator * denominator;
  const BigInteger to_end = (root.numerator + 1) * denominator - scaled;
  return from_begin.sign() * denominator.sign() > 0 && to_end.sign() * denominator.sign() > 0;
}

// Remainder of f divided by g, times a power of g's leading coefficient.
ExactPolynomial remainder(ExactPolynomial f, const ExactPolynomial& g) {
  const int degree = g.degree();
  for (int k = f.degree(); k >= degree; k = std::min(k - 1, f.degree())) {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    const BigInteger lead = f.c[at(k)];
    for (BigInteger& coefficient : f.c) coefficient = coefficient * g.c[at(degree)];
    for (int i = 0; i <= degree; ++i) {
      f.c[at(k - degree + i)] = f.c[at(k - degree + i)] - lead * g.c[at(i)];
    }
  }
  return f;
}

// Whether q, of degree one or two, is zero at a root of p that is known by its interval.
bool vanishes_at(const ExactPolynomial& q, const ExactPolynomial& p, const ExactRoot& root) {
  const bool is_q_lower = q.degree() <= p.degree();
  const ExactPolynomial& low = is_q_lower ? q : p;
  const ExactPolynomial& high = is_q_lower ? p : q;
  ExactPolynomial common = low;
  if (low.degree() == 2) {
    common = remainder(high, low);
    if (common.is_zero()) {
      // One divides the other. If q divides p, its roots are among those of p, and one of them is
      // here.
      return !is_q_lower || count_variations(bernstein_around(q, root)) % 2 == 1;
    }
  }
  if (common.degree() != 1) return false;
  const BigInteger numerator = -common.c[0];
  return is_inside(numerator, common.c[1], root) &&
         sign_at_fraction(q, numerator, common.c[1]) == 0 &&
         sign_at_fraction(p, numerator, common.c[1]) == 0;
}

void halve(const ExactPolynomial& p, ExactRoot& root) {
  const BigInteger middle = root.numerator + root.numerator + 1;
  ++root.level;
  const int sign = sign_at_dyadic(p, middle, root.level);
  if (sign == 0) {
    root.is_fraction = true;
    root.numerator = middle;
    root.denominator = BigInteger(1) << root.level;
  } else {
    root.numerator = sign == root.sign_at_begin ? middle : middle - 1;
  }
}

}  // namespace

int ExactPolynomial::degree() const {
  int degree = 3;
  while (degree >= 0 && c[static_cast<std::size_t>(degree)].is_zero()) --degree;
  return degree;
}

int ExactPolynomial::bit_length() const {
  int bits = 0;
  for (const BigInteger& coefficient : c) bits = std::max(bits, coefficient.bit_length());
  return bits;
}

ExactPolynomial operator+(const ExactPolynomial& x, const ExactPolynomial& y) {
  ExactPolynomial sum;
  for (std::size_t i = 0; i < sum.c.size(); ++i) sum.c[i] = x.c[i] + y.c[i];
  return sum;
}

ExactPolynomial operator-(const ExactPolynomial& x, const ExactPolynomial& y) {
  ExactPolynomial difference;
  for (std::size_t i = 0; i < difference.c.size(); ++i) difference.c[i] = x.c[i] - y.c[i];
  return difference;
}

ExactPolynomial operator*(const ExactPolynomial& x, const ExactPolynomial& y) {
  ExactPolynomial product;
  for (std::size_t i = 0; i < x.c.size(); ++i) {
    if (x.c[i].is_zero()) continue;
    for (std::size_t j = 0; i + j < product.c.size(); ++j) {
      if (!y.c[j].is_zero()) product.c[i + j] = product.c[i + j] + x.c[i] * y.c[j];
    }
  }
  return product;
}

std::vector<ExactRoot> roots_in_unit_interval(const ExactPolynomial& p) {
  std::vector<ExactRoot> roots;
  switch (p.degree()) {
    case 3:
      append_cubic_roots(p, roots);
      break;
    case 2:
      append_quadratic_roots(p, roots);
      break;
    case 1:
      append_fraction(-p.c[0], p.c[1], roots);
      break;
    default:
      break;
  }
  return roots;
}

int sign_at(const ExactPolynomial& q, const ExactPolynomial& p, ExactRoot& root) {
  if (q.degree() <= 0) return q.c[0].sign();
  // The values of q at the roots of p multiply to an integer, the resultant, over powers of p's
  // leading coefficient: where q is not zero it is at least 2^-O(bits), so the loop ends.
  const int deepest = root.level + 16 * (p.bit_length() + q.bit_length()) + 64;
  constexpr int kFirstSteps = 8;
  constexpr int kMostSteps = 64;
  for (int steps = kFirstSteps; !root.is_fraction; steps = std::min(2 * steps, kMostSteps)) {
    const std::array<BigInteger, 3> b = bernstein_around(q, root);
    if (b[0].sign() == b[1].sign() && b[1].sign() == b[2].sign()) return b[0].sign();
    // Usually the sign is clear at once; only if it stays open is a common root tested for.
    if (steps == 2 * kFirstSteps && vanishes_at(q, p, root)) return 0;
    if (root.level > deepest) throw InternalError("could not determine the sign at a root");
    for (int i = 0; i < steps && !root.is_fraction; ++i) halve(p, root);
  }
  return sign_at_fraction(q, root.numerator, root.denominator);
}

}  // namespace dyop::exact_internal
