// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <memory>

namespace octomap {
class OcTree;
}

namespace shapes {

enum ShapeType { UNKNOWN_SHAPE, SPHERE, CYLINDER, CONE, BOX, PLANE, MESH, OCTREE };

class Shape {
 public:
  virtual ~Shape() = default;
  ShapeType type = UNKNOWN_SHAPE;
};

class Sphere : public Shape {
 public:
  explicit Sphere(double r) : radius(r) { type = SPHERE; }
  double radius;
};

class Cylinder : public Shape {
 public:
  Cylinder(double r, double l) : length(l), radius(r) { type = CYLINDER; }
  double length;
  double radius;
};

class Cone : public Shape {
 public:
  Cone(double r, double l) : length(l), radius(r) { type = CONE; }
  double length;
  double radius;
};

class Box : public Shape {
 public:
  Box(double x, double y, double z) : size{x, y, z} { type = BOX; }
  double size[3];
};

class Mesh : public Shape {
 public:
  Mesh(unsigned int v_count, unsigned int t_count)
      : vertex_count(v_count),
        vertices(new double[v_count * 3]()),
        triangle_count(t_count),
        triangles(new unsigned int[t_count * 3]()) {
    type = MESH;
  }
  Mesh(const Mesh&) = delete;
  Mesh& operator=(const Mesh&) = delete;
  ~Mesh() override {
    delete[] vertices;
    delete[] triangles;
  }
  unsigned int vertex_count;
  double* vertices;
  unsigned int triangle_count;
  unsigned int* triangles;
};

class Plane : public Shape {
 public:
  Plane(double pa, double pb, double pc, double pd) : a(pa), b(pb), c(pc), d(pd) { type = PLANE; }
  double a, b, c, d;
};

class OcTree : public Shape {
 public:
  explicit OcTree(const std::shared_ptr<const octomap::OcTree>& t) : octree(t) { type = OCTREE; }
  std::shared_ptr<const octomap::OcTree> octree;
};

using ShapePtr = std::shared_ptr<Shape>;
using ShapeConstPtr = std::shared_ptr<const Shape>;

}  // namespace shapes
