// SPDX-License-Identifier: BSD-3-Clause
#include "io/robot/robot_shapes.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/sphere.h"

namespace dyop::io_internal {
namespace {

// The prism around a cylinder is 0.12 % wider at its edges.
constexpr int kPrismSides = 64;
// More than the rounding of a sine, a product and a division: the prisms are proven to be outside
// and inside.
constexpr Scalar kPrismNoise = 0x1p-45;

std::shared_ptr<const Shape> prism(Scalar radius, Scalar length) {
  std::vector<Vector3> points;
  for (int k = 0; k < kPrismSides; ++k) {
    const Scalar angle = 2 * std::numbers::pi_v<Scalar> * k / kPrismSides;
    for (const Scalar z : {-length / 2, length / 2}) {
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  return std::make_shared<ConvexHull>(std::move(points));
}

struct ShapePair {
  std::shared_ptr<const Shape> outer;
  std::shared_ptr<const Shape> inner;
};

template <typename Made, typename... Arguments>
ShapePair same(const Arguments&... arguments) {
  const auto shape = std::make_shared<Made>(arguments...);
  return {shape, shape};
}

ShapePair read_shape(const XmlNode& node, MeshFinder& meshes) {
  const std::string kind = node.name();
  if (kind == "mesh") {
    const auto mesh = meshes.load(node);
    return {mesh, mesh};
  }
  if (kind == "box") {
    const Vector3 size = node.vector3("size");
    if (!(size.array() > 0).all()) node.fail_expected("size", "three numbers > 0");
    return same<Box>(Vector3(size / 2));
  }
  if (kind == "sphere") return same<Sphere>(node.positive("radius"));
  const Scalar radius = node.positive("radius");
  const Scalar length = node.positive("length");
  if (kind == "capsule") return same<Capsule>(radius, length / 2);
  return {prism_around(radius, length), prism_inside(radius, length)};
}

ShapePair read_collision(const XmlNode& collision, MeshFinder& meshes) {
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

std::shared_ptr<const Shape> prism_around(Scalar radius, Scalar length) {
  const Scalar up = 1 + kPrismNoise;
  return prism(radius / std::cos(std::numbers::pi_v<Scalar> / kPrismSides) * up, length * up);
}

std::shared_ptr<const Shape> prism_inside(Scalar radius, Scalar length) {
  return prism(radius * (1 - kPrismNoise), length * (1 - kPrismNoise));
}

LinkShapes read_link_shapes(const XmlNode& link, MeshFinder& meshes) {
  std::vector<CompoundChild> outer;
  std::vector<CompoundChild> inner;
  LinkShapes result;
  bool has_mesh = false;
  bool is_closed = true;
  bool is_exact = true;
  for (const XmlNode& collision : link.all("collision")) {
    const ShapePair shapes = read_collision(collision, meshes);
    const RigidPose X_LS = collision.origin();
    outer.push_back({shapes.outer, X_LS});
    inner.push_back({shapes.inner, X_LS});
    is_exact = is_exact && shapes.outer == shapes.inner;
    if (const auto* mesh = dynamic_cast<const TriangleMesh*>(shapes.outer.get())) {
      has_mesh = true;
      is_closed = is_closed && mesh->is_closed();
    }
  }
  if (outer.empty()) return result;
  try {
    result.outer = joined(outer);
    result.inner = is_exact ? result.outer : joined(inner);
  } catch (const InvalidArgument& error) {
    link.fail(error.what());
  }
  result.is_solid = has_mesh && is_closed;
  return result;
}

}  // namespace dyop::io_internal
