#include "dyop/distance/distance.h"

#include <algorithm>
#include <vector>

#include "distance/box_gap.h"
#include "distance/piece_distance.h"
#include "distance/shape_tree.h"
#include "dyop/core/error.h"
#include "dyop/distance/penetration.h"

namespace dyop {
namespace {

using internal::BoxGap;
using internal::PieceDistance;
using internal::ShapeTree;

// Depth-first branch and bound over pairs of tree nodes, nearest child first.
class DistanceTraversal {
 public:
  DistanceTraversal(const ShapeTree& a, const ShapeTree& b, const RigidPose& X_AB, Scalar noise,
                    Scalar upper_limit)
      : a_(a), b_(b), X_AB_(X_AB), noise_(noise), limit_(upper_limit) {}

  void run();

  PieceDistance best;
  std::int32_t leaf_a = 0;
  std::int32_t leaf_b = 0;
  Scalar lower = kInfinity;  // of the whole pair: least bound of all that was pruned or evaluated
  DistanceStatistics statistics;

 private:
  struct NodePair {
    Scalar gap;
    std::int32_t a;
    std::int32_t b;
  };

  // What is provably farther than this cannot change the answer.
  Scalar cutoff() const { return std::min(best.upper, limit_); }
  NodePair bounded(std::int32_t a, std::int32_t b);
  void visit_leaves(std::int32_t a, std::int32_t b);
  void push_children(const NodePair& pair);

  const ShapeTree& a_;
  const ShapeTree& b_;
  const RigidPose& X_AB_;
  Scalar noise_;
  Scalar limit_;
  std::vector<NodePair> stack_;
};

DistanceTraversal::NodePair DistanceTraversal::bounded(std::int32_t a, std::int32_t b) {
  ++statistics.box_tests;
  return {internal::box_gap(a_.box(a), b_.box(b), X_AB_, noise_).gap, a, b};
}

void DistanceTraversal::visit_leaves(std::int32_t a, std::int32_t b) {
  ++statistics.leaf_tests;
  const PieceDistance piece = internal::piece_distance(a_, a, b_, b, X_AB_, noise_);
  statistics.gjk_iterations += piece.gjk_iterations;
  lower = std::min(lower, piece.lower);
  if (piece.upper < best.upper) {
    best = piece;
    leaf_a = a;
    leaf_b = b;
  }
}

void DistanceTraversal::push_children(const NodePair& pair) {
  const bool split_a =
      !a_.is_leaf(pair.a) && (b_.is_leaf(pair.b) || a_.box(pair.a).half_extents.squaredNorm() >=
                                                        b_.box(pair.b).half_extents.squaredNorm());
  const std::int32_t first = split_a ? a_.first_child(pair.a) : b_.first_child(pair.b);
  NodePair near = split_a ? bounded(first, pair.b) : bounded(pair.a, first);
  NodePair far = split_a ? bounded(first + 1, pair.b) : bounded(pair.a, first + 1);
  if (far.gap < near.gap) std::swap(near, far);
  stack_.push_back(far);
  stack_.push_back(near);
}

void DistanceTraversal::run() {
  stack_.push_back(bounded(0, 0));
  while (!stack_.empty()) {
    const NodePair pair = stack_.back();
    stack_.pop_back();
    if (pair.gap > cutoff()) {
      lower = std::min(lower, pair.gap);
      continue;
    }
    if (a_.is_leaf(pair.a) && b_.is_leaf(pair.b)) {
      visit_leaves(pair.a, pair.b);
      if (best.is_overlapping) return;  // nothing can be nearer
    } else {
      push_children(pair);
    }
  }
}

DistanceStatus status_of(const DistanceTraversal& traversal, Scalar limit) {
  if (traversal.best.is_overlapping) return DistanceStatus::Overlapping;
  if (traversal.lower > limit) return DistanceStatus::FartherThanLimit;
  return traversal.lower > 0 ? DistanceStatus::Separated : DistanceStatus::Inconclusive;
}

}  // namespace

DistanceResult distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                        const RigidPose& X_WB, const DistanceOptions& options) {
  DYOP_REQUIRE(options.upper_limit >= 0, "distance: upper_limit must be >= 0, not ",
               options.upper_limit);
  const ShapeTree tree_a(a);
  const ShapeTree tree_b(b);
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  DistanceTraversal traversal(tree_a, tree_b, X_AB, internal::pose_noise(a, X_WA, b, X_WB),
                              options.upper_limit);
  traversal.run();

  DistanceResult result;
  result.status = status_of(traversal, options.upper_limit);
  result.statistics = traversal.statistics;
  result.lower =
      traversal.best.is_overlapping ? 0 : std::min(traversal.lower, traversal.best.upper);
  result.upper = traversal.best.upper;
  if (result.upper == kInfinity) return result;  // farther than the limit: no piece was looked at
  result.p_WCa = X_WA * traversal.best.p_ACa;
  result.p_WCb = X_WA * traversal.best.p_ACb;
  result.nhat_AB_W = X_WA.rotation() * traversal.best.nhat_AB_A;
  result.feature_a = traversal.best.feature_a;
  result.feature_b = traversal.best.feature_b;
  result.triangle_a = internal::triangle_number(tree_a, traversal.leaf_a);
  result.triangle_b = internal::triangle_number(tree_b, traversal.leaf_b);
  result.pivot_W = (result.p_WCa + result.p_WCb) / 2;
  if (options.with_penetration && result.status == DistanceStatus::Overlapping && tree_a.convex() &&
      tree_b.convex()) {
    result.penetration = find_penetration(*tree_a.convex(), X_WA, *tree_b.convex(), X_WB);
  }
  return result;
}

}  // namespace dyop
