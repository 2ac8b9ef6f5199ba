// Runs the rigid scenes of [Ferguson2021] and lets CGAL look for bodies that intersect:
// outside_rigid_scenes [END [TIMES [SCENE...]]]. END: time at which a scene is ended, if it does
// not end before (default 0.02); TIMES: how many times between any two recorded ones are looked at
// (default 1); SCENE: names of scenes, without them all. They are looked for in the folder that
// DYOP_EXTERNAL_DATA names; without it the program says so and returns 77 (skipped). The exit code
// is 1 if bodies intersect, energy is won, or a scene does not get to its end.
//
// Coefficients of restitution and friction are zero where a scene has none. The rotation of a body
// that may not turn has a rotational inertia 1e12 times its own.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/io/mesh_file.h"
#include "dyop/scene_io/run_recording.h"
#include "dyop/scene_io/scene_file.h"
#include "support/recording_oracle.h"

namespace dyop::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kSkipped = 77;
constexpr Scalar kRadiansPerDegree = std::numbers::pi_v<Scalar> / 180;

Vector3 vector_or_zero(const Json& body, const char* key) {
  if (!body.contains(key)) return Vector3::Zero();
  const Json& value = body.at(key);
  return {value.at(0).get<Scalar>(), value.at(1).get<Scalar>(), value.at(2).get<Scalar>()};
}

Quaternion rotation_of(const Json& body) {
  const Vector3 angles = kRadiansPerDegree * vector_or_zero(body, "rotation");
  return Eigen::AngleAxis<Scalar>(angles.z(), Vector3::UnitZ()) *
         Eigen::AngleAxis<Scalar>(angles.y(), Vector3::UnitY()) *
         Eigen::AngleAxis<Scalar>(angles.x(), Vector3::UnitX());
}

std::shared_ptr<const TriangleMesh> shape_of(const Json& body, const fs::path& meshes) {
  const TriangleMesh mesh = load_mesh(meshes / body.at("mesh").get<std::string>());
  Vector3 scale = Vector3::Ones();
  if (body.contains("scale") && body.at("scale").is_array())
    scale = vector_or_zero(body, "scale");
  else if (body.contains("scale"))
    scale *= body.at("scale").get<Scalar>();
  std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
  for (Vector3& vertex : vertices) vertex = vertex.cwiseProduct(scale);
  return std::make_shared<TriangleMesh>(mesh.with_vertices(vertices));
}

// How many of the coordinates from `first` on are fixed; of three.
int fixed_count(const Json& body, std::size_t first) {
  if (!body.contains("is_dof_fixed")) return 0;
  const Json& fixed = body.at("is_dof_fixed");
  if (fixed.is_boolean()) return fixed.get<bool>() ? 3 : 0;
  int count = 0;
  for (std::size_t i = first; i < first + 3; ++i) count += fixed.at(i).get<bool>();
  return count;
}

BodyDefinition read_body(const Json& body, const fs::path& meshes) {
  BodyDefinition definition;
  definition.shape = shape_of(body, meshes);
  const int fixed_translations = fixed_count(body, 0), fixed_rotations = fixed_count(body, 3);
  const std::string type = body.value("type", "dynamic");
  const bool is_static = type == "static" || fixed_translations + fixed_rotations == 6;
  if (type == "kinematic" || (!is_static && (fixed_translations > 0 || fixed_rotations % 3 > 0))) {
    throw std::runtime_error("kinematic and half fixed bodies are not supported");
  }
  definition.kind = is_static ? BodyKind::Static : BodyKind::Dynamic;
  definition.initial.X_WB = RigidPose(rotation_of(body), vector_or_zero(body, "position"));
  if (is_static) return definition;
  MassProperties& mass = definition.mass_properties;
  mass = definition.shape->compute_mass_properties(body.value("density", 1000.0));
  if (fixed_rotations == 3) mass.I_BBcm *= 1e12;
  Twist& twist = definition.initial.twist;
  twist.w_WB = kRadiansPerDegree * vector_or_zero(body, "angular_velocity");
  const Vector3 p_BoBcm_W = definition.initial.X_WB.rotation() * mass.p_BoBcm;
  twist.v_WB = vector_or_zero(body, "linear_velocity") - twist.w_WB.cross(p_BoBcm_W);
  return definition;
}

Scene read_scene(const fs::path& file, const fs::path& meshes, Scalar end) {
  std::ifstream in(file);
  const Json json = Json::parse(in);
  const Json& problem = json.at("rigid_body_problem");
  Scene scene;
  scene.title = file.stem().string();
  scene.source = json.dump();
  scene.end_time = std::min(end, json.at("max_time").get<Scalar>());
  scene.step = json.value("timestep", 0.01);
  scene.options.gravity_W = vector_or_zero(problem, "gravity");
  // literal: small, so that lifting what begins below its rest gap is no energy to speak of
  scene.options.target_distance = 1e-5;
  // literal: as above
  scene.options.standoff = 4e-5;
  std::vector<int> groups;
  for (const Json& body : problem.at("rigid_bodies")) {
    if (!body.value("enabled", true)) continue;
    scene.bodies.push_back(read_body(body, meshes));
    BodyDefinition& definition = scene.bodies.back();
    definition.name = "body " + std::to_string(scene.bodies.size());
    definition.restitution = std::max(0.0, problem.value("coefficient_restitution", 0.0));
    definition.friction = problem.value("coefficient_friction", 0.0);
    scene.shape_names.push_back(body.at("mesh").get<std::string>());
    const BodyId id(groups.size());
    groups.push_back(body.value("group_id", -1));
    for (std::size_t other = 0; other < id.slot; ++other) {
      const int group = groups[other];
      if (group >= 0 && group == groups.back()) scene.disabled_pairs.emplace_back(BodyId(other), id);
    }
  }
  return scene;
}

