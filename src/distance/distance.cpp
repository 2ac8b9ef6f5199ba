#include "dyop/distance/distance.h"

#include <algorithm>
#include <array>
#include <vector>

#include "distance/box_gaps.h"
#include "distance/enclosure.h"
#include "distance/piece_distance.h"
#include "distance/shape_tree.h"
#include "dyop/core/error.h"
#include "dyop/core/tolerance.h"
#include "dyop/distance/penetration.h"

namespace dyop {
namespace {

using internal::PieceDistance;
using internal::ShapeTree;

// Depth-first branch and bound over pairs of tree boxes, nearest child first.
class DistanceTraversal {
 public:
  DistanceTraversal(const ShapeTree& a, const ShapeTree& b, const RigidPose& X_AB, Scalar noise,
                    Scalar upper_limit)
      : a_(a),
        b_(b),
        X_AB_(X_AB),
        X_BA_(X_AB.inverse()),
        noise_(noise),
        box_noise_(noise * (kStepNoise / kPoseNoise)),
        limit_(upper_limit),
        box_gaps_(internal::box_gaps_kernel(internal::best_instruction_set())) {}

  /// Looks at one pair of pieces first, if these are leaves.
  void seed(std::int32_t leaf_a, std::int32_t leaf_b);
  void run();

  PieceDistance best;
  std::int32_t leaf_a = 0;
  std::int32_t leaf_b = 0;
  Scalar lower = kInfinity;  // of the whole pair: least bound of all that was pruned or evaluated
  DistanceStatistics statistics;

 private:
  struct BoxPair {
    Scalar gap;
    std::int32_t a;
    std::int32_t b;
  };

  // What is provably farther than this cannot change the answer.
  Scalar cutoff() const { return std::min(best.upper, limit_); }
  void visit_leaves(std::int32_t a, std::int32_t b);
  void open(const BoxPair& pair);

  const ShapeTree& a_;
  const ShapeTree& b_;
  const RigidPose X_AB_;
  const RigidPose X_BA_;
  const Scalar noise_;      // of a point of one shape in the frame of the other
  const Scalar box_noise_;  // of a gap of boxes
  const Scalar limit_;
  const internal::BoxGapsKernel box_gaps_;
  std::vector<BoxPair> stack_;
};

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

// Puts the pairs of the larger box's parts with the other box on the stack, nearest on top.
void DistanceTraversal::open(const BoxPair& pair) {
  const bool opens_a = internal::opens_first(a_, pair.a, b_, pair.b);
  const ShapeTree& tree = opens_a ? a_ : b_;
  const std::int32_t child = tree.child(opens_a ? pair.a : pair.b);
  const int count = tree.node(child).count();
  const internal::FacingBox other = opens_a ? internal::facing_box(b_.box(pair.b), X_AB_)
                                            : internal::facing_box(a_.box(pair.a), X_BA_);
  std::array<Scalar, BoxGroup::kWidth> gaps;
  box_gaps_(tree.rows(child), count, other, box_noise_, gaps.data());
  statistics.box_tests += count;
  const auto first = stack_.size();
  for (int column = 0; column < count; ++column) {
    const Scalar gap = std::max(pair.gap, gaps[std::size_t(column)]);
    if (gap > cutoff()) {
      lower = std::min(lower, gap);
      continue;
    }
    const std::int32_t part = ShapeTree::box_number(child, column);
    stack_.push_back({gap, opens_a ? part : pair.a, opens_a ? pair.b : part});
  }
  // Insertion sort: eight at most, and the nearest on top.
  for (auto k = first + 1; k < stack_.size(); ++k) {
    const BoxPair moved = stack_[k];
    auto place = k;
    for (; place > first && stack_[place - 1].gap < moved.gap; --place) {
      stack_[place] = stack_[place - 1];
    }
    stack_[place] = moved;
  }
}

void DistanceTraversal::seed(std::int32_t box_a, std::int32_t box_b) {
  if (a_.has_leaf(box_a) && b_.has_leaf(box_b)) visit_leaves(box_a, box_b);
}

void DistanceTraversal::run() {
  if (best.is_overlapping) return;
  stack_.push_back({0, ShapeTree::kRoot, ShapeTree::kRoot});
  while (!stack_.empty()) {
    const BoxPair pair = stack_.back();
    stack_.pop_back();
    if (pair.gap > cutoff()) {
      lower = std::min(lower, pair.gap);
      continue;
    }
    if (a_.is_leaf(pair.a) && b_.is_leaf(pair.b)) {
      visit_leaves(pair.a, pair.b);
      if (best.is_overlapping) return;  // nothing can be nearer
    } else {
      open(pair);
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
  DistanceCache cache;
  return distance(a, X_WA, b, X_WB, options, cache);
}

DistanceResult distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                        const RigidPose& X_WB, const DistanceOptions& options,
                        DistanceCache& cache) {
  DYOP_REQUIRE(options.upper_limit >= 0, "distance: upper_limit must be >= 0, not ",
               options.upper_limit);
  const internal::Solids solids{options.solid_a, options.solid_b};
  internal::require_closed("distance", a, b, solids);
  const ShapeTree tree_a(a);
  const ShapeTree tree_b(b);
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  DistanceTraversal traversal(tree_a, tree_b, X_AB, internal::pose_noise(a, X_WA, b, X_WB),
                              options.upper_limit);
  traversal.seed(cache.leaf_a, cache.leaf_b);
  traversal.run();

  DistanceResult result;
  result.status = status_of(traversal, options.upper_limit);
  result.statistics = traversal.statistics;
  if (const auto p_W = result.status == DistanceStatus::Overlapping
                           ? std::nullopt
                           : internal::find_enclosed_point(a, X_WA, b, X_WB, solids)) {
    result.status = DistanceStatus::Overlapping;
    result.upper = 0;
    result.p_WCa = result.p_WCb = result.pivot_W = *p_W;
    return result;
  }
  result.lower =
      traversal.best.is_overlapping ? 0 : std::min(traversal.lower, traversal.best.upper);
  result.upper = traversal.best.upper;
  if (result.upper == kInfinity) return result;  // farther than the limit: no piece was looked at
  cache.leaf_a = traversal.leaf_a;
  cache.leaf_b = traversal.leaf_b;
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
