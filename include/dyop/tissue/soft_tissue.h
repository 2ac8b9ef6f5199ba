// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/haptics/haptic_runner.h"
#include "dyop/haptics/haptic_session.h"

namespace DYOP_EXPORT dyop {

/// An isotropic elastic material, in any consistent units. With millimetres, newtons and seconds
/// stresses are megapascals and masses tonnes: a liver has about 5e-3, 0.45 and 1.05e-9.
struct TissueMaterial {
  Scalar youngs_modulus = 0;  ///< force per area, finite, > 0
  Scalar poissons_ratio = 0;  ///< in (-1, 0.5); 0.45 suits organs
  Scalar density = 0;         ///< mass per volume, finite, > 0
  Scalar drag = 0;            ///< force per mass and velocity, 1 / time, >= 0
  /// Stress of a strain rate, relative to that of the strain (Kelvin-Voigt): a time, >= 0.
  Scalar viscosity = 0;
};

struct SoftTissueOptions {
  TissueMaterial material = {};
  /// Edge of the lattice's cubes, length, > 0. Four in a thickness bend within 3 %.
  Scalar cube_edge = 0;
  Scalar period = 0;                    ///< of a step, time, finite, > 0
  Vector3 gravity_W = Vector3::Zero();  ///< length per time squared
  /// The lattice's nodes inside one of these, in world, at rest, never move: to within a cube, the
  /// part of the tissue that lies in them.
  std::vector<AlignedBox> fixed = {};
  /// Relative error of a step's velocities, in the energy norm, > 0 and < 1.
  Scalar tolerance = 1e-2;
  int most_iterations = 12;  ///< of a solve, >= 1: it then ends with what it has
};

/// A force on a point of the surface.
struct SurfaceForce {
  std::int32_t triangle = 0;
  Vector3 weights = Vector3::Zero();  ///< of the triangle's corners, with sum one
  Vector3 force_W = Vector3::Zero();
};

/// What a body of tissue holds: sums over its nodes that can move.
struct TissueBalance {
  Scalar kinetic_energy = 0;
  Scalar elastic_energy = 0;
  Scalar potential_energy = 0;  ///< of gravity, about the world's origin
  Vector3 momentum_W = Vector3::Zero();
  Vector3 angular_momentum_W = Vector3::Zero();  ///< about the world's origin
  Scalar mass = 0;

  Scalar energy() const { return kinetic_energy + elastic_energy + potential_energy; }
};

/// What a blade takes out of tissue: a box, thin along one of its axes.
struct TissueKerf {
  RigidPose X_WK;                          ///< pose of the box in world, its middle as origin
  Vector3 half_extents = Vector3::Zero();  ///< length, finite, > 0

  /// @throws InvalidArgument if an extent is not finite and > 0.
  void require_valid() const;
};

/// What came of a cut.
enum class CutStatus {
  NotRun,
  Missed,       ///< The kerf does not meet the tissue, which is as before.
  Cut,          ///< The tissue has another surface.
  NothingLeft,  ///< The kerf holds all of the tissue, which is as before.
  Unclear,      ///< The tissue is as before: its sides lie over each other in the kerf.
};

struct CutReport {
  CutStatus status = CutStatus::NotRun;
  std::size_t parts = 1;  ///< of the tissue that are not connected, after the cut
};

class SoftTissue;

namespace tissue_internal {
using namespace haptics_internal;  // as in core/namespaces.h
class TissueBody;
TissueBody& body_of(SoftTissue& tissue);
}  // namespace tissue_internal

/// A body of soft tissue: a closed triangle mesh embedded in a lattice of cubes, corotational
/// linear elasticity [Mueller2004], and implicit Euler steps of a fixed period.
///
/// Each step solves one linear system, of the rotations that the cubes have when it begins, by
/// conjugate gradients; the Cholesky factor of the body at rest, turned with the nodes, is the
/// preconditioner, so nothing is factorised again. Steps are deterministic. Forces between cubes
/// and from the surface are in balance: momentum is conserved to rounding; a rigid motion strains
/// nothing.
///
/// Not modelled: contact of the tissue with itself, detail below a cube (parts of the surface
/// closer than a cube are glued, but for the sides of a cut), large changes of volume.
class SoftTissue {
 public:
  /// @param surface_W Closed, with positive volume, in world, at rest.
  /// @throws InvalidArgument if the mesh is not closed, the cubes would be more than a million, or
  ///         an option is out of its range; the message names the value.
  SoftTissue(const TriangleMesh& surface_W, const SoftTissueOptions& options);
  ~SoftTissue();
  SoftTissue(SoftTissue&&) noexcept;
  SoftTissue& operator=(SoftTissue&&) noexcept;

