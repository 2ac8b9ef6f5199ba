// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/redundant_rows.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace dyop::dynamics_internal {

namespace {

// A row is implied by others if so small a part of it is left, in misfits over the radius: the
// misfit itself makes rows differ by about one. Larger: mechanisms near a dead centre lose rows.
constexpr Scalar kMisfits = 10;
constexpr Scalar kMostImpliedPart = 0.3;
constexpr Scalar kLeastImpliedPart = 1e-7;  // literal: of a row, above rounding
// Joints fit together if they contradict each other by no more than this part of the radius: what
// rounding leaves.
constexpr Scalar kFittingPart = 1e-12;  // literal: of the radius, above rounding
// A loop's rows are compared with each other, each comparison of the length of its bodies.
constexpr std::size_t kMostLoopRows = 400;

/// A joint between two bodies; those that cannot be moved are one.
struct Link {
  std::size_t a = 0;
  std::size_t b = 0;
  std::size_t first = 0;  // row
  std::size_t last = 0;
  bool is_in_loop = true;
};

std::vector<Link> links_of(std::span<const HeldRow> rows, std::size_t movable) {
  std::vector<Link> links;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (links.empty() || rows[links.back().first].joint != rows[i].joint) {
      const JointRow& row = *rows[i].row;
      links.push_back({std::min(row.body_a, movable), std::min(row.body_b, movable), i, i});
    }
    links.back().last = i + 1;
  }
  return links;
}

// Takes out the links that hang on a loop, or on nothing, from their ends.
void prune_trees(std::vector<Link>& links, std::size_t movable) {
  std::vector<std::size_t> degree(movable + 1, 0);
  for (const Link& link : links) {
    ++degree[link.a];
    ++degree[link.b];
  }
  for (bool has_changed = true; has_changed;) {
    has_changed = false;
    for (Link& link : links) {
      if (!link.is_in_loop || (degree[link.a] > 1 && degree[link.b] > 1)) continue;
      link.is_in_loop = false;
      --degree[link.a];
      --degree[link.b];
      has_changed = true;
    }
  }
  std::erase_if(links, [](const Link& link) { return !link.is_in_loop; });
}

// Links that share bodies other than the ground, together.
std::vector<std::vector<Link>> loops_of(const std::vector<Link>& links, std::size_t movable) {
  std::vector<std::size_t> group(movable + 1);
  std::iota(group.begin(), group.end(), std::size_t{0});
  const auto root = [&](std::size_t body) {
    while (group[body] != body) body = group[body] = group[group[body]];
    return body;
  };
  for (const Link& link : links) {
    if (link.a < movable && link.b < movable) group[root(link.a)] = root(link.b);
  }
  std::vector<std::vector<Link>> loops;
  std::vector<std::size_t> loop_of(movable + 1, links.size());
  for (const Link& link : links) {
    std::size_t& loop = loop_of[root(link.a < movable ? link.a : link.b)];
    if (loop == links.size()) {
      loop = loops.size();
      loops.emplace_back();
    }
    loops[loop].push_back(link);
  }
  return loops;
}

Matrix3 square_root(const Matrix3& mobility) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(mobility);
  const Matrix3& V = eigen.eigenvectors();
  return V * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * V.transpose();
}

// The rows of one loop, in the metric of the kinetic energy.
class Loop {
 public:
  Loop(const std::vector<Link>& links, std::span<const HeldRow> rows,
       std::span<const ContactBody> bodies, std::size_t movable)
      : rows_(rows), bodies_(bodies), movable_(movable) {
    for (const Link& link : links) {
      for (std::size_t i = link.first; i < link.last; ++i) numbers_.push_back(i);
    }
  }

  // Appends the rows to be left out.
  void find(std::vector<std::size_t>& found);

 private:
  Eigen::VectorXd column(const JointRow& row);
  void take_body(std::size_t body, const Vector3& j_v, const Vector3& j_w, Eigen::VectorXd& column);

  std::span<const HeldRow> rows_;
  std::span<const ContactBody> bodies_;
  std::size_t movable_;
  std::vector<std::size_t> numbers_;                // of the loop's rows
  std::vector<std::size_t> members_;                // its bodies
  std::vector<std::pair<Matrix3, Matrix3>> roots_;  // of their mobilities
};

void Loop::take_body(std::size_t body, const Vector3& j_v, const Vector3& j_w,
                     Eigen::VectorXd& column) {
  if (body >= movable_) return;
  const auto known = std::find(members_.begin(), members_.end(), body);
  const auto place = std::size_t(known - members_.begin());
  if (known == members_.end()) {
    members_.push_back(body);
    roots_.emplace_back(square_root(bodies_[body].inverse_mass_W),
                        square_root(bodies_[body].inverse_inertia_W));
  }
  const auto first = Eigen::Index(6 * place);
  if (column.size() < first + 6) column.conservativeResizeLike(Eigen::VectorXd::Zero(first + 6));
  column.segment<3>(first) += roots_[place].first * j_v;
  column.segment<3>(first + 3) += roots_[place].second * j_w;
}

Eigen::VectorXd Loop::column(const JointRow& row) {
  Eigen::VectorXd column = Eigen::VectorXd::Zero(Eigen::Index(6 * members_.size()));
  take_body(row.body_a, row.j_av_W, row.j_aw_W, column);
  take_body(row.body_b, row.j_bv_W, row.j_bw_W, column);
  return column;
}

void Loop::find(std::vector<std::size_t>& found) {
  if (numbers_.size() > kMostLoopRows) return;
  Scalar misfit = 0;
  Scalar radius = kInfinity;
  for (const std::size_t i : numbers_) {
    misfit = std::max(misfit, std::abs(rows_[i].value));
    radius = std::min(radius, rows_[i].radius);
  }
  const Scalar implied =
      std::clamp(kMisfits * misfit / radius, kLeastImpliedPart, kMostImpliedPart);
  // Orthonormal, and the values that go with them.
  std::vector<std::pair<Eigen::VectorXd, Scalar>> basis;
  std::vector<std::size_t> left_out;
  Scalar contradiction = 0;
  for (const std::size_t i : numbers_) {
    Eigen::VectorXd rest = column(*rows_[i].row);
    const Scalar length = rest.norm();
    Scalar value = rows_[i].value;
    for (const auto& [direction, along] : basis) {
      const Scalar part = direction.dot(rest.head(direction.size()));
      rest.head(direction.size()) -= part * direction;
      value -= part * along;
    }
    const Scalar left = rest.norm();
    if (left > implied * length) {
      basis.emplace_back(rest / left, value / left);
    } else {
      left_out.push_back(i);
      contradiction = std::max(contradiction, std::abs(value));
    }
  }
  if (contradiction <= kFittingPart * radius) return;
  found.insert(found.end(), left_out.begin(), left_out.end());
}

}  // namespace

std::vector<std::size_t> find_contradicting_rows(std::span<const HeldRow> rows,
                                                 std::span<const ContactBody> bodies,
                                                 std::size_t movable) {
  std::vector<Link> links = links_of(rows, movable);
  prune_trees(links, movable);
  std::vector<std::size_t> found;
  for (const std::vector<Link>& loop : loops_of(links, movable)) {
    Loop(loop, rows, bodies, movable).find(found);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace dyop::dynamics_internal
