#include "geometry/split_tree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>

namespace dyop::internal {
namespace {

constexpr int kWidth = MeshHierarchy::kWidth;
constexpr int kBinCount = 16;
constexpr float kLengthShare = 0.01f;

// Up to here all splits are tried.
constexpr std::size_t kSmallSet = 8;

// From this depth on nodes are halved by count: with at most 2^30 triangles no leaf is deeper than
// 64 + 30 < MeshHierarchy::kMaxDepth, whatever the input.
constexpr int kDepthOfHalving = 64;

// Sets below this size stay on one thread.
constexpr std::size_t kGrain = 4096;

// Four numbers, of which three are used, so that they fill a register.
using Row = Eigen::Array4f;

struct Box {
  Row lo = Row::Constant(4);  // all coordinates are in [-1, 1]
  Row hi = Row::Constant(-4);

  void include(const Box& other) {
    lo = lo.min(other.lo);
    hi = hi.max(other.hi);
  }
  // Half the area, and a little of the squared length so that sets without area (needles) are
  // split in the middle, too.
  float cost() const {
    const Row size = hi - lo;
    const float x = size[0];
    const float y = size[1];
    const float z = size[2];
    return x * y + y * z + z * x + kLengthShare * (x * x + y * y + z * z);
  }
};

struct Item {
  Box box;
  std::int32_t triangle = -1;

  // Twice the center of the box.
  Row center() const { return box.lo + box.hi; }
};

// Boxes in units of half the size of the mesh, about its middle.
std::vector<Item> make_items(std::span<const Vector3> vertices,
                             std::span<const TriangleIndices> triangles) {
  AlignedBox bounds;
  for (const TriangleIndices& t : triangles) {
    for (const std::int32_t v : t) bounds.extend(vertices[std::size_t(v)]);
  }
  const Vector3 middle = 0.5 * bounds.min() + 0.5 * bounds.max();
  const Scalar half_size = (0.5 * bounds.max() - 0.5 * bounds.min()).maxCoeff();
  // literal: the reciprocal of a size near the end of the range would be infinite.
  const Scalar scale = half_size > 0x1p-1000 ? 1 / half_size : 0x1p1000;
  std::vector<Item> items(triangles.size());
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, items.size(), kGrain),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t k = range.begin(); k < range.end(); ++k) {
          Box& box = items[k].box;
          for (const std::int32_t v : triangles[k]) {
            Row p = Row::Zero();
            p.head<3>() = ((vertices[std::size_t(v)] - middle) * scale).cast<float>();
            box.include({p, p});
          }
          items[k].triangle = std::int32_t(k);
        }
      });
  return items;
}

// Which of the bins along each axis a center falls into.
struct Binning {
  Row lo;
  Row bins_per_length;

  explicit Binning(const Box& centers) : lo(centers.lo) {
    for (int axis = 0; axis < 4; ++axis) {
      const float length = centers.hi[axis] - centers.lo[axis];
      // literal: such a length has no digits; zero puts all into the first bin, which is no split.
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
  int last_left = -1;  // bin
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
    const Eigen::Array4i index = binning(item.center());
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
    return binning(item.center())[best.axis] <= best.last_left;
  });
  return std::size_t(middle - items.begin());
}

// Ties go by triangle number, so that the order is unique.
struct AlongAxis {
  int axis;
  bool operator()(const Item& a, const Item& b) const {
    const float x = a.center()[axis];
    const float y = b.center()[axis];
    return x < y || (x == y && a.triangle < b.triangle);
  }
};

