// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/tick_row.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/io/haptic_recording.h"

namespace dyop::io_internal {
namespace {

template <typename To, typename From>
void copy_numbers(const From& from, To& to) {
  for (std::size_t k = 0; k < to.size(); ++k) {
    to[k] = typename To::value_type(from[Eigen::Index(k)]);
  }
}

template <std::size_t kCount, typename Number>
auto as_vector(const std::array<Number, kCount>& numbers) {
  Eigen::Matrix<Scalar, int(kCount), 1> v;
  for (std::size_t k = 0; k < kCount; ++k) v[Eigen::Index(k)] = Scalar(numbers[k]);
  return v;
}

template <typename Unsigned>
Unsigned exactly(std::int64_t value, const char* name) {
  DYOP_REQUIRE(value >= 0 && value <= std::int64_t(std::numeric_limits<Unsigned>::max()),
               "a recording cannot hold ", name, " = ", value);
  return Unsigned(value);
}

template <typename Unsigned>
Unsigned at_most(std::int64_t value) {
  return Unsigned(std::clamp<std::int64_t>(value, 0, std::numeric_limits<Unsigned>::max()));
}

void put_clearances(const HapticTick& tick, TickRow& row) {
  Scalar least = kInfinity;
  for (std::size_t k = 0; k < tick.clearances.size(); ++k) {
    const ToolClearance& clearance = tick.clearances[k];
    row.lower[k] = float_below(clearance.lower);
    row.upper[k] = float_above(clearance.upper);
    row.time_to_breach[k] = float_below(clearance.time_to_breach);
    if (!(clearance.upper < least)) continue;
    least = clearance.upper;
    row.nearest = std::uint16_t(k);
    copy_numbers(clearance.p_WT, row.p_tool);
    copy_numbers(clearance.p_WO, row.p_obstacle);
  }
}

}  // namespace

TickShape::TickShape(const HapticScene& scene, std::int64_t file_version)
    : version(file_version), hinges(scene.hinges.size()), obstacles(scene.obstacles.size()) {
  for (const HapticTool& tool : scene.more_tools) other_hinges.push_back(tool.hinges.size());
}

TickRow::TickRow(TickShape shape)
    : device_angles(shape.hinges),
      new_snapshots(shape.obstacles),
      tool_angles(shape.hinges),
      tissue_stopped(shape.version >= 3 ? 1 : 0),
      tissue_behind(shape.version >= 7 ? 1 : 0),
      lower(shape.obstacles),
      upper(shape.obstacles),
      time_to_breach(shape.obstacles),
      shape_(std::move(shape)) {
  const std::size_t others = shape_.other_hinges.size();
  const auto angles =
      std::accumulate(shape_.other_hinges.begin(), shape_.other_hinges.end(), std::size_t{0});
  other_status.resize(others);
  other_device_p.resize(3 * others);
  other_device_q.resize(4 * others);
  other_device_angles.resize(angles);
  other_tool_p.resize(3 * others);
  other_tool_q.resize(4 * others);
  other_tool_angles.resize(angles);
  other_force.resize(3 * others);
  other_torque.resize(3 * others);
  other_energy_returned.resize(others);
  other_lower.resize(others * shape_.obstacles);
  other_upper.resize(others * shape_.obstacles);
  tools_lower.resize(others * (others + 1) / 2);
  tools_upper.resize(tools_lower.size());
  tools_p_second.resize(3 * tools_lower.size());
  tools_p_first.resize(3 * tools_lower.size());
}

namespace {

// The numbers of one of several, each with so many.
template <typename Number>
std::span<Number> part_of(std::vector<Number>& all, std::size_t count, std::size_t number) {
  return std::span(all).subspan(count * number, count);
}
template <typename Number>
std::span<const Number> part_of(const std::vector<Number>& all, std::size_t count,
                                std::size_t number) {
  return std::span(all).subspan(count * number, count);
}

template <typename To, typename From>
void copy_into(std::span<To> to, const From& from) {
  for (std::size_t k = 0; k < to.size(); ++k) to[k] = To(from[Eigen::Index(k)]);
}

Vector3 vector_of(const auto& numbers) {
  return {Scalar(numbers[0]), Scalar(numbers[1]), Scalar(numbers[2])};
}

Quaternion quaternion_of(const auto& numbers) {
  return {Scalar(numbers[3]), Scalar(numbers[0]), Scalar(numbers[1]), Scalar(numbers[2])};
}

void put_other(const ToolRecord& record, std::size_t number, std::size_t first_angle,
               TickRow& row) {
  const HapticTick& tick = record.tick;
  row.other_status[number] = std::uint8_t(tick.status);
  copy_into(part_of(row.other_device_p, 3, number), record.device.p_WD);
  copy_into(part_of(row.other_device_q, 4, number), record.device.q_WD.coeffs());
  copy_into(part_of(row.other_tool_p, 3, number), tick.tool.X_WT.translation());
  copy_into(part_of(row.other_tool_q, 4, number), tick.tool.X_WT.quaternion().coeffs());
  for (std::size_t k = 0; k < row.shape().other_hinges[number]; ++k) {
    row.other_device_angles[first_angle + k] = record.device.angles[k];
    row.other_tool_angles[first_angle + k] = float(tick.tool.angles[k]);
  }
  copy_into(part_of(row.other_force, 3, number), tick.wrench.force_W);
  copy_into(part_of(row.other_torque, 3, number), tick.wrench.torque_W);
  row.other_energy_returned[number] = float(tick.energy_returned);
  const std::size_t first = number * row.shape().obstacles;
  for (std::size_t k = 0; k < tick.clearances.size(); ++k) {
    row.other_lower[first + k] = float_below(tick.clearances[k].lower);
    row.other_upper[first + k] = float_above(tick.clearances[k].upper);
  }
}

void put_others(const TickRecord& record, TickRow& row) {
  DYOP_REQUIRE(record.others.size() == row.shape().other_hinges.size(), "a tick has ",
               record.others.size(), " further tools, the recording ",
               row.shape().other_hinges.size());
  std::size_t angle = 0;
  for (std::size_t k = 0; k < record.others.size(); ++k) {
    put_other(record.others[k], k, angle, row);
    angle += row.shape().other_hinges[k];
  }
  const std::vector<ToolClearance> pairs = record.tool_clearances();
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    row.tools_lower[k] = float_below(pairs[k].lower);
    row.tools_upper[k] = float_above(pairs[k].upper);
    copy_into(part_of(row.tools_p_second, 3, k), pairs[k].p_WT);
    copy_into(part_of(row.tools_p_first, 3, k), pairs[k].p_WO);
  }
}

ToolClearance clearance_of(float lower, float upper, Scalar margin) {
  ToolClearance clearance;
  clearance.lower = Scalar(lower);
  clearance.upper = Scalar(upper);
  clearance.is_breached = clearance.upper < margin;
  return clearance;
}

HapticStatus status_from(std::uint8_t number, std::uint32_t tick) {
  DYOP_REQUIRE(number <= std::uint8_t(HapticStatus::Outlier), "tick ", tick,
               " has the unknown status ", int(number));
  return HapticStatus(number);
}

RecordedTool other_from(const TickRow& row, std::size_t number, std::size_t first_angle,
                        std::span<const Scalar> margins) {
  RecordedTool other;
  other.status = status_from(row.other_status[number], row.number);
  other.device.p_WD = vector_of(part_of(row.other_device_p, 3, number));
  other.device.q_WD = quaternion_of(part_of(row.other_device_q, 4, number));
  other.tool.X_WT = RigidPose(quaternion_of(part_of(row.other_tool_q, 4, number)).normalized(),
                              vector_of(part_of(row.other_tool_p, 3, number)));
  for (std::size_t k = 0; k < row.shape().other_hinges[number]; ++k) {
    other.device.angles[k] = row.other_device_angles[first_angle + k];
    other.tool.angles[k] = Scalar(row.other_tool_angles[first_angle + k]);
  }
  other.wrench = {vector_of(part_of(row.other_force, 3, number)),
                  vector_of(part_of(row.other_torque, 3, number))};
  other.energy_returned = Scalar(row.other_energy_returned[number]);
  const std::size_t first = number * row.shape().obstacles;
  for (std::size_t k = 0; k < row.shape().obstacles; ++k) {
    other.clearances.push_back(
        clearance_of(row.other_lower[first + k], row.other_upper[first + k], margins[k]));
  }
  return other;
}

}  // namespace

