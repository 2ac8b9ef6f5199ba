// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/tissue/joint_step.h"

namespace DYOP_EXPORT dyop {

/// The part of a haptic scene that a SoftTissueModel needs to know.
struct ModelledObstacle {
  CouplingOptions coupling;
  std::vector<ToolHinge> hinges;
  Scalar rest_gap = 0;  ///< the obstacle's margin plus HapticOptions::rest_offset
  Scalar friction = 0;
};

/// A SoftTissue as an obstacle of run_session() (TissueFeed::model): each snapshot is a joint step
/// with the tool.
///
/// The device is expected to go on as it did since the last step, by at most a cube's edge. Over
/// time the tissue takes exactly what it did to the tool: where the forces of a step came out
/// otherwise than expected, the next steps make up for the difference.
class SoftTissueModel final : public TissueModel {
 public:
  SoftTissueModel(SoftTissue tissue, const ModelledObstacle& obstacle);

  ContactSearch search() const override;
  void step(const TissueNews& news, std::span<Vector3> vertices) override;

  const SoftTissue& tissue() const { return tissue_; }
  /// The impulse on the tool whose opposite the tissue has taken in the time that is over, and what
  /// is still to be made up for.
  const Vector3& given_impulse_W() const { return given_; }
  const Vector3& owed_impulse_W() const { return owed_; }

 private:
  struct Sight {
    ToolPose device;
    Scalar time = 0;
  };
  struct Load {
    SurfacePoint place;
    Scalar share = 0;
  };
  ToolPose expected_device(const TissueNews& news);
  void settle(const TissueNews& news);
  std::vector<SurfaceForce> repay();
  void remember_loads();

  SoftTissue tissue_;
  JointTool tool_;
  std::optional<Sight> last_;
  std::vector<ToolContactPoint> contacts_;
  std::vector<Load> loads_;                 // of the last step that had any
  Vector3 step_impulse_ = Vector3::Zero();  // expected of the newest step
  Vector3 left_ = Vector3::Zero();          // of the one before: its part that is not yet settled
  Scalar springs_share_ = 1;                // in the last step
  Vector3 given_ = Vector3::Zero();
  Vector3 owed_ = Vector3::Zero();
};

}  // namespace dyop
