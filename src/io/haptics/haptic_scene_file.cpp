// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/haptic_scene_file.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/io/mesh_file.h"
#include "dyop/tissue/soft_tissue.h"
#include "io/file_bytes.h"
#include "io/json_reader.h"

namespace dyop::io_internal {

/// The key `breathing` of a tool scene (docs/formats.md): an obstacle that moves by a
/// formula, and is cut at given times.
/// @param vertices, triangles The obstacle at the start, in world.
/// @throws FileError naming the key that is missing, out of range or unknown.
TissueFeed read_breathing(const JsonNode& node, std::size_t obstacle,
                          const std::vector<Vector3>& vertices,
                          const std::vector<TriangleIndices>& triangles);

}  // namespace dyop::io_internal

namespace dyop {
namespace {

using io_internal::Json;
using io_internal::JsonNode;

Scalar number_or(const JsonNode& node, const char* key, Scalar fallback) {
  return node.has(key) ? node.at(key).non_negative_number() : fallback;
}

std::size_t triangles_of(const JsonNode& node) {
  return std::size_t(node.at("triangles").positive_integer());
}

RigidPose read_pose(const JsonNode& node) {
  const Vector3 p = node.has("position") ? node.at("position").vector3() : Vector3::Zero();
  const Vector3 w = node.has("rotation") ? node.at("rotation").vector3() : Vector3::Zero();
  return node.guard([&] { return RigidPose(rotation_from_vector(w), p); });
}

// A generated mesh, or one from a file.
AnatomyMesh read_mesh(const JsonNode& node) {
  if (node.has("mesh")) {
    const std::filesystem::path file = node.file().parent_path() / node.at("mesh").text();
    const TriangleMesh mesh = load_mesh(file);
    return {{mesh.vertices().begin(), mesh.vertices().end()},
            {mesh.triangles().begin(), mesh.triangles().end()}};
  }
  const auto generated = [&](const char* key, AnatomyMesh (*make)(std::size_t)) {
    const JsonNode child = node.at(key);
    child.require_object({"triangles"});
    return child.guard([&] { return make(triangles_of(child)); });
  };
  const auto rod = [&](const char* key, AnatomyMesh (*make)(std::size_t, Scalar, Scalar)) {
    const JsonNode child = node.at(key);
    child.require_object({"triangles", "radius", "length"});
    return child.guard([&] {
      return make(triangles_of(child), child.at("radius").positive_number(),
                  child.at("length").positive_number());
    });
  };
  if (node.has("liver")) return generated("liver", make_liver);
  if (node.has("vessel")) return generated("vessel", make_vessel);
  if (node.has("wall")) return generated("wall", make_wall);
  if (node.has("shaft")) return rod("shaft", make_shaft);
  if (node.has("jaw")) return rod("jaw", make_jaw);
  node.fail("expected one of mesh, liver, vessel, wall, shaft, jaw");
}

HapticTool read_tool(const JsonNode& node) {
  HapticTool tool;
  tool.X_WT = read_pose(node);
  if (node.has("hinges")) {
    for (const JsonNode& item : node.at("hinges").items()) {
      item.require_object({"position", "rotation", "angle", "stiffness"});
      const Scalar angle = item.has("angle") ? item.at("angle").number() : 0;
      tool.hinges.push_back({read_pose(item), angle, item.at("stiffness").positive_number()});
    }
  }
  for (const JsonNode& item : node.at("parts").items(1)) {
    item.require_object({"mesh", "shaft", "jaw", "position", "rotation", "hinge"});
    const AnatomyMesh mesh = read_mesh(item);
    ToolPart part;
    part.shape = item.guard(
        [&] { return std::make_shared<const TriangleMesh>(mesh.vertices, mesh.triangles); });
    part.X_TP = read_pose(item);
    if (item.has("hinge")) part.hinge = std::size_t(item.at("hinge").positive_integer() - 1);
    tool.parts.push_back(std::move(part));
  }
  if (!node.has("trocar")) return tool;
  const JsonNode trocar = node.at("trocar");
  trocar.require_object({"position", "point", "axis"});
  tool.trocar.emplace();
  tool.trocar->p_W = trocar.at("position").vector3();
  if (trocar.has("point")) tool.trocar->p_T = trocar.at("point").vector3();
  if (trocar.has("axis")) tool.trocar->axis_T = trocar.at("axis").vector3();
  if (!(tool.trocar->axis_T.norm() > 0)) trocar.at("axis").fail("must not be zero");
  return tool;
}

CouplingOptions read_coupling(const JsonNode& node, Scalar period) {
  node.require_object({"stiffness", "damping", "rotational_stiffness", "rotational_damping",
                       "largest_force", "largest_torque", "device_damping",
                       "device_rotational_damping"});
  CouplingOptions springs;
  springs.stiffness.setConstant(node.at("stiffness").positive_number());
  springs.damping.setConstant(number_or(node, "damping", 0));
  springs.rotational_stiffness.setConstant(node.at("rotational_stiffness").positive_number());
  springs.rotational_damping.setConstant(number_or(node, "rotational_damping", 0));
  springs.largest_force = number_or(node, "largest_force", kInfinity);
  springs.largest_torque = number_or(node, "largest_torque", kInfinity);
  springs.device_damping = number_or(node, "device_damping", 0);
  springs.device_rotational_damping = number_or(node, "device_rotational_damping", 0);
  springs.period = period;
  return springs;
}

void read_tools(const JsonNode& root, const HapticRun& run, HapticScene& scene) {
  const JsonNode first = root.at("tool");
  first.require_object({"parts", "hinges", "position", "rotation", "trocar"});
  HapticTool tool = read_tool(first);
  scene.tool = std::move(tool.parts);
  scene.hinges = std::move(tool.hinges);
  scene.X_WT = tool.X_WT;
  scene.trocar = tool.trocar;
  scene.tool_margin = number_or(root, "tool_margin", 0);
  scene.tool_friction = number_or(root, "tool_friction", 0);
  if (!root.has("more_tools")) return;
  for (const JsonNode& item : root.at("more_tools").items()) {
    item.require_object({"parts", "hinges", "position", "rotation", "trocar", "coupling"});
    scene.more_tools.push_back(read_tool(item));
    if (!item.has("coupling")) continue;
    scene.more_tools.back().coupling = read_coupling(item.at("coupling"), run.runner.period);
  }
}

void read_mapping(const JsonNode& node, DeviceMappingOptions& mapping) {
  node.require_object({"rotation", "scale", "rotation_scale"});
  mapping.R_WV = read_pose(node).rotation();
  if (node.has("scale")) mapping.scale = node.at("scale").positive_number();
  if (node.has("rotation_scale")) {
    mapping.rotation_scale = node.at("rotation_scale").positive_number();
  }
}

ToolObstacle read_obstacle(const JsonNode& node) {
  node.require_object({"name", "role", "margin", "friction", "stiffness", "mesh", "liver", "vessel",
                       "wall", "position", "rotation", "breathing", "elastic"});
  if (node.has("breathing") && node.has("elastic")) {
    node.fail("expected breathing or elastic, not both");
  }
  ToolObstacle obstacle;
  obstacle.name = node.at("name").text();
  obstacle.role = node.at("role").choice<ObstacleRole>({{"tissue", ObstacleRole::Tissue},
                                                        {"hard", ObstacleRole::HardRegion},
                                                        {"soft", ObstacleRole::SoftRegion},
                                                        {"monitor", ObstacleRole::Monitor}});
  obstacle.margin = number_or(node, "margin", 0);
  obstacle.friction = number_or(node, "friction", 0);
  obstacle.soft_stiffness = number_or(node, "stiffness", 0);
  AnatomyMesh mesh = read_mesh(node);
  const RigidPose X_WO = read_pose(node);
  for (Vector3& p : mesh.vertices) p = X_WO * p;
  if (node.has("breathing") || node.has("elastic")) {
    obstacle.vertices = std::move(mesh.vertices);
    obstacle.triangles = std::move(mesh.triangles);
  } else {
    obstacle.shape = node.guard([&] {
      return std::make_shared<const TriangleMesh>(std::move(mesh.vertices),
                                                  std::move(mesh.triangles));
    });
  }
  return obstacle;
}

// The key `cuts` of `elastic`.
std::vector<ModelledCut> read_kerfs(const JsonNode& node, Scalar period) {
  std::vector<ModelledCut> cuts;
  Scalar last = 0;
  for (const JsonNode& item : node.items(1)) {
    item.require_object({"t", "blade"});
    const Scalar t = item.at("t").positive_number();
    constexpr Scalar kMostSteps = 1e15;  // no run has as many
    if (t < last || !(t / period < kMostSteps)) item.at("t").fail("cuts must be in order of time");
    last = t;
    const JsonNode blade = item.at("blade");
    blade.require_object({"position", "rotation", "size"});
    const JsonNode size = blade.at("size");
    const TissueKerf kerf{read_pose(blade), size.vector3() / 2};
    if (!(kerf.half_extents.minCoeff() > 0)) size.fail("expected three numbers > 0");
    cuts.push_back({std::llround(t / period), kerf});
  }
  return cuts;
}

// The key `elastic`: an obstacle of soft tissue that answers the tool.
TissueFeed read_elastic(const JsonNode& node, const HapticRun& run) {
  node.require_object({"youngs_modulus", "poissons_ratio", "density", "drag", "viscosity", "cube",
                       "rate", "gravity", "fixed", "cuts"});
  SoftTissueOptions options;
  options.material.youngs_modulus = node.at("youngs_modulus").positive_number();
  options.material.poissons_ratio = node.at("poissons_ratio").number();
  options.material.density = node.at("density").positive_number();
  options.material.drag = number_or(node, "drag", 0);
  options.material.viscosity = number_or(node, "viscosity", 0);
  options.cube_edge = node.at("cube").positive_number();
  options.period = 1 / node.at("rate").positive_number();
  if (node.has("gravity")) options.gravity_W = node.at("gravity").vector3();
  for (const JsonNode& item : node.at("fixed").items()) {
    item.require_object({"min", "max"});
    options.fixed.emplace_back(item.at("min").vector3(), item.at("max").vector3());
  }
  const ToolObstacle& obstacle = run.scene.obstacles.back();
  ModelledObstacle modelled =
      modelled_obstacle(run.scene, run.options, run.scene.obstacles.size() - 1);
  if (node.has("cuts")) modelled.cuts = read_kerfs(node.at("cuts"), options.period);
  TissueFeed feed;
  feed.obstacle = run.scene.obstacles.size() - 1;
  feed.period = options.period;
  feed.model = node.guard([&] {
    return std::make_shared<SoftTissueModel>(
        SoftTissue(TriangleMesh(obstacle.vertices, obstacle.triangles), options), modelled);
  });
  return feed;
}

void read_options(const JsonNode& root, HapticRun& run) {
  HapticOptions& options = run.options;
  options.rest_offset = root.at("rest_offset").positive_number();
  options.recovery_speed = root.at("recovery_speed").positive_number();
  if (root.has("max_work")) options.max_work = root.at("max_work").positive_integer();
  if (root.has("device_speed")) {
    options.largest_device_speed = root.at("device_speed").positive_number();
  }
  run.runner.period = 1 / root.at("rate").positive_number();
  options.coupling = read_coupling(root.at("coupling"), run.runner.period);
  if (root.has("deadline")) {
    constexpr Scalar kNanosecondsPerSecond = 1e9;
    run.runner.deadline = std::chrono::nanoseconds(
        std::int64_t(kNanosecondsPerSecond * root.at("deadline").positive_number()));
  }
}

std::vector<DevicePoint> read_path(const JsonNode& node, std::size_t hinge_count) {
  std::vector<DevicePoint> points;
  for (const JsonNode& item : node.items(2)) {
    item.require_object({"t", "position", "rotation", "angles"});
    DevicePoint point{item.at("t").non_negative_number(), DevicePose(read_pose(item))};
    const std::vector<JsonNode> angles =
        item.has("angles") ? item.at("angles").items() : std::vector<JsonNode>{};
    if (angles.size() != hinge_count) {
      item.fail("expected as many angles as hinges, " + std::to_string(hinge_count));
    }
    for (std::size_t k = 0; k < angles.size(); ++k) point.pose.angles[k] = angles[k].number();
    const bool is_first = points.empty();
    if (is_first ? point.t != 0 : !(point.t > points.back().t)) {
      item.fail("times must ascend from 0");
    }
    points.push_back(point);
  }
  return points;
}

ToolStroke read_stroke(const JsonNode& node, const HapticScene& scene) {
  node.require_object({"name", "path", "more_paths"});
  ToolStroke stroke{node.at("name").text(), read_path(node.at("path"), scene.hinges.size())};
  const std::vector<JsonNode> more =
      node.has("more_paths") ? node.at("more_paths").items() : std::vector<JsonNode>{};
  if (more.size() != scene.more_tools.size()) {
    node.fail("expected as many more_paths as more_tools, " +
              std::to_string(scene.more_tools.size()));
  }
  for (std::size_t k = 0; k < more.size(); ++k) {
    stroke.more_points.push_back(read_path(more[k], scene.more_tools[k].hinges.size()));
  }
  return stroke;
}

// A stroke and the time since its start.
struct StrokePlace {
  std::size_t stroke;
  Scalar t;
};

StrokePlace place_of(const std::vector<ToolStroke>& strokes, Scalar t) {
  Scalar whole = 0;
  for (const ToolStroke& stroke : strokes) whole += stroke.duration();
  StrokePlace place{0, std::fmod(t, whole)};
  while (place.stroke + 1 < strokes.size() && place.t >= strokes[place.stroke].duration()) {
    place.t -= strokes[place.stroke].duration();
    ++place.stroke;
  }
  return place;
}

}  // namespace

std::size_t HapticRun::stroke_at(std::int64_t tick) const {
  return place_of(strokes, Scalar(tick) * runner.period).stroke;
}

DevicePose HapticRun::device(std::int64_t tick, std::size_t tool) const {
  const auto [number, t] = place_of(strokes, Scalar(tick) * runner.period);
  const std::vector<DevicePoint>& points =
      tool == 0 ? strokes[number].points : strokes[number].more_points.at(tool - 1);
  std::size_t next = 1;
  while (next + 1 < points.size() && points[next].t < t) ++next;
  const DevicePoint& from = points[next - 1];
  const DevicePoint& to = points[next];
  const Scalar s = std::clamp((t - from.t) / (to.t - from.t), Scalar{0}, Scalar{1});
  DevicePose pose;
  pose.p_WD = from.pose.p_WD + s * (to.pose.p_WD - from.pose.p_WD);
  pose.q_WD = from.pose.q_WD.slerp(s, to.pose.q_WD);
  for (std::size_t k = 0; k < kMostHinges; ++k) {
    pose.angles[k] = from.pose.angles[k] + s * (to.pose.angles[k] - from.pose.angles[k]);
  }
  return pose;
}

HapticRun parse_haptic_run(const std::filesystem::path& file, const std::string& text) {
  const Json json = io_internal::parse_json(file, text);
  const JsonNode root(file, json);
  root.require_object({"title", "tool", "more_tools", "tool_margin", "tool_friction", "obstacles",
                       "coupling", "rest_offset", "recovery_speed", "max_work", "device_speed",
                       "device", "rate", "deadline", "duration", "strokes"});
  HapticRun run;
  run.text = text;
  if (root.has("title")) run.title = root.at("title").text();
  read_options(root, run);
  if (root.has("device")) read_mapping(root.at("device"), run.mapping.emplace());
  read_tools(root, run, run.scene);
  for (const JsonNode& item : root.at("obstacles").items()) {
    run.scene.obstacles.push_back(read_obstacle(item));
    if (item.has("elastic")) run.tissue.push_back(read_elastic(item.at("elastic"), run));
    if (!item.has("breathing")) continue;
    const ToolObstacle& obstacle = run.scene.obstacles.back();
    run.tissue.push_back(io_internal::read_breathing(item.at("breathing"),
                                                     run.scene.obstacles.size() - 1,
                                                     obstacle.vertices, obstacle.triangles));
  }
  for (const JsonNode& item : root.at("strokes").items(1)) {
    run.strokes.push_back(read_stroke(item, run.scene));
  }
  const Scalar duration = root.at("duration").positive_number();
  run.runner.ticks = std::llround(duration / run.runner.period);
  return run;
}

TissueFeed feed_of_formula(const std::filesystem::path& file, const std::string& formula,
                           std::size_t obstacle, const HapticScene& scene) {
  const Json json = io_internal::parse_json(file, formula);
  const ToolObstacle& at_start = scene.obstacles.at(obstacle);
  return io_internal::read_breathing(JsonNode(file, json), obstacle, at_start.vertices,
                                     at_start.triangles);
}

HapticRun load_haptic_run(const std::filesystem::path& file) {
  return parse_haptic_run(file, io_internal::read_bytes(file));
}

}  // namespace dyop

