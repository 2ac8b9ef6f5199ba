// SPDX-License-Identifier: BSD-3-Clause
#include "io/query/record_motion.h"

#include <array>

#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/screw_motion.h"
#include "dyop/motion/sequence_motion.h"
#include "io/json_reader.h"

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