  const SoftTissueOptions& options() const;
  std::size_t cube_count() const;
  std::size_t node_count() const;

  /// One period on, under these forces, held over the step.
  /// @return Iterations of the solve; options().most_iterations: it may not have converged.
  /// @throws InvalidArgument if a triangle is out of range, or a number not finite.
  int step(std::span<const SurfaceForce> forces = {});

  std::span<const Vector3> vertices() const;           ///< of the surface, now, in world
  std::span<const TriangleIndices> triangles() const;  ///< of the surface: changed by cut() alone
  Vector3 velocity(std::int32_t triangle, const Vector3& weights) const;

  /// Gives all nodes that can move the velocity v + w x p, in world; p from the world's origin.
  /// @throws InvalidArgument if a number is not finite.
  void set_velocity(const Vector3& v_W, const Vector3& w_W);
  /// Moves every node to X p, and turns velocities with it: the body as it is, elsewhere. Fixed
  /// nodes stay there.
  void move(const RigidPose& X);

  TissueBalance balance() const;

  /// Takes everything inside the kerf away, as the tissue is now. The surface less the kerf, closed
  /// by caps, is the new one; vertices and triangles have other numbers. Both sides of a kerf move
  /// on their own, however thin it is: cubes that it divides are doubled [Molino2004]. What is left
  /// keeps its places, velocities and momentum. Cut cubes are made softer, down to a half, so that
  /// the elastic energy does not rise. A cut ends where it leaves material connected within a cube;
  /// crumbs below a fiftieth of a cube go with it.
  ///
  /// Cost: a factorisation, some tenths of a second for 2,000 cubes. The next joint steps find what
  /// prepare_joint_steps() has found, for the nodes they need.
  /// @throws InvalidArgument if the pose or an extent is not finite, or an extent not > 0.
  CutReport cut(const TissueKerf& kerf);

 private:
  friend tissue_internal::TissueBody& tissue_internal::body_of(SoftTissue& tissue);
  std::unique_ptr<tissue_internal::TissueBody> body_;
};

/// The tool on its springs, as a joint step sees it.
struct JointTool {
  CouplingOptions coupling;
  std::vector<ToolHinge> hinges;
  ToolPose tool;    ///< where the contacts were found
  ToolPose device;  ///< to where the springs pull it
  /// Where the tool is when the step begins, if that is later than the contacts were found.
  std::optional<ToolPose> start = {};
  Scalar rest_offset = 0;  ///< gap of a loaded contact, with the margin: length, >= 0
  Scalar friction = 0;     ///< Coulomb's coefficient, >= 0
};

struct JointReport {
  int iterations = 0;    ///< of the tissue's solves
  int rounds = 0;        ///< of the contacts' solves
  bool is_exact = true;  ///< every contact was found to be open, to stick or to slip
  /// Part of the contacts' compliance that is that of the springs, the rest the tissue's over a
  /// step, 0 to 1; 1 without contacts.
  Scalar springs_share = 1;
  std::vector<ToolPose> tools;  ///< at the step's end
};

/// One step of the tissue, solved together with the tool on its springs: at its end the springs'
/// pull, the forces of all contacts and the tissue's own are in balance, gaps are kept and friction
/// holds or slips by Coulomb's law. So the tissue may be much softer than the springs: stable for
/// any stiffness and for snapshots that come late, where an exchange of forces is not.
///
/// @param contacts Where tool and tissue touch or soon may, each with its place on the surface,
///        whether it bears a force now or not (HapticSession::find_contacts()); those without a
///        `surface` are left alone. Out: `state` and `force_W` on the tool, the mean of the step.
/// @param forces Others that act on the tissue.
/// @throws InvalidArgument if a triangle or hinge is out of range, a spring has no stiffness, a
///         number is not finite or negative where that is not allowed.
JointReport step_jointly(SoftTissue& tissue, const JointTool& tool,
                         std::vector<ToolContactPoint>& contacts,
                         std::span<const SurfaceForce> forces = {});
/// The same with several tools: ToolContactPoint::tool tells which. The tissue joins them; what
/// they do to each other directly is not part of it. All have the friction of the first.
JointReport step_jointly(SoftTissue& tissue, std::span<const JointTool> tools,
                         std::vector<ToolContactPoint>& contacts,
                         std::span<const SurfaceForce> forces = {});

/// Computes what joint steps need once, a second or so for 2,000 cubes, on all cores: how the nodes
/// at the surface answer forces on each other. Some 40 MB for 1,000 such nodes. Otherwise the first
/// joint step does it.
void prepare_joint_steps(SoftTissue& tissue);

/// A further tool of a session with a SoftTissueModel.
struct ModelledTool {
  CouplingOptions coupling;
  std::vector<ToolHinge> hinges;
};

/// A cut of a SoftTissueModel.
struct ModelledCut {
  std::int64_t steps = 0;  ///< after so many steps, >= 0
  TissueKerf kerf;
};

/// The part of a haptic scene that a SoftTissueModel needs to know.
struct ModelledObstacle {
  CouplingOptions coupling;
  std::vector<ToolHinge> hinges;
  Scalar rest_gap = 0;  ///< the obstacle's margin plus HapticOptions::rest_offset
  Scalar friction = 0;
  std::vector<ModelledTool> more_tools = {};
  std::vector<ModelledCut> cuts = {};  ///< in order of time