void put_tick(const TickRecord& record, std::vector<std::int64_t>& seen, TickRow& row) {
  const HapticTick& tick = record.tick;
  row = TickRow(row.shape());
  row.number = exactly<std::uint32_t>(record.number, "the number of a tick");
  row.status = std::uint8_t(tick.status);
  row.contacts = at_most<std::uint8_t>(std::int64_t(tick.contacts.size()));
  row.dt = record.dt;
  copy_numbers(record.device.p_WD, row.device_p);
  copy_numbers(record.device.q_WD.coeffs(), row.device_q);
  std::copy_n(record.device.angles.begin(), row.device_angles.size(), row.device_angles.begin());
  if (tick.cutoff) {
    row.cutoff_checkpoint = exactly<std::uint32_t>(tick.cutoff->checkpoint, "a checkpoint");
    row.cutoff_node_pairs = exactly<std::uint32_t>(tick.cutoff->node_pairs, "node pairs");
  }
  for (std::size_t k = 0; k < seen.size(); ++k) {
    row.new_snapshots[k] = exactly<std::uint8_t>(tick.snapshots[k] - seen[k], "new snapshots");
    seen[k] = tick.snapshots[k];
  }
  copy_numbers(tick.tool.X_WT.translation(), row.tool_p);
  copy_numbers(tick.tool.X_WT.quaternion().coeffs(), row.tool_q);
  for (std::size_t k = 0; k < row.tool_angles.size(); ++k) {
    row.tool_angles[k] = float(tick.tool.angles[k]);
  }
  copy_numbers(tick.wrench.force_W, row.force);
  copy_numbers(tick.wrench.torque_W, row.torque);
  row.energy_returned = float(tick.energy_returned);
  row.tissue_lag = float(tick.tissue_lag);
  row.tissue_stopped = {float(tick.tissue_stopped)};
  row.tissue_behind = {float(tick.tissue_behind)};
  put_clearances(tick, row);
  row.latency_ns = at_most<std::uint32_t>(tick.latency.count());
  row.checkpoints = at_most<std::uint32_t>(tick.statistics.checkpoints);
  row.node_pairs = at_most<std::uint32_t>(tick.statistics.node_pairs);
  row.impact_queries = at_most<std::uint16_t>(tick.statistics.impact_queries);
  row.distance_queries = at_most<std::uint16_t>(tick.statistics.distance_queries);
  row.solves = at_most<std::uint16_t>(tick.statistics.solves);
  row.pieces = at_most<std::uint16_t>(tick.statistics.pieces);
  put_others(record, row);
  row.digest = tick_digest(tick);
  for (const ToolRecord& other : record.others) {
    row.digest = joined_digest(row.digest, tick_digest(other.tick));
  }
}

