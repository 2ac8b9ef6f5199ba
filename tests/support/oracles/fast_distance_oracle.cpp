// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/fast_distance_oracle.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dyop/geometry/triangle_mesh.h"

namespace dyop::testing {
namespace {

constexpr Scalar kRoundoff = 0x1p-53;
// Posing, boxes, nearest points and slab: each about 20 roundings of numbers of the pair's size.
constexpr Scalar kNoise = 128 * kRoundoff;
// A pair in double that its slab proves to this fraction of the size needs no quad precision. The
// slab tilts by the error of the witness over the distance, so that it cannot reach rounding.
constexpr Scalar kProven = 0x1p-40;

// B transformed to the frame of A, and the best result so far.
class Search {
 public:
  Search(const OracleBody& a, const RigidPose& X_WA, const OracleBody& b, const RigidPose& X_WB,
         const SearchGap& gap)
      : a_(a), b_(b), gap_(gap) {
    const Matrix3 R_AW = X_WA.rotation().transpose();
    R_AB_ = R_AW * X_WB.rotation();
    p_AB_ = R_AW * (X_WB.translation() - X_WA.translation());
    R_AB_abs_ = R_AB_.cwiseAbs();
    noise_ = kNoise * (p_AB_.norm() + a.radius() + b.radius());
    radii_ = a.surface().rounding_radius + b.surface().rounding_radius;
  }

  void examine_triangles(std::int32_t i, std::int32_t j);
  void run();

  DistanceBracket result() const {
    const Scalar lower = std::min(lower_, pruned_) - radii_ - 2 * noise_;
    return {std::max(0.0, lower), std::max(0.0, upper_ - radii_ + 2 * noise_)};
  }
  PairSeed nearest_pair() const { return nearest_; }

 private:
  struct NodePair {
    std::size_t a;
    std::size_t b;
    Scalar lower;
  };

  Scalar box_gap(const OracleBody::Node& a, const OracleBody::Node& b) const {
    const Vector3 step = R_AB_ * b.center + p_AB_ - a.center;
    const Scalar balls = step.norm() - a.radius - b.radius;
    if (balls >= upper_) return balls;
    // Along the axes of A, where B's box is enlarged to an aligned one, and vice versa.
    const Vector3 along_a = step.cwiseAbs() - a.half_extents - R_AB_abs_ * b.half_extents;
    const Vector3 step_b = R_AB_.transpose() * step;
    const Vector3 along_b =
        step_b.cwiseAbs() - b.half_extents - R_AB_abs_.transpose() * a.half_extents;
    // Along the line of centers.
    const Scalar length = step.norm();
    const Scalar slab = length > 0 ? length - (step.cwiseAbs().dot(a.half_extents) +
                                               step_b.cwiseAbs().dot(b.half_extents)) /
                                                  length
                                   : 0;
    return std::max({balls, slab, along_a.cwiseMax(0.0).norm(), along_b.cwiseMax(0.0).norm()});
  }

  // A pair at least this far apart need not be examined.
  Scalar limit() const {
    if (upper_ == kInfinity) return kInfinity;
    const Scalar above = std::max(0.0, upper_ - radii_ - gap_.target);
    return upper_ - std::max(gap_.absolute, gap_.relative * above);
  }
  bool is_done() const { return upper_ <= noise_ || upper_ - radii_ <= 0; }

  void push(std::size_t i, std::size_t j) {
    stack_.push_back({i, j, box_gap(a_.nodes()[i], b_.nodes()[j])});
  }
  void expand(const NodePair& pair);

