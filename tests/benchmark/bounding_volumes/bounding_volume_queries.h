// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "benchmark/bounding_volumes/bounding_volumes.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/motion.h"
#include "hierarchy/split_tree.h"

// Distance and impact on plain binary trees, the same for every bounding volume: what is split, in
// which order and how far a gap reaches in time depend on nothing but the gaps of the volumes.
namespace dyop::testing {

/// What the trees of all volumes share. Node numbers are those of build_split_tree().
struct TreeShape {
  struct Node {
    std::int32_t right = -1;  ///< as in SplitNode; the left child of node n is n + 1
    Scalar size = 0;          ///< half the diagonal of the axis-aligned box of its vertices
    Scalar reach = 0;         ///< farthest vertex from the origin of the body

    bool is_leaf() const { return right < 0; }
    std::size_t triangle() const { return std::size_t(-1 - right); }
  };

  explicit TreeShape(const TriangleMesh& mesh);

  /// The vertices below a node, three a triangle.
  std::span<const Vector3> points(std::size_t node) const {
    return std::span(leaf_points).subspan(3 * first_leaf[node], 3 * leaf_count[node]);
  }

  std::vector<Node> nodes;
  std::vector<Triangle> triangles;
  std::vector<Vector3> leaf_points;  ///< of all leaves from left to right
  std::vector<std::size_t> first_leaf;
  std::vector<std::size_t> leaf_count;
};

inline TreeShape::TreeShape(const TriangleMesh& mesh) {
  for (const TriangleIndices& t : mesh.triangles()) {
    triangles.push_back({mesh.vertices()[std::size_t(t[0])], mesh.vertices()[std::size_t(t[1])],
                         mesh.vertices()[std::size_t(t[2])]});
  }
  const auto tree = hierarchy_internal::build_split_tree(mesh.vertices(), mesh.triangles());
  nodes.resize(tree.size());
  first_leaf.resize(tree.size());
  leaf_count.resize(tree.size(), 1);
  for (std::size_t n = 0; n < tree.size(); ++n) {
    nodes[n].right = tree[n].right;
    first_leaf[n] = leaf_points.size() / 3;
    if (!nodes[n].is_leaf()) continue;
    const Triangle& triangle = triangles[nodes[n].triangle()];
    leaf_points.insert(leaf_points.end(), triangle.begin(), triangle.end());
  }
  // Children have higher numbers.
  for (std::size_t n = tree.size(); n-- > 0;) {
    Node& node = nodes[n];
    if (!node.is_leaf()) leaf_count[n] = leaf_count[n + 1] + leaf_count[std::size_t(node.right)];
    AlignedBox box;
    for (const Vector3& p : points(n)) {
      box.extend(p);
      node.reach = std::max(node.reach, p.norm());
    }
    node.size = box.diagonal().norm() / 2;
  }
}

template <typename Volume>
struct VolumeTree {
  explicit VolumeTree(const TreeShape& tree_shape) : shape(&tree_shape) {
    for (std::size_t n = 0; n < shape->nodes.size(); ++n) {
      volumes.push_back(Volume::fit(shape->points(n)));
    }
  }

  const TreeShape* shape;
  std::vector<Volume> volumes;
};

/// A distance, or the time of an impact (infinite without one), and what it took.
struct TreeAnswer {
  Scalar value = kInfinity;
  std::int64_t volume_tests = 0;
  std::int64_t leaf_tests = 0;
};

/// A pair of nodes, at a lower bound of its distance, or at a time up to which it stays apart.
struct NodePair {
  Scalar key = 0;
  std::size_t a = 0;
  std::size_t b = 0;
  bool is_far = false;  ///< its gap was large against its size when last tested

  bool operator>(const NodePair& other) const { return key > other.key; }
};

/// The pair with the least key first. Cleared, not freed, between queries.
class PairQueue {
 public:
  void clear() { pairs_.clear(); }
  bool is_empty() const { return pairs_.empty(); }
  void push(const NodePair& pair) {
    pairs_.push_back(pair);
    std::push_heap(pairs_.begin(), pairs_.end(), std::greater<>());
  }
  NodePair pop() {
    std::pop_heap(pairs_.begin(), pairs_.end(), std::greater<>());
    const NodePair pair = pairs_.back();
    pairs_.pop_back();
    return pair;
  }

