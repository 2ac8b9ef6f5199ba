#include "distance/box_gap.h"

#include <cmath>

namespace dyop::internal {
namespace {

// Edge axes of nearly parallel edges divide rounding noise by a small length and say nothing that
// the face axes do not. literal: squared sine of the smallest angle used.
constexpr Scalar kSmallestSineSq = 1e-6;

}  // namespace

BoxGap box_gap(const OrientedBox& a, const OrientedBox& b, const RigidPose& X_AB, Scalar noise) {
  // Work in the frame of box a, scaled by nothing: R holds b's axes, t b's centre.
  const Matrix3 R = a.axes.transpose() * (X_AB.rotation() * b.axes);
  const Vector3 t = a.axes.transpose() * (X_AB * b.center - a.center);
  const Matrix3 abs_R = R.cwiseAbs();
  const Vector3& ha = a.half_extents;
  const Vector3& hb = b.half_extents;

  // Candidates are compared by their normalised gap; best_axis is in box a's frame, not unit.
  Scalar best = -kInfinity;
  Vector3 best_axis = Vector3::UnitX();

  const Vector3 face_a = t.cwiseAbs() - ha - abs_R * hb;
  for (int i = 0; i < 3; ++i) {
    if (face_a[i] - noise > best) {
      best = face_a[i] - noise;
      best_axis = t[i] < 0 ? Vector3(-Vector3::Unit(i)) : Vector3(Vector3::Unit(i));
    }
  }
  const Vector3 t_b = R.transpose() * t;
  const Vector3 face_b = t_b.cwiseAbs() - hb - abs_R.transpose() * ha;
  for (int j = 0; j < 3; ++j) {
    if (face_b[j] - noise > best) {
      best = face_b[j] - noise;
      best_axis = t_b[j] < 0 ? Vector3(-R.col(j)) : Vector3(R.col(j));
    }
  }
  const Scalar distance_sq = t.squaredNorm();
  if (distance_sq > 0) {
    const Scalar centers = std::sqrt(distance_sq);
    const Scalar gap =
        (distance_sq - ha.dot(t.cwiseAbs()) - hb.dot(t_b.cwiseAbs())) / centers - noise;
    if (gap > best) {
      best = gap;
      best_axis = t / centers;
    }
  }
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3;
    const int i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      // The squared length of the axis e_i x b_j itself: 1 - R(i, j)^2 loses its digits.
      const Scalar sine_sq = R(i1, j) * R(i1, j) + R(i2, j) * R(i2, j);
      if (sine_sq < kSmallestSineSq) continue;
      const int j1 = (j + 1) % 3;
      const int j2 = (j + 2) % 3;
      const Scalar along = t[i2] * R(i1, j) - t[i1] * R(i2, j);  // t . (e_i x b_j)
      const Scalar gap = std::abs(along) - ha[i1] * abs_R(i2, j) - ha[i2] * abs_R(i1, j) -
                         hb[j1] * abs_R(i, j2) - hb[j2] * abs_R(i, j1) - noise;
      // Only a positive gap can win over a face axis usefully; this saves the square root.
      if (gap > 0 && gap * gap > best * std::abs(best) * sine_sq) {
        const Scalar sine = std::sqrt(sine_sq);
        best = gap / sine;
        Vector3 axis = Vector3::Zero();
        axis[i1] = -R(i2, j);
        axis[i2] = R(i1, j);
        best_axis = axis / (along < 0 ? -sine : sine);
      }
    }
  }
  BoxGap result;
  result.gap = best;
  result.nhat_AB_A = a.axes * best_axis;
  return result;
}

}  // namespace dyop::internal
