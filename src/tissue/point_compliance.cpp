// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/point_compliance.h"

#include <algorithm>
#include <iterator>

namespace dyop::tissue_internal {

void PointCompliance::prepare(std::span<const CarriedPoint* const> points) {
  std::vector<std::int32_t> nodes;
  for (const CarriedPoint* point : points) {
    std::copy_if(point->nodes.begin(), point->nodes.end(), std::back_inserter(nodes),
                 [&](std::int32_t node) { return body_.is_free(node); });
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  body_.find_response(std::move(nodes));
}

std::span<const Matrix3> PointCompliance::add(const CarriedPoint& point) {
  const std::vector<Carrier> carriers = carriers_of(point);
  points_.push_back(carriers);
  sum_.assign(nodes_.size(), Matrix3::Zero());
  for (const Carrier& carrier : carriers) {
    std::vector<Matrix3>& column = columns_[std::size_t(carrier.place)];
    extend(column, nodes_[std::size_t(carrier.place)]);
    for (std::size_t n = 0; n < sum_.size(); ++n) sum_[n] += carrier.weight * column[n];
  }
  blocks_.assign(points_.size(), Matrix3::Zero());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for (const Carrier& carrier : points_[i]) {
      blocks_[i] += carrier.weight * sum_[std::size_t(carrier.place)];
    }
  }
  return blocks_;
}

std::vector<PointCompliance::Carrier> PointCompliance::carriers_of(const CarriedPoint& point) {
  std::vector<Carrier> carriers;
  for (std::size_t k = 0; k < point.nodes.size(); ++k) {
    const std::int32_t node = point.nodes[k];
    if (!body_.is_free(node) || point.weights[k] == 0) continue;
    std::int32_t& place = place_of_[std::size_t(node)];
    if (place < 0) {
      place = std::int32_t(nodes_.size());
      nodes_.push_back(node);
    }
    carriers.push_back({place, point.weights[k]});
  }
  columns_.resize(nodes_.size());
  return carriers;
}

void PointCompliance::extend(std::vector<Matrix3>& column, std::int32_t node) const {
  for (std::size_t n = column.size(); n < nodes_.size(); ++n) {
    column.push_back(body_.response(nodes_[n], node));
  }
}

}  // namespace dyop::tissue_internal
