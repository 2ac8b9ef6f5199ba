#include "dyop/geometry/mesh_hierarchy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dyop/core/error.h"
#include "dyop/core/tolerance.h"

namespace dyop {
namespace {

constexpr int kBinCount = 16;
constexpr Scalar kLengthShare = 0.01;

// From this depth on nodes are halved by count: with at most 2^30 triangles no leaf is deeper than
// 64 + 30 < MeshHierarchy::kMaxDepth, whatever the input.
constexpr int kDepthOfHalving = 64;

struct Item {
  Triangle vertices;
  std::int32_t triangle = -1;
};

// A box along given axes, relative to a reference point.
struct Extent {
  Vector3 lo = Vector3::Constant(kInfinity);
  Vector3 hi = Vector3::Constant(-kInfinity);

  void include(const Vector3& y) {
    lo = lo.cwiseMin(y);
    hi = hi.cwiseMax(y);
  }
  void include(const Extent& other) {
    lo = lo.cwiseMin(other.lo);
    hi = hi.cwiseMax(other.hi);
  }
  Scalar half_area() const {
    const Vector3 size = hi - lo;
    return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
  }
};

// Coordinates along a node's axes, from a vertex of the node: zero is then in every extent.
struct Frame {
  Matrix3 axes_transposed = Matrix3::Identity();
  Vector3 origin = Vector3::Zero();

  Vector3 operator()(const Vector3& p) const { return axes_transposed * (p - origin); }

  std::array<Vector3, 3> operator()(const Triangle& triangle) const {
    return {(*this)(triangle[0]), (*this)(triangle[1]), (*this)(triangle[2])};
  }

  // Three times the centroid.
  Vector3 center_of(const Triangle& triangle) const {
    const std::array<Vector3, 3> y = (*this)(triangle);
    return y[0] + y[1] + y[2];
  }
};

// A node's extent and its triangles' centers (times three) in a frame.
struct Fit {
  Frame frame;
  Extent extent;
  Extent centers;
};

Fit fit(std::span<const Item> items, const Matrix3& axes) {
  Fit result;
  result.frame = {axes.transpose(), items.front().vertices[0]};
  for (const Item& item : items) {
    const std::array<Vector3, 3> y = result.frame(item.vertices);
    for (const Vector3& vertex : y) result.extent.include(vertex);
    result.centers.include(y[0] + y[1] + y[2]);
  }
  return result;
}

// The box of an extent, rounded up; see kBoxNoise for the bound. The smallest normal number covers
// products that underflow.
OrientedBox box_of(const Fit& fit) {
  OrientedBox box;
  box.axes = fit.frame.axes_transposed.transpose();
  box.center = fit.frame.origin + box.axes * (0.5 * fit.extent.lo + 0.5 * fit.extent.hi);
  box.half_extents = 0.5 * fit.extent.hi - 0.5 * fit.extent.lo;
  const Scalar noise = kBoxNoise * (box.center.stableNorm() + box.half_extents.stableNorm()) +
                       std::numeric_limits<Scalar>::min();
  box.half_extents.array() += noise;
  return box;
}

Vector3 any_perpendicular(const Vector3& unit) {
  int smallest = 0;
  unit.cwiseAbs().minCoeff(&smallest);
  return unit.cross(Vector3::Unit(smallest));
}

// Orthonormal columns a, b, a x b with a along `first` and b towards `second`; both have entries
// of at most about one. The identity if `first` is zero or something is not finite.
//
// Columns deviate from orthonormality by at most 8u an entry, as kBoxNoise assumes. Lengths:
// normalising a vector of length about one errs by 1.5u (squares), 1u (root) and 1u (quotient), and
// twice that in the square. Right angles: the last pass for b leaves 3u (dot product), 1u
// (difference) and 1u (quotient); the cross product errs less.
Matrix3 orthonormal_axes(const Vector3& first, const Vector3& second) {
  // The scaling of stableNormalized() costs digits, which the second normalisation restores.
  const Vector3 a = first.stableNormalized().normalized();
  // The negation makes NaN end here too.
  if (!(a.squaredNorm() > 0.5) || !second.allFinite()) return Matrix3::Identity();
  Vector3 b = second - a.dot(second) * a;
  if (b.norm() <= kBoxNoise) b = any_perpendicular(a);
  b.normalize();
  // Once more: the first pass may have cancelled most digits of b.
  b -= a.dot(b) * a;
  b.normalize();
  Matrix3 axes;
  axes << a, b, a.cross(b).normalized();
  return axes;
}

// Longest edge first, then the normal.
Matrix3 axes_of_triangle(const Triangle& triangle) {
  std::array<Vector3, 3> edges{triangle[1] - triangle[0], triangle[2] - triangle[1],
                               triangle[0] - triangle[2]};
  Scalar scale = 0;
  for (const Vector3& edge : edges) scale = std::max(scale, edge.lpNorm<Eigen::Infinity>());
  if (!(scale > 0)) return Matrix3::Identity();
  for (Vector3& edge : edges) edge /= scale;
  int longest = 0;
  for (int k = 1; k < 3; ++k) {
    if (edges[std::size_t(k)].squaredNorm() > edges[std::size_t(longest)].squaredNorm()) {
      longest = k;
    }
  }
  const Vector3& edge = edges[std::size_t(longest)];
  return orthonormal_axes(edge, edge.cross(edges[std::size_t((longest + 1) % 3)]));
}

Matrix3 principal_axes(std::span<const Item> items) {
  const Vector3 origin = items.front().vertices[0];
  Vector3 sum = Vector3::Zero();
  Matrix3 sum_of_squares = Matrix3::Zero();
  for (const Item& item : items) {
    for (const Vector3& vertex : item.vertices) {
      const Vector3 d = vertex - origin;
      sum += d;
      sum_of_squares += d * d.transpose();
    }
  }
  const Scalar count = 3 * Scalar(items.size());
  const Matrix3 covariance = sum_of_squares / count - (sum / count) * (sum / count).transpose();
  if (!covariance.allFinite()) return Matrix3::Identity();
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(covariance);
  if (solver.info() != Eigen::Success) return Matrix3::Identity();
  return orthonormal_axes(solver.eigenvectors().col(2), solver.eigenvectors().col(1));
}

// The smaller box of the two.
Fit fit_inner(std::span<const Item> items) {
  const Fit principal = fit(items, principal_axes(items));
  const Fit aligned = fit(items, Matrix3::Identity());
  // A NaN area, from overflow, leaves the aligned box.
  return principal.extent.half_area() < aligned.extent.half_area() ? principal : aligned;
}

// Which of the bins along an axis a center (times three) falls into.
struct Binning {
  int axis = 0;
  Scalar lo = 0;
  Scalar bins_per_length = 0;