namespace dyop::io_internal {
namespace {

// What is left of the obstacle from a snapshot on.
struct Cut {
  std::int64_t number;
  std::vector<TriangleIndices> triangles;
};

// A formula for every snapshot, whichever were asked for before.
struct Breathing {
  Scalar frequency;
  Vector3 amplitude;
  Scalar period;  // of snapshots
  std::vector<Vector3> rest;
  std::vector<Cut> cuts;

  // Every vertex oscillates, with a lag that grows along the mesh.
  void place(std::int64_t number, std::span<Vector3> shape) const {
    const Scalar phase = 2 * std::numbers::pi * frequency * period * Scalar(number);
    constexpr Scalar kLag = 0.005;  // radians per millimetre
    for (std::size_t k = 0; k < shape.size(); ++k) {
      const Vector3& p = rest[k];
      const Scalar lag = kLag * p.x();
      shape[k] = p + amplitude * (std::sin(phase - lag) + std::sin(lag));
    }
  }

  // Where the snapshot before put them; all vertices, so that the formula goes on.
  std::optional<TissueMesh> cut(std::int64_t number) const {
    const auto found = std::find_if(cuts.begin(), cuts.end(),
                                    [&](const Cut& cut) { return cut.number == number; });
    if (found == cuts.end()) return std::nullopt;
    TissueMesh mesh{rest, found->triangles};
    place(number - 1, mesh.vertices);
    return mesh;
  }
};

// Takes away the triangles that have a corner in a ball, as the obstacle stands at the start.
Cut read_cut(const JsonNode& node, const Breathing& before,
             const std::vector<TriangleIndices>& triangles) {
  node.require_object({"t", "position", "radius"});
  const JsonNode time = node.at("t");
  const std::int64_t last = before.cuts.empty() ? 0 : before.cuts.back().number;
  // No run has as many snapshots as that.
  constexpr Scalar kMostSnapshots = 1e15;
  const Scalar number = std::round(time.positive_number() / before.period);
  if (!(number > Scalar(last) && number < kMostSnapshots)) {
    time.fail("cuts must be at least a snapshot apart, and after the first");
  }
  const Vector3 center = node.at("position").vector3();
  const Scalar radius = node.at("radius").positive_number();
  Cut cut{std::int64_t(number), triangles};
  std::erase_if(cut.triangles, [&](const TriangleIndices& corners) {
    return std::any_of(corners.begin(), corners.end(), [&](std::int32_t corner) {
      return (before.rest[std::size_t(corner)] - center).norm() < radius;
    });
  });
  if (cut.triangles.size() == triangles.size()) node.fail("no triangle has a corner in the ball");
  if (cut.triangles.empty()) node.fail("nothing is left of the obstacle");
  return cut;
}

}  // namespace

TissueFeed read_breathing(const JsonNode& node, std::size_t obstacle,
                          const std::vector<Vector3>& vertices,
                          const std::vector<TriangleIndices>& triangles) {
  node.require_object({"frequency", "amplitude", "rate", "cuts"});
  const auto breathing = std::make_shared<Breathing>();
  breathing->frequency = node.at("frequency").positive_number();
  breathing->amplitude = node.at("amplitude").vector3();
  breathing->period = 1 / node.at("rate").positive_number();
  breathing->rest = vertices;
  if (node.has("cuts")) {
    for (const JsonNode& item : node.at("cuts").items(1)) {
      const auto& cuts = breathing->cuts;
      breathing->cuts.push_back(
          read_cut(item, *breathing, cuts.empty() ? triangles : cuts.back().triangles));
    }
  }
  TissueFeed feed;
  feed.obstacle = obstacle;
  feed.period = breathing->period;
  feed.formula = node.value().dump();
  feed.shape = [breathing](std::int64_t number, std::span<Vector3> shape) {
    breathing->place(number, shape);
  };
  if (!breathing->cuts.empty()) {
    feed.cut = [breathing](std::int64_t number) { return breathing->cut(number); };
  }
  return feed;
}

}  // namespace dyop::io_internal
