#include "dyop/geometry/mesh_hierarchy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
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

}  // namespace

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
  nodes_.reserve(2 * items.size() - 1);
  nodes_.emplace_back();
  std::vector<Task> tasks{{0, items, 0}};
  // Each round makes one of the 2n - 1 nodes.
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    Node& node = nodes_[task.node];
    if (task.items.size() == 1) {
      const Item& item = task.items.front();
      node = {box_of(fit(task.items, axes_of_triangle(item.vertices))), item.triangle, true};
      continue;
    }
    const Fit fit = fit_inner(task.items);
    const std::size_t child = nodes_.size();
    node = {box_of(fit), std::int32_t(child), false};
    const std::size_t left = split(task.items, fit, task.depth);
    nodes_.resize(child + 2);
    tasks.push_back({child + 1, task.items.subspan(left), task.depth + 1});
    tasks.push_back({child, task.items.first(left), task.depth + 1});
  }
}

}  // namespace dyop