  Binning(const Extent& centers, int axis_in) : axis(axis_in), lo(centers.lo[axis_in]) {
    bins_per_length = kBinCount / (centers.hi[axis] - lo);
  }
  // False if all centers coincide along the axis, or their distances under- or overflow.
  bool is_useful() const { return bins_per_length > 0 && bins_per_length < kInfinity; }
  int operator()(const Vector3& center) const {
    return std::clamp(int((center[axis] - lo) * bins_per_length), 0, kBinCount - 1);
  }
};

struct Split {
  int axis = -1;
  int last_left_bin = -1;
  Scalar cost = kInfinity;
};

struct Bin {
  Extent extent;
  std::int32_t count = 0;
  void include(const Bin& other) {
    extent.include(other.extent);
    count += other.count;
  }
  // Number times area, and a little of the squared length so that sets without area (needles) are
  // split in the middle, too.
  Scalar cost() const {
    if (count == 0) return 0;
    return count * (extent.half_area() + kLengthShare * (extent.hi - extent.lo).squaredNorm());
  }
};

void find_best_split(const std::array<Bin, kBinCount>& bins, int axis, Split& best) {
  std::array<Scalar, kBinCount> cost_right{};
  Bin right;
  for (std::size_t k = kBinCount - 1; k > 0; --k) {
    right.include(bins[k]);
    cost_right[k - 1] = right.count == 0 ? kInfinity : right.cost();
  }
  Bin left;
  for (std::size_t k = 0; k + 1 < kBinCount; ++k) {
    left.include(bins[k]);
    const Scalar cost = left.cost() + cost_right[k];
    if (left.count > 0 && cost < best.cost) best = {axis, int(k), cost};
  }
}

// Moves the items of the left child to the front by the surface-area heuristic; returns their
// number, or zero if no split separates the centers.
std::size_t split_by_area(std::span<Item> items, const Fit& fit) {
  const std::array<Binning, 3> binnings{Binning(fit.centers, 0), Binning(fit.centers, 1),
                                        Binning(fit.centers, 2)};
  std::array<std::array<Bin, kBinCount>, 3> bins;
  for (const Item& item : items) {
    const std::array<Vector3, 3> y = fit.frame(item.vertices);
    const Vector3 center = y[0] + y[1] + y[2];
    Extent extent;
    for (const Vector3& vertex : y) extent.include(vertex);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!binnings[axis].is_useful()) continue;
      Bin& bin = bins[axis][std::size_t(binnings[axis](center))];
      bin.extent.include(extent);
      ++bin.count;
    }
  }
  Split best;
  for (int axis = 0; axis < 3; ++axis) {
    if (binnings[std::size_t(axis)].is_useful()) {
      find_best_split(bins[std::size_t(axis)], axis, best);
    }
  }
  if (best.axis < 0) return 0;
  const Binning& binning = binnings[std::size_t(best.axis)];
  const auto middle = std::partition(items.begin(), items.end(), [&](const Item& item) {
    return binning(fit.frame.center_of(item.vertices)) <= best.last_left_bin;
  });
  return std::size_t(middle - items.begin());
}