RecordedTick tick_from(const TickRow& row, const HapticScene& scene) {
  std::vector<Scalar> margins;
  for (const ToolObstacle& obstacle : scene.obstacles) margins.push_back(obstacle.margin);
  RecordedTick tick;
  tick.number = row.number;
  tick.status = status_from(row.status, row.number);
  tick.contacts = row.contacts;
  tick.dt = row.dt;
  tick.device.p_WD = as_vector(row.device_p);
  tick.device.q_WD.coeffs() = as_vector(row.device_q);
  std::copy(row.device_angles.begin(), row.device_angles.end(), tick.device.angles.begin());
  if (row.cutoff_checkpoint > 0) tick.cutoff = {row.cutoff_checkpoint, row.cutoff_node_pairs};
  tick.new_snapshots = row.new_snapshots;
  Quaternion q_WT;
  q_WT.coeffs() = as_vector(row.tool_q);
  tick.tool.X_WT = RigidPose(q_WT.normalized(), as_vector(row.tool_p));
  std::copy(row.tool_angles.begin(), row.tool_angles.end(), tick.tool.angles.begin());
  tick.wrench = {as_vector(row.force), as_vector(row.torque)};
  tick.energy_returned = Scalar(row.energy_returned);
  if (row.tissue_stopped.empty()) {
    tick.tissue_stopped = Scalar(row.tissue_lag);
  } else {
    tick.tissue_stopped = Scalar(row.tissue_stopped[0]);
    tick.tissue_lag = Scalar(row.tissue_lag);
  }
  if (!row.tissue_behind.empty()) tick.tissue_behind = Scalar(row.tissue_behind[0]);
  for (std::size_t k = 0; k < row.lower.size(); ++k) {
    ToolClearance& clearance = tick.clearances.emplace_back();
    clearance.lower = Scalar(row.lower[k]);
    clearance.upper = Scalar(row.upper[k]);
    clearance.time_to_breach = Scalar(row.time_to_breach[k]);
    clearance.is_breached = clearance.upper < margins[k];
    if (row.nearest != k) continue;
    tick.nearest = k;
    clearance.p_WT = as_vector(row.p_tool);
    clearance.p_WO = as_vector(row.p_obstacle);
  }
  tick.latency = std::chrono::nanoseconds(row.latency_ns);
  tick.statistics = {row.impact_queries, row.distance_queries, row.node_pairs,
                     row.checkpoints,    row.solves,           row.pieces};
  std::size_t angle = 0;
  for (std::size_t k = 0; k < row.other_status.size(); ++k) {
    tick.others.push_back(other_from(row, k, angle, margins));
    angle += row.shape().other_hinges[k];
  }
  for (std::size_t k = 0; k < row.tools_lower.size(); ++k) {
    tick.tool_clearances.push_back(
        clearance_of(row.tools_lower[k], row.tools_upper[k], scene.tool_margin));
    tick.tool_clearances.back().p_WT = vector_of(part_of(row.tools_p_second, 3, k));
    tick.tool_clearances.back().p_WO = vector_of(part_of(row.tools_p_first, 3, k));
  }
  tick.digest = row.digest;
  return tick;
}

}  // namespace dyop::io_internal

