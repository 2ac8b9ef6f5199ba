// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/io/scene_file.h"
#include "io/json_reader.h"
#include "io/scene/shape_reader.h"

namespace dyop::io_internal {

/// Whether the root of a file is a scene of [Ferguson2021], recognised by its key
/// "rigid_body_problem".
bool is_rigid_ipc_scene(const JsonNode& root);

/// Reads such a scene, see docs/formats.md. Meshes are searched for in the folders `meshes`
/// beside and above the scene, then in `mesh_directories`. Does not set `scene.source`.
void read_rigid_ipc_scene(const JsonNode& root,
                          const std::vector<std::filesystem::path>& mesh_directories, Scene& scene);

/// The target distance of generated scenes.
// literal: small compared with bodies of length one
inline constexpr Scalar kGeneratedTarget = 1e-5;
inline constexpr Scalar kGeneratedRestOffset = 4 * kGeneratedTarget;
/// The gap between bodies at rest, as World keeps it.
inline constexpr Scalar kGeneratedGap = kGeneratedTarget + kGeneratedRestOffset;

/// Collects the parts of a generated scene.
class SceneBuilder {
 public:
  SceneBuilder(std::string title, Scalar end_time);

  void set_lengths(Scalar target_distance, Scalar rest_offset);
  /// A dynamic body of density 1000 that does not bounce; the reference is valid until the next
  /// call.
  Json& add_body(const std::string& name, Json shape, const Vector3& position);
  /// The same, static.
  Json& add_static_body(const std::string& name, Json shape, const Vector3& position);
  /// A static box with its top at z = 0.
  void add_floor(const Vector3& middle, Scalar half_length, Scalar half_width);
  /// For all bodies added so far.
  void set_friction(Scalar friction);

  void add_mesh(const std::string& file, std::string text);
  /// A further key of the scene: "filters", "joints".
  Json& root() { return root_; }

  GeneratedScene finish() const;

 private:
  Json root_;
  std::vector<Json> bodies_;
  std::vector<std::pair<std::string, std::string>> meshes_;
};

Json box_shape(const Vector3& half_extents);
Json sphere_shape(Scalar radius);
Json hull_shape(const std::vector<Vector3>& points);
Json mesh_shape(const std::string& file);
Json vector_json(const Vector3& v);
/// A rotation about an axis, for the key "axis_angle" of a pose.
Json turn_json(const Vector3& axis, Scalar degrees);
/// The text of an OBJ file; triangle indices count from 0.
std::string obj_text(const std::vector<Vector3>& vertices,
                     const std::vector<std::array<int, 3>>& triangles);

// One function per kind. To add a kind: one here and one row in scene_generator.cpp.
GeneratedScene make_stack(int n);
GeneratedScene make_pyramid(int n);
GeneratedScene make_wall(int n);
GeneratedScene make_pile(int n);
GeneratedScene make_spheres(int n);
GeneratedScene make_hulls(int n);
GeneratedScene make_ragdolls(int n);
GeneratedScene make_rope(int n);
GeneratedScene make_arch(int n);
GeneratedScene make_cards(int n);
GeneratedScene make_domino(int n);
GeneratedScene make_chain_net(int n);
GeneratedScene make_gears(int n);
GeneratedScene make_cradle(int n);
GeneratedScene make_bolt(int n);

/// Pulls a point P of a body towards a point A of the world: force -stiffness * (P - A) - damping *
/// v_P.
struct SpringForce {
  Vector3 p_BP = Vector3::Zero();
  Vector3 p_WA = Vector3::Zero();
  Scalar stiffness = 0;  ///< force per length
  Scalar damping = 0;    ///< force per speed
};

/// All forces on one body except gravity.
struct BodyForces {
  Wrench constant;
  std::vector<SpringForce> springs;
  Scalar linear_drag = 0;   ///< force per speed of the centre of mass
  Scalar angular_drag = 0;  ///< torque per angular speed
};

/// The sum of the forces as a callback. @param p_BoBcm centre of mass in the body's frame.
WrenchCallback make_wrench(const BodyForces& forces, const Vector3& p_BoBcm);

struct NamedBody {
  BodyDefinition definition;
  std::string shape_name;  ///< for display
};

/// Reads one element of "bodies" of docs/formats.md. A kinematic body's motion must cover
/// `span`.
NamedBody read_body(const JsonNode& node, const TimeInterval& span, ShapeReader& shapes);

}  // namespace dyop::io_internal
