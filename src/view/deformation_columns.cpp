// SPDX-License-Identifier: BSD-3-Clause
#include "view/deformation_columns.h"

#include "view/shape_surface.h"

namespace dyop::view_internal {

nlohmann::json add_deformation(ColumnBlock& block, const std::string& name,
                               const PageDeformation& deformation,
                               std::span<const TriangleIndices> triangles) {
  nlohmann::json json{{"body", deformation.body.slot}, {"modes", nlohmann::json::array()}};
  block.add(name + ".t", std::span<const double>(deformation.times));
  block.add(name + ".weights", std::span<const double>(deformation.weights));
  for (std::size_t k = 0; k < deformation.modes.size(); ++k) {
    std::vector<Vector3> moved;
    for (const std::int32_t vertex : vertices_in_order(triangles, deformation.modes[k].size())) {
      moved.push_back(deformation.modes[k][std::size_t(vertex)]);
    }
    const AlignedBox box = add_rounded(block, name + ".mode" + std::to_string(k), moved);
    json["modes"].push_back({{"low", {box.min().x(), box.min().y(), box.min().z()}},
                             {"high", {box.max().x(), box.max().y(), box.max().z()}}});
  }
  return json;
}

}  // namespace dyop::view_internal
