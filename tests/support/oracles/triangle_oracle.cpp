// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/triangle_oracle.h"

#include <gmpxx.h>

#include <cmath>

namespace dyop::testing {
namespace {

using Rational = mpq_class;

// Rounding of some hundred operations in 113 bits, relative to the size of the pair.
constexpr long double kQuadNoise = 0x1p-100L;
// What a quad result may leave open before rational arithmetic takes over; about 1e-28.
constexpr long double kQuadAccepted = 0x1p-93L;
// Rounding of the bounds to long double and of their middle.
constexpr long double kLongDoubleNoise = 0x1p-61L;

Quad absolute(Quad x) {
  return x < 0 ? -x : x;
}

// Both triangles relative to one vertex, so that their place in the world costs no digits.
Quad move_to_local_origin(PointTriangle<Quad>& a, PointTriangle<Quad>& b) {
  const Point<Quad> origin = a[0];
  Quad size = 0;
  for (PointTriangle<Quad>* triangle : {&a, &b}) {
    for (Point<Quad>& p : *triangle) {
      p = p - origin;
      size = std::max({size, absolute(p.x), absolute(p.y), absolute(p.z)});
    }
  }
  return size;
}

OracleDistance make_result(long double lower, long double upper) {
  const long double middle = lower + (upper - lower) / 2;
  return {middle, (upper - lower) / 2 + kLongDoubleNoise * upper};
}

Rational exact_squared_distance(const Triangle& a, const Triangle& b) {
  return nearest_points(to_points<Rational>(a), to_points<Rational>(b)).squared_distance;
}

// A double holds the first 53 bits of a rational, the remainder's double the next, and so on.
Quad to_quad(Rational x) {
  Quad sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double part = x.get_d();
    sum += static_cast<Quad>(part);
    x -= part;
  }
  return sum;
}

OracleDistance exact_distance(const Triangle& a, const Triangle& b, long double size) {
  const Rational squared = exact_squared_distance(a, b);
  if (squared == 0) return {};
  // Squares are brought near one, so that only distances below 1e-150 of the size underflow.
  const int exponent = std::ilogb(size);
  mpz_class power = 1;
  power <<= static_cast<mp_bitcnt_t>(2 * std::abs(exponent));
  const Rational scaled = exponent > 0 ? Rational(squared / power) : Rational(squared * power);
  const long double distance =
      std::ldexp(static_cast<long double>(square_root(to_quad(scaled))), exponent);
  return {distance, kQuadNoise * size + kLongDoubleNoise * distance};
}

}  // namespace

OracleDistance oracle_triangle_distance(const PointTriangle<Quad>& a,
                                        const PointTriangle<Quad>& b) {
  PointTriangle<Quad> local_a = a;
  PointTriangle<Quad> local_b = b;
  const auto size = static_cast<long double>(move_to_local_origin(local_a, local_b));
  const NearestPair<Quad> nearest = nearest_points(local_a, local_b);
  const auto upper = static_cast<long double>(square_root(nearest.squared_distance));
  const auto gap = static_cast<long double>(slab_gap(local_a, local_b, nearest));
  const long double noise = kQuadNoise * size;
  return make_result(std::clamp(gap - noise, 0.0L, upper), upper + noise);
}

OracleDistance oracle_triangle_distance(const Triangle& a, const Triangle& b) {
  const PointTriangle<Quad> quad_a = to_points<Quad>(a);
  const PointTriangle<Quad> quad_b = to_points<Quad>(b);
  PointTriangle<Quad> local_a = quad_a;
  PointTriangle<Quad> local_b = quad_b;
  const auto size = static_cast<long double>(move_to_local_origin(local_a, local_b));
  const OracleDistance result = oracle_triangle_distance(quad_a, quad_b);
  const long double rounding = kLongDoubleNoise * result.upper();
  if (result.error <= kQuadAccepted * size + 2 * rounding) return result;
  return exact_distance(a, b, size);
}

bool oracle_triangles_intersect(const Triangle& a, const Triangle& b) {
  return exact_squared_distance(a, b) == 0;
}

}  // namespace dyop::testing
