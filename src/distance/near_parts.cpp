// SPDX-License-Identifier: BSD-3-Clause
#include "distance/near_parts.h"

#include <algorithm>
#include <tuple>

#include "distance/leaf_pairs.h"
#include "geometry/shape_tree.h"

namespace dyop::distance_internal {
namespace {

// A shape's tree down to the boxes of its children.
class PartTree : public ShapeTree {
 public:
  PartTree(const Shape& shape, Scalar extent) : ShapeTree(shape, extent) {
    if (shape.kind() != ShapeKind::Compound) return;
    compound_ = &static_cast<const CompoundShape&>(shape).tree();
  }
  bool is_leaf(std::int32_t box) const { return !compound_ || compound_->is_part(box); }
  std::int32_t part_in(std::int32_t box) const { return compound_ ? compound_->part_in(box) : 0; }

 private:
  const geometry_internal::CompoundTree* compound_ = nullptr;
};

}  // namespace

void find_near_parts(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                     Scalar noise, Scalar reach, BoxPairStack& stack,
                     std::vector<PartPair>& pairs) {
  pairs.clear();
  if (a.kind() != ShapeKind::Compound && b.kind() != ShapeKind::Compound) {
    pairs.emplace_back();
    return;
  }
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  const Scalar apart = X_AB.translation().norm();
  const PartTree tree_a(a, geometry_internal::extent_beside(a, b, apart));
  const PartTree tree_b(b, geometry_internal::extent_beside(b, a, apart));
  stack.assign(1, kRootPair);
  visit_leaf_pairs(
      LeafSearch<PartTree>{tree_a, tree_b, X_AB, noise, reach}, stack,
      [&](const BoxPair& pair) {
        pairs.push_back({tree_a.part_in(pair.a), tree_b.part_in(pair.b)});
      },
      [](bool /*are_leaves*/) { return false; }, [](const BoxPair& /*pair*/) { return true; });
  std::sort(pairs.begin(), pairs.end(), [](const PartPair& x, const PartPair& y) {
    return std::tie(x.a, x.b) < std::tie(y.a, y.b);
  });
}

}  // namespace dyop::distance_internal