// Halves by count along the longest axis; ties go by triangle number, so the result is unique.
std::size_t split_by_count(std::span<Item> items, const Fit& fit) {
  int axis = 0;
  (fit.extent.hi - fit.extent.lo).maxCoeff(&axis);
  const std::size_t half = items.size() / 2;
  const auto key = [&](const Item& item) {
    return std::pair(fit.frame.center_of(item.vertices)[axis], item.triangle);
  };
  std::nth_element(items.begin(), items.begin() + std::ptrdiff_t(half), items.end(),
                   [&](const Item& a, const Item& b) { return key(a) < key(b); });
  return half;
}

std::size_t split(std::span<Item> items, const Fit& fit, int depth) {
  if (items.size() == 2) return 1;
  if (depth < kDepthOfHalving) {
    const std::size_t left = split_by_area(items, fit);
    if (left > 0 && left < items.size()) return left;
  }
  return split_by_count(items, fit);
}

struct Task {
  std::size_t node;
  std::span<Item> items;
  int depth;
};

// The tree before it is collapsed: children are nodes first and first + 1.
struct BinaryNode {
  OrientedBox box;
  std::int32_t first = -1;  // or the triangle
  bool is_leaf = false;

  Scalar cost() const {
    const Vector3& h = box.half_extents;
    return h.x() * h.y() + h.y() * h.z() + h.z() * h.x() + kLengthShare * h.squaredNorm();
  }
};

std::vector<BinaryNode> build_binary(std::span<Item> items) {
  std::vector<BinaryNode> nodes;
  nodes.reserve(2 * items.size() - 1);
  nodes.emplace_back();
  std::vector<Task> tasks{{0, items, 0}};
  // Each round makes one of the 2n - 1 nodes.
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    BinaryNode& node = nodes[task.node];
    if (task.items.size() == 1) {
      const Item& item = task.items.front();
      node = {box_of(fit(task.items, axes_of_triangle(item.vertices))), item.triangle, true};
      continue;
    }
    const Fit fit = fit_inner(task.items);
    const std::size_t child = nodes.size();
    node = {box_of(fit), std::int32_t(child), false};
    const std::size_t left = split(task.items, fit, task.depth);
    nodes.resize(child + 2);
    tasks.push_back({child + 1, task.items.subspan(left), task.depth + 1});
    tasks.push_back({child, task.items.first(left), task.depth + 1});
  }
  return nodes;
}

// How to collapse the binary tree into wide nodes at the least expected cost, a node costing its
// area (the chance that a query comes by): the dynamic program of [Ylitie2017]. cost(n, k) is that
// of all wide nodes below binary node n when it is given k columns of a parent.
class Collapse {
 public:
  explicit Collapse(const std::vector<BinaryNode>& nodes) : nodes_(nodes), choices_(nodes.size()) {
    // Children come after their parents.
    for (std::size_t n = nodes.size(); n-- > 0;) decide(n);
  }

  // The binary nodes that become the columns of the wide node made of inner node n.
  struct Columns {
    std::array<std::int32_t, MeshHierarchy::kWidth> binary{};
    int count = 0;
  };
  Columns columns(std::int32_t n) const {
    Columns columns;
    distribute(n, MeshHierarchy::kWidth, columns);
    return columns;
  }

 private:
  static constexpr int kWidth = MeshHierarchy::kWidth;

  struct Choice {
    std::array<float, kWidth + 1> cost{};        // by number of columns; all zero for a leaf
    std::array<std::int8_t, kWidth + 1> left{};  // columns of the left child; 0: one column for all
  };

  void decide(std::size_t n) {
    const BinaryNode& node = nodes_[n];
    if (node.is_leaf) return;
    Choice& choice = choices_[n];
    const Choice& left = choices_[std::size_t(node.first)];
    const Choice& right = choices_[std::size_t(node.first) + 1];
    for (int k = kWidth; k >= 2; --k) {
      int best = 1;
      for (int j = 1; j < k; ++j) {
        if (left.cost[std::size_t(j)] + right.cost[std::size_t(k - j)] <
            left.cost[std::size_t(best)] + right.cost[std::size_t(k - best)]) {
          best = j;
        }
      }
      choice.cost[std::size_t(k)] =
          left.cost[std::size_t(best)] + right.cost[std::size_t(k - best)];
      choice.left[std::size_t(k)] = std::int8_t(best);
    }
    choice.cost[1] = float(node.cost()) + choice.cost[kWidth];
    for (std::size_t k = 2; k <= kWidth; ++k) {
      if (choice.cost[1] < choice.cost[k] && k < kWidth) {
        choice.cost[k] = choice.cost[1];
        choice.left[k] = 0;
      }
    }
  }

