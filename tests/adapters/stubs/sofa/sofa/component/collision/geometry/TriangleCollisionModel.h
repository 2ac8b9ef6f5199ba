// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of SOFA as of 2025 with just what the adapter and its tests use.
#pragma once

#include <sofa/core/CollisionModel.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace sofa::component::collision::geometry {

template <class TDataTypes>
class TriangleCollisionModel : public core::CollisionModel {
 public:
  using VecCoord = typename TDataTypes::VecCoord;
  using SeqTriangles = std::vector<std::array<Index, 3>>;

  // The host's come from a mechanical state and a topology.
  TriangleCollisionModel(std::string name, VecCoord x, SeqTriangles triangles)
      : CollisionModel(std::move(name)), x_(std::move(x)), triangles_(std::move(triangles)) {
    size = static_cast<Size>(triangles_.size());
  }
  const VecCoord& getX() const { return x_; }
  const SeqTriangles& getTriangles() const { return triangles_; }
  VecCoord& stub_x() { return x_; }

 private:
  VecCoord x_;
  SeqTriangles triangles_;
};

}  // namespace sofa::component::collision::geometry
