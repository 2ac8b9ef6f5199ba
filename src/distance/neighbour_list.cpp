// SPDX-License-Identifier: BSD-3-Clause
#include "distance/neighbour_list.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "distance/leaf_pairs.h"
#include "distance/piece_distance.h"

namespace dyop::distance_internal {
namespace {

// More would take longer to look through than the trees.
constexpr std::size_t kMostPairs = 4096;

// How far the points of a triangle or a convex shape, in its shape's frame, are from p.
Scalar radius_about(const LeafPiece& piece, const Vector3& p) {
  if (piece.convex) return p.norm() + piece.convex->bounding_radius();
  Scalar squared = 0;
  for (const Vector3& corner : piece.corners()) {
    squared = std::max(squared, (corner - p).squaredNorm());
  }
  return std::sqrt(squared);
}

}  // namespace

void NeighbourList::measure(const ShapeTree& a, const ShapeTree& b, Entry& entry,
                            Reach& reach) const {
  const PieceDistance piece = piece_distance(a, entry.a, b, entry.b, X_AB_, noise_);
  const bool is_apart = !piece.is_overlapping && piece.lower > 0;
  reach.gap = is_apart ? piece.lower : 0;
  const Vector3 normal = is_apart ? piece.nhat_AB : Vector3(Vector3::Zero());
  if (moves_a_) {
    entry.p = X_FM_ * piece.p_a;
    entry.radius = radius_about(a.piece(entry.a), piece.p_a);
    entry.normal = -(X_FM_.rotation() * normal);
  } else {
    entry.p = piece.p_b;
    entry.radius = radius_about(b.piece(entry.b), X_FM_.inverse() * piece.p_b);
    entry.normal = normal;
  }
  reach.far = (entry.p - pivot_F_).norm() + entry.radius;
}

bool NeighbourList::build(const Shape& a, const RigidPose& X_WA, const Shape& b,
                          const RigidPose& X_WB, const Vector3& pivot_W, const NearBound& bound) {
  X_AB_ = X_WA.inverse() * X_WB;
  const Scalar apart = X_AB_.translation().norm();
  const ShapeTree tree_a(a, extent_beside(a, b, apart));
  const ShapeTree tree_b(b, extent_beside(b, a, apart));
  noise_ = pose_noise(a, X_WA, b, X_WB);
  moves_a_ = a.kind() == ShapeKind::TriangleMesh;
  X_FM_ = moves_a_ ? X_AB_.inverse() : X_AB_;
  pivot_F_ = (moves_a_ ? X_WB : X_WA).inverse() * pivot_W;
  bound_ = bound;
  entries_.clear();
  reaches_.clear();
  const ShapeTree& moving = moves_a_ ? tree_a : tree_b;
  const auto far_of = [&](const BoxPair& pair) {
    const OrientedBox box = moving.box(moves_a_ ? pair.a : pair.b);
    return (X_FM_ * box.center - pivot_F_).norm() + box.half_extents.norm();
  };
  const auto is_near = [&](const BoxPair& pair) {
    return pair.gap <= bound.reach || pair.gap <= bound.reach + bound.slope * far_of(pair);
  };
  const auto visit = [&](const BoxPair& leaves) {
    entries_.push_back({.a = leaves.a, .b = leaves.b});
    reaches_.push_back({leaves.gap, far_of(leaves)});
  };
  const auto is_over = [&](bool /*are_leaves*/) { return entries_.size() >= kMostPairs; };
  BoxPairStack stack{kRootPair};
  visit_leaf_pairs(LeafPairSearch{tree_a, tree_b, X_AB_, noise_, kInfinity}, stack, visit, is_over,
                   is_near);
  is_built_ = stack.empty();
  return is_built_;
}

NeighbourList::Placement NeighbourList::place(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                              const RigidPose& X_WB) const {
  Placement placement;
  const RigidPose X_FM = moves_a_ ? X_WB.inverse() * X_WA : X_WA.inverse() * X_WB;
  const Matrix3 R = X_FM.rotation() * X_FM_.rotation().transpose();
  placement.turn = R - Matrix3::Identity();
  placement.shift = X_FM.translation() - R * X_FM_.translation();
  // Twice the sine of half the angle: the Frobenius norm over sqrt(2).
  placement.turning = placement.turn.norm() / std::sqrt(Scalar{2});
  placement.way = (placement.turn * pivot_F_ + placement.shift).norm();
  // That of the poses, and as much again for what is computed from posed points.
  placement.noise = 2 * pose_noise(a, X_WA, b, X_WB);
  return placement;
}

// With l as it was at build(): by now the piece may be (1 + turning) l + way from the pivot.
bool NeighbourList::covers(const Placement& placement, const NearBound& bound) const {
  return is_built_ &&
         bound.reach + (1 + bound.slope) * placement.way + placement.noise < bound_.reach &&
         placement.turning + bound.slope * (1 + placement.turning) <= bound_.slope;
}

void NeighbourList::collect(const Shape& a, const Shape& b, const Placement& placement,
                            const NearBound& bound, BoxPairStack& pairs) {
  pairs.clear();
  const Scalar apart = X_AB_.translation().norm();
  const ShapeTree tree_a(a, extent_beside(a, b, apart));
  const ShapeTree tree_b(b, extent_beside(b, a, apart));
  const Matrix3 transposed = placement.turn.transpose();
  const Scalar most_gap = bound.reach + bound.slope * placement.way + placement.noise;
  const Scalar slope = bound.slope * (1 + placement.turning);
  // No point of the piece has moved farther.
  const auto is_beyond = [&](const Reach& reach) {
    return reach.gap - placement.way - placement.turning * reach.far > most_gap + slope * reach.far;
  };
  for (std::size_t k = 0; k < reaches_.size(); ++k) {
    Reach& reach = reaches_[k];
    if (is_beyond(reach)) continue;
    Entry& entry = entries_[k];
    if (entry.radius < 0) {
      measure(tree_a, tree_b, entry, reach);
      if (is_beyond(reach)) continue;
    }
    const Vector3 lever = transposed * entry.normal;
    const Scalar gap = reach.gap + entry.normal.dot(placement.shift) + lever.dot(entry.p) -
                       lever.norm() * entry.radius;
    if (gap > most_gap + slope * reach.far) continue;
    pairs.push_back({std::max(gap - placement.noise, Scalar{0}), entry.a, entry.b});
  }
}

void sort_farthest_first(BoxPairStack& pairs) {
  std::sort(pairs.begin(), pairs.end(), [](const BoxPair& x, const BoxPair& y) {
    return std::tie(y.gap, x.a, x.b) < std::tie(x.gap, y.a, y.b);
  });
}

}  // namespace dyop::distance_internal
