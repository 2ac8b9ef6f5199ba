// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "exact/big_integer.h"

namespace dyop::exact_internal {

// c[0] + c[1] s + c[2] s^2 + c[3] s^3 with integer coefficients; degree at most three.
struct ExactPolynomial {
  std::array<BigInteger, 4> c;

  int degree() const;  // -1 for the zero polynomial
  bool is_zero() const { return degree() < 0; }
  int bit_length() const;  // of the largest coefficient

  friend ExactPolynomial operator+(const ExactPolynomial& x, const ExactPolynomial& y);
  friend ExactPolynomial operator-(const ExactPolynomial& x, const ExactPolynomial& y);
  // The degree of the product must not exceed three.
  friend ExactPolynomial operator*(const ExactPolynomial& x, const ExactPolynomial& y);
};

// A root in [0, 1] of a polynomial: either a fraction, or known to be the only root in an open
// interval ]k, k + 1[ / 2^level, in which the polynomial changes its sign.
struct ExactRoot {
  bool is_fraction = true;
  BigInteger numerator = 0;  // k, if not a fraction
  BigInteger denominator = 1;
  int level = 0;
  int sign_at_begin = 0;  // of the polynomial just after the interval's start
};

// All distinct roots of p in [0, 1]; p must not be zero.
std::vector<ExactRoot> roots_in_unit_interval(const ExactPolynomial& p);

// Sign (-1, 0, 1) of q at a root of p; the degree of q is at most two. Narrows the root's interval.
int sign_at(const ExactPolynomial& q, const ExactPolynomial& p, ExactRoot& root);

}  // namespace dyop::exact_internal
