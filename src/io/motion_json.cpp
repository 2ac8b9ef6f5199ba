// SPDX-License-Identifier: BSD-3-Clause
#include "io/motion_json.h"

#include <array>
#include <numbers>

#include "dyop/io/motion_file.h"
#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "io/file_bytes.h"
#include "io/json_reader.h"

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

namespace dyop {

std::shared_ptr<const Motion> load_motion(const std::filesystem::path& file) {
  const io_internal::Json json = io_internal::parse_json(file, io_internal::read_bytes(file));
  return io_internal::read_motion(io_internal::JsonNode(file, json));
}

}  // namespace dyop

namespace dyop::io_internal {
namespace {

using MotionPointer = std::shared_ptr<const Motion>;

Json interval_json(const TimeInterval& interval) {
  return Json::array({hex_json(interval.begin), hex_json(interval.end)});
}

TimeInterval interval_from(const JsonNode& node) {
  const std::vector<JsonNode> ends = node.items(2);
  return {hex_number(ends[0]), hex_number(ends[1])};
}

Json motion_json(const RestMotion& motion) {
  return {{"X_WB", hex_json(motion.pose(0))}};
}

MotionPointer recorded_rest(const JsonNode& node) {
  node.require_object({"kind", "X_WB"});
  return std::make_shared<RestMotion>(hex_pose(node.at("X_WB")));
}

Json motion_json(const ConstantTwistMotion& motion) {
  const Twist twist = motion.twist(0);
  return {{"X_WB0", hex_json(motion.X_WB0())},
          {"v_WB", hex_json(twist.v_WB)},
          {"w_WB", hex_json(twist.w_WB)},
          {"t0", hex_json(motion.t0())}};
}

MotionPointer recorded_constant_twist(const JsonNode& node) {
  node.require_object({"kind", "X_WB0", "v_WB", "w_WB", "t0"});
  const Twist twist{hex_vector(node.at("v_WB")), hex_vector(node.at("w_WB"))};
  return std::make_shared<ConstantTwistMotion>(hex_pose(node.at("X_WB0")), twist,
                                               hex_number(node.at("t0")));
}

Json motion_json(const ScrewMotion& motion) {
  const ScrewMotion::Screw& screw = motion.screw();
  return {{"X_WB0", hex_json(motion.X_WB0())},        {"p_WA", hex_json(screw.p_WA)},
          {"axis_W", hex_json(screw.axis_W)},         {"turn_rate", hex_json(screw.turn_rate)},
          {"slide_rate", hex_json(screw.slide_rate)}, {"t0", hex_json(motion.t0())}};
}

MotionPointer recorded_screw(const JsonNode& node) {
  node.require_object({"kind", "X_WB0", "p_WA", "axis_W", "turn_rate", "slide_rate", "t0"});
  ScrewMotion::Screw screw;
  screw.p_WA = hex_vector(node.at("p_WA"));
  screw.axis_W = hex_vector(node.at("axis_W"));
  screw.turn_rate = hex_number(node.at("turn_rate"));
  screw.slide_rate = hex_number(node.at("slide_rate"));
  return std::make_shared<ScrewMotion>(hex_pose(node.at("X_WB0")), screw,
                                       hex_number(node.at("t0")));
}

Json node_json(const InterpolatedMotion::Node& node) {
  return {{"p_WB", hex_json(node.p_WB)}, {"theta", hex_json(node.theta)}};
}

InterpolatedMotion::Node interpolated_node(const JsonNode& node) {
  node.require_object({"p_WB", "theta"});
  return {hex_vector(node.at("p_WB")), hex_vector(node.at("theta"))};
}

Json motion_json(const InterpolatedMotion& motion) {
  return {{"interval", interval_json(motion.domain())},
          {"X_WC", hex_json(motion.X_WC())},
          {"begin", node_json(motion.begin())},
          {"end", node_json(motion.end())}};
}

MotionPointer recorded_interpolated(const JsonNode& node) {
  node.require_object({"kind", "interval", "X_WC", "begin", "end"});
  return std::make_shared<InterpolatedMotion>(InterpolatedMotion::from_chart(
      interval_from(node.at("interval")), hex_pose(node.at("X_WC")),
      interpolated_node(node.at("begin")), interpolated_node(node.at("end"))));
}

Json node_json(const HermiteNode& node) {
  return {{"p_WB", hex_json(node.p_WB)},
          {"v_WB", hex_json(node.v_WB)},
          {"theta", hex_json(node.theta)},
          {"theta_rate", hex_json(node.theta_rate)}};
}

HermiteNode hermite_node(const JsonNode& node) {
  node.require_object({"p_WB", "v_WB", "theta", "theta_rate"});
  return {hex_vector(node.at("p_WB")), hex_vector(node.at("v_WB")), hex_vector(node.at("theta")),
          hex_vector(node.at("theta_rate"))};
}

Json motion_json(const HermiteMotion& motion) {
  return {{"interval", interval_json(motion.domain())},
          {"X_WC", hex_json(motion.X_WC())},
          {"begin", node_json(motion.begin())},
          {"end", node_json(motion.end())}};
}

MotionPointer recorded_hermite(const JsonNode& node) {
  node.require_object({"kind", "interval", "X_WC", "begin", "end"});
  return std::make_shared<HermiteMotion>(
      HermiteMotion::from_chart(interval_from(node.at("interval")), hex_pose(node.at("X_WC")),
                                hermite_node(node.at("begin")), hermite_node(node.at("end"))));
}

Json motion_json(const SampledMotion& motion) {
  Json samples = Json::array();
  for (const SampledMotion::Sample& sample : motion.samples()) {
    samples.push_back({{"t", hex_json(sample.t)}, {"X_WB", hex_json(sample.X_WB)}});
  }
  return {{"samples", samples}};
}

MotionPointer recorded_sampled(const JsonNode& node) {
  node.require_object({"kind", "samples"});
  std::vector<SampledMotion::Sample> samples;
  for (const JsonNode& item : node.at("samples").items(2)) {
    item.require_object({"t", "X_WB"});
    samples.push_back({hex_number(item.at("t")), hex_pose(item.at("X_WB"))});
  }
  return std::make_shared<SampledMotion>(samples);
}

Json motion_json(const ComposedMotion& motion) {
  return {{"X_WM", record_motion(motion.outer())}, {"X_MB", record_motion(motion.inner())}};
}

MotionPointer recorded_composed(const JsonNode& node) {
  node.require_object({"kind", "X_WM", "X_MB"});
  MotionPointer X_WM = recorded_motion(node.at("X_WM"));
  return std::make_shared<ComposedMotion>(std::move(X_WM), recorded_motion(node.at("X_MB")));
}

Json motion_json(const BezierMotion& motion) {
  Json points = Json::array();
  for (const ControlPoint& point : motion.control_points()) {
    points.push_back({{"p_WB", hex_json(point.p_WB)}, {"theta", hex_json(point.theta)}});
  }
  return {{"interval", interval_json(motion.domain())},
          {"X_WC", hex_json(motion.X_WC())},
          {"control_points", points}};
}

MotionPointer recorded_bezier(const JsonNode& node) {
  node.require_object({"kind", "interval", "X_WC", "control_points"});
  std::vector<ControlPoint> points;
  for (const JsonNode& item : node.at("control_points").items(1)) {
    item.require_object({"p_WB", "theta"});
    points.push_back({hex_vector(item.at("p_WB")), hex_vector(item.at("theta"))});
  }
  return std::make_shared<BezierMotion>(interval_from(node.at("interval")),
                                        hex_pose(node.at("X_WC")), points);
}

Json motion_json(const SequenceMotion& motion) {
  Json parts = Json::array();
  for (const SequenceMotion::Part& part : motion.parts()) {
    parts.push_back(
        {{"interval", interval_json(part.interval)}, {"motion", record_motion(*part.motion)}});
  }
  return {{"parts", parts}};
}

MotionPointer recorded_sequence(const JsonNode& node) {
  node.require_object({"kind", "parts"});
  std::vector<SequenceMotion::Part> parts;
  for (const JsonNode& item : node.at("parts").items(1)) {
    item.require_object({"interval", "motion"});
    parts.push_back({interval_from(item.at("interval")), recorded_motion(item.at("motion"))});
  }
  return std::make_shared<SequenceMotion>(std::move(parts));
}

struct Kind {
  std::string_view name;
  std::optional<Json> (*write)(const Motion& motion);  // nothing for other kinds
  MotionPointer (*read)(const JsonNode& node);
};

template <typename Type>
std::optional<Json> write_as(const Motion& motion) {
  const auto* typed = dynamic_cast<const Type*>(&motion);
  if (typed == nullptr) return std::nullopt;
  return motion_json(*typed);
}

constexpr std::array kKinds{
    Kind{"rest", &write_as<RestMotion>, &recorded_rest},
    Kind{"constant_twist", &write_as<ConstantTwistMotion>, &recorded_constant_twist},
    Kind{"screw", &write_as<ScrewMotion>, &recorded_screw},
    Kind{"interpolated", &write_as<InterpolatedMotion>, &recorded_interpolated},
    Kind{"hermite", &write_as<HermiteMotion>, &recorded_hermite},
    Kind{"bezier", &write_as<BezierMotion>, &recorded_bezier},
    Kind{"sequence", &write_as<SequenceMotion>, &recorded_sequence},
    Kind{"sampled", &write_as<SampledMotion>, &recorded_sampled},
    Kind{"composed", &write_as<ComposedMotion>, &recorded_composed}};

}  // namespace

Json record_motion(const Motion& motion) {
  for (const Kind& kind : kKinds) {
    const std::optional<Json> fields = kind.write(motion);
    if (!fields) continue;
    Json json{{"kind", kind.name}};
    json.update(*fields);
    return json;
  }
  throw InvalidArgument(
      "a motion that is not dyop's own, or is made of user functions, cannot be "
      "recorded");
}

std::shared_ptr<const Motion> recorded_motion(const JsonNode& node) {
  const JsonNode kind = node.at("kind");
  const std::string name = kind.text();
  std::string names;
  for (const Kind& known : kKinds) {
    if (known.name == name) return node.guard([&] { return known.read(node); });
    names.append(names.empty() ? "one of " : ", ").append(known.name);
  }
  kind.fail_expected(names);
}

}  // namespace dyop::io_internal