  const OracleBody& a_;
  const OracleBody& b_;
  SearchGap gap_;
  Matrix3 R_AB_;
  Matrix3 R_AB_abs_;
  Vector3 p_AB_;
  Scalar noise_;
  Scalar radii_;
  Scalar lower_ = kInfinity;   // of the examined triangle pairs
  Scalar pruned_ = kInfinity;  // of the pairs skipped
  Scalar upper_ = kInfinity;
  PairSeed nearest_;
  std::vector<NodePair> stack_;
};

Scalar size_of(const Triangle& a, const Triangle& b) {
  Scalar size = 0;
  for (const Triangle* t : {&a, &b}) {
    for (const Vector3& p : *t) size = std::max(size, (p - a[0]).lpNorm<Eigen::Infinity>());
  }
  return size;
}

// Width of the slab between the triangles perpendicular to the line through their centers.
Scalar gap_between_centers(const Triangle& a, const Triangle& b) {
  const Vector3 n = b[0] + b[1] + b[2] - (a[0] + a[1] + a[2]);
  const Scalar length = n.norm();
  if (!(length > 0)) return 0;
  const Scalar a_max = std::max({n.dot(a[0]), n.dot(a[1]), n.dot(a[2])});
  const Scalar b_min = std::min({n.dot(b[0]), n.dot(b[1]), n.dot(b[2])});
  return (b_min - a_max) / length;
}

void Search::examine_triangles(std::int32_t i, std::int32_t j) {
  const Triangle a = a_.surface().triangles->triangle(i);
  Triangle b = b_.surface().triangles->triangle(j);
  for (Vector3& p : b) p = R_AB_ * p + p_AB_;
  const Scalar gap = gap_between_centers(a, b);
  if (gap >= limit()) {
    pruned_ = std::min(pruned_, gap);
    return;
  }
  const PointTriangle<double> points_a = to_points<double>(a);
  const PointTriangle<double> points_b = to_points<double>(b);
  const NearestPair<double> nearest = nearest_points(points_a, points_b);
  Scalar upper = std::sqrt(nearest.squared_distance);
  Scalar lower = std::clamp(slab_gap(points_a, points_b, nearest), 0.0, upper);
  const Scalar allowed = std::max(kProven * size_of(a, b), gap_.absolute / 2);
  if (upper - lower > allowed && lower < limit()) {
    const OracleDistance d = oracle_triangle_distance(a, b);
    lower = static_cast<Scalar>(d.lower());
    upper = static_cast<Scalar>(d.upper());
  }
  lower_ = std::min(lower_, lower);
  if (upper < upper_) {
    upper_ = upper;
    nearest_ = {i, j};
  }
}

void Search::expand(const NodePair& pair) {
  const OracleBody::Node& a = a_.nodes()[pair.a];
  const OracleBody::Node& b = b_.nodes()[pair.b];
  if (a.is_leaf && b.is_leaf) {
    examine_triangles(a.first, b.first);
    return;
  }
  const std::size_t size = stack_.size();
  const bool split_a = b.is_leaf || (!a.is_leaf && a.radius > b.radius);
  for (std::size_t k = 0; k < 2; ++k) {
    if (split_a) {
      push(static_cast<std::size_t>(a.first) + k, pair.b);
    } else {
      push(pair.a, static_cast<std::size_t>(b.first) + k);
    }
  }
  // The nearer one on top.
  if (stack_[size].lower < stack_[size + 1].lower) std::swap(stack_[size], stack_[size + 1]);
}

// Each pair of nodes is reached at most once, so this ends.
void Search::run() {
  push(0, 0);
  while (!stack_.empty() && !is_done()) {
    const NodePair pair = stack_.back();
    stack_.pop_back();
    if (pair.lower >= limit()) {
      pruned_ = std::min(pruned_, pair.lower);
    } else {
      expand(pair);
    }
  }
  if (!stack_.empty()) pruned_ = 0;
}

}  // namespace

OracleBody::OracleBody(const Shape& shape) : shape_(&shape), surface_(oracle_surface(shape)) {
  const TriangleMesh& mesh = *surface_.triangles;
  const std::size_t count = mesh.triangles().size();
  std::vector<AlignedBox> boxes(count);
  for (std::size_t k = 0; k < count; ++k) {
    for (const Vector3& p : mesh.triangle(static_cast<std::int32_t>(k))) {
      boxes[k].extend(p);
      radius_ = std::max(radius_, p.norm());
    }
  }
  radius_ = (radius_ + surface_.rounding_radius) * (1 + kNoise);
  std::vector<std::int32_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  nodes_.reserve(2 * count);
  nodes_.emplace_back();
  build(0, 0, count, order, boxes);
}

void OracleBody::build(std::size_t node, std::size_t begin, std::size_t end,
                       std::vector<std::int32_t>& order, const std::vector<AlignedBox>& boxes) {
  const auto first = order.begin() + static_cast<std::ptrdiff_t>(begin);
  const auto last = order.begin() + static_cast<std::ptrdiff_t>(end);
  AlignedBox box;
  std::for_each(first, last,
                [&](std::int32_t t) { box.extend(boxes[static_cast<std::size_t>(t)]); });
  Node& made = nodes_[node];
  made.center = box.center();
  made.half_extents = box.sizes() / 2;
  made.radius = 0;
  std::for_each(first, last, [&](std::int32_t t) {
    for (const Vector3& p : surface_.triangles->triangle(t)) {
      made.radius = std::max(made.radius, (p - made.center).norm());
    }
  });
  if (end - begin == 1) {
    made.first = *first;
    made.is_leaf = true;
    return;
  }
  const std::size_t children = nodes_.size();
  made.first = static_cast<std::int32_t>(children);
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto place = [&](std::int32_t t) {
    const AlignedBox& of_t = boxes[static_cast<std::size_t>(t)];
    return of_t.min()[axis] + of_t.max()[axis];
  };
  const std::size_t middle = begin + (end - begin) / 2;
  std::nth_element(first, order.begin() + static_cast<std::ptrdiff_t>(middle), last,
                   [&](std::int32_t s, std::int32_t t) { return place(s) < place(t); });
  nodes_.resize(children + 2);  // `made` may dangle from here on
  build(children, begin, middle, order, boxes);
  build(children + 1, middle, end, order, boxes);
}

DistanceBracket fast_oracle_distance(const OracleBody& a, const RigidPose& X_WA,
                                     const OracleBody& b, const RigidPose& X_WB,
                                     const SearchGap& gap, PairSeed& seed) {
  Search search(a, X_WA, b, X_WB, gap);
  search.examine_triangles(seed.triangle_a, seed.triangle_b);
  search.run();
  seed = search.nearest_pair();
  return search.result();
}

}  // namespace dyop::testing
