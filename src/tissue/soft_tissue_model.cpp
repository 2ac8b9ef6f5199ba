// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "dyop/core/error.h"
#include "dyop/tissue/soft_tissue.h"
#include "tissue/tissue_body.h"

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

// Of all tools, where they are not yet known to be.
std::vector<JointTool> joint_tools(const ModelledObstacle& obstacle) {
  JointTool tool;
  tool.coupling = obstacle.coupling;
  tool.hinges = obstacle.hinges;
  tool.rest_offset = obstacle.rest_gap;
  tool.friction = obstacle.friction;
  std::vector<JointTool> tools{tool};
  for (const ModelledTool& other : obstacle.more_tools) {
    tool.coupling = other.coupling;
    tool.hinges = other.hinges;
    tools.push_back(tool);
  }
  return tools;
}

}  // namespace

ModelledObstacle modelled_obstacle(const HapticScene& scene, const HapticOptions& options,
                                   std::size_t obstacle) {
  DYOP_REQUIRE(obstacle < scene.obstacles.size(), "modelled_obstacle: there is no obstacle ",
               obstacle, " of ", scene.obstacles.size());
  const ToolObstacle& tissue = scene.obstacles[obstacle];
  ModelledObstacle modelled{options.coupling, scene.hinges, tissue.margin + options.rest_offset,
                            tissue.friction};
  for (const HapticTool& tool : scene.more_tools) {
    modelled.more_tools.push_back({tool.coupling.value_or(options.coupling), tool.hinges});
  }
  return modelled;
}

void ModelledObstacle::require_valid() const {
  std::int64_t last = 0;
  for (const ModelledCut& cut : cuts) {
    DYOP_REQUIRE(cut.steps >= last, "SoftTissueModel: a cut after ", cut.steps,
                 " steps follows one after ", last);
    cut.kerf.require_valid();
    last = cut.steps;
  }
  for (const JointTool& tool : joint_tools(*this)) tissue_internal::require_valid(tool);
}

SoftTissueModel::SoftTissueModel(SoftTissue tissue, const ModelledObstacle& obstacle)
    : tissue_(std::move(tissue)),
      joints_(joint_tools(obstacle)),
      tools_(joints_.size()),
      cuts_(obstacle.cuts) {
  obstacle.require_valid();
  prepare_joint_steps(tissue_);
}

const SoftTissueModel::Account& SoftTissueModel::account(std::size_t tool) const {
  DYOP_REQUIRE(tool < tools_.size(), "SoftTissueModel: there is no tool ", tool, " of ",
               tools_.size());
  return tools_[tool];
}

ContactSearch SoftTissueModel::search() const {
  const Scalar edge = tissue_.options().cube_edge;
  Scalar way = 0;  // of a tool in the last step
  for (const JointTool& tool : joints_) {
    const Vector3 moved = tool.device.X_WT.translation() - tool.tool.X_WT.translation();
    way = std::max(way, moved.norm());
  }
  return {kReach * edge + std::min(way, kMostWay * edge), kRise, kSpread * edge};
}

// If it goes on as since the last news, where it is when the step ends.
ToolPose SoftTissueModel::expected_device(const ToolNews& news, Scalar fraction,
                                          Account& account) const {
  const Sight now{pose_of(news.device, news.tick.tool), news.tick.time};
  ToolPose expected = now.device;
  if (account.last && now.time > account.last->time) {
    const Scalar period = tissue_.options().period;
    const Scalar lead = (2 - fraction) * period / (now.time - account.last->time);
    const RigidPose& before = account.last->device.X_WT;
    Vector3 way = lead * (now.device.X_WT.translation() - before.translation());
    const Scalar most = tissue_.options().cube_edge;
    if (way.norm() > most) way *= most / way.norm();
    Eigen::AngleAxisd turn(now.device.X_WT.quaternion() * before.quaternion().conjugate());
    turn.angle() = std::clamp(lead * turn.angle(), -kMostTurn, kMostTurn);
    expected.X_WT = RigidPose(Quaternion(turn) * now.device.X_WT.quaternion(),
                              now.device.X_WT.translation() + way);
  }
  account.last = now;
  return expected;
}

