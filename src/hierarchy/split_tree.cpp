// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/split_tree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>

namespace dyop::hierarchy_internal {
namespace {

constexpr int kWidth = MeshHierarchy::kWidth;
constexpr int kBinCount = 16;
constexpr float kLengthShare = 0.01f;

// From this depth on nodes are halved by count: with at most 2^30 triangles no leaf is deeper than
// 64 + 30 < MeshHierarchy::kMaxDepth, whatever the input.
constexpr int kDepthOfHalving = 64;

// Sets below this size stay on one thread.
constexpr std::size_t kGrain = 4096;

// Four numbers, of which three are used, to fill a register.
using Row = Eigen::Array4f;

// Half the area of a box of this size, plus a little of its squared length, so that sets without
// area (needles) are split in the middle too.
float cost_of(const Eigen::Array3f& size) {
  return size[0] * size[1] + size[1] * size[2] + size[2] * size[0] +
         kLengthShare * size.square().sum();
}

struct Box {
  Row lo = Row::Constant(4);  // all coordinates are in [-1, 1], centers times three in [-3, 3]
  Row hi = Row::Constant(-4);

  void include(const Box& other) {
    lo = lo.min(other.lo);
    hi = hi.max(other.hi);
  }
  float cost() const { return cost_of((hi - lo).head<3>()); }
};

struct Item {
  Box box;
  Row center = Row::Zero();  // of the vertices, times three
  std::int32_t triangle = -1;
};

// The mesh, centred and in units of half its size.
class Input {
 public:
  Input(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles)
      : vertices_(vertices), triangles_(triangles) {
    AlignedBox bounds;
    for (const TriangleIndices& t : triangles) {
      for (const std::int32_t v : t) bounds.extend(vertices[std::size_t(v)]);
    }
    middle_ = 0.5 * bounds.min() + 0.5 * bounds.max();
    const Scalar half_size = (0.5 * bounds.max() - 0.5 * bounds.min()).maxCoeff();
    // literal: the reciprocal of a smaller size would be infinite.
    scale_ = half_size > 0x1p-1000 ? 1 / half_size : 0x1p1000;
  }

  std::size_t size() const { return triangles_.size(); }

  Triangle triangle(std::size_t k) const {
    Triangle result;
    for (std::size_t i = 0; i < 3; ++i) {
      result[i] = (vertices_[std::size_t(triangles_[k][i])] - middle_) * scale_;
    }
    return result;
  }

 private:
  std::span<const Vector3> vertices_;
  std::span<const TriangleIndices> triangles_;
  Vector3 middle_ = Vector3::Zero();
  Scalar scale_ = 1;
};

std::vector<Item> make_items(const Input& input) {
  std::vector<Item> items(input.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, items.size(), kGrain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t k = range.begin(); k < range.end(); ++k) {
                        for (const Vector3& vertex : input.triangle(k)) {
                          const Row p(float(vertex.x()), float(vertex.y()), float(vertex.z()), 0);
                          items[k].box.include({p, p});
                          items[k].center += p;
                        }
                        items[k].triangle = std::int32_t(k);
                      }
                    });
  return items;
}

// The bin along each axis that a center falls into.
struct Binning {
  Row lo;
  Row bins_per_length;

  explicit Binning(const Box& centers) : lo(centers.lo) {
    for (int axis = 0; axis < 4; ++axis) {
      const float length = centers.hi[axis] - centers.lo[axis];
      // literal: such a length has no digits left; zero puts all into the first bin: no split.
      bins_per_length[axis] = axis < 3 && length > 1e-30f ? kBinCount / length : 0;
    }
  }
  Eigen::Array4i operator()(const Row& center) const {
    return ((center - lo) * bins_per_length).cast<int>().min(kBinCount - 1);
  }
};

struct Bin {
  Box box;
  std::int32_t count = 0;
  void include(const Bin& other) {
    box.include(other.box);
    count += other.count;
  }
  float cost() const { return count == 0 ? 0 : float(count) * box.cost(); }
};

struct Split {
  int axis = -1;
  int last_left = -1;  // number of a bin
  float cost = std::numeric_limits<float>::infinity();
};

using Bins = std::array<Bin, kBinCount>;

void find_best_split(const Bins& bins, int axis, Split& best) {
  std::array<float, kBinCount> cost_right{};
  Bin right;
  for (std::size_t k = kBinCount - 1; k > 0; --k) {
    right.include(bins[k]);
    cost_right[k - 1] = right.cost();
  }
  const std::int32_t all = right.count + bins[0].count;
  Bin left;
  for (std::size_t k = 0; k + 1 < kBinCount; ++k) {
    left.include(bins[k]);
    const float cost = left.cost() + cost_right[k];
    if (left.count > 0 && left.count < all && cost < best.cost) best = {axis, int(k), cost};
  }
}

