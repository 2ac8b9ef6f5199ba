// SPDX-License-Identifier: BSD-3-Clause
#include "io/scene/motion_reader.h"

#include <numbers>

#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/screw_motion.h"
#include "dyop/motion/sequence_motion.h"

namespace dyop::io_internal {
namespace {

constexpr Scalar kRadiansPerDegree = std::numbers::pi / 180;

Quaternion read_quaternion(const JsonNode& node) {
  const std::vector<JsonNode> entries = node.items();
  if (entries.size() != 4) node.fail_expected("four numbers [w, x, y, z]");
  return {entries[0].number(), entries[1].number(), entries[2].number(), entries[3].number()};
}

Quaternion read_axis_angle(const JsonNode& node) {
  node.require_object({"axis", "degrees"});
  const Vector3 axis = node.at("axis").vector3();
  if (axis.isZero(0)) node.at("axis").fail_expected("an axis of nonzero length");
  return Quaternion(Eigen::AngleAxis<Scalar>(node.at("degrees").number() * kRadiansPerDegree,
                                             axis.stableNormalized()));
}

// About the fixed axes of the world: x, then y, then z.
Quaternion read_euler(const JsonNode& node) {
  const Vector3 angles = node.vector3() * kRadiansPerDegree;
  return Eigen::AngleAxis<Scalar>(angles.z(), Vector3::UnitZ()) *
         Eigen::AngleAxis<Scalar>(angles.y(), Vector3::UnitY()) *
         Eigen::AngleAxis<Scalar>(angles.x(), Vector3::UnitX());
}

TimeInterval read_interval(const JsonNode& node) {
  const std::vector<JsonNode> ends = node.items();
  if (ends.size() != 2) node.fail_expected("two times [begin, end]");
  const TimeInterval interval{ends[0].number(), ends[1].number()};
  node.guard([&] { require_valid(interval); });
  return interval;
}

Scalar number_or(const JsonNode& node, std::string_view key, Scalar otherwise) {
  const std::optional<JsonNode> found = node.find(key);
  return found ? found->number() : otherwise;
}

std::shared_ptr<const Motion> read_rest(const JsonNode& node) {
  node.require_object({"kind", "pose"});
  return std::make_shared<RestMotion>(node.has("pose") ? read_pose(node.at("pose")) : RigidPose());
}

std::shared_ptr<const Motion> read_constant_twist(const JsonNode& node) {
  node.require_object({"kind", "pose", "velocity", "time"});
  const RigidPose X_WB0 = node.has("pose") ? read_pose(node.at("pose")) : RigidPose();
  const Twist twist = read_twist(node.at("velocity"));
  return std::make_shared<ConstantTwistMotion>(X_WB0, twist, number_or(node, "time", 0));
}

std::shared_ptr<const Motion> read_screw(const JsonNode& node) {
  node.require_object({"kind", "pose", "point", "axis", "turn_rate", "slide_rate", "time"});
  const RigidPose X_WB0 = node.has("pose") ? read_pose(node.at("pose")) : RigidPose();
  ScrewMotion::Screw screw;
  if (node.has("point")) screw.p_WA = node.at("point").vector3();
  screw.axis_W = node.at("axis").vector3();
  screw.turn_rate = number_or(node, "turn_rate", 0);
  screw.slide_rate = number_or(node, "slide_rate", 0);
  return std::make_shared<ScrewMotion>(X_WB0, screw, number_or(node, "time", 0));
}

std::shared_ptr<const Motion> read_interpolated(const JsonNode& node) {
  node.require_object({"kind", "interval", "from", "to", "path"});
  RotationPath path = RotationPath::Slerp;
  if (const auto word = node.find("path")) {
    path = word->choice<RotationPath>(
        {{"slerp", RotationPath::Slerp}, {"rotation_vector", RotationPath::RotationVector}});
  }
  return std::make_shared<InterpolatedMotion>(read_interval(node.at("interval")),
                                              read_pose(node.at("from")), read_pose(node.at("to")),
                                              path);
}

std::shared_ptr<const Motion> read_sampled(const JsonNode& node) {
  node.require_object({"kind", "samples", "smooth"});
  const bool is_smooth = node.has("smooth") && node.at("smooth").boolean();
  std::vector<SampledMotion::Sample> samples;
  for (const JsonNode& sample : node.at("samples").items(2)) {
    sample.require_object({"time", "pose"});
    samples.push_back({sample.at("time").number(), read_pose(sample.at("pose"))});
  }
  return node.at("samples").guard([&]() -> std::shared_ptr<const Motion> {
    if (is_smooth) return std::make_shared<SequenceMotion>(smooth_sampled_motion(samples));
    return std::make_shared<SampledMotion>(samples);
  });
}

Matrix3 read_base(const JsonNode& node) {
  if (!node.has("base")) return Matrix3::Identity();
  node.at("base").require_object({"quaternion", "axis_angle", "euler_degrees"});
  return read_pose(node.at("base")).rotation();
}

std::vector<ControlPoint> read_control_points(const JsonNode& node) {
  std::vector<ControlPoint> points;
  for (const JsonNode& point : node.at("control_points").items(2)) {
    point.require_object({"position", "rotation_vector"});
    points.emplace_back();
    if (const auto p = point.find("position")) points.back().p_WB = p->vector3();
    if (const auto theta = point.find("rotation_vector")) points.back().theta = theta->vector3();
  }
  return points;
}

std::shared_ptr<const Motion> read_bezier(const JsonNode& node) {
  node.require_object({"kind", "interval", "base", "control_points"});
  const TimeInterval interval = read_interval(node.at("interval"));
  return std::make_shared<BezierMotion>(interval, read_base(node), read_control_points(node));
}

std::shared_ptr<const Motion> read_bspline(const JsonNode& node) {
  node.require_object({"kind", "degree", "knots", "base", "control_points"});
  std::vector<Scalar> knots;
  for (const JsonNode& knot : node.at("knots").items(4)) knots.push_back(knot.number());
  const std::int64_t degree = node.at("degree").positive_integer();
  return std::make_shared<SequenceMotion>(bspline_motion(
      static_cast<std::size_t>(degree), knots, read_base(node), read_control_points(node)));
}

std::shared_ptr<const Motion> read_hermite(const JsonNode& node) {
  node.require_object({"kind", "interval", "from", "to"});
  const auto read_state = [](const JsonNode& state) {
    state.require_object({"pose", "velocity"});
    return MotionState{read_pose(state.at("pose")), read_twist(state.at("velocity"))};
  };
  return std::make_shared<HermiteMotion>(read_interval(node.at("interval")),
                                         read_state(node.at("from")), read_state(node.at("to")));
}

std::shared_ptr<const Motion> read_composed(const JsonNode& node) {
  node.require_object({"kind", "carrier", "relative"});
  return std::make_shared<ComposedMotion>(read_motion(node.at("carrier")),
                                          read_motion(node.at("relative")));
}

std::shared_ptr<const Motion> read_sequence(const JsonNode& node) {
  node.require_object({"kind", "parts"});
  std::vector<SequenceMotion::Part> parts;
  for (const JsonNode& part : node.at("parts").items(1)) {
    part.require_object({"interval", "motion"});
    parts.push_back({read_interval(part.at("interval")), read_motion(part.at("motion"))});
  }
  return std::make_shared<SequenceMotion>(std::move(parts));
}

}  // namespace

RigidPose read_pose(const JsonNode& node) {
  node.require_object({"position", "quaternion", "axis_angle", "euler_degrees"});
  const Vector3 p = node.has("position") ? node.at("position").vector3() : Vector3::Zero();
  if (node.has("quaternion") + node.has("axis_angle") + node.has("euler_degrees") > 1) {
    node.fail("expected at most one of quaternion, axis_angle, euler_degrees");
  }
  if (const auto q = node.find("quaternion")) {
    return q->guard([&] { return RigidPose(read_quaternion(*q), p); });
  }
  return node.guard([&] {
    if (node.has("axis_angle")) return RigidPose(read_axis_angle(node.at("axis_angle")), p);
    if (node.has("euler_degrees")) return RigidPose(read_euler(node.at("euler_degrees")), p);
    return RigidPose(p);
  });
}

Twist read_twist(const JsonNode& node) {
  node.require_object({"linear", "angular"});
  Twist twist;
  if (node.has("linear")) twist.v_WB = node.at("linear").vector3();
  if (node.has("angular")) twist.w_WB = node.at("angular").vector3();
  return twist;
}

std::shared_ptr<const Motion> read_motion(const JsonNode& node) {
  using Reader = std::shared_ptr<const Motion> (*)(const JsonNode&);
  const Reader read = node.at("kind").choice<Reader>({{"rest", &read_rest},
                                                      {"constant_twist", &read_constant_twist},
                                                      {"screw", &read_screw},
                                                      {"interpolated", &read_interpolated},
                                                      {"sampled", &read_sampled},
                                                      {"hermite", &read_hermite},
                                                      {"bezier", &read_bezier},
                                                      {"bspline", &read_bspline},
                                                      {"sequence", &read_sequence},
                                                      {"composed", &read_composed}});
  return node.guard([&] { return read(node); });
}

}  // namespace dyop::io_internal
