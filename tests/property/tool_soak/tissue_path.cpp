// SPDX-License-Identifier: BSD-3-Clause
#include "tissue_path.h"

#include <algorithm>

#include "dyop/geometry/triangle_mesh.h"

namespace dyop::testing {
namespace {

// Neighbours in the list are mostly neighbours in space.
constexpr std::size_t kBlock = 32;

}  // namespace

TissuePath::TissuePath(const ToolObstacle& obstacle) {
  if (obstacle.shape) {
    const auto& mesh = static_cast<const TriangleMesh&>(*obstacle.shape);
    for (const Vector3& p : mesh.vertices()) begin_.push_back(obstacle.X_WO * p);
    triangles_.assign(mesh.triangles().begin(), mesh.triangles().end());
  } else {
    begin_ = obstacle.vertices;
    triangles_ = obstacle.triangles;
  }
  end_ = begin_;
  fit_boxes();
}

void TissuePath::give(std::vector<Vector3> vertices, Scalar duration) {
  next_.push_back({std::move(vertices), {}, duration});
}

void TissuePath::give_mesh(std::vector<Vector3> vertices, std::vector<TriangleIndices> triangles) {
  next_.push_back({std::move(vertices), std::move(triangles), 0});
}

void TissuePath::start_tick() {
  if (duration_ == 0) go_on();
}

void TissuePath::go_on() {
  duration_ = elapsed_ = 0;
  if (next_.empty()) {
    begin_ = end_;
  } else {
    Next& next = next_.front();
    begin_ = next.duration > 0 ? std::move(end_) : next.vertices;
    end_ = std::move(next.vertices);
    duration_ = next.duration;
    is_new_mesh_ = !(duration_ > 0);
    if (is_new_mesh_) triangles_ = std::move(next.triangles);
    next_.pop_front();
    ++lines_begun_;
  }
  fit_boxes();
}

Scalar TissuePath::time_left() const {
  return duration_ > 0 ? std::max(Scalar{0}, duration_ - elapsed_) : kInfinity;
}

void TissuePath::pass(Scalar time) {
  if (duration_ > 0) elapsed_ = std::min(duration_, elapsed_ + time);
}

Scalar TissuePath::fraction(Scalar later) const {
  return duration_ > 0 ? std::min(Scalar{1}, (elapsed_ + later) / duration_) : 1;
}

Vector3 TissuePath::place(std::size_t vertex, Scalar later) const {
  return begin_[vertex] + fraction(later) * (end_[vertex] - begin_[vertex]);
}

Triangle TissuePath::triangle(std::size_t number, Scalar later) const {
  const TriangleIndices& t = triangles_[number];
  return {place(std::size_t(t[0]), later), place(std::size_t(t[1]), later),
          place(std::size_t(t[2]), later)};
}

Scalar TissuePath::travel(Scalar time) const {
  return duration_ > 0 ? largest_ * time / duration_ : 0;
}

void TissuePath::fit_boxes() {
  boxes_.assign(triangles_.size(), AlignedBox());
  block_boxes_.assign(triangles_.size() / kBlock + 1, AlignedBox());
  largest_ = 0;
  for (std::size_t k = 0; k < triangles_.size(); ++k) {
    for (const std::int32_t i : triangles_[k]) {
      boxes_[k].extend(begin_[std::size_t(i)]).extend(end_[std::size_t(i)]);
    }
    block_boxes_[k / kBlock].extend(boxes_[k]);
  }
  for (std::size_t i = 0; i < begin_.size(); ++i) {
    largest_ = std::max(largest_, (end_[i] - begin_[i]).norm());
  }
}

void TissuePath::find_near(const AlignedBox& box, std::vector<std::size_t>& found) const {
  found.clear();
  for (std::size_t block = 0; block < block_boxes_.size(); ++block) {
    if (!block_boxes_[block].intersects(box)) continue;
    const std::size_t last = std::min(triangles_.size(), (block + 1) * kBlock);
    for (std::size_t k = block * kBlock; k < last; ++k) {
      if (boxes_[k].intersects(box)) found.push_back(k);
    }
  }
}

}  // namespace dyop::testing