// Moves the items of the left child to the front; returns their number, or zero if no bin border
// separates the centers.
std::size_t split_by_bins(std::span<Item> items, const Box& centers) {
  const Binning binning(centers);
  std::array<Bins, 3> bins;
  for (const Item& item : items) {
    const Eigen::Array4i index = binning(item.center);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Bin& bin = bins[axis][std::size_t(index[Eigen::Index(axis)])];
      bin.box.include(item.box);
      ++bin.count;
    }
  }
  Split best;
  for (std::size_t axis = 0; axis < 3; ++axis) find_best_split(bins[axis], int(axis), best);
  if (best.axis < 0) return 0;
  const auto middle = std::partition(items.begin(), items.end(), [&](const Item& item) {
    return binning(item.center)[best.axis] <= best.last_left;
  });
  return std::size_t(middle - items.begin());
}

// Ties are broken by triangle number, so that the order is unique.
struct AlongAxis {
  int axis;
  bool operator()(const Item& a, const Item& b) const {
    const float x = a.center[axis];
    const float y = b.center[axis];
    return x < y || (x == y && a.triangle < b.triangle);
  }
};

// Halves by count along the longest axis of the centers.
std::size_t split_by_count(std::span<Item> items, const Box& centers) {
  int axis = 0;
  (centers.hi - centers.lo).head<3>().maxCoeff(&axis);
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + std::ptrdiff_t(half), items.end(),
                   AlongAxis{axis});
  return half;
}

// Moves the items of the left child to the front; returns their number.
std::size_t split(std::span<Item> items, int depth) {
  if (items.size() == 2) return 1;
  Box centers;
  for (const Item& item : items) centers.include({item.center, item.center});
  if (depth < kDepthOfHalving) {
    const std::size_t left = split_by_bins(items, centers);
    if (left > 0) return left;
  }
  return split_by_count(items, centers);
}

// By k: the cost of all wide nodes below a binary node that gets k columns of a parent, where a
// node costs its area (the chance that a query visits it): the dynamic program of [Ylitie2017]. All
// zero for a leaf.
using Costs = std::array<float, kWidth + 1>;

Costs join(SplitNode& node, float own_cost, const Costs& left, const Costs& right) {
  Costs costs{};
  for (std::size_t k = kWidth; k >= 2; --k) {
    std::size_t best = 1;
    costs[k] = left[1] + right[k - 1];
    for (std::size_t j = 2; j < k; ++j) {
      const float cost = left[j] + right[k - j];
      if (cost < costs[k]) {
        best = j;
        costs[k] = cost;
      }
    }
    node.left_columns[k] = std::int8_t(best);
  }
  costs[1] = own_cost + costs[kWidth];
  for (std::size_t k = 2; k < kWidth; ++k) {
    if (costs[1] < costs[k]) {
      costs[k] = costs[1];
      node.left_columns[k] = 0;
    }
  }
  return costs;
}

class Builder {
 public:
  explicit Builder(const Input& input)
      : input_(input),
        items_(make_items(input)),
        ordered_(input.size()),
        nodes_(2 * input.size() - 1) {}

  std::vector<SplitNode> build() && {
    build(0, items_.size(), 0, 0);
    return std::move(nodes_);
  }

 private:
  // Makes the nodes over items [begin, end), twice their number minus one, from `node` on.
  // Recursion ends because both parts of a split have items; its depth is that of the tree.
  Costs build(std::size_t begin, std::size_t end, std::size_t node, int depth) {
    const std::span<Item> items(items_.begin() + std::ptrdiff_t(begin), end - begin);
    if (items.size() == 1) {
      nodes_[node].right = -1 - items[0].triangle;
      ordered_[begin] = input_.triangle(std::size_t(items[0].triangle));
      return {};
    }
    const std::size_t left_size = split(items, depth);
    const std::size_t right = node + 2 * left_size;
    nodes_[node].right = std::int32_t(right);
    Costs left_costs;
    Costs right_costs;
    const auto build_left = [&] {
      left_costs = build(begin, begin + left_size, node + 1, depth + 1);
    };
    const auto build_right = [&] { right_costs = build(begin + left_size, end, right, depth + 1); };
    if (items.size() < kGrain) {
      build_left();
      build_right();
    } else {
      tbb::parallel_invoke(build_left, build_right);
    }
    const std::span<const Triangle> ordered(ordered_.begin() + std::ptrdiff_t(begin), end - begin);
    const Vector3 size = fitted_size(ordered);
    return join(nodes_[node], cost_of(size.cast<float>()), left_costs, right_costs);
  }

  const Input& input_;
  std::vector<Item> items_;
  // The triangles of finished items, in order.
  std::vector<Triangle> ordered_;
  std::vector<SplitNode> nodes_;
};

}  // namespace

std::vector<SplitNode> build_split_tree(std::span<const Vector3> vertices,
                                        std::span<const TriangleIndices> triangles) {
  const Input input(vertices, triangles);
  return Builder(input).build();
}

}  // namespace dyop::hierarchy_internal
