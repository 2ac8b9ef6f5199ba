// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <set>

#include "dyop/motion/composed_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "geometry/mesh_topology.h"
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

using MeshPointer = std::shared_ptr<const TriangleMesh>;

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
  const Vector3 factors =
      scale->value().is_array() ? scale->vector3() : Vector3::Constant(scale->number());
  if ((factors.array() == 0).any()) scale->fail_expected("factors that are not zero");
  return factors;
}

std::int32_t read_index(const JsonNode& node, std::size_t count) {
  const Scalar number = node.number();
  if (!(number >= 0 && number < Scalar(count) && number == std::floor(number))) {
    node.fail_expected("a vertex number from 0 to " + std::to_string(count - 1));
  }
  return std::int32_t(number);
}

std::array<std::int32_t, 2> edge_of(std::int32_t a, std::int32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

// A body given by its vertices: faces, edges that are of no face, and vertices of neither.
class InlineMesh {
 public:
  explicit InlineMesh(const JsonNode& node) {
    for (const JsonNode& vertex : node.at("vertices").items(1)) {
      vertices_.push_back(vertex.vector3());
    }
    for (const auto& face : read_rows<3>(node, "faces")) {
      add({face[0], face[1], face[2]});
      for (std::size_t k = 0; k < 3; ++k) edges_.insert(edge_of(face[k], face[(k + 1) % 3]));
    }
    for (const auto& edge : read_rows<2>(node, "edges")) {
      if (edges_.insert(edge_of(edge[0], edge[1])).second) add({edge[0], edge[1], edge[1]});
    }
    for (std::int32_t v = 0; v < std::int32_t(vertices_.size()); ++v) {
      if (!used_.contains(v)) add({v, v, v});
    }
  }

  TriangleMesh mesh() const { return {vertices_, triangles_}; }

 private:
  template <std::size_t kCount>
  std::vector<std::array<std::int32_t, kCount>> read_rows(const JsonNode& node,
                                                          std::string_view key) const {
    std::vector<std::array<std::int32_t, kCount>> rows;
    if (!node.has(key)) return rows;
    for (const JsonNode& row : node.at(key).items()) {
      const std::vector<JsonNode> items = row.items();
      if (items.size() != kCount) {
        row.fail_expected(std::to_string(kCount) + " vertex numbers");
      }
      std::array<std::int32_t, kCount>& last = rows.emplace_back();
      for (std::size_t k = 0; k < kCount; ++k) last[k] = read_index(items[k], vertices_.size());
    }
    return rows;
  }
  void add(const TriangleIndices& triangle) {
    triangles_.push_back(triangle);
    used_.insert(triangle.begin(), triangle.end());
  }

  std::vector<Vector3> vertices_;
  std::vector<TriangleIndices> triangles_;
  std::set<std::array<std::int32_t, 2>> edges_;
  std::set<std::int32_t> used_;
};

bool has_file(const JsonNode& node) {
  return node.has("mesh") && !(node.at("mesh").value() == "");
}

MeshPointer read_scaled_mesh(const JsonNode& node, ShapeReader& shapes) {
  return node.guard([&]() -> MeshPointer {
    const TriangleMesh mesh = has_file(node) || !node.has("vertices") ? shapes.load(node.at("mesh"))
                                                                      : InlineMesh(node).mesh();
    const Vector3 scale = read_scale(node, mesh);
    if (scale.minCoeff() < 0) {
      return std::static_pointer_cast<const TriangleMesh>(scaled(mesh, scale));
    }
    std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
    for (Vector3& vertex : vertices) vertex = vertex.cwiseProduct(scale);
    return std::make_shared<TriangleMesh>(mesh.with_vertices(vertices));
  });
}

// The connected parts of a mesh, each with its own vertices, in the order of the triangles.
std::vector<MeshPointer> split(const TriangleMesh& mesh) {
  struct Part {
    std::vector<Vector3> vertices;
    std::vector<TriangleIndices> triangles;
  };
  const std::vector<std::int32_t> part_of =
      geometry_internal::parts_of_triangles(mesh.vertices().size(), mesh.triangles());
  std::map<std::int32_t, std::size_t> number_of_part;
  std::map<std::int32_t, std::int32_t> number_of_vertex;
  std::vector<Part> parts;
  for (std::size_t k = 0; k < part_of.size(); ++k) {
    const auto [number, is_new_part] = number_of_part.try_emplace(part_of[k], parts.size());
    if (is_new_part) parts.emplace_back();
    Part& part = parts[number->second];
    TriangleIndices triangle = mesh.triangles()[k];
    for (std::int32_t& vertex : triangle) {
      const auto [found, is_new] =
          number_of_vertex.try_emplace(vertex, std::int32_t(part.vertices.size()));
      if (is_new) part.vertices.push_back(mesh.vertices()[std::size_t(vertex)]);
      vertex = found->second;
    }
    part.triangles.push_back(triangle);
  }
  std::vector<MeshPointer> meshes;
  for (const Part& part : parts) {
    meshes.push_back(std::make_shared<TriangleMesh>(part.vertices, part.triangles));
  }
  return meshes;
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

using MotionPointer = std::shared_ptr<const Motion>;

// Of the body, from the motion of a frame fixed to it.
MotionPointer carried(const MotionPointer& frame, const RigidPose& X_FB) {
  return std::make_shared<ComposedMotion>(frame, std::make_shared<RestMotion>(X_FB));
}

// The centre of mass moves straight on, and the body turns about it, until it stops.
MotionPointer make_steady_motion(const RigidPose& X_WB, const Vector3& p_BoBcm, const Twist& twist,
                                 Scalar until, Scalar end) {
  const RigidPose X_WC(X_WB.quaternion(), X_WB * p_BoBcm);
  const RigidPose X_CB(Quaternion::Identity(), -p_BoBcm);
  const auto moving = std::make_shared<ConstantTwistMotion>(X_WC, twist);
  if (!(until < end)) return carried(moving, X_CB);
  if (!(until > 0)) return std::make_shared<RestMotion>(X_WB);
  const auto resting = std::make_shared<RestMotion>(moving->pose(until));
  return carried(std::make_shared<SequenceMotion>(std::vector<SequenceMotion::Part>{
                     {{0, until}, moving}, {{until, end}, resting}}),
                 X_CB);
}

// The axes of inertia, of least moment first, as [Ferguson2021]'s program finds them, in the
// world's axes; of the ways they may point, which poses do not tell, the one with which the body
// turns least to its first pose.
Matrix3 axes_of_inertia(const Matrix3& I_BBcm, const Matrix3& R_WB, const Matrix3& R_WP) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(R_WB * I_BBcm * R_WB.transpose());
  const Matrix3 axes = R_WB.transpose() * solver.eigenvectors();
  Matrix3 best = axes;
  Scalar most = -kInfinity;
  for (int signs = 0; signs < 4; ++signs) {
    Matrix3 R_BP = axes;
    if (signs % 2 == 1) R_BP.col(0) *= -1;
    if (signs / 2 == 1) R_BP.col(1) *= -1;
    R_BP.col(2) = R_BP.col(0).cross(R_BP.col(1));
    const Scalar likeness = (R_WB.transpose() * R_WP * R_BP.transpose()).trace();
    if (likeness > most) best = R_BP;
    most = std::max(most, likeness);
  }
  return best;
}

// Where the centre of mass and the axes of inertia are at the end of each step; after the last one
// the body goes on as in the last step.
MotionPointer read_given_poses(const JsonNode& node, const BodyDefinition& body, Scalar step,
                               Scalar end) {
  const RigidPose& X_WB = body.initial.X_WB;
  const MassProperties& mass = body.mass_properties;
  std::vector<RigidPose> poses;
  for (const JsonNode& pose : node.items(1)) {
    poses.emplace_back(rotation_from_vector(vector_or_zero(pose, "rotation")),
                       vector_or_zero(pose, "position"));
  }
  const Matrix3 R_BP = axes_of_inertia(mass.I_BBcm, X_WB.rotation(), poses[0].rotation());
  const RigidPose X_BP(R_BP, mass.p_BoBcm);
  std::vector<SampledMotion::Sample> samples{{0, X_WB * X_BP}};
  for (const RigidPose& pose : poses) {
    samples.push_back({step * Scalar(samples.size()), pose});
  }
  const Scalar last = samples.back().t;
  const auto given = std::make_shared<SampledMotion>(std::move(samples));
  if (!(last < end)) return carried(given, X_BP.inverse());
  const auto on =
      std::make_shared<ConstantTwistMotion>(given->pose(last), given->twist(last), last);
  return carried(std::make_shared<SequenceMotion>(
                     std::vector<SequenceMotion::Part>{{{0, last}, given}, {{last, end}, on}}),
                 X_BP.inverse());
}

MotionPointer read_kinematic_motion(const JsonNode& node, const BodyDefinition& body,
                                    const Twist& twist, const Scene& scene) {
  if (const auto poses = node.find("kinematic_poses"); poses && !poses->items().empty()) {
    return poses->guard([&] { return read_given_poses(*poses, body, scene.step, scene.end_time); });
  }
  const auto until = node.find("kinematic_max_time");
  return make_steady_motion(body.initial.X_WB, body.mass_properties.p_BoBcm, twist,
                            until && until->number() >= 0 ? until->number() : kInfinity,
                            scene.end_time);
}

bool is_point(const TriangleMesh& mesh) {
  return mesh.bounding_box().sizes().isZero(0);
}

MassProperties read_rigid_ipc_mass(const JsonNode& node, const TriangleMesh& mesh) {
  const auto density = node.find("density");
  const Scalar amount = density ? density->positive_number() : kRigidIpcDensity;
  if (is_point(mesh)) return {amount, mesh.bounding_box().center(), amount * Matrix3::Identity()};
  return node.guard([&] {
    return mesh.is_closed() ? mesh.compute_mass_properties(amount)
                            : mesh.compute_shell_mass_properties(amount);
  });
}

std::string shape_name(const JsonNode& node, const TriangleMesh& mesh) {
  const std::string file =
      has_file(node) ? fs::path(node.at("mesh").text()).filename().string() : "of the scene";
  return "mesh " + file + ", " + std::to_string(mesh.triangles().size()) + " triangles";
}

RigidIpcBody read_rigid_ipc_body(const JsonNode& node, const MeshPointer& mesh,
                                 const Scene& scene) {
  RigidIpcBody result;
  BodyDefinition& body = result.definition;
  result.shape_name = shape_name(node, *mesh);
  body.shape = mesh;
  const LockedAxes locked = read_fixed(node);
  body.kind = read_kind(node, locked);
  body.initial.X_WB = RigidPose(read_rotation(node), vector_or_zero(node, "position"));
  if (const auto group = node.find("group_id"); group && group->number() >= 0) {
    result.group = group->number();
  }
  if (body.kind == BodyKind::Static) return result;
  body.mass_properties = read_rigid_ipc_mass(node, *mesh);
  const Vector3& p_BoBcm = body.mass_properties.p_BoBcm;
  Twist twist = read_mass_center_twist(node, locked);
  if (body.kind == BodyKind::Kinematic) {
    body.motion = read_kinematic_motion(node, body, twist, scene);
    return result;
  }
  body.locked = locked;
  if (is_point(*mesh)) body.locked.rotation = {true, true, true};
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

// Without a name yet: one body, or one for each part of its mesh.
std::vector<RigidIpcBody> read_rigid_ipc_bodies(const JsonNode& node, ShapeReader& shapes,
                                                const Scene& scene) {
  const MeshPointer mesh = read_scaled_mesh(node, shapes);
  const auto splits = node.find("split_components");
  if (!splits || !splits->boolean()) return {read_rigid_ipc_body(node, mesh, scene)};
  std::vector<RigidIpcBody> bodies;
  for (const MeshPointer& part : split(*mesh)) {
    bodies.push_back(read_rigid_ipc_body(node, part, scene));
  }
  return bodies;
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

// What all bodies share.
struct RigidIpcMaterial {
  Scalar friction = 0;
  Scalar restitution = 0;
};

RigidIpcMaterial read_material(const JsonNode& problem) {
  RigidIpcMaterial material;
  if (const auto friction = problem.find("coefficient_friction")) {
    material.friction = friction->non_negative_number();
  }
  if (const auto restitution = problem.find("coefficient_restitution")) {
    material.restitution = std::max<Scalar>(0, restitution->number());
    if (material.restitution > 1) restitution->fail_expected("-1, or a number from 0 to 1");
  }
  return material;
}

// Bodies of one group do not collide; `groups` are those of the bodies before.
void add_body(RigidIpcBody&& body, std::vector<std::optional<Scalar>>& groups, Scene& scene) {
  const BodyId id(groups.size());
  for (std::size_t other = 0; body.group && other < id.slot; ++other) {
    if (groups[other] == body.group) scene.disabled_pairs.emplace_back(BodyId(other), id);
  }
  groups.push_back(body.group);
  scene.bodies.push_back(std::move(body.definition));
  scene.shape_names.push_back(std::move(body.shape_name));
}

std::string name_of_item(const JsonNode& node, std::size_t index) {
  const std::string stem =
      has_file(node) ? fs::path(node.at("mesh").text()).stem().string() : "body";
  return stem + ' ' + std::to_string(index);
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
  const RigidIpcMaterial material = read_material(problem);
  ShapeReader shapes(mesh_folders(root.file(), mesh_directories), LoneVertices::Points);
  std::vector<std::optional<Scalar>> groups;
  const std::vector<JsonNode> items = problem.at("rigid_bodies").items(1);
  for (std::size_t index = 0; index < items.size(); ++index) {
    const auto enabled = items[index].find("enabled");
    if (enabled && !enabled->boolean()) continue;
    const std::string name = name_of_item(items[index], index);
    std::vector<RigidIpcBody> bodies = read_rigid_ipc_bodies(items[index], shapes, scene);
    for (std::size_t part = 0; part < bodies.size(); ++part) {
      BodyDefinition& body = bodies[part].definition;
      body.name = bodies.size() == 1 ? name : name + " part " + std::to_string(part);
      body.friction = material.friction;
      body.restitution = material.restitution;
      add_body(std::move(bodies[part]), groups, scene);
    }
  }
}

}  // namespace dyop::io_internal
