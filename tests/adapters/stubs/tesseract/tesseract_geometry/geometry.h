// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of Tesseract 0.33 with just what the adapter and its tests use.
#pragma once

#include <cstdint>
#include <memory>

namespace tesseract_geometry {

enum class GeometryType : std::uint8_t {
  UNINITIALIZED,
  SPHERE,
  CYLINDER,
  CAPSULE,
  CONE,
  BOX,
  PLANE,
  MESH,
  CONVEX_MESH,
  SDF_MESH,
  OCTREE,
  POLYGON_MESH,
  COMPOUND_MESH
};

class Geometry {
 public:
  using Ptr = std::shared_ptr<Geometry>;
  using ConstPtr = std::shared_ptr<const Geometry>;
  explicit Geometry(GeometryType type = GeometryType::UNINITIALIZED) : type_(type) {}
  virtual ~Geometry() = default;
  GeometryType getType() const { return type_; }

 private:
  GeometryType type_;
};

}  // namespace tesseract_geometry
