// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/feature_witness.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::contact_internal {
namespace {

// If a triangle's normal is longer than this, relative to the product of two sides, rounding moves
// its plane by less than kPlaneSlack times the distance from its corner.
constexpr Scalar kLeastNormalSine = 1.0 / (1 << 20);
constexpr Scalar kPlaneSlack = kLeastNormalSine * kLeastNormalSine;

// The nearest point on the three sides and corners.
TriangleFoot border_foot(const Triangle& t, const Vector3& p) {
  TriangleFoot best;
  Scalar best_sq = kInfinity;
  for (int k = 0; k < 3; ++k) {
    const int next = k < 2 ? k + 1 : 0;
    const Vector3& from = t[std::size_t(k)];
    const Vector3 along = t[std::size_t(next)] - from;
    const Scalar length_sq = along.squaredNorm();
    const Scalar s = length_sq > 0 ? along.dot(p - from) / length_sq : 0;
    TriangleFoot foot;
    if (s > 0 && s < 1) {
      foot.kind = foot.place = FeatureKind::Edge;
      foot.index = k;
      foot.point = from + s * along;
    } else {
      foot.kind = foot.place = FeatureKind::Vertex;
      foot.index = s > 0 ? next : k;
      foot.point = t[std::size_t(foot.index)];
    }
    const Scalar distance_sq = (p - foot.point).squaredNorm();
    if (!(distance_sq < best_sq)) continue;
    best_sq = distance_sq;
    best = foot;
  }
  return best;
}

}  // namespace

std::optional<TriangleFoot> find_foot(const Triangle& t, const Vector3& p, Scalar reach,
                                      Scalar border_sine, Scalar noise) {
  const Vector3 e = t[1] - t[0];
  const Vector3 f = t[2] - t[0];
  const Vector3 r = p - t[0];
  const Vector3 n = e.cross(f);
  const Scalar n_sq = n.squaredNorm();
  const bool has_plane =
      n_sq > kLeastNormalSine * kLeastNormalSine * e.squaredNorm() * f.squaredNorm();
  Scalar height = 0;
  TriangleFoot foot;
  if (has_plane) {
    const Scalar length = std::sqrt(n_sq);
    height = n.dot(r) / length;
    if (std::abs(height) > reach + kPlaneSlack * r.norm()) return std::nullopt;
    foot.is_outer = height >= 0;
    foot.normal = foot.is_outer ? Vector3(n / length) : Vector3(-n / length);
    const Scalar u = r.cross(f).dot(n);
    const Scalar v = e.cross(r).dot(n);
    if (u >= 0 && v >= 0 && u + v <= n_sq) {
      foot.point = t[0] + (u / n_sq) * e + (v / n_sq) * f;
      return foot;
    }
  }
  const TriangleFoot border = border_foot(t, p);
  const Vector3 w = p - border.point;
  const Scalar distance_sq = w.squaredNorm();
  if (distance_sq > reach * reach) return std::nullopt;
  const Scalar lateral_sq = (w - std::abs(height) * foot.normal).squaredNorm();
  const Scalar slack = border_sine * std::abs(height) + noise;
  if (!has_plane || lateral_sq > slack * slack) return border;
  foot.place = border.place;
  foot.index = border.index;
  foot.point = border.point;
  return foot;
}

std::optional<EdgeCrossing> find_crossing(const Vector3& a0, const Vector3& a1, const Vector3& b0,
                                          const Vector3& b1, Scalar reach, Scalar noise) {
  const Vector3 e = a1 - a0;
  const Vector3 f = b1 - b0;
  const Vector3 r = b0 - a0;
  const Vector3 n = e.cross(f);
  const Scalar n_sq = n.squaredNorm();
  const Scalar height = n.dot(r);
  // Slightly farther than reach: the bounds decide.
  if (height * height > 1.0625 * reach * reach * n_sq) return std::nullopt;
  const Scalar e_sq = e.squaredNorm();
  const Scalar f_sq = f.squaredNorm();
  if (!(n_sq > kContactNoCrossingSine * kContactNoCrossingSine * e_sq * f_sq)) return std::nullopt;
  Scalar s = r.cross(f).dot(n) / n_sq;
  Scalar t = r.cross(e).dot(n) / n_sq;
  const Scalar off_a = std::max(-s, s - 1);
  const Scalar off_b = std::max(-t, t - 1);
  if (off_a > 0 && off_a * off_a * e_sq > noise * noise) return std::nullopt;
  if (off_b > 0 && off_b * off_b * f_sq > noise * noise) return std::nullopt;
  s = std::clamp(s, Scalar{0}, Scalar{1});
  t = std::clamp(t, Scalar{0}, Scalar{1});
  const Scalar length = std::sqrt(n_sq);
  return EdgeCrossing{a0 + s * e, b0 + t * f, n / length, length / std::sqrt(e_sq * f_sq)};
}

}  // namespace dyop::contact_internal