  /// @throws InvalidArgument if cuts are not in order of time, a kerf is not valid, a spring has no
  ///         stiffness, or a number is out of its range.
  void require_valid() const;
};

/// That of an obstacle of a scene with these options; without cuts.
/// @throws InvalidArgument if there is no such obstacle.
ModelledObstacle modelled_obstacle(const HapticScene& scene, const HapticOptions& options,
                                   std::size_t obstacle);

/// A SoftTissue as an obstacle of run_session() (TissueFeed::model): each snapshot is a joint step
/// with the session's tools.
///
/// A device is expected to go on as it did since the last step, by at most a cube's edge. Over
/// time the tissue takes exactly what it did to each tool: where the forces of a step came out
/// otherwise than expected, the next steps make up for the difference.
class SoftTissueModel final : public TissueModel {
 public:
  /// @throws InvalidArgument as ModelledObstacle::require_valid().
  SoftTissueModel(SoftTissue tissue, const ModelledObstacle& obstacle);

  ContactSearch search() const override;
  /// Makes the cuts that are due. One that is not Cut changes nothing; cut_reports() tells.
  std::optional<TissueMesh> cut(const TissueNews& news) override;
  void step(const TissueNews& news, std::span<Vector3> vertices) override;

  /// A further cut, in place of the next snapshot. From the thread that calls step().
  /// @return The number that it will have in cut_reports(), from 0.
  /// @throws InvalidArgument if the kerf is not valid.
  std::size_t add_cut(const TissueKerf& kerf);
  std::int64_t steps() const { return steps_; }  ///< made so far

  const SoftTissue& tissue() const { return tissue_; }
  const std::vector<CutReport>& cut_reports() const { return cut_reports_; }  ///< of those made
  /// The impulse on a tool whose opposite the tissue has taken in the time that is over, and what
  /// is still to be made up for.
  /// @throws InvalidArgument if there is no such tool.
  const Vector3& given_impulse_W(std::size_t tool = 0) const { return account(tool).given; }
  const Vector3& owed_impulse_W(std::size_t tool = 0) const { return account(tool).owed; }

 private:
  struct Sight {
    ToolPose device;
    Scalar time = 0;
  };
  struct Load {
    SurfacePoint place;
    Scalar share = 0;
  };
  /// What is known of a tool from the steps before.
  struct Account {
    std::optional<Sight> last;
    std::vector<ToolPose> expected;  // the tool at the ends of the last two steps, the newer last
    std::vector<Load> loads;         // of the last step that had any
    Vector3 step_impulse = Vector3::Zero();  // expected of the newest step
    Vector3 left = Vector3::Zero();          // of the one before: its part that is not yet settled
    Vector3 given = Vector3::Zero();
    Vector3 owed = Vector3::Zero();
  };

  const Account& account(std::size_t tool) const;
  ToolPose expected_device(const ToolNews& news, Scalar fraction, Account& account) const;
  void begin_step(const ToolNews& news, Scalar fraction, JointTool& tool, Account& account) const;
  void repay(Account& account, std::vector<SurfaceForce>& forces) const;
  void remember_loads(std::size_t tool);

  SoftTissue tissue_;
  std::vector<JointTool> joints_;  // by tool
  std::vector<Account> tools_;
  std::vector<ToolContactPoint> contacts_;
  std::vector<ModelledCut> cuts_;
  std::vector<CutReport> cut_reports_;
  std::int64_t steps_ = 0;
  Scalar springs_share_ = 1;  // in the last step
};

}  // namespace dyop
