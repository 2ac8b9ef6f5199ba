#include "toi/box_direction.h"

#include <cmath>

namespace dyop::internal {
namespace {

// Keeps the direction of the largest gap.
class BestDirection {
 public:
  BestDirection(const OrientedBox& a, const OrientedBox& b)
      : a_(a), b_(b), between_(b.center - a.center) {}

  // Returns the slab gap along n or -n, not divided by the length of n.
  Scalar offer(const Vector3& n) {
    const Scalar along = n.dot(between_);
    const Scalar gap = std::abs(along) - (a_.axes.transpose() * n).cwiseAbs().dot(a_.half_extents) -
                       (b_.axes.transpose() * n).cwiseAbs().dot(b_.half_extents);
    const Scalar length_sq = n.squaredNorm();
    // literal: below this a cross product of unit axes is rounding, and says nothing the faces do
    // not.
    if (!(length_sq > 1e-6)) return gap;
    const Scalar normalised = gap / std::sqrt(length_sq);
    if (normalised > gap_) {
      gap_ = normalised;
      nhat_ = (along < 0 ? -n : n) / std::sqrt(length_sq);
    }
    return gap;
  }
  // For directions that are lengths, not products of unit vectors.
  void offer_way(const Vector3& way) {
    const Scalar length = way.norm();
    if (length > 0) offer(way / length);
  }

  const Vector3& nhat() const { return nhat_; }
  const Vector3& between() const { return between_; }

 private:
  const OrientedBox& a_;
  const OrientedBox& b_;
  const Vector3 between_;
  Scalar gap_ = -kInfinity;
  Vector3 nhat_ = Vector3::UnitX();
};

}  // namespace

Vector3 separating_direction(const OrientedBox& a, const OrientedBox& b) {
  BestDirection best(a, b);
  Vector3 way = Vector3::Zero();
  for (int i = 0; i < 3; ++i) {
    const Vector3 axis = a.axes.col(i);
    const Scalar gap = best.offer(axis);
    if (gap > 0) way += (axis.dot(best.between()) < 0 ? -gap : gap) * axis;
  }
  best.offer_way(way);
  best.offer_way(best.between());
  if (b.axes == a.axes) return best.nhat();
  for (int j = 0; j < 3; ++j) {
    best.offer(b.axes.col(j));
    for (int i = 0; i < 3; ++i) best.offer(a.axes.col(i).cross(b.axes.col(j)));
  }
  return best.nhat();
}

}  // namespace dyop::internal
