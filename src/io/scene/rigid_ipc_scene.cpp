// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <numbers>

#include "dyop/motion/composed_motion.h"
#include "dyop/motion/steady_motions.h"
#include "io/scene/scene_builder.h"
#include "io/scene/shape_reader.h"

namespace dyop::io_internal {
namespace {

namespace fs = std::filesystem;

constexpr Scalar kRadiansPerDegree = std::numbers::pi_v<Scalar> / 180;
constexpr Scalar kRigidIpcDensity = 1000;
constexpr Scalar kRigidIpcStep = 0.01;
constexpr Scalar kRigidIpcEnd = 10;
// literal: lengths in these scenes are metres, and bodies may start a tenth of a millimetre apart
constexpr Scalar kRigidIpcTarget = 1e-5;
// literal: as above; bodies then rest at half of that
constexpr Scalar kRigidIpcRestOffset = 4e-5;

// What is read about a body besides its BodyDefinition.
struct RigidIpcBody {
  BodyDefinition definition;
  std::string shape_name;
  std::optional<Scalar> group;
};

// The scene may lie some folders below the one that contains `meshes`.
std::vector<fs::path> mesh_folders(const fs::path& file, const std::vector<fs::path>& others) {
  constexpr int kMostFoldersUp = 4;
  std::vector<fs::path> folders;
  fs::path folder = file.parent_path();
  for (int up = 0; up <= kMostFoldersUp; ++up) {
    folders.push_back(folder / "meshes");
    folder = folder.empty() ? fs::path("..") : folder / "..";
  }
  folders.push_back(file.parent_path());
  folders.insert(folders.end(), others.begin(), others.end());
  return folders;
}

Vector3 vector_or_zero(const JsonNode& node, std::string_view key) {
  return node.has(key) ? node.at(key).vector3() : Vector3::Zero();
}

Quaternion read_rotation(const JsonNode& node) {
  const Vector3 angles = kRadiansPerDegree * vector_or_zero(node, "rotation");
  return Eigen::AngleAxis<Scalar>(angles.z(), Vector3::UnitZ()) *
         Eigen::AngleAxis<Scalar>(angles.y(), Vector3::UnitY()) *
         Eigen::AngleAxis<Scalar>(angles.x(), Vector3::UnitX());
}

// "dimensions" are the new sides of the bounding box; a flat side stays flat.
Vector3 scale_to_dimensions(const JsonNode& node, const TriangleMesh& mesh) {
  Vector3 low = Vector3::Constant(kInfinity), high = -low;
  for (const Vector3& vertex : mesh.vertices()) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  const Vector3 wanted = node.vector3();
  Vector3 scale = Vector3::Ones();
  for (int axis = 0; axis < 3; ++axis) {
    if (high[axis] > low[axis]) scale[axis] = wanted[axis] / (high[axis] - low[axis]);
  }
  if (!(scale.minCoeff() > 0)) node.fail_expected("sides > 0");
  return scale;
}

Vector3 read_scale(const JsonNode& node, const TriangleMesh& mesh) {
  if (const auto dimensions = node.find("dimensions");
      dimensions && !dimensions->value().is_null()) {
    return scale_to_dimensions(*dimensions, mesh);
  }
  const auto scale = node.find("scale");
  if (!scale) return Vector3::Ones();
  if (!scale->value().is_array()) return Vector3::Constant(scale->positive_number());
  const Vector3 factors = scale->vector3();
  if (!(factors.minCoeff() > 0)) scale->fail_expected("factors > 0");
  return factors;
}

std::shared_ptr<const TriangleMesh> read_scaled_mesh(const JsonNode& node, ShapeReader& shapes) {
  const TriangleMesh& mesh = shapes.load(node.at("mesh"));
  const Vector3 scale = read_scale(node, mesh);
  std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
  for (Vector3& vertex : vertices) vertex = vertex.cwiseProduct(scale);
  return node.guard([&] { return std::make_shared<TriangleMesh>(mesh.with_vertices(vertices)); });
}

LockedAxes read_fixed(const JsonNode& node) {
  LockedAxes locked;
  const auto fixed = node.find("is_dof_fixed");
  if (!fixed) return locked;
  std::array<bool, 6> flags{};
  if (fixed->value().is_array()) {
    const std::vector<JsonNode> items = fixed->items();
    if (items.size() != flags.size()) fixed->fail_expected("one Boolean or six");
    for (std::size_t i = 0; i < flags.size(); ++i) flags[i] = items[i].boolean();
  } else {
    flags.fill(fixed->boolean());
  }
  for (std::size_t i = 0; i < 3; ++i) {
    locked.translation[i] = flags[i];
    locked.rotation[i] = flags[i + 3];
  }
  return locked;
}

bool is_all_locked(const LockedAxes& locked) {
  bool all = true;
  for (std::size_t i = 0; i < 3; ++i) all &= locked.translation[i] && locked.rotation[i];
  return all;
}

BodyKind read_kind(const JsonNode& node, const LockedAxes& locked) {
  const auto type = node.find("type");
  const BodyKind kind = !type ? BodyKind::Dynamic
                              : type->choice<BodyKind>({{"dynamic", BodyKind::Dynamic},
                                                        {"kinematic", BodyKind::Kinematic},
                                                        {"static", BodyKind::Static}});
  return kind != BodyKind::Static && is_all_locked(locked) ? BodyKind::Static : kind;
}

// The velocity of the origin from that of the centre of mass; locked components are zero.
Twist read_mass_center_twist(const JsonNode& node, const LockedAxes& locked) {
  Twist twist;
  twist.v_WB = vector_or_zero(node, "linear_velocity");
  twist.w_WB = kRadiansPerDegree * vector_or_zero(node, "angular_velocity");
  for (std::size_t i = 0; i < 3; ++i) {
    if (locked.translation[i]) twist.v_WB[Eigen::Index(i)] = 0;
    if (locked.rotation[i]) twist.w_WB[Eigen::Index(i)] = 0;
  }
  return twist;
}

// The centre of mass moves straight on, and the body turns about it.
std::shared_ptr<const Motion> make_steady_motion(const RigidPose& X_WB, const Vector3& p_BoBcm,
                                                 const Twist& twist) {
  const RigidPose X_WC(X_WB.quaternion(), X_WB * p_BoBcm);
  const RigidPose X_CB(Quaternion::Identity(), -p_BoBcm);
  return std::make_shared<ComposedMotion>(std::make_shared<ConstantTwistMotion>(X_WC, twist),
                                          std::make_shared<RestMotion>(X_CB));
}

RigidIpcBody read_rigid_ipc_body(const JsonNode& node, ShapeReader& shapes) {
  for (const std::string_view key : {"kinematic_poses", "kinematic_max_time", "vertices"}) {
    if (node.has(key)) node.at(key).fail("this key of the format is not supported");
  }
  RigidIpcBody result;
  BodyDefinition& body = result.definition;
  const auto mesh = read_scaled_mesh(node, shapes);
  const std::string file = fs::path(node.at("mesh").text()).filename().string();
  result.shape_name =
      "mesh " + file + ", " + std::to_string(mesh->triangles().size()) + " triangles";
  body.shape = mesh;
  const LockedAxes locked = read_fixed(node);
  body.kind = read_kind(node, locked);
  body.initial.X_WB = RigidPose(read_rotation(node), vector_or_zero(node, "position"));
  if (const auto group = node.find("group_id"); group && group->number() >= 0) {
    result.group = group->number();
  }
  if (body.kind == BodyKind::Static) return result;
  const auto density = node.find("density");
  const Scalar amount = density ? density->positive_number() : kRigidIpcDensity;
  body.mass_properties = node.guard([&] {
    return mesh->is_closed() ? mesh->compute_mass_properties(amount)
                             : mesh->compute_shell_mass_properties(amount);
  });
  const Vector3& p_BoBcm = body.mass_properties.p_BoBcm;
  Twist twist = read_mass_center_twist(node, locked);
  if (body.kind == BodyKind::Kinematic) {
    body.motion = make_steady_motion(body.initial.X_WB, p_BoBcm, twist);
    return result;
  }
  body.locked = locked;
  twist.v_WB -= twist.w_WB.cross(body.initial.X_WB.rotation() * p_BoBcm);
  body.initial.twist = twist;
  if (node.has("force") || node.has("torque")) {
    BodyForces forces;
    forces.constant.force = vector_or_zero(node, "force");
    forces.constant.torque = vector_or_zero(node, "torque");
    body.wrench = make_wrench(forces, p_BoBcm);
  }
  return result;
}

void read_rigid_ipc_times(const JsonNode& root, Scene& scene) {
  const auto step = root.find("timestep");
  scene.step = step ? step->positive_number() : kRigidIpcStep;
  scene.end_time = kRigidIpcEnd;
  if (const auto end = root.find("max_time"); end && end->number() > 0) {
    scene.end_time = end->positive_number();
  } else if (const auto count = root.find("max_iterations"); count && count->number() > 0) {
    scene.end_time = scene.step * count->positive_number();
  }
  constexpr Scalar kMostSteps = 1e9;
  if (!(scene.end_time / scene.step <= kMostSteps)) {
    root.fail_expected("a timestep of at least one part in 1e9 of max_time");
  }
}

}  // namespace

bool is_rigid_ipc_scene(const JsonNode& root) {
  return root.value().is_object() && root.has("rigid_body_problem");
}

void read_rigid_ipc_scene(const JsonNode& root, const std::vector<fs::path>& mesh_directories,
                          Scene& scene) {
  const JsonNode problem = root.at("rigid_body_problem");
  read_rigid_ipc_times(root, scene);
  scene.title = root.file().stem().string();
  scene.options.gravity_W = vector_or_zero(problem, "gravity");
  scene.options.target_distance = kRigidIpcTarget;
  scene.options.rest_offset = kRigidIpcRestOffset;
  const auto friction = problem.find("coefficient_friction");
  const auto restitution = problem.find("coefficient_restitution");
  ShapeReader shapes(mesh_folders(root.file(), mesh_directories));
  std::vector<std::optional<Scalar>> groups;
  const std::vector<JsonNode> items = problem.at("rigid_bodies").items(1);
  for (std::size_t index = 0; index < items.size(); ++index) {
    const auto enabled = items[index].find("enabled");
    if (enabled && !enabled->boolean()) continue;
    RigidIpcBody body = read_rigid_ipc_body(items[index], shapes);
    body.definition.name =
        fs::path(items[index].at("mesh").text()).stem().string() + " " + std::to_string(index);
    body.definition.friction = friction ? friction->non_negative_number() : 0;
    body.definition.restitution = restitution ? std::max<Scalar>(0, restitution->number()) : 0;
    if (body.definition.restitution > 1) restitution->fail_expected("-1, or a number from 0 to 1");
    const BodyId id(groups.size());
    for (std::size_t other = 0; body.group && other < id.slot; ++other) {
      if (groups[other] == body.group) scene.disabled_pairs.emplace_back(BodyId(other), id);
    }
    groups.push_back(body.group);
    scene.bodies.push_back(std::move(body.definition));
    scene.shape_names.push_back(std::move(body.shape_name));
  }
}

}  // namespace dyop::io_internal
