// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/deforming_mesh.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

using Node = DeformingMesh::Node;
using Order = std::span<std::int32_t>;

void require_places(std::span<const Vector3> places, const char* when) {
  for (std::size_t row = 0; row < places.size(); ++row) {
    const Vector3& p = places[row];
    const bool is_valid = (p.array().abs() <= kLargestCoordinate).all();
    DYOP_REQUIRE(is_valid, "DeformingMesh: vertex ", row, " at the ", when,
                 " must have finite coordinates of at most ", kLargestCoordinate, ", not (", p.x(),
                 ", ", p.y(), ", ", p.z(), ")");
  }
}

void require_valid(std::span<const Vector3> begin, std::span<const Vector3> end) {
  DYOP_REQUIRE(begin.size() == end.size(),
               "DeformingMesh: begin and end must have equally many vertices, not ", begin.size(),
               " and ", end.size());
  require_places(begin, "begin");
  require_places(end, "end");
}

void require_valid(const std::vector<TriangleIndices>& triangles, std::size_t vertex_count) {
  DYOP_REQUIRE(!triangles.empty(), "DeformingMesh: needs at least one triangle");
  DYOP_REQUIRE(triangles.size() <= kLargestTriangleCount, "DeformingMesh: at most ",
               kLargestTriangleCount, " triangles are possible, not ", triangles.size());
  for (std::size_t row = 0; row < triangles.size(); ++row) {
    for (const std::int32_t vertex : triangles[row]) {
      DYOP_REQUIRE(vertex >= 0 && static_cast<std::size_t>(vertex) < vertex_count,
                   "DeformingMesh: triangle ", row, " names vertex ", vertex, " of ", vertex_count);
    }
  }
}

// Splits the triangles of a node in halves at the median of their centers along the longest axis.
// Ties are broken by number, so that the same input gives the same tree.
std::size_t split(Order order, const std::vector<Vector3>& centers) {
  const auto center = [&](std::int32_t i) -> const Vector3& {
    return centers[static_cast<std::size_t>(i)];
  };
  AlignedBox bounds;
  for (const std::int32_t i : order) bounds.extend(center(i));
  Eigen::Index axis = 0;
  bounds.sizes().maxCoeff(&axis);
  const std::size_t half = order.size() / 2;
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
                   [&](std::int32_t i, std::int32_t j) {
                     const Scalar x = center(i)[axis];
                     const Scalar y = center(j)[axis];
                     return x != y ? x < y : i < j;
                   });
  return half;
}

}  // namespace

DeformingMesh::DeformingMesh(std::vector<Vector3> begin, std::vector<Vector3> end,
                             std::vector<TriangleIndices> triangles) {
  require_valid(begin, end);
  require_valid(triangles, begin.size());
  begin_ = std::move(begin);
  end_ = std::move(end);
  triangles_ = std::move(triangles);
  build();
  fit_boxes();
}

void DeformingMesh::refit(std::span<const Vector3> begin, std::span<const Vector3> end) {
  require_valid(begin, end);
  DYOP_REQUIRE(begin.size() == begin_.size(), "DeformingMesh: needs ", begin_.size(),
               " vertices as before, not ", begin.size());
  std::copy(begin.begin(), begin.end(), begin_.begin());
  std::copy(end.begin(), end.end(), end_.begin());
  fit_boxes();
}

void DeformingMesh::advance(std::span<const Vector3> next_end) {
  DYOP_REQUIRE(next_end.size() == end_.size(), "DeformingMesh: there must be ", end_.size(),
               " vertices as before, not ", next_end.size());
  require_places(next_end, "end");
  begin_.swap(end_);
  std::copy(next_end.begin(), next_end.end(), end_.begin());
  fit_boxes();
}

Triangle DeformingMesh::triangle(std::int32_t index, Scalar s) const {
  const TriangleIndices& indices = triangles_[static_cast<std::size_t>(index)];
  Triangle corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = vertex(static_cast<std::size_t>(indices[i]), s);
  }
  return corners;
}

TriangleMesh DeformingMesh::snapshot(Scalar s) const {
  std::vector<Vector3> places;
  places.reserve(begin_.size());
  for (std::size_t i = 0; i < begin_.size(); ++i) places.push_back(vertex(i, s));
  return TriangleMesh(std::move(places), triangles_);
}

// Halving keeps the depth below 32, and so the stack of open nodes.
void DeformingMesh::build() {
  std::vector<Vector3> centers;
  centers.reserve(triangles_.size());
  for (const TriangleIndices& indices : triangles_) {
    Vector3 center = Vector3::Zero();
    for (const std::int32_t i : indices) {
      const auto vertex = static_cast<std::size_t>(i);
      center += begin_[vertex] / 2 + end_[vertex] / 2;
    }
    centers.push_back(center);
  }
  std::vector<std::int32_t> order(triangles_.size());
  std::iota(order.begin(), order.end(), 0);
  std::vector<std::pair<std::size_t, Order>> open{{0, order}};
  nodes_.reserve(2 * triangles_.size());
  nodes_.resize(1);
  while (!open.empty()) {
    const auto [number, part] = open.back();
    open.pop_back();
    if (part.size() == 1) {
      nodes_[number].is_leaf = true;
      nodes_[number].first = part.front();
      continue;
    }
    const std::size_t first = nodes_.size();
    nodes_.resize(first + 2);
    nodes_[number].first = static_cast<std::int32_t>(first);
    const std::size_t half = split(part, centers);
    open.emplace_back(first, part.first(half));
    open.emplace_back(first + 1, part.subspan(half));
  }
}

void DeformingMesh::fit_boxes() {
  Scalar radius_sq = 0;
  Scalar displacement_sq = 0;
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
    if (!node->is_leaf) {
      const Node& left = nodes_[static_cast<std::size_t>(node->first)];
      const Node& right = nodes_[static_cast<std::size_t>(node->first) + 1];
      node->at_begin = left.at_begin.merged(right.at_begin);
      node->at_end = left.at_end.merged(right.at_end);
      continue;
    }
    node->at_begin.setEmpty();
    node->at_end.setEmpty();
    for (const std::int32_t i : triangles_[static_cast<std::size_t>(node->first)]) {
      const Vector3& from = begin_[static_cast<std::size_t>(i)];
      const Vector3& to = end_[static_cast<std::size_t>(i)];
      node->at_begin.extend(from);
      node->at_end.extend(to);
      radius_sq = std::max({radius_sq, from.squaredNorm(), to.squaredNorm()});
      displacement_sq = std::max(displacement_sq, (to - from).squaredNorm());
    }
  }
  const Scalar up = 1 + 8 * kUnitRoundoff;  // the rounding of a norm is less than 4u
  largest_radius_ = up * std::sqrt(radius_sq);
  largest_displacement_ = up * std::sqrt(displacement_sq);
}

}  // namespace dyop
