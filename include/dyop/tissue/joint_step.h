// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dyop/haptics/haptic_session.h"
#include "dyop/tissue/soft_tissue.h"

namespace DYOP_EXPORT dyop {

/// The tool on its springs, as a joint step sees it.
struct JointTool {
  CouplingOptions coupling;
  std::vector<ToolHinge> hinges;
  ToolPose tool;           ///< where the contacts were found
  ToolPose device;         ///< to where the springs pull it
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
/// @throws InvalidArgument if a triangle or hinge is out of range, a number is not finite or
///         negative where that is not allowed.
JointReport step_jointly(SoftTissue& tissue, const JointTool& tool,
                         std::vector<ToolContactPoint>& contacts,
                         std::span<const SurfaceForce> forces = {});

/// Computes what joint steps need once, a second or so for 2,000 cubes, on all cores: how the nodes
/// at the surface answer forces on each other. Some 40 MB for 1,000 such nodes. Otherwise the first
/// joint step does it.
void prepare_joint_steps(SoftTissue& tissue);

}  // namespace dyop
