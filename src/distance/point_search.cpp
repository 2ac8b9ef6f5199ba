// SPDX-License-Identifier: BSD-3-Clause
#include "distance/point_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::distance_internal {
namespace {

struct OpenBox {
  Scalar gap_sq;  // lower bound, in units of the hierarchy's scale
  std::int32_t child;
};

constexpr int kGroupSize = BoxGroup::kWidth;

// Lower bounds on the squared distances of the boxes of a group to a point q, both in units of the
// scale, before rounding outward: |y| - half extents, with y the coordinates of the point along a
// box's axes. docs/algorithms/distance.md, "Points".
std::array<Scalar, kGroupSize> squared_gaps(const BoxGroup& boxes, const Vector3& q) {
  std::array<Scalar, kGroupSize> x, y, z, slack, sum{};
  for (int i = 0; i < kGroupSize; ++i) {
    const auto k = static_cast<std::size_t>(i);
    x[k] = q.x() - static_cast<Scalar>(boxes.rows[BoxGroup::kCenter][i]);
    y[k] = q.y() - static_cast<Scalar>(boxes.rows[BoxGroup::kCenter + 1][i]);
    z[k] = q.z() - static_cast<Scalar>(boxes.rows[BoxGroup::kCenter + 2][i]);
    slack[k] = kPointBoxNoise * (static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents][i]) +
                                 static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents + 1][i]) +
                                 static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents + 2][i]));
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto* row = boxes.rows + BoxGroup::kAxes + 3 * axis;
    const float* half = boxes.rows[BoxGroup::kHalfExtents + axis];
    for (int i = 0; i < kGroupSize; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Scalar along =
          std::abs(x[k] * static_cast<Scalar>(row[0][i]) + y[k] * static_cast<Scalar>(row[1][i]) +
                   z[k] * static_cast<Scalar>(row[2][i]));
      const Scalar beyond = along - static_cast<Scalar>(half[i]) - slack[k];
      const Scalar outside = beyond > 0 ? beyond : 0;
      sum[k] += outside * outside;
    }
  }
  return sum;
}

class PointSearch {
 public:
  PointSearch(const TriangleMesh& mesh, const Vector3& p, Scalar limit)
      : mesh_(mesh), tree_(mesh.hierarchy()), p_(p), q_(p / tree_.scale()), limit_(limit) {}

  NearestToPoint run() {
    open(0);
    while (count_ > 0) {
      const OpenBox box = stack_[--count_];
      if (is_far(box.gap_sq)) continue;
      if (box.child >= 0) {
        open(box.child);
      } else {
        visit(-1 - box.child);
      }
    }
    result_.nearest.lower = std::min(lower_, result_.nearest.upper);
    return result_;
  }

 private:
  // Proven farther than what is known or sought. Squares err by much less than the noise.
  bool is_far(Scalar gap_sq) {
    const Scalar cutoff = std::min(result_.nearest.upper, limit_);
    const Scalar proven_sq = gap_sq * (1 - 2 * kPointBoxNoise);
    const Scalar in_units = cutoff / tree_.scale();
    if (!(proven_sq > in_units * in_units)) return false;
    lower_ = std::min(lower_, std::max(cutoff, std::sqrt(proven_sq) * tree_.scale()));
    return true;
  }

  // Pushes the boxes of a node, nearest on top.
  void open(std::int32_t number) {
    const MeshHierarchy::Node& node = tree_.nodes()[static_cast<std::size_t>(number)];
    const std::array<Scalar, kGroupSize> gaps = squared_gaps(node.boxes, q_);
    const std::size_t first = count_;
    const int count = node.count();
    for (int i = 0; i < count; ++i) {
      const Scalar gap = gaps[static_cast<std::size_t>(i)];
      if (is_far(gap)) continue;
      std::size_t place = count_++;
      for (; place > first && stack_[place - 1].gap_sq < gap; --place) {
        stack_[place] = stack_[place - 1];
      }
      stack_[place] = {gap, node.child[i]};
    }
  }

  void visit(std::int32_t triangle) {
    const PointTriangleDistance found = point_triangle_distance(p_, mesh_.triangle(triangle));
    lower_ = std::min(lower_, found.lower);
    if (!(found.upper < result_.nearest.upper)) return;
    result_.nearest = found;
    result_.triangle = triangle;
  }

  const TriangleMesh& mesh_;
  const MeshHierarchy& tree_;
  const Vector3 p_;
  const Vector3 q_;  // in units of the scale
  const Scalar limit_;
  Scalar lower_ = kInfinity;  // of everything skipped or measured
  NearestToPoint result_;
  std::size_t count_ = 0;
  std::array<OpenBox, MeshHierarchy::kMaxDepth * kGroupSize + 1> stack_;
};

}  // namespace

NearestToPoint find_nearest_to_point(const TriangleMesh& mesh, const Vector3& p, Scalar limit) {
  return PointSearch(mesh, p, limit).run();
}

}  // namespace dyop::distance_internal
