// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/hierarchy/mesh_hierarchy.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/assert.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "hierarchy/split_tree.h"

namespace dyop {
namespace {

using hierarchy_internal::SplitNode;

static_assert(sizeof(MeshHierarchy::Node) == 512);

// Minimum number of nodes whose boxes one thread fits at a time.
constexpr std::size_t kGrain = 64;

// Boxes so many times as far from the origin as they are large are measured from their middle:
// otherwise single precision would make those of small parts too large. Speed only.
constexpr Scalar kFar = 16;

// The binary nodes that become the columns of a wide node.
struct Columns {
  std::array<std::int32_t, MeshHierarchy::kWidth> binary{};
  int count = 0;
};

void distribute(const std::vector<SplitNode>& nodes, std::int32_t n, int count, Columns& columns) {
  const SplitNode& node = nodes[std::size_t(n)];
  const int left = node.left_columns[std::size_t(count)];
  if (left == 0) {
    columns.binary[std::size_t(columns.count++)] = n;
    return;
  }
  distribute(nodes, n + 1, left, columns);
  distribute(nodes, node.right, count - left, columns);
}

}  // namespace

OrientedBox BoxGroup::box(int column, const BoxFrame& frame) const {
  DYOP_ASSERT(column >= 0 && column < MeshHierarchy::kWidth, column);
  OrientedBox box;
  for (int i = 0; i < 3; ++i) {
    box.center[i] = frame.origin[i] + frame.scale * Scalar(rows[kCenter + i][column]);
    box.half_extents[i] = frame.scale * Scalar(rows[kHalfExtents + i][column]);
    for (int k = 0; k < 3; ++k) box.axes(i, k) = Scalar(rows[kAxes + 3 * k + i][column]);
  }
  return box;
}

// Let the box be c + U y, |y_k| <= h_k, and the stored one C + A x with A = U + E, |E_ij| <= 2^-25
// because entries are at most about one. A point of both has x - y = (A^-1 U - I) y + A^-1 (c - C),
// where |A^-1 U - I| <= 3 * 2^-25 and |c - C| <= 2^-24 |c|, each up to second order, and up to
// numbers that underflow. kSinglePrecisionBoxNoise times |c| + |h| covers both. Taking the frame's
// origin off the center, and adding it again, are two roundings that kBoxNoise covers.
void BoxGroup::set_box(int column, const OrientedBox& box, const BoxFrame& frame) {
  DYOP_ASSERT(column >= 0 && column < MeshHierarchy::kWidth, column);
  const Vector3 center = frame.local(box.center);
  const Vector3 half_extents = box.half_extents / frame.scale;
  // literal: more than the absolute error of numbers that underflow in single precision.
  const Scalar noise = kSinglePrecisionBoxNoise * (center.norm() + half_extents.norm()) + 0x1p-140;
  for (int i = 0; i < 3; ++i) {
    rows[kCenter + i][column] = static_cast<float>(center[i]);
    rows[kHalfExtents + i][column] = core_internal::float_above(half_extents[i] + noise);
    for (int k = 0; k < 3; ++k) {
      rows[kAxes + 3 * k + i][column] = static_cast<float>(box.axes(i, k));
    }
  }
}

float BoxGroup::squared_half_diagonal(int column) const {
  const float x = rows[kHalfExtents][column];
  const float y = rows[kHalfExtents + 1][column];
  const float z = rows[kHalfExtents + 2][column];
  return x * x + y * y + z * z;
}

BoxFrame BoxFrame::around(const OrientedBox& root) {
  BoxFrame frame;
  const Scalar away = root.center.lpNorm<Eigen::Infinity>();
  const Scalar size = 2 * root.half_extents.sum();
  if (away > kFar * size) frame.origin = root.center;
  // literal: so that multiples of it by numbers in single precision never underflow.
  frame.scale = 0x1p-800;
  frame.make_room(root);
  return frame;
}

void BoxFrame::make_room(const OrientedBox& root) {
  const Scalar largest =
      (root.center - origin).lpNorm<Eigen::Infinity>() + 2 * root.half_extents.sum();
  int exponent = 0;
  std::frexp(largest, &exponent);
  scale = std::max(scale, std::ldexp(Scalar{1}, exponent));
}

MeshHierarchy::MeshHierarchy(std::span<const Vector3> vertices,
                             std::span<const TriangleIndices> triangles) {
  DYOP_REQUIRE(!triangles.empty() && triangles.size() <= kLargestTriangleCount,
               "a hierarchy needs 1 to ", kLargestTriangleCount, " triangles, not ",
               triangles.size());
  const std::vector<SplitNode> binary = hierarchy_internal::build_split_tree(vertices, triangles);

  // A box of a wide node and its place in the binary tree, still to be expanded.
  struct Opening {
    std::int32_t node;
    int column;
    std::int32_t binary;
  };
  std::vector<Opening> openings;
  // Without their boxes, as how many there are is known only at the end.
  std::vector<std::array<std::int32_t, kWidth>> children;
  const auto add_node = [&](const Columns& columns) {
    const auto made = std::int32_t(children.size());
    std::array<std::int32_t, kWidth>& child = children.emplace_back();
    child.fill(kNothing);
    for (int column = columns.count - 1; column >= 0; --column) {
      const std::int32_t index = columns.binary[std::size_t(column)];
      const SplitNode& part = binary[std::size_t(index)];
      // Replaced when it is expanded, unless it is a leaf.
      child[std::size_t(column)] = part.right;
      if (!part.is_leaf()) openings.push_back({made, column, index});
    }
    return made;
  };
  children.reserve(triangles.size() / 4 + 2);
  add_node({{0}, 1});
  // Each round makes one node with two or more boxes.
  while (!openings.empty()) {
    const Opening opening = openings.back();
    openings.pop_back();
    Columns columns;
    distribute(binary, opening.binary, kWidth, columns);
    const std::int32_t made = add_node(columns);
    children[std::size_t(opening.node)][std::size_t(opening.column)] = made;
  }
  nodes_.resize(children.size());
  for (std::size_t k = 0; k < children.size(); ++k) {
    std::copy(children[k].begin(), children[k].end(), nodes_[k].child);
  }
  fit_boxes(vertices, triangles);
}

MeshHierarchy MeshHierarchy::refitted(std::span<const Vector3> vertices,
                                      std::span<const TriangleIndices> triangles) const {
  MeshHierarchy result = *this;
  result.fit_boxes(vertices, triangles);
  return result;
}

// Nodes come in preorder, so those below a box are consecutive, and so are their triangles if those
// of each node are listed in turn.
void MeshHierarchy::fit_boxes(std::span<const Vector3> vertices,
                              std::span<const TriangleIndices> triangles) {
  std::vector<Triangle> leaves;
  leaves.reserve(triangles.size());
  // Triangles of node k start at first[k]; the nodes below it end before end[k].
  std::vector<std::size_t> first(nodes_.size() + 1);
  std::vector<std::size_t> end(nodes_.size());
  end[0] = nodes_.size();
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    first[k] = leaves.size();
    std::size_t end_of_child = end[k];
    const int count = nodes_[k].count();
    for (int column = count - 1; column >= 0; --column) {
      const std::int32_t child = nodes_[k].child[column];
      if (child < 0) continue;
      DYOP_ASSERT(std::size_t(child) > k && std::size_t(child) < end_of_child, k, ' ', child, ' ',
                  end_of_child);
      end[std::size_t(child)] = end_of_child;
      end_of_child = std::size_t(child);
    }
    for (int column = 0; column < count; ++column) {
      const std::int32_t child = nodes_[k].child[column];
      if (child >= 0) continue;
      const TriangleIndices& t = triangles[std::size_t(-1 - child)];
      leaves.push_back(
          {vertices[std::size_t(t[0])], vertices[std::size_t(t[1])], vertices[std::size_t(t[2])]});
    }
  }
  first.back() = leaves.size();
  DYOP_ASSERT(leaves.size() == triangles.size(), leaves.size(), ' ', triangles.size());

  const std::span<const Triangle> all(leaves);
  const auto fit = [&](std::int32_t child, std::size_t leaf) {
    if (child < 0) return hierarchy_internal::fit_triangle(all[leaf]);
    const std::size_t begin = first[std::size_t(child)];
    return hierarchy_internal::fit_triangles(
        all.subspan(begin, first[end[std::size_t(child)]] - begin));
  };
  const OrientedBox root = fit(nodes_[0].child[0], 0);
  frame_ = BoxFrame::around(root);
  for (int column = 0; column < kWidth; ++column) nodes_[0].boxes.set_box(column, root, frame_);
  const auto fit_node = [&](std::size_t k) {
    const int count = nodes_[k].count();
    std::size_t leaf = first[k];
    OrientedBox box;
    for (int column = 0; column < kWidth; ++column) {
      if (column < count) box = fit(nodes_[k].child[column], leaf);
      if (nodes_[k].child[column] < 0) ++leaf;
      nodes_[k].boxes.set_box(column, box, frame_);
    }
  };
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(1, std::max(nodes_.size(), std::size_t{1}), kGrain),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t k = range.begin(); k < range.end(); ++k) fit_node(k);
      });
}

}  // namespace dyop
