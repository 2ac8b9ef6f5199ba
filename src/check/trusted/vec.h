// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

/// Vectors and rotations of the checker. TRUSTED: a proof depends on this file.
namespace dyop_check {

/// More than the rounding of the few operations that make a bound.
inline constexpr double kUp = 1 + 1e-12;  // literal: unitless

inline constexpr double kPi = 3.141592653589793;
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Vec {
  double x = 0;
  double y = 0;
  double z = 0;
};

inline Vec operator+(const Vec& a, const Vec& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec operator-(const Vec& a, const Vec& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec operator*(double s, const Vec& a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline double dot(const Vec& a, const Vec& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec& a) {
  return std::sqrt(dot(a, a));
}
inline Vec absolute(const Vec& a) {
  return {std::abs(a.x), std::abs(a.y), std::abs(a.z)};
}

/// A matrix, row by row.
struct Mat {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
};

inline Vec operator*(const Mat& R, const Vec& v) {
  const auto& m = R.m;
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
          m[6] * v.x + m[7] * v.y + m[8] * v.z};
}
/// R^T v.
inline Vec transposed(const Mat& R, const Vec& v) {
  const auto& m = R.m;
  return {m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z,
          m[2] * v.x + m[5] * v.y + m[8] * v.z};
}
inline Mat transpose(const Mat& R) {
  const auto& m = R.m;
  Mat T;
  T.m = {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
  return T;
}
inline Mat operator*(const Mat& A, const Mat& B) {
  Mat C;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      C.m[std::size_t(3 * i + j)] = A.m[std::size_t(3 * i)] * B.m[std::size_t(j)] +
                                    A.m[std::size_t(3 * i + 1)] * B.m[std::size_t(3 + j)] +
                                    A.m[std::size_t(3 * i + 2)] * B.m[std::size_t(6 + j)];
    }
  }
  return C;
}

/// The rotation by |r| radians about r (Rodrigues' formula).
inline Mat rotation(const Vec& r) {
  const double angle = norm(r);
  // sin(a)/a and (1 - cos a)/a^2, without cancellation.
  const double half = 0.5 * angle;
  const double s = angle > 0 ? std::sin(angle) / angle : 1;
  const double q = half > 0 ? std::sin(half) / half : 1;
  const double c = 0.5 * q * q;
  Mat R;
  R.m = {1 - c * (r.y * r.y + r.z * r.z), c * r.x * r.y - s * r.z,
         c * r.x * r.z + s * r.y,         c * r.x * r.y + s * r.z,
         1 - c * (r.x * r.x + r.z * r.z), c * r.y * r.z - s * r.x,
         c * r.x * r.z - s * r.y,         c * r.y * r.z + s * r.x,
         1 - c * (r.x * r.x + r.y * r.y)};
  return R;
}

/// The rotation vector of a rotation by less than half a turn.
inline Vec rotation_vector(const Mat& R) {
  const auto& m = R.m;
  const Vec axis{m[7] - m[5], m[2] - m[6], m[3] - m[1]};  // 2 sin(angle) along the axis
  const double sine = norm(axis) / 2;
  const double angle = std::atan2(sine, (m[0] + m[4] + m[8] - 1) / 2);
  return (sine > 0 ? angle / (2 * sine) : 0.5) * axis;
}

struct Pose {
  Mat R;
  Vec p;
};

inline Vec operator*(const Pose& X, const Vec& v) {
  return X.R * v + X.p;
}
inline Pose operator*(const Pose& X, const Pose& Y) {
  return {X.R * Y.R, X * Y.p};
}

}  // namespace dyop_check
