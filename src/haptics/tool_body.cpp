// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/tool_body.h"

#include <algorithm>

#include "dyop/core/error.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_shape.h"

namespace dyop::haptics_internal {
namespace {

bool is_identity(const RigidPose& X) {
  return X.rotation() == Matrix3::Identity() && X.translation() == Vector3::Zero();
}

TriangleMesh moved(const TriangleMesh& mesh, const RigidPose& X_BS) {
  if (is_identity(X_BS)) return mesh;
  std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
  for (Vector3& p : vertices) p = X_BS * p;
  return mesh.with_vertices(std::move(vertices));
}

void add_pieces(const Shape& shape, const RigidPose& X_BS, std::vector<CorePiece>& pieces) {
  switch (shape.kind()) {
    case ShapeKind::TriangleMesh:
      pieces.push_back({moved(static_cast<const TriangleMesh&>(shape), X_BS), 0});
      return;
    case ShapeKind::Convex: {
      const auto& convex = static_cast<const ConvexShape&>(shape);
      const TriangleMesh* surface = convex.core_surface();
      DYOP_REQUIRE(surface,
                   "HapticSession: a part with a smooth core cannot meet a deforming mesh; ",
                   "make it of meshes, boxes, hulls, spheres or capsules");
      pieces.push_back({moved(*surface, X_BS), convex.rounding_radius()});
      return;
    }
    case ShapeKind::Compound:
      for (const CompoundChild& child : static_cast<const CompoundShape&>(shape).children()) {
        add_pieces(*child.shape, X_BS * child.X_CS, pieces);
      }
      return;
  }
}

ToolBody make_body(const std::vector<CompoundChild>& children, std::optional<std::size_t> hinge,
                   bool with_pieces) {
  ToolBody body;
  body.hinge = hinge;
  if (children.size() == 1 && is_identity(children[0].X_CS)) {
    body.shape = children[0].shape;
  } else {
    body.shape = std::make_shared<CompoundShape>(children);
  }
  if (with_pieces) add_pieces(*body.shape, RigidPose(), body.pieces);
  body.box = body.shape->bounding_box();
  body.reach = body.shape->bounding_radius();
  const Vector3 sizes = body.box.sizes();
  body.thickness = sizes.minCoeff() > 0 ? sizes.minCoeff() : sizes.norm();
  return body;
}

std::vector<CompoundChild> children_of(const HapticScene& scene, std::optional<std::size_t> hinge) {
  std::vector<CompoundChild> children;
  for (const ToolPart& part : scene.tool) {
    if (part.hinge != hinge) continue;
    const RigidPose X_BP = hinge ? scene.hinges[*hinge].X_TJ.inverse() * part.X_TP : part.X_TP;
    children.push_back({part.shape, X_BP});
  }
  return children;
}

}  // namespace

std::vector<ToolBody> make_tool_bodies(const HapticScene& scene, bool with_pieces) {
  DYOP_REQUIRE(!scene.tool.empty(), "HapticSession: the tool needs at least one part");
  for (std::size_t k = 0; k < scene.tool.size(); ++k) {
    DYOP_REQUIRE(scene.tool[k].shape, "HapticSession: part ", k, " has no shape");
    DYOP_REQUIRE(!scene.tool[k].hinge || *scene.tool[k].hinge < scene.hinges.size(),
                 "HapticSession: part ", k, " names hinge ", scene.tool[k].hinge.value_or(0),
                 " of ", scene.hinges.size());
  }
  std::vector<ToolBody> bodies;
  const auto fixed = children_of(scene, std::nullopt);
  if (!fixed.empty()) bodies.push_back(make_body(fixed, std::nullopt, with_pieces));
  for (std::size_t hinge = 0; hinge < scene.hinges.size(); ++hinge) {
    const auto children = children_of(scene, hinge);
    DYOP_REQUIRE(!children.empty(), "HapticSession: hinge ", hinge, " has no parts");
    bodies.push_back(make_body(children, hinge, with_pieces));
    bodies.back().reach += scene.hinges[hinge].X_TJ.translation().norm();
  }
  return bodies;
}

Scalar reach_of(std::span<const ToolBody> bodies) {
  Scalar reach = 0;
  for (const ToolBody& body : bodies) reach = std::max(reach, body.reach);
  return reach;
}

}  // namespace dyop::haptics_internal
