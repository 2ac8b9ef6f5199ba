// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/tool_body.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_shape.h"
#include "motion/guarded_state.h"

namespace dyop {

ToolPose HapticTool::start() const {
  ToolPose pose{X_WT, {}};
  for (std::size_t k = 0; k < hinges.size(); ++k) pose.angles[k] = hinges[k].angle;
  return pose;
}

std::vector<HapticTool> HapticScene::tools() const {
  std::vector<HapticTool> tools{{tool, hinges, X_WT, trocar, {}}};
  tools.insert(tools.end(), more_tools.begin(), more_tools.end());
  return tools;
}

}  // namespace dyop

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
  for (const CorePiece& piece : body.pieces) piece.mesh.topology();  // now, not within a tick
  body.box = body.shape->bounding_box();
  body.reach = body.shape->bounding_radius();
  const Vector3 sizes = body.box.sizes();
  body.thickness = sizes.minCoeff() > 0 ? sizes.minCoeff() : sizes.norm();
  return body;
}

std::vector<CompoundChild> children_of(const HapticTool& tool, std::optional<std::size_t> hinge) {
  std::vector<CompoundChild> children;
  for (const ToolPart& part : tool.parts) {
    if (part.hinge != hinge) continue;
    const RigidPose X_BP = hinge ? tool.hinges[*hinge].X_TJ.inverse() * part.X_TP : part.X_TP;
    children.push_back({part.shape, X_BP});
  }
  return children;
}

void require_valid_parts(const HapticTool& tool, std::size_t number) {
  DYOP_REQUIRE(!tool.parts.empty(), "HapticSession: tool ", number, " needs at least one part");
  for (std::size_t k = 0; k < tool.parts.size(); ++k) {
    const ToolPart& part = tool.parts[k];
    DYOP_REQUIRE(part.shape, "HapticSession: tool ", number, ", part ", k, " has no shape");
    DYOP_REQUIRE(!part.hinge || *part.hinge < tool.hinges.size(), "HapticSession: tool ", number,
                 ", part ", k, " names hinge ", part.hinge.value_or(0), " of ", tool.hinges.size());
  }
}

}  // namespace

std::vector<ToolBody> make_tool_bodies(const HapticTool& tool, std::size_t number,
                                       bool with_pieces) {
  require_valid_parts(tool, number);
  std::vector<ToolBody> bodies;
  const auto fixed = children_of(tool, std::nullopt);
  if (!fixed.empty()) bodies.push_back(make_body(fixed, std::nullopt, with_pieces));
  for (std::size_t hinge = 0; hinge < tool.hinges.size(); ++hinge) {
    const auto children = children_of(tool, hinge);
    DYOP_REQUIRE(!children.empty(), "HapticSession: tool ", number, ", hinge ", hinge,
                 " has no parts");
    bodies.push_back(make_body(children, hinge, with_pieces));
    bodies.back().reach += tool.hinges[hinge].X_TJ.translation().norm();
  }
  for (ToolBody& body : bodies) body.tool = number;
  return bodies;
}

Scalar reach_of(std::span<const ToolBody> bodies, std::size_t tool) {
  Scalar reach = 0;
  for (const ToolBody& body : bodies) {
    if (body.tool == tool) reach = std::max(reach, body.reach);
  }
  return reach;
}

namespace {

RigidPose turned_about_z(Scalar angle) {
  return RigidPose::from_trusted(rotation_from_vector(angle * Vector3::UnitZ()), Vector3::Zero());
}

// More than the rounding error of the few operations in a bound.
Scalar rounded_up(Scalar x) {
  return x * (1 + 64 * kUnitRoundoff);
}

Twist per_time(const ToolStep& step, Scalar duration) {
  return {step.v_W / duration, step.w_W / duration};
}

}  // namespace

ToolStep step_between(const ToolPose& from, const ToolPose& to) {
  ToolStep step;
  step.v_W = to.X_WT.translation() - from.X_WT.translation();
  step.w_W = rotation_vector(to.X_WT.rotation() * from.X_WT.rotation().transpose());
  for (std::size_t k = 0; k < kMostHinges; ++k) step.angles[k] = to.angles[k] - from.angles[k];
  return step;
}

ToolStep scaled(const ToolStep& step, Scalar factor) {
  ToolStep result{step.v_W * factor, step.w_W * factor, step.angles};
  for (Scalar& angle : result.angles) angle *= factor;
  return result;
}

ToolStep difference(const ToolStep& step, const ToolStep& other) {
  ToolStep result{step.v_W - other.v_W, step.w_W - other.w_W, step.angles};
  for (std::size_t k = 0; k < kMostHinges; ++k) result.angles[k] -= other.angles[k];
  return result;
}

ToolSteps step_between(const ToolPoses& from, const ToolPoses& to) {
  ToolSteps steps(from.size());
  for (std::size_t k = 0; k < from.size(); ++k) steps[k] = step_between(from[k], to[k]);
  return steps;
}