// Tries all splits of all three orders.
std::size_t split_small(std::span<Item> items) {
  Split best;
  std::array<float, kSmallSet> cost_right{};
  for (int axis = 0; axis < 3; ++axis) {
    std::sort(items.begin(), items.end(), AlongAxis{axis});
    Box right;
    for (std::size_t k = items.size() - 1; k > 0; --k) {
      right.include(items[k].box);
      cost_right[k - 1] = float(items.size() - k) * right.cost();
    }
    Box left;
    for (std::size_t k = 0; k + 1 < items.size(); ++k) {
      left.include(items[k].box);
      const float cost = float(k + 1) * left.cost() + cost_right[k];
      if (cost < best.cost) best = {axis, int(k), cost};
    }
  }
  if (best.axis < 2) std::sort(items.begin(), items.end(), AlongAxis{best.axis});
  return std::size_t(best.last_left + 1);
}

// Halves by count along the longest axis.
std::size_t split_by_count(std::span<Item> items, const Box& box) {
  int axis = 0;
  (box.hi - box.lo).head<3>().maxCoeff(&axis);
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + std::ptrdiff_t(half), items.end(),
                   AlongAxis{axis});
  return half;
}

// The number of items of the left child, which are moved to the front.
std::size_t split(std::span<Item> items, const Box& box, int depth) {
  if (items.size() == 2) return 1;
  if (depth < kDepthOfHalving) {
    if (items.size() <= kSmallSet) return split_small(items);
    Box centers;
    for (const Item& item : items) centers.include({item.center(), item.center()});
    const std::size_t left = split_by_bins(items, centers);
    if (left > 0) return left;
  }
  return split_by_count(items, box);
}

// cost(k): of all wide nodes below a binary node that is given k columns of a parent, a node
// costing its area (the chance that a query comes by): the dynamic program of [Ylitie2017]. All
// zero for a leaf.
using Costs = std::array<float, kWidth + 1>;

Costs collapse(SplitNode& node, const Box& box, const Costs& left, const Costs& right) {
  Costs costs{};
  for (int k = kWidth; k >= 2; --k) {
    int best = 1;
    float best_cost = left[1] + right[std::size_t(k - 1)];
    for (int j = 2; j < k; ++j) {
      const float cost = left[std::size_t(j)] + right[std::size_t(k - j)];
      if (cost < best_cost) {
        best = j;
        best_cost = cost;
      }
    }
    costs[std::size_t(k)] = best_cost;
    node.left_columns[std::size_t(k)] = std::int8_t(best);
  }
  costs[1] = box.cost() + costs[kWidth];
  for (std::size_t k = 2; k < kWidth; ++k) {
    if (costs[1] < costs[k]) {
      costs[k] = costs[1];
      node.left_columns[k] = 0;
    }
  }
  return costs;
}

// Fills `nodes`, twice as many as items but one, whose first has number `first`. Recursion ends
// because both parts of a split have items; its depth is that of the tree.
Costs build(std::span<Item> items, std::span<SplitNode> nodes, std::size_t first, int depth) {
  if (items.size() == 1) {
    nodes[0].right = -1 - items[0].triangle;
    return {};
  }
  Box box;
  for (const Item& item : items) box.include(item.box);
  const std::size_t left = split(items, box, depth);
  nodes[0].right = std::int32_t(first + 2 * left);
  Costs costs_left;
  Costs costs_right;
  const auto build_left = [&] {
    costs_left =
        build(items.first(left), nodes.subspan(1, 2 * left - 1), first + 1, depth + 1);
  };
  const auto build_right = [&] {
    costs_right =
        build(items.subspan(left), nodes.subspan(2 * left), first + 2 * left, depth + 1);
  };
  if (items.size() < kGrain) {
    build_left();
    build_right();
  } else {
    tbb::parallel_invoke(build_left, build_right);
  }
  return collapse(nodes[0], box, costs_left, costs_right);
}

}  // namespace

std::vector<SplitNode> build_split_tree(std::span<const Vector3> vertices,
                                        std::span<const TriangleIndices> triangles) {
  std::vector<Item> items = make_items(vertices, triangles);
  std::vector<SplitNode> nodes(2 * items.size() - 1);
  build(items, nodes, 0, 0);
  return nodes;
}

}  // namespace dyop::internal