// Kinetic and potential energy of all bodies that move.
Scalar energy(const World& world, const Vector3& gravity_W) {
  Scalar sum = world.kinetic_energy();
  for (const BodyId id : world.bodies()) {
    const BodyDefinition& body = world.body(id);
    if (body.kind != BodyKind::Dynamic) continue;
    const Vector3 p_WBcm = world.state(id).X_WB * body.mass_properties.p_BoBcm;
    sum -= body.mass_properties.mass * gravity_W.dot(p_WBcm);
  }
  return sum;
}

struct Outcome {
  RunTotals totals;
  Scalar largest_gain =
      0;  // of energy, over what was there and the work of falling a length of one
  double seconds = 0;
};

Outcome run(const Scene& scene, const fs::path& recording) {
  World world = make_world(scene);
  std::ofstream out(recording, std::ios::binary);
  RunRecorder recorder(out, scene);
  Scalar weight = 0;
  for (const BodyDefinition& body : scene.bodies) {
    if (body.kind == BodyKind::Dynamic) weight += body.mass_properties.mass;
  }
  weight *= scene.options.gravity_W.norm();
  const Scalar begin = energy(world, scene.options.gravity_W);
  const Scalar scale = world.kinetic_energy() + weight;
  Outcome outcome;
  const auto clock = std::chrono::steady_clock::now();
  bool goes_on = true;
  while (goes_on && world.time() < scene.end_time) {
    const AdvanceReport report = world.advance(std::min(scene.step, scene.end_time - world.time()));
    recorder.write(report);
    const Scalar gain = (energy(world, scene.options.gravity_W) - begin) / scale;
    outcome.largest_gain = std::max(outcome.largest_gain, gain);
    goes_on = report.status == AdvanceStatus::Completed;
  }
  recorder.finish();
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - clock).count();
  outcome.totals = recorder.totals();
  return outcome;
}

bool examine(const fs::path& file, const fs::path& meshes, Scalar end, int times_between) {
  const std::string name = file.stem().string();
  const Scene scene = read_scene(file, meshes, end);
  const fs::path recording = fs::current_path() / ("outside-" + name + ".jsonl");
  const Outcome outcome = run(scene, recording);
  const RecordingReport report = check_recording(scene, read_recording(recording), times_between);
  fs::remove(recording);
  const bool is_complete = outcome.totals.status == AdvanceStatus::Completed;
  // literal: what hops at rest win, far below what a wrong impact law would.
  const bool is_sound = outcome.largest_gain < 1e-4;
  for (const std::string& fault : report.faults) std::printf("%s\n", fault.c_str());
  std::printf("%-14s %-15s %6.3f %8lld %8lld %8lld %7zu %8.1e %8.2f\n", name.c_str(),
              std::string(outcome.totals.end()).c_str(), outcome.totals.t,
              static_cast<long long>(outcome.totals.impacts), static_cast<long long>(report.steps),
              static_cast<long long>(report.poses), report.faults.size(), outcome.largest_gain,
              outcome.seconds);
  std::fflush(stdout);
  return is_complete && is_sound && report.faults.empty();
}

int run_all(Scalar end, int times_between, const std::set<std::string>& chosen) {
  const char* data = std::getenv("DYOP_EXTERNAL_DATA");
  const fs::path folder = fs::path(data == nullptr ? "" : data) / "rigid-ipc";
  if (data == nullptr || !fs::is_directory(folder)) {
    std::printf("skipped: DYOP_EXTERNAL_DATA names no folder that holds rigid-ipc\n");
    return kSkipped;
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder / "scenes")) {
    if (entry.path().extension() != ".json") continue;
    if (chosen.empty() || chosen.contains(entry.path().stem().string())) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  if (files.size() < std::max<std::size_t>(1, chosen.size())) {
    throw std::runtime_error("not all scenes asked for are in " + folder.string());
  }
  std::printf("%-14s %-15s %6s %8s %8s %8s %7s %8s %8s\n", "scene", "end", "time", "impacts",
              "steps", "poses", "faults", "gain", "seconds");
  bool is_good = true;
  for (const fs::path& file : files) {
    is_good &= examine(file, folder / "meshes", end, times_between);
  }
  return is_good ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int count, char** arguments) {
  try {
    const double end = count > 1 ? std::atof(arguments[1]) : 0.02;
    const int times_between = count > 2 ? std::atoi(arguments[2]) : 1;
    if (!(end > 0) || times_between < 0)
      throw std::runtime_error("expected END > 0 and TIMES >= 0");
    const std::set<std::string> chosen(arguments + std::min(count, 3), arguments + count);
    return dyop::testing::run_all(end, times_between, chosen);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "outside_rigid_scenes: %s\n", error.what());
    return 2;
  }
}