 private:
  std::vector<NodePair> pairs_;
};

/// Calls `visit` on both pairs that come from splitting the larger node. Not for two leaves.
template <typename Visit>
void split_larger(const TreeShape& shape_a, const TreeShape& shape_b, const NodePair& pair,
                  const Visit& visit) {
  const TreeShape::Node& a = shape_a.nodes[pair.a];
  const TreeShape::Node& b = shape_b.nodes[pair.b];
  if (b.is_leaf() || (!a.is_leaf() && a.size > b.size)) {
    visit(pair.a + 1, pair.b);
    visit(std::size_t(a.right), pair.b);
  } else {
    visit(pair.a, pair.b + 1);
    visit(pair.a, std::size_t(b.right));
  }
}

inline TriangleDistance leaf_distance(const TreeShape& a, const TreeShape& b, const NodePair& pair,
                                      const RigidPose& X_AB) {
  const Triangle& t = b.triangles[b.nodes[pair.b].triangle()];
  return triangle_distance(a.triangles[a.nodes[pair.a].triangle()],
                           {X_AB * t[0], X_AB * t[1], X_AB * t[2]});
}

/// Best first: splits those pairs that are nearer than the answer, and no other.
template <typename Volume>
TreeAnswer tree_distance(const VolumeTree<Volume>& a, const VolumeTree<Volume>& b,
                         const RigidPose& X_AB, PairQueue& queue) {
  const typename Volume::Placement placement(X_AB);
  TreeAnswer answer;
  const auto visit = [&](std::size_t node_a, std::size_t node_b) {
    ++answer.volume_tests;
    const Scalar gap = separation(placement, a.volumes[node_a], b.volumes[node_b]).gap;
    if (gap < answer.value) queue.push({gap, node_a, node_b});
  };
  queue.clear();
  visit(0, 0);
  while (!queue.is_empty()) {
    const NodePair pair = queue.pop();
    if (pair.key >= answer.value) break;
    if (a.shape->nodes[pair.a].is_leaf() && b.shape->nodes[pair.b].is_leaf()) {
      ++answer.leaf_tests;
      answer.value = std::min(answer.value, leaf_distance(*a.shape, *b.shape, pair, X_AB).upper);
    } else {
      split_larger(*a.shape, *b.shape, pair, visit);
    }
  }
  return answer;
}

/// Two bodies at constant twists.
struct ImpactQuery {
  const Motion* motion_a = nullptr;
  const Motion* motion_b = nullptr;
  TimeInterval interval;
  Scalar tolerance = 0;  ///< largest gap of an impact
};

/// Conservative advancement of pairs of nodes, always of the one that is safe for the shortest time
/// [Mirtich1996].
template <typename Volume>
class ImpactSearch {
 public:
  ImpactSearch(const VolumeTree<Volume>& a, const VolumeTree<Volume>& b, const ImpactQuery& query,
               PairQueue& queue)
      : a_(a), b_(b), query_(query), queue_(queue) {
    const Scalar begin = query.interval.begin;
    twist_a_ = query.motion_a->twist(begin);
    twist_b_ = query.motion_b->twist(begin);
  }

  TreeAnswer run() {
    queue_.clear();
    advance(query_.interval.begin, 0, 0);
    while (!queue_.is_empty()) {
      const NodePair pair = queue_.pop();
      if (pair.is_far) {
        advance(pair.key, pair.a, pair.b);
      } else if (a_.shape->nodes[pair.a].is_leaf() && b_.shape->nodes[pair.b].is_leaf()) {
        if (advance_leaves(pair)) {
          answer_.value = pair.key;
          break;
        }
      } else {
        split_larger(*a_.shape, *b_.shape, pair,
                     [&](std::size_t a, std::size_t b) { advance(pair.key, a, b); });
      }
    }
    return answer_;
  }

 private:
  // A pair is not split but advanced again while its gap exceeds this part of its size.
  static constexpr Scalar kFarRatio = 0.2;

  void set_time(Scalar t) {
    if (placement_ && t == time_) return;
    time_ = t;
    X_WA_ = query_.motion_a->pose(t);
    X_AB_ = X_WA_.inverse() * query_.motion_b->pose(t);
    placement_.emplace(X_AB_);
  }

  // No point below either node moves faster than this against the gap, at any time: x being a point
  // relative to the origin of its body, n . (w x x) = x . (n x w) <= |x| |n x w|.
  Scalar closing_speed(const NodePair& pair, const Vector3& nhat_W) const {
    return nhat_W.dot(twist_a_.v_WB - twist_b_.v_WB) +
           a_.shape->nodes[pair.a].reach * nhat_W.cross(twist_a_.w_WB).norm() +
           b_.shape->nodes[pair.b].reach * nhat_W.cross(twist_b_.w_WB).norm();
  }

  void push(NodePair pair, Scalar gap, const Vector3& nhat_AB_A) {
    if (gap > 0) {
      const Scalar speed = closing_speed(pair, X_WA_.rotation() * nhat_AB_A);
      if (gap >= speed * (query_.interval.end - pair.key)) return;
      pair.key += gap / speed;
    }
    queue_.push(pair);
  }

  void advance(Scalar t, std::size_t a, std::size_t b) {
    set_time(t);
    ++answer_.volume_tests;
    const Separation slab = separation(*placement_, a_.volumes[a], b_.volumes[b]);
    const Scalar size = a_.shape->nodes[a].size + b_.shape->nodes[b].size;
    const bool is_far = slab.gap > std::max(kFarRatio * size, query_.tolerance);
    push({t, a, b, is_far}, slab.gap, slab.nhat_AB_A);
  }

  // True at an impact.
  bool advance_leaves(const NodePair& pair) {
    set_time(pair.key);
    ++answer_.leaf_tests;
    const TriangleDistance d = leaf_distance(*a_.shape, *b_.shape, pair, X_AB_);
    if (d.upper <= query_.tolerance) return true;
    push(pair, d.lower, d.nhat_AB);
    return false;
  }

  const VolumeTree<Volume>& a_;
  const VolumeTree<Volume>& b_;
  const ImpactQuery& query_;
  PairQueue& queue_;
  Twist twist_a_;
  Twist twist_b_;
  Scalar time_ = 0;
  RigidPose X_WA_;
  RigidPose X_AB_;
  std::optional<typename Volume::Placement> placement_;
  TreeAnswer answer_;
};

}  // namespace dyop::testing