// Sets what the ticks felt against what was expected of them. The step begins when tissue has come
// to where its last step ends: until then the tool goes on as was expected, from where it really
// is.
void SoftTissueModel::begin_step(const ToolNews& news, Scalar fraction, JointTool& tool,
                                 Account& account) const {
  tool.tool = news.tick.tool;
  if (news.tick.status == HapticStatus::NotRun) {
    tool.device = tool.tool;
    tool.start.reset();
    return;
  }
  const Vector3 expected = account.left + fraction * account.step_impulse;
  account.left = (1 - fraction) * account.step_impulse;
  account.given += expected;
  account.owed += news.impulse_W - expected;
  tool.device = expected_device(news, fraction, account);
  tool.start.reset();
  if (account.expected.size() < 2) return;
  tool.start = displaced(tool.tool,
                         (1 - fraction) * tool_displacement(tool.hinges.size(), account.expected[0],
                                                            account.expected[1]));
}

// What is owed acts where the last step's contacts were.
void SoftTissueModel::repay(Account& account, std::vector<SurfaceForce>& forces) const {
  if (account.loads.empty()) return;
  Vector3 part = kRepaid * springs_share_ * account.owed;
  const Scalar most = kMostRepaid * account.step_impulse.norm();
  if (part.norm() > most) part *= most / part.norm();
  account.owed -= part;
  account.given += part;
  for (const Load& load : account.loads) {
    const auto& weights = load.place.weights;
    forces.push_back({load.place.triangle, Vector3(weights[0], weights[1], weights[2]),
                      -load.share / tissue_.options().period * part});
  }
}

// Behind those that are due.
std::size_t SoftTissueModel::add_cut(const TissueKerf& kerf) {
  kerf.require_valid();
  const auto later = std::find_if(cuts_.begin() + std::ptrdiff_t(cut_reports_.size()), cuts_.end(),
                                  [&](const ModelledCut& cut) { return cut.steps > steps_; });
  const auto number = std::size_t(later - cuts_.begin());
  cuts_.insert(later, {steps_, kerf});
  return number;
}

std::optional<TissueMesh> SoftTissueModel::cut(const TissueNews& /*news*/) {
  bool is_cut = false;
  while (cut_reports_.size() < cuts_.size() && cuts_[cut_reports_.size()].steps <= steps_) {
    cut_reports_.push_back(tissue_.cut(cuts_[cut_reports_.size()].kerf));
    is_cut |= cut_reports_.back().status == CutStatus::Cut;
  }
  if (!is_cut) return std::nullopt;
  for (Account& account : tools_) account.loads.clear();  // on triangles that are no more
  return TissueMesh{{tissue_.vertices().begin(), tissue_.vertices().end()},
                    {tissue_.triangles().begin(), tissue_.triangles().end()}};
}

void SoftTissueModel::step(const TissueNews& news, std::span<Vector3> vertices) {
  DYOP_REQUIRE(vertices.size() == tissue_.vertices().size(), "SoftTissueModel: the obstacle has ",
               vertices.size(), " vertices, the tissue ", tissue_.vertices().size());
  DYOP_REQUIRE(news.tools.size() == tools_.size(), "SoftTissueModel: the session has ",
               news.tools.size(), " tools, the model ", tools_.size());
  std::vector<SurfaceForce> repaid;
  for (std::size_t k = 0; k < tools_.size(); ++k) {
    begin_step(news.tools[k], news.progress.fraction, joints_[k], tools_[k]);
    repay(tools_[k], repaid);
  }
  contacts_ = news.contacts;
  const JointReport report = step_jointly(tissue_, joints_, contacts_, repaid);
  springs_share_ = report.springs_share;
  ++steps_;
  for (std::size_t k = 0; k < tools_.size(); ++k) {
    std::vector<ToolPose>& expected = tools_[k].expected;
    if (expected.size() == 2) expected.erase(expected.begin());
    expected.push_back(report.tools[k]);
    remember_loads(k);
  }
  std::copy(tissue_.vertices().begin(), tissue_.vertices().end(), vertices.begin());
}

void SoftTissueModel::remember_loads(std::size_t tool) {
  Account& account = tools_[tool];
  account.step_impulse.setZero();
  Scalar sum = 0;
  for (const ToolContactPoint& contact : contacts_) {
    if (contact.tool != tool) continue;
    account.step_impulse += tissue_.options().period * contact.force_W;
    sum += contact.force_W.norm();
  }
  if (!(sum > 0)) return;  // the old ones stay
  account.loads.clear();
  for (const ToolContactPoint& contact : contacts_) {
    if (contact.tool != tool) continue;
    const Scalar share = contact.force_W.norm() / sum;
    if (contact.surface && share > 0) account.loads.push_back({*contact.surface, share});
  }
}

}  // namespace dyop