  void distribute(std::int32_t n, int count, Columns& columns) const {
    const BinaryNode& node = nodes_[std::size_t(n)];
    const int left = choices_[std::size_t(n)].left[std::size_t(count)];
    if (node.is_leaf || left == 0) {
      columns.binary[std::size_t(columns.count++)] = n;
      return;
    }
    distribute(node.first, left, columns);
    distribute(node.first + 1, count - left, columns);
  }

  const std::vector<BinaryNode>& nodes_;
  std::vector<Choice> choices_;
};

// The nearest number in single precision that is not smaller. x >= 0, at most 2.
float rounded_up(Scalar x) {
  const auto rounded = static_cast<float>(x);
  return Scalar{rounded} < x ? std::nextafter(rounded, 4.0f) : rounded;
}

}  // namespace

OrientedBox BoxGroup::box(int column, Scalar scale) const {
  OrientedBox box;
  for (int i = 0; i < 3; ++i) {
    box.center[i] = scale * Scalar{rows[kCenter + i][column]};
    box.half_extents[i] = scale * Scalar{rows[kHalfExtents + i][column]};
    for (int k = 0; k < 3; ++k) box.axes(i, k) = Scalar{rows[kAxes + 3 * k + i][column]};
  }
  return box;
}

// Let the box be c + U y, |y_k| <= h_k, and what is stored C + A x with A = U + E, |E_ij| <= 2^-25
// as entries are at most about one. A point of both has x - y = (A^-1 U - I) y + A^-1 (c - C),
// where |A^-1 U - I| <= 3 * 2^-25 and |c - C| <= 2^-24 |c|, each up to second order, and up to
// numbers that underflow.
void BoxGroup::set_box(int column, const OrientedBox& box, Scalar scale) {
  const Vector3 center = box.center / scale;
  const Vector3 half_extents = box.half_extents / scale;
  // literal: more than the absolute error of numbers that underflow in single precision.
  const Scalar noise = kSinglePrecisionBoxNoise * (center.norm() + half_extents.norm()) + 0x1p-140;
  for (int i = 0; i < 3; ++i) {
    rows[kCenter + i][column] = static_cast<float>(center[i]);
    rows[kHalfExtents + i][column] = rounded_up(half_extents[i] + noise);
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

Scalar MeshHierarchy::scale_of(const OrientedBox& root) {
  const Scalar largest = root.center.lpNorm<Eigen::Infinity>() + 2 * root.half_extents.sum();
  int exponent = 0;
  std::frexp(largest, &exponent);
  // literal: so that multiples of it by numbers in single precision never underflow.
  return std::ldexp(Scalar{1}, std::max(exponent, -800));
}

MeshHierarchy::MeshHierarchy(std::span<const Vector3> vertices,
                             std::span<const TriangleIndices> triangles) {
  DYOP_REQUIRE(!triangles.empty() && triangles.size() <= kLargestTriangleCount,
               "a hierarchy needs 1 to ", kLargestTriangleCount, " triangles, not ",
               triangles.size());
  std::vector<Item> items(triangles.size());
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const TriangleIndices& t = triangles[k];
    items[k] = {
        {vertices[std::size_t(t[0])], vertices[std::size_t(t[1])], vertices[std::size_t(t[2])]},
        std::int32_t(k)};
  }
  const std::vector<BinaryNode> binary = build_binary(items);
  const Collapse collapse(binary);

  scale_ = scale_of(binary[0].box);

  // Where a box of a wide node stands in the binary tree, to be opened.
  struct Opening {
    std::int32_t node;
    int column;
    std::int32_t binary;
  };
  std::vector<Opening> openings;
  const auto add_node = [&](const Collapse::Columns& columns) {
    const auto made = std::int32_t(nodes_.size());
    Node& node = nodes_.emplace_back();
    for (int column = kWidth - 1; column >= 0; --column) {
      const int used = std::min(column, columns.count - 1);
      const std::int32_t index = columns.binary[std::size_t(used)];
      const BinaryNode& box = binary[std::size_t(index)];
      node.boxes.set_box(column, box.box, scale_);
      // Replaced when it is opened, unless it is a leaf.
      node.child[column] = used < column ? kNothing : -1 - box.first;
      if (used == column && !box.is_leaf) openings.push_back({made, column, index});
    }
    return made;
  };
  nodes_.reserve(triangles.size() / 4 + 2);
  add_node({{0}, 1});
  // Each round makes one node of two or more boxes.
  while (!openings.empty()) {
    const Opening opening = openings.back();
    openings.pop_back();
    const std::int32_t made = add_node(collapse.columns(opening.binary));
    nodes_[std::size_t(opening.node)].child[opening.column] = made;
  }
}

}  // namespace dyop