ToolSteps scaled(const ToolSteps& steps, Scalar factor) {
  ToolSteps result(steps.size());
  for (std::size_t k = 0; k < steps.size(); ++k) result[k] = scaled(steps[k], factor);
  return result;
}

// The rounding errors of three rotations can add up to more than a query takes for one.
RigidPose HingeMotion::pose(Scalar t) const {
  return without_drift(X_WT_.pose(t) * X_TJ_ * turned_about_z(angle_ + t * rate_));
}

Twist HingeMotion::twist(Scalar t) const {
  const MotionState tool = X_WT_.state(t);
  const Matrix3& R_WT = tool.X_WB.rotation();
  return {tool.twist.v_WB + tool.twist.w_WB.cross(R_WT * X_TJ_.translation()),
          tool.twist.w_WB + rate_ * (R_WT * X_TJ_.rotation().col(2))};
}

TwistBound HingeMotion::twist_bound(const TimeInterval& interval) const {
  const TwistBound tool = X_WT_.twist_bound(interval);
  const Scalar lever = rounded_up(X_TJ_.translation().stableNorm());
  const Scalar turn = std::abs(rate_);
  return {rounded_up(tool.linear_speed + tool.angular_speed * lever),
          rounded_up(tool.angular_speed + turn),
          rounded_up(tool.angular_speed * tool.angular_speed * lever),
          rounded_up(tool.angular_speed * turn)};
}

PoseScale HingeMotion::pose_scale(const TimeInterval& interval) const {
  PoseScale scale = X_WT_.pose_scale(interval);
  scale.length += X_TJ_.translation().stableNorm();
  scale.angle += std::abs(angle_) +
                 std::abs(rate_) * std::max(std::abs(interval.begin), std::abs(interval.end));
  // Three composed poses.
  return {3 * scale.length, 3 * scale.angle};
}

ToolMotion::ToolMotion(const ToolPose& from, const ToolStep& step, Scalar duration,
                       std::span<const ToolHinge> hinges)
    : from_(from),
      rate_(scaled(step, 1 / duration)),
      places_(hinges),
      frame_(from.X_WT, per_time(step, duration)) {
  for (std::size_t k = 0; k < hinges.size(); ++k) {
    hinges_[k].emplace(frame_, hinges[k].X_TJ, from.angles[k], rate_.angles[k]);
  }
}

ToolPose ToolMotion::at(Scalar t) const {
  ToolPose pose{frame_.pose(t), from_.angles};
  for (std::size_t k = 0; k < kMostHinges; ++k) pose.angles[k] += t * rate_.angles[k];
  return pose;
}

// A point at c from T's origin moves by t v + (R(t) - I) c, |(R - I) c - t w x c| <= |t w|^2 |c| /
// 2, and that of the hinge adds at most its angle times the distance from its axis. Both are convex
// in the point, so the corners of the box bound them.
Scalar ToolMotion::largest_displacement(const ToolBody& body, Scalar t) const {
  const RigidPose X_TB = body_in_tool(body, places_, from_);
  const Scalar turn = t * rate_.w_W.norm();
  const Scalar hinge_turn = body.hinge ? t * std::abs(rate_.angles[*body.hinge]) : 0;
  Scalar largest = 0;
  for (int k = 0; k < 8; ++k) {
    const Vector3 p_B = body.box.corner(static_cast<AlignedBox::CornerType>(k));
    const Vector3 c_W = from_.X_WT.rotation() * (X_TB * p_B);
    const Scalar linear = t * (rate_.v_W + rate_.w_W.cross(c_W)).norm();
    const Scalar radius = std::hypot(p_B.x(), p_B.y());
    largest = std::max(largest, linear + turn * turn / 2 * c_W.norm() + hinge_turn * radius);
  }
  return rounded_up(largest);
}

// With p = c + r the displacements differ by (R(t) - I) r, at most the angle of R times |r|.
std::pair<Vector3, Scalar> ToolMotion::shift(const ToolBody& body, Scalar t) const {
  const Vector3 c_B = body.box.center();
  const Vector3 shift_W = of(body).pose(t) * c_B - of(body).pose(0) * c_B;
  const Scalar hinge_rate = body.hinge ? std::abs(rate_.angles[*body.hinge]) : 0;
  const Scalar turn = t * (rate_.w_W.norm() + hinge_rate);
  return {shift_W, rounded_up(turn * body.box.diagonal().norm() / 2)};
}

RigidPose body_in_tool(const ToolBody& body, std::span<const ToolHinge> hinges,
                       const ToolPose& pose) {
  if (!body.hinge) return RigidPose();
  return hinges[*body.hinge].X_TJ * turned_about_z(pose.angles[*body.hinge]);
}

}  // namespace dyop::haptics_internal