namespace dyop {
namespace {

// As FNV-1a, with words of 64 bits in place of bytes.
class Digest {
 public:
  void add(std::uint64_t word) {
    hash_ ^= word;
    hash_ *= 0x100000001b3u;
    hash_ ^= hash_ >> 32;
  }
  void add(std::int64_t word) { add(std::bit_cast<std::uint64_t>(word)); }
  void add(Scalar number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(const Vector3& v) {
    for (const Scalar x : v) add(x);
  }
  void add(const ToolPose& tool) {
    for (Eigen::Index k = 0; k < 3; ++k) add(Vector3(tool.X_WT.rotation().col(k)));
    add(tool.X_WT.translation());
    for (const Scalar angle : tool.angles) add(angle);
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

}  // namespace

std::uint64_t tick_digest(std::span<const HapticTick> ticks) {
  std::uint64_t digest = tick_digest(ticks.front());
  for (const HapticTick& tick : ticks.subspan(1)) {
    digest = io_internal::joined_digest(digest, tick_digest(tick));
  }
  return digest;
}

std::uint64_t tick_digest(const HapticTick& tick) {
  Digest digest;
  digest.add(std::int64_t(tick.status));
  digest.add(tick.tool);
  for (const ToolWaypoint& waypoint : tick.path) {
    digest.add(waypoint.time);
    digest.add(waypoint.tool);
  }
  digest.add(tick.wrench.force_W);
  digest.add(tick.wrench.torque_W);
  for (const ToolContactPoint& contact : tick.contacts) {
    digest.add(std::uint64_t(contact.obstacle));
    digest.add(std::uint64_t(contact.part));
    digest.add(contact.p_W);
    digest.add(contact.nhat_W);
    digest.add(contact.gap);
    digest.add(contact.force_W);
  }
  for (const ToolContactPoint& contact : tick.tool_contacts) {
    digest.add(contact.p_W);
    digest.add(contact.force_W);
  }
  for (const auto* clearances : {&tick.clearances, &tick.tool_clearances}) {
    for (const ToolClearance& clearance : *clearances) {
      digest.add(clearance.lower);
      digest.add(clearance.upper);
      digest.add(clearance.p_WT);
      digest.add(clearance.p_WO);
      digest.add(std::int64_t(clearance.is_breached));
      digest.add(clearance.time_to_breach);
    }
  }
  digest.add(tick.energy_returned);
  digest.add(tick.tissue_lag);
  digest.add(tick.tissue_stopped);
  for (const std::int64_t count : tick.snapshots) digest.add(count);
  const TickCutoff cutoff = tick.cutoff.value_or(TickCutoff{});
  digest.add(cutoff.checkpoint);
  digest.add(cutoff.node_pairs);
  return digest.value();
}

}  // namespace dyop

namespace dyop::io_internal {
namespace {

constexpr std::array<const char*, 4> kRoleNames{"tissue", "hard", "soft", "monitor"};

// JSON has no infinity.
Json limit_json(Scalar limit) {
  return limit < kInfinity ? Json(limit) : Json(nullptr);
}

Scalar limit_from(const Json& json) {
  return json.is_null() ? kInfinity : json.get<Scalar>();
}

Json axes_json(const Vector3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Vector3 axes_from(const Json& json) {
  return {json.at(0).get<Scalar>(), json.at(1).get<Scalar>(), json.at(2).get<Scalar>()};
}

}  // namespace

Json springs_json(const CouplingOptions& springs) {
  return {{"stiffness", axes_json(springs.stiffness)},
          {"damping", axes_json(springs.damping)},
          {"rotational_stiffness", axes_json(springs.rotational_stiffness)},
          {"rotational_damping", axes_json(springs.rotational_damping)},
          {"largest_force", limit_json(springs.largest_force)},
          {"largest_torque", limit_json(springs.largest_torque)},
          {"device_damping", limit_json(springs.device_damping)},
          {"device_rotational_damping", limit_json(springs.device_rotational_damping)},
          {"period", springs.period},
          {"bounds_energy", springs.bounds_energy}};
}

namespace {

Json options_json(const HapticOptions& options) {
  Json json = springs_json(options.coupling);
  json["rest_offset"] = options.rest_offset;
  json["recovery_speed"] = options.recovery_speed;
  json["max_rounds"] = options.max_rounds;
  json["max_attempts"] = options.max_attempts;
  json["max_contacts"] = options.max_contacts;
  json["clearance_tolerance"] = options.clearance_tolerance;
  json["clearance_work"] = options.clearance_work;
  json["max_work"] = options.max_work;
  json["largest_device_speed"] = limit_json(options.largest_device_speed);
  return json;
}

}  // namespace

CouplingOptions springs_from(const Json& json) {
  CouplingOptions springs;
  springs.stiffness = axes_from(json.at("stiffness"));
  springs.damping = axes_from(json.at("damping"));
  springs.rotational_stiffness = axes_from(json.at("rotational_stiffness"));
  springs.rotational_damping = axes_from(json.at("rotational_damping"));
  springs.largest_force = limit_from(json.at("largest_force"));
  springs.largest_torque = limit_from(json.at("largest_torque"));
  springs.device_damping = limit_from(json.at("device_damping"));
  springs.device_rotational_damping = limit_from(json.at("device_rotational_damping"));
  springs.period = json.at("period").get<Scalar>();
  springs.bounds_energy = json.at("bounds_energy").get<bool>();
  return springs;
}

namespace {

HapticOptions options_from(const Json& json) {
  HapticOptions options;
  options.coupling = springs_from(json);
  options.rest_offset = json.at("rest_offset").get<Scalar>();
  options.recovery_speed = json.at("recovery_speed").get<Scalar>();
  options.max_rounds = json.at("max_rounds").get<int>();
  options.max_attempts = json.at("max_attempts").get<int>();
  options.max_contacts = json.at("max_contacts").get<int>();
  options.clearance_tolerance = json.at("clearance_tolerance").get<Scalar>();
  options.clearance_work = json.value("clearance_work", options.clearance_work);
  // Older recordings know no limit.
  options.max_work = json.value("max_work", std::numeric_limits<std::int64_t>::max());
  if (json.contains("largest_device_speed")) {
    options.largest_device_speed = limit_from(json.at("largest_device_speed"));
  }
  return options;
}

Json obstacle_json(const ToolObstacle& obstacle, std::size_t shape, const TissueFeed* feed) {
  Json json{{"name", obstacle.name},
            {"role", kRoleNames.at(std::size_t(obstacle.role))},
            {"margin", obstacle.margin},
            {"friction", obstacle.friction},
            {"stiffness", obstacle.soft_stiffness},
            {"shape", shape},
            {"X_WO", pose_numbers(obstacle.X_WO)},
            {"deforms", deforms(obstacle)}};
  if (feed != nullptr && !feed->formula.empty()) {
    json["formula"] = Json::parse(feed->formula);
    json["period"] = feed->period;
  }
  return json;
}

ToolObstacle obstacle_from(const Json& json, std::span<const std::shared_ptr<const Shape>> shapes) {
  ToolObstacle obstacle;
  obstacle.name = json.at("name").get<std::string>();
  const auto role = json.at("role").get<std::string>();
  const auto* const place = std::find(kRoleNames.begin(), kRoleNames.end(), role);
  DYOP_REQUIRE(place != kRoleNames.end(), "unknown role of an obstacle: ", role);
  obstacle.role = ObstacleRole(place - kRoleNames.begin());
  obstacle.margin = json.at("margin").get<Scalar>();
  obstacle.friction = json.at("friction").get<Scalar>();
  obstacle.soft_stiffness = json.at("stiffness").get<Scalar>();
  obstacle.X_WO = pose_from_numbers(json.at("X_WO"));
  const auto number = json.at("shape").get<std::size_t>();
  DYOP_REQUIRE(number < shapes.size(), "an obstacle has the shape ", number, ", which is missing");
  if (!json.at("deforms").get<bool>()) {
    obstacle.shape = shapes[number];
    return obstacle;
  }
  const auto* mesh = dynamic_cast<const TriangleMesh*>(shapes[number].get());
  DYOP_REQUIRE(mesh != nullptr, "the shape of an obstacle that deforms is no mesh");
  obstacle.vertices.assign(mesh->vertices().begin(), mesh->vertices().end());
  obstacle.triangles.assign(mesh->triangles().begin(), mesh->triangles().end());
  return obstacle;
}

Json tool_json(const HapticTool& tool, ShapeWriter& shapes, SessionText& text) {
  Json json{{"X_WT", pose_numbers(tool.X_WT)}, {"parts", Json::array()}, {"hinges", Json::array()}};
  for (const ToolPart& part : tool.parts) {
    const std::size_t shape = shapes.add(part.shape, text.shapes, text.rows);
    json["parts"].push_back({{"shape", shape},
                             {"X_TP", pose_numbers(part.X_TP)},
                             {"hinge", part.hinge ? Json(*part.hinge) : Json(nullptr)}});
  }
  for (const ToolHinge& hinge : tool.hinges) {
    json["hinges"].push_back({{"X_TJ", pose_numbers(hinge.X_TJ)},
                              {"angle", hinge.angle},
                              {"stiffness", hinge.stiffness}});
  }
  if (tool.trocar) {
    json["trocar"] = {{"p_W", axes_json(tool.trocar->p_W)},
                      {"p_T", axes_json(tool.trocar->p_T)},
                      {"axis_T", axes_json(tool.trocar->axis_T)}};
  }
  if (tool.coupling) json["coupling"] = springs_json(*tool.coupling);
  return json;
}

HapticTool tool_from(const Json& json, std::span<const std::shared_ptr<const Shape>> shapes) {
  HapticTool tool;
  tool.X_WT = pose_from_numbers(json.at("X_WT"));
  for (const Json& item : json.at("parts")) {
    const auto number = item.at("shape").get<std::size_t>();
    DYOP_REQUIRE(number < shapes.size(), "a part has the shape ", number, ", which is missing");
    ToolPart part{shapes[number], pose_from_numbers(item.at("X_TP"))};
    if (!item.at("hinge").is_null()) part.hinge = item.at("hinge").get<std::size_t>();
    tool.parts.push_back(std::move(part));
  }
  for (const Json& item : json.at("hinges")) {
    tool.hinges.push_back({pose_from_numbers(item.at("X_TJ")), item.at("angle").get<Scalar>(),
                           item.at("stiffness").get<Scalar>()});
  }
  DYOP_REQUIRE(tool.hinges.size() <= kMostHinges, "a tool has ", tool.hinges.size(), " hinges");
  if (json.contains("trocar")) {
    const Json& trocar = json.at("trocar");
    tool.trocar = {axes_from(trocar.at("p_W")), axes_from(trocar.at("p_T")),
                   axes_from(trocar.at("axis_T"))};
  }
  if (json.contains("coupling")) tool.coupling = springs_from(json.at("coupling"));
  return tool;
}

}  // namespace

SessionText session_text(const HapticScene& scene, const HapticOptions& options,
                         std::span<const TissueFeed> tissue) {
  SessionText text;
  ShapeWriter shapes;
  Json json = tool_json(scene.tools().front(), shapes, text);
  json["obstacles"] = Json::array();
  json["options"] = options_json(options);
  for (const HapticTool& tool : scene.more_tools) {
    json["more_tools"].push_back(tool_json(tool, shapes, text));
  }
  if (!scene.more_tools.empty()) {
    json["tool_margin"] = scene.tool_margin;
    json["tool_friction"] = scene.tool_friction;
  }
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k) {
    const ToolObstacle& obstacle = scene.obstacles[k];
    const auto shape = deforms(obstacle) ? std::make_shared<const TriangleMesh>(obstacle.vertices,
                                                                                obstacle.triangles)
                                         : obstacle.shape;
    const std::size_t number = shapes.add(shape, text.shapes, text.rows);
    const auto feed = std::find_if(tissue.begin(), tissue.end(), [&](const TissueFeed& candidate) {
      return candidate.obstacle == k;
    });
    json["obstacles"].push_back(
        obstacle_json(obstacle, number, feed == tissue.end() ? nullptr : &*feed));
  }
  text.json = json.dump();
  return text;
}

StoredSession session_from(const Json& json, std::span<const std::shared_ptr<const Shape>> shapes) {
  StoredSession session;
  HapticTool first = tool_from(json, shapes);
  session.scene.tool = std::move(first.parts);
  session.scene.hinges = std::move(first.hinges);
  session.scene.X_WT = first.X_WT;
  session.scene.trocar = first.trocar;
  if (json.contains("more_tools")) {
    for (const Json& item : json.at("more_tools")) {
      session.scene.more_tools.push_back(tool_from(item, shapes));
    }
    DYOP_REQUIRE(session.scene.more_tools.size() < kMostTools, "there are ",
                 session.scene.more_tools.size(), " further tools");
    session.scene.tool_margin = json.at("tool_margin").get<Scalar>();
    session.scene.tool_friction = json.at("tool_friction").get<Scalar>();
  }
  for (const Json& item : json.at("obstacles")) {
    session.scene.obstacles.push_back(obstacle_from(item, shapes));
    SnapshotSource& source = session.sources.emplace_back();
    if (!item.contains("formula")) continue;
    source.formula = item.at("formula").dump();
    source.period = item.at("period").get<Scalar>();
  }
  session.options = options_from(json.at("options"));
  return session;
}

}  // namespace dyop::io_internal
