// SPDX-License-Identifier: BSD-3-Clause
#include "tissue_cuts.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace dyop::testing {
namespace {

constexpr std::size_t kUnused = std::numeric_limits<std::size_t>::max();

}  // namespace

TissueCuts::TissueCuts(const ToolObstacle& obstacle)
    : all_(obstacle.triangles), count_(obstacle.vertices.size()) {
  sew();
}

void TissueCuts::sew() {
  triangles_ = all_;
  source_.resize(count_);
  std::iota(source_.begin(), source_.end(), std::size_t{0});
}

void TissueCuts::take(const TissueMesh& mesh) {
  sew();
  triangles_ = mesh.triangles;
}

std::vector<Vector3> TissueCuts::gather(std::span<const Vector3> whole) const {
  std::vector<Vector3> places;
  places.reserve(source_.size());
  for (const std::size_t number : source_) places.push_back(whole[number]);
  return places;
}

bool TissueCuts::take_away(const Vector3& center, Scalar radius, std::span<const Vector3> whole) {
  const auto is_cut = [&](const TriangleIndices& corners) {
    return std::any_of(corners.begin(), corners.end(), [&](std::int32_t corner) {
      return (whole[source_[std::size_t(corner)]] - center).norm() < radius;
    });
  };
  const auto left = std::size_t(std::count_if(triangles_.begin(), triangles_.end(),
                                              [&](const auto& t) { return !is_cut(t); }));
  if (left == triangles_.size() || 2 * left < all_.size()) return false;
  std::erase_if(triangles_, is_cut);
  std::vector<std::size_t> numbers(source_.size(), kUnused), source;
  for (TriangleIndices& t : triangles_) {
    for (std::int32_t& corner : t) {
      std::size_t& number = numbers[std::size_t(corner)];
      if (number == kUnused) {
        number = source.size();
        source.push_back(source_[std::size_t(corner)]);
      }
      corner = std::int32_t(number);
    }
  }
  source_ = std::move(source);
  return true;
}

void TissueCuts::slit(const Vector3& center, const Vector3& normal,
                      std::span<const Vector3> whole) {
  const std::size_t before = source_.size();
  std::vector<std::size_t> other(before, kUnused);
  for (TriangleIndices& t : triangles_) {
    Scalar height = 0;
    for (const std::int32_t corner : t) {
      height += normal.dot(whole[source_[std::size_t(corner)]] - center);
    }
    if (height < 0) continue;
    for (std::int32_t& corner : t) {
      std::size_t& twin = other[std::size_t(corner)];
      if (twin == kUnused) {
        twin = source_.size();
        source_.push_back(source_[std::size_t(corner)]);
      }
      corner = std::int32_t(twin);
    }
  }
}

}  // namespace dyop::testing
