// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "dyop/core/error.h"
#include "dyop/tissue/soft_tissue.h"

namespace dyop {
namespace {

// Part of what is owed that a step makes up for, times the springs' share of the compliance: what
// is given moves the tissue, and springs that are stiffer than it answer any error of that with a
// multiple, one or two steps later. At most so much of what a step gives anyway.
constexpr Scalar kRepaid = 0.5;
constexpr Scalar kMostRepaid = 0.1;
// Contacts are looked for this far in cubes, besides the tool's way in a step, which counts up to
// kMostWay: what tissue or tool may reach until the step's end, two periods after the search. Those
// that are not found are run into at full speed, by a fast hand or by tissue that springs back.
constexpr Scalar kReach = 1;
constexpr Scalar kMostWay = 1;
// And not nearer to each other than this: the facets of the surface beside each other must all be
// found, as the tool rests on one or another of them.
constexpr Scalar kSpread = 0.05;
constexpr Scalar kRise = 0.5;
// The expected turn of the device until the end of a step, radians.
constexpr Scalar kMostTurn = 0.2;

// The device's pose, or where it was if there is none.
ToolPose pose_of(const DevicePose& device, const ToolPose& otherwise) {
  const Scalar norm = device.q_WD.norm();
  const bool is_pose = device.p_WD.allFinite() && norm > 0.5 && norm < 2;
  if (!is_pose) return otherwise;
  return {RigidPose(device.q_WD.normalized(), device.p_WD), device.angles};
}

}  // namespace

SoftTissueModel::SoftTissueModel(SoftTissue tissue, const ModelledObstacle& obstacle)
    : tissue_(std::move(tissue)) {
  tool_.coupling = obstacle.coupling;
  tool_.hinges = obstacle.hinges;
  tool_.rest_offset = obstacle.rest_gap;
  tool_.friction = obstacle.friction;
  prepare_joint_steps(tissue_);
}

ContactSearch SoftTissueModel::search() const {
  const Scalar edge = tissue_.options().cube_edge;
  const Scalar way =  // of the tool in the last step
      (tool_.device.X_WT.translation() - tool_.tool.X_WT.translation()).norm();
  return {kReach * edge + std::min(way, kMostWay * edge), kRise, kSpread * edge};
}

// If it goes on as since the last news, where it is when the step ends.
ToolPose SoftTissueModel::expected_device(const TissueNews& news) {
  const Sight now{pose_of(news.device, news.tick.tool), news.tick.time};
  ToolPose expected = now.device;
  if (last_ && now.time > last_->time) {
    const Scalar period = tissue_.options().period;
    const Scalar lead = (2 - news.progress.fraction) * period / (now.time - last_->time);
    const RigidPose& before = last_->device.X_WT;
    Vector3 way = lead * (now.device.X_WT.translation() - before.translation());
    const Scalar most = tissue_.options().cube_edge;
    if (way.norm() > most) way *= most / way.norm();
    Eigen::AngleAxisd turn(now.device.X_WT.quaternion() * before.quaternion().conjugate());
    turn.angle() = std::clamp(lead * turn.angle(), -kMostTurn, kMostTurn);
    expected.X_WT = RigidPose(Quaternion(turn) * now.device.X_WT.quaternion(),
                              now.device.X_WT.translation() + way);
  }
  last_ = now;
  return expected;
}

// The step begins when tissue has come to where its last step ends: until then the tool goes on as
// was expected, from where it really is.
std::optional<ToolPose> SoftTissueModel::expected_start(const TissueNews& news) const {
  if (expected_.size() < 2) return std::nullopt;
  const Scalar left = 1 - news.progress.fraction;
  return displaced(news.tick.tool,
                   left * tool_displacement(tool_.hinges.size(), expected_[0], expected_[1]));
}

// Sets what the ticks felt against what was expected of them.
void SoftTissueModel::settle(const TissueNews& news) {
  const Scalar fraction = news.progress.fraction;
  const Vector3 expected = left_ + fraction * step_impulse_;
  left_ = (1 - fraction) * step_impulse_;
  given_ += expected;
  owed_ += news.impulse_W - expected;
}

// What is owed acts where the last step's contacts were.
std::vector<SurfaceForce> SoftTissueModel::repay() {
  std::vector<SurfaceForce> forces;
  if (loads_.empty()) return forces;
  Vector3 part = kRepaid * springs_share_ * owed_;
  const Scalar most = kMostRepaid * step_impulse_.norm();
  if (part.norm() > most) part *= most / part.norm();
  owed_ -= part;
  given_ += part;
  for (const Load& load : loads_) {
    const auto& weights = load.place.weights;
    forces.push_back({load.place.triangle, Vector3(weights[0], weights[1], weights[2]),
                      -load.share / tissue_.options().period * part});
  }
  return forces;
}

void SoftTissueModel::step(const TissueNews& news, std::span<Vector3> vertices) {
  DYOP_REQUIRE(vertices.size() == tissue_.vertices().size(), "SoftTissueModel: the obstacle has ",
               vertices.size(), " vertices, the tissue ", tissue_.vertices().size());
  const bool is_told = news.tick.status != HapticStatus::NotRun;
  if (is_told) settle(news);
  tool_.tool = news.tick.tool;
  tool_.device = is_told ? expected_device(news) : tool_.tool;
  tool_.start = is_told ? expected_start(news) : std::nullopt;
  contacts_ = news.contacts;
  const JointReport report = step_jointly(tissue_, tool_, contacts_, repay());
  springs_share_ = report.springs_share;
  if (expected_.size() == 2) expected_.erase(expected_.begin());
  expected_.push_back(report.tool);
  remember_loads();
  std::copy(tissue_.vertices().begin(), tissue_.vertices().end(), vertices.begin());
}

void SoftTissueModel::remember_loads() {
  step_impulse_.setZero();
  Scalar sum = 0;
  for (const ToolContactPoint& contact : contacts_) {
    step_impulse_ += tissue_.options().period * contact.force_W;
    sum += contact.force_W.norm();
  }
  if (!(sum > 0)) return;  // the old ones stay
  loads_.clear();
  for (const ToolContactPoint& contact : contacts_) {
    const Scalar share = contact.force_W.norm() / sum;
    if (contact.surface && share > 0) loads_.push_back({*contact.surface, share});
  }
}

}  // namespace dyop
