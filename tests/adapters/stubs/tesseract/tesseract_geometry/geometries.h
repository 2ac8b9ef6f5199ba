// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of Tesseract 0.33 with just what the adapter and its tests use.
#pragma once

#include <tesseract_common/eigen_types.h>
#include <tesseract_geometry/geometry.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace octomap {
class OcTree;
}

namespace tesseract_geometry {

class Sphere : public Geometry {
 public:
  explicit Sphere(double r) : Geometry(GeometryType::SPHERE), r_(r) {}
  double getRadius() const { return r_; }

 private:
  double r_;
};

class StubRound : public Geometry {
 public:
  StubRound(GeometryType type, double r, double l) : Geometry(type), r_(r), l_(l) {}
  double getRadius() const { return r_; }
  double getLength() const { return l_; }

 private:
  double r_;
  double l_;
};

class Cylinder : public StubRound {
 public:
  Cylinder(double r, double l) : StubRound(GeometryType::CYLINDER, r, l) {}
};

class Capsule : public StubRound {
 public:
  Capsule(double radius, double length) : StubRound(GeometryType::CAPSULE, radius, length) {}
};

class Cone : public StubRound {
 public:
  Cone(double radius, double length) : StubRound(GeometryType::CONE, radius, length) {}
};

class Box : public Geometry {
 public:
  Box(double x, double y, double z) : Geometry(GeometryType::BOX), x_(x), y_(y), z_(z) {}
  double getX() const { return x_; }
  double getY() const { return y_; }
  double getZ() const { return z_; }

 private:
  double x_, y_, z_;
};

class Plane : public Geometry {
 public:
  Plane(double a, double b, double c, double d)
      : Geometry(GeometryType::PLANE), a_(a), b_(b), c_(c), d_(d) {}
  double getA() const { return a_; }
  double getB() const { return b_; }
  double getC() const { return c_; }
  double getD() const { return d_; }

 private:
  double a_, b_, c_, d_;
};

class PolygonMesh : public Geometry {
 public:
  PolygonMesh(std::shared_ptr<const tesseract_common::VectorVector3d> vertices,
              std::shared_ptr<const Eigen::VectorXi> faces,
              GeometryType type = GeometryType::POLYGON_MESH)
      : Geometry(type), vertices_(std::move(vertices)), faces_(std::move(faces)) {}
  const std::shared_ptr<const tesseract_common::VectorVector3d>& getVertices() const {
    return vertices_;
  }
  const std::shared_ptr<const Eigen::VectorXi>& getFaces() const { return faces_; }

 private:
  std::shared_ptr<const tesseract_common::VectorVector3d> vertices_;
  std::shared_ptr<const Eigen::VectorXi> faces_;
};

class Mesh : public PolygonMesh {
 public:
  Mesh(std::shared_ptr<const tesseract_common::VectorVector3d> vertices,
       std::shared_ptr<const Eigen::VectorXi> faces)
      : PolygonMesh(std::move(vertices), std::move(faces), GeometryType::MESH) {}
};

class ConvexMesh : public PolygonMesh {
 public:
  ConvexMesh(std::shared_ptr<const tesseract_common::VectorVector3d> vertices,
             std::shared_ptr<const Eigen::VectorXi> faces)
      : PolygonMesh(std::move(vertices), std::move(faces), GeometryType::CONVEX_MESH) {}
};

class CompoundMesh : public Geometry {
 public:
  explicit CompoundMesh(std::vector<std::shared_ptr<PolygonMesh>> meshes)
      : Geometry(GeometryType::COMPOUND_MESH), meshes_(std::move(meshes)) {}
  const std::vector<std::shared_ptr<PolygonMesh>>& getMeshes() const { return meshes_; }

 private:
  std::vector<std::shared_ptr<PolygonMesh>> meshes_;
};

enum class OctreeSubType : std::uint8_t { BOX, SPHERE_INSIDE, SPHERE_OUTSIDE };

class Octree : public Geometry {
 public:
  Octree(std::shared_ptr<const octomap::OcTree> octree, OctreeSubType sub_type)
      : Geometry(GeometryType::OCTREE), octree_(std::move(octree)), sub_type_(sub_type) {}
  const std::shared_ptr<const octomap::OcTree>& getOctree() const { return octree_; }
  OctreeSubType getSubType() const { return sub_type_; }

 private:
  std::shared_ptr<const octomap::OcTree> octree_;
  OctreeSubType sub_type_;
};

}  // namespace tesseract_geometry
