// SPDX-License-Identifier: BSD-3-Clause
#include "io/robot/robot_shapes.h"

#include <vector>

#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/cylinder.h"
#include "dyop/geometry/sphere.h"

namespace dyop::io_internal {
namespace {

std::shared_ptr<const Shape> read_shape(const XmlNode& node, MeshFinder& meshes) {
  const std::string kind = node.name();
  if (kind == "mesh") return meshes.load(node);
  if (kind == "box") {
    const Vector3 size = node.vector3("size");
    if (!(size.array() > 0).all()) node.fail_expected("size", "three numbers > 0");
    return std::make_shared<Box>(Vector3(size / 2));
  }
  const Scalar radius = node.positive("radius");
  if (kind == "sphere") return std::make_shared<Sphere>(radius);
  const Scalar half_length = node.positive("length") / 2;
  if (kind == "capsule") return std::make_shared<Capsule>(radius, half_length);
  return std::make_shared<Cylinder>(radius, half_length);
}

std::shared_ptr<const Shape> read_collision(const XmlNode& collision, MeshFinder& meshes) {
  const XmlNode geometry = collision.at("geometry");
  for (const char* kind : {"mesh", "box", "sphere", "cylinder", "capsule"}) {
    const std::optional<XmlNode> node = geometry.find(kind);
    if (!node) continue;
    try {
      return read_shape(*node, meshes);
    } catch (const InvalidArgument& error) {
      node->fail(error.what());
    }
  }
  geometry.fail("expected one of <mesh>, <box>, <sphere>, <cylinder>, <capsule>");
}

bool is_identity(const RigidPose& X) {
  return X.rotation() == Matrix3::Identity() && X.translation() == Vector3::Zero();
}

std::shared_ptr<const Shape> joined(const std::vector<CompoundChild>& children) {
  if (children.size() == 1 && is_identity(children[0].X_CS)) return children[0].shape;
  return std::make_shared<CompoundShape>(children);
}

}  // namespace

LinkShape read_link_shape(const XmlNode& link, MeshFinder& meshes) {
  std::vector<CompoundChild> children;
  bool has_mesh = false;
  bool is_closed = true;
  for (const XmlNode& collision : link.all("collision")) {
    children.push_back({read_collision(collision, meshes), collision.origin()});
    if (const auto* mesh = dynamic_cast<const TriangleMesh*>(children.back().shape.get())) {
      has_mesh = true;
      is_closed = is_closed && mesh->is_closed();
    }
  }
  if (children.empty()) return {};
  try {
    return {joined(children), has_mesh && is_closed};
  } catch (const InvalidArgument& error) {
    link.fail(error.what());
  }
}

}  // namespace dyop::io_internal
