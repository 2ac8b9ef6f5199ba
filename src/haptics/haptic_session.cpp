// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_session.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <tuple>
#include <utility>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/haptics/haptic_tick.h"
#include "haptics/deforming_obstacle.h"
#include "haptics/device_filter.h"
#include "haptics/proxy.h"
#include "haptics/soft_region.h"

namespace dyop {
namespace haptics_internal {

/// What a session knows of a tool besides its proxy.
struct ToolState {
  ToolState(const HapticTool& tool, Scalar reach, const HapticScene& scene,
            const HapticOptions& options)
      : filter(options, reach), coupling(*tool.coupling), wanted(*tool.coupling) {
    for (std::size_t k = 0; k < scene.obstacles.size(); ++k) {
      const ToolObstacle& obstacle = scene.obstacles[k];
      if (obstacle.role != ObstacleRole::SoftRegion || !(obstacle.soft_stiffness > 0)) continue;
      soft_regions.push_back(std::make_unique<SoftRegion>(tool, obstacle, k, options));
    }
  }

  std::vector<std::unique_ptr<SoftRegion>> soft_regions;
  DeviceFilter filter;
  VirtualCoupling coupling;
  // Springs that shall act as soon as they may.
  CouplingOptions wanted;
  bool is_stiffening = false;  // not all of them do
};

struct SessionState {
  SessionState(const HapticScene& described, const HapticOptions& given)
      : scene(described), options(given), proxy(scene, given), clock(given.max_work) {
    const std::span<const HapticTool> all = proxy.scene().tools;
    for (std::size_t k = 0; k < all.size(); ++k) {
      tools.emplace_back(all[k], reach_of(proxy.scene().bodies, k), scene, given);
    }
    ticks.resize(tools.size());
  }

  std::span<const std::unique_ptr<Obstacle>> obstacles() const {
    return std::span(proxy.scene().obstacles).first(proxy.scene().scene_obstacles);
  }

  HapticScene scene;
  HapticOptions options;
  Proxy proxy;
  std::vector<ToolState> tools;
  std::vector<HapticTick> ticks;  // by tool
  WorkClock clock;
  Scalar time = 0;
  std::shared_ptr<HapticObserver> observer;
  bool is_fresh = true;  // no tick, and nothing else from its thread
  std::mutex giving;     // one thread at a time gives tissue; ticks never wait for it
  // Memory of find_contacts().
  haptics_internal::PairMemory search_memory;
  std::vector<HoldPoint> found;
};

}  // namespace haptics_internal

namespace {

using haptics_internal::DeformingObstacle;
using haptics_internal::DeviceFilter;
using haptics_internal::FollowReport;
using haptics_internal::HoldPoint;
using haptics_internal::LoopScene;
using haptics_internal::Obstacle;
using haptics_internal::PerTool;
using haptics_internal::ProxyPair;
using haptics_internal::SessionState;
using haptics_internal::ToolPoses;
using haptics_internal::ToolState;
using haptics_internal::ToolStep;
using haptics_internal::ToolSteps;

// Time that a tick may miss by rounding.
constexpr Scalar kTimeNoise = 0x1p-20;

// A contact sticks if its force is farther inside the friction cone than this fraction of it.
constexpr Scalar kConeEdge = 1e-3;

// A snapshot takes at least this fraction of a period.
constexpr Scalar kLeastDuration = 1e-6;  // literal: a ratio of times

// With less, the share is used up before a search has come to what is new.
constexpr int kLeastWork = 10;

void require_positive(const char* name, Scalar value) {
  DYOP_REQUIRE(value > 0 && value < kInfinity, "HapticSession: ", name,
               " must be finite and > 0, not ", value);
}

void require_valid(const HapticOptions& options) {
  require_positive("rest_offset", options.rest_offset);
  require_positive("recovery_speed", options.recovery_speed);
  require_positive("clearance_tolerance", options.clearance_tolerance);
  DYOP_REQUIRE(options.largest_device_speed > 0,
               "HapticSession: largest_device_speed must be > 0, not ",
               options.largest_device_speed);
  const auto require_work = [](const char* name, std::int64_t pieces) {
    DYOP_REQUIRE(pieces >= kLeastWork, "HapticSession: ", name, " must be >= ", kLeastWork,
                 ", not ", pieces);
  };
  require_work("clearance_work", options.clearance_work);
  require_work("max_work", options.max_work);
  DYOP_REQUIRE(options.max_rounds >= 1, "HapticSession: max_rounds must be >= 1, not ",
               options.max_rounds);
  DYOP_REQUIRE(options.max_attempts >= 1, "HapticSession: max_attempts must be >= 1, not ",
               options.max_attempts);
  DYOP_REQUIRE(options.max_contacts > options.max_attempts,
               "HapticSession: max_contacts must be more than max_attempts, not ",
               options.max_contacts);
}

void require_valid(const HapticTool& tool) {
  DYOP_REQUIRE(tool.hinges.size() <= kMostHinges, "HapticSession: a tool has at most ", kMostHinges,
               " hinges, not ", tool.hinges.size());
  for (const ToolHinge& hinge : tool.hinges) {
    require_positive("a hinge's stiffness", hinge.stiffness);
    DYOP_REQUIRE(std::isfinite(hinge.angle), "HapticSession: a hinge's angle must be finite, not ",
                 hinge.angle);
  }
  if (!tool.trocar) return;
  const ToolTrocar& trocar = *tool.trocar;
  const Scalar length = trocar.axis_T.norm();
  DYOP_REQUIRE(length > 0 && length < kInfinity && trocar.p_W.allFinite() && trocar.p_T.allFinite(),
               "HapticSession: the trocar's points must be finite, and its axis not (",
               trocar.axis_T.transpose(), ")");
}

void require_valid(const HapticScene& scene) {
  DYOP_REQUIRE(scene.more_tools.size() < kMostTools, "HapticSession: there are at most ",
               kMostTools, " tools, not ", 1 + scene.more_tools.size());
  for (const HapticTool& tool : scene.tools()) require_valid(tool);
  DYOP_REQUIRE(scene.tool_margin >= 0 && scene.tool_margin < kInfinity,
               "HapticSession: tool_margin must be finite and >= 0, not ", scene.tool_margin);
  DYOP_REQUIRE(scene.tool_friction >= 0 && scene.tool_friction < kInfinity,
               "HapticSession: tool_friction must be finite and >= 0, not ", scene.tool_friction);
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k) {
    const ToolObstacle& obstacle = scene.obstacles[k];
    const auto require = [&](const char* name, Scalar value) {
      DYOP_REQUIRE(value >= 0 && value < kInfinity, "HapticSession: ", name, " of obstacle ", k,
                   " must be finite and >= 0, not ", value);
    };
    require("margin", obstacle.margin);
    require("friction", obstacle.friction);
    require("soft_stiffness", obstacle.soft_stiffness);
    DYOP_REQUIRE((obstacle.shape != nullptr) != !obstacle.triangles.empty(),
                 "HapticSession: ", "obstacle ", k, " must have either a shape or triangles");
  }
}

HapticStatus status_of(const FollowReport& report, std::size_t tool, bool was_cut, bool is_late) {
  if (report.overlapping[tool]) return HapticStatus::Overlapping;
  if (report.recovering[tool]) return HapticStatus::Recovering;
  if (was_cut) return HapticStatus::Deadline;
  if (is_late) return HapticStatus::Trapped;
  if (report.at_goal[tool]) return HapticStatus::Free;
  return report.held[tool] ? HapticStatus::Held : HapticStatus::Blocked;
}

ContactState state_of(const Vector3& force_W, const Vector3& nhat_W, Scalar friction) {
  if (force_W.isZero(0)) return ContactState::Open;
  const Scalar pressure = nhat_W.dot(force_W);
  const Scalar across = (force_W - pressure * nhat_W).norm();
  return across < (1 - kConeEdge) * friction * pressure ? ContactState::Stick : ContactState::Slip;
}

// Without its force.
ToolContactPoint point_of(const HoldPoint& hold, const LoopScene& scene) {
  const haptics_internal::ToolBody& body = scene.bodies[hold.body];
  ToolContactPoint contact;
  contact.tool = body.tool;
  contact.obstacle = hold.obstacle;
  contact.part = hold.body - scene.first_body[body.tool];
  contact.p_W = hold.p_WB;
  contact.nhat_W = hold.nhat_AB_W;
  contact.gap = hold.gap();
  contact.hinge = body.hinge;
  contact.p_WO = hold.p_WA;
  contact.v_WO = hold.v_WA;
  contact.surface = hold.surface;
  return contact;
}

// As the other tool sees it.
HoldPoint mirrored(const HoldPoint& hold) {
  HoldPoint seen = hold;
  seen.body = *hold.other;
  std::swap(seen.p_WA, seen.p_WB);
  seen.nhat_AB_W = -hold.nhat_AB_W;
  seen.impulse_W = -hold.impulse_W;
  return seen;
}

void tell_tool_contact(SessionState& state, const ToolContactPoint& point, const HoldPoint& hold) {
  const LoopScene& scene = state.proxy.scene();
  const std::size_t tool = scene.bodies[hold.body].tool, other = scene.bodies[*hold.other].tool;
  ToolContactPoint contact = point;
  contact.obstacle = other;
  state.ticks[tool].tool_contacts.push_back(contact);
  contact = point_of(mirrored(hold), scene);
  contact.obstacle = tool;
  contact.force_W = -point.force_W;
  contact.state = point.state;
  state.ticks[other].tool_contacts.push_back(contact);
}

void tell_contacts(SessionState& state) {
  const haptics_internal::Proxy& proxy = state.proxy;
  const LoopScene& scene = proxy.scene();
  for (std::size_t k = 0; k < state.ticks.size(); ++k) {
    HapticTick& tick = state.ticks[k];
    tick.contacts.clear();
    tick.candidates.clear();
    tick.tool_contacts.clear();
    tick.impulses = proxy.impulses(k);
    tick.trocar_force_W = proxy.trocar_force_W(k);
  }
  for (const HoldPoint& hold : proxy.holds()) {
    ToolContactPoint contact = point_of(hold, scene);
    contact.force_W = proxy.force_W(hold);
    contact.state =
        state_of(contact.force_W, hold.nhat_AB_W, scene.obstacles[hold.obstacle]->friction);
    HapticTick& tick = state.ticks[scene.bodies[hold.body].tool];
    if (hold.other) {
      tell_tool_contact(state, contact, hold);
    } else {
      (contact.state == ContactState::Open ? tick.candidates : tick.contacts).push_back(contact);
    }
  }
}

// A bound of the speed of all points of a body if the tool keeps the motion of this tick.
Scalar body_speed(const haptics_internal::ToolBody& body, const ToolStep& step, Scalar dt) {
  if (!(dt > 0)) return 0;
  const Scalar hinge_turn = body.hinge ? std::abs(step.angles[*body.hinge]) : 0;
  return (step.v_W.norm() + step.w_W.norm() * body.reach +
          hinge_turn * body.shape->bounding_radius()) /
         dt;
}

// Takes the pair's bounds into a clearance if they are nearer. The points are the tool's and the
// other side's.
void narrow(const ProxyPair& pair, Scalar margin, Scalar speed, const Vector3& p_WT,
            const Vector3& p_WO, ToolClearance& clearance) {
  clearance.lower = std::min(clearance.lower, pair.distance.lower);
  const Scalar free = pair.distance.lower - margin;
  const Scalar time = free > 0 ? (speed > 0 ? free / speed : kInfinity) : 0;
  clearance.time_to_breach = std::min(clearance.time_to_breach, time);
  if (!(pair.distance.upper < clearance.upper)) return;
  clearance.upper = pair.distance.upper;
  clearance.p_WT = p_WT;
  clearance.p_WO = p_WO;
  clearance.is_breached = pair.distance.upper < margin;
}

void tell_clearances(SessionState& state, const ToolSteps& steps, Scalar dt) {
  ToolClearance none;
  none.lower = kInfinity;
  const std::size_t tools = state.ticks.size();
  for (HapticTick& tick : state.ticks) {
    tick.clearances.assign(state.obstacles().size(), none);
    tick.tool_clearances.assign(tools > 1 ? tools : 0, none);
  }
  const LoopScene& scene = state.proxy.scene();
  for (const ProxyPair& pair : state.proxy.pairs()) {
    const Obstacle& obstacle = *scene.obstacles[pair.obstacle];
    const haptics_internal::ToolBody& body = scene.bodies[pair.body];
    const auto& [lower, upper, p_WA, p_WB] = pair.distance;
    const Scalar speed = body_speed(body, steps[body.tool], dt);
    HapticTick& tick = state.ticks[body.tool];
    const auto number = scene.body_of(pair.obstacle);
    if (!number) {
      narrow(pair, obstacle.margin, speed + obstacle.speed(), p_WB, p_WA,
             tick.clearances[pair.obstacle]);
      continue;
    }
    const haptics_internal::ToolBody& other = scene.bodies[*number];
    const Scalar both = speed + body_speed(other, steps[other.tool], dt);
    narrow(pair, obstacle.margin, both, p_WB, p_WA, tick.tool_clearances[other.tool]);
    narrow(pair, obstacle.margin, both, p_WA, p_WB,
           state.ticks[other.tool].tool_clearances[body.tool]);
  }
}

// What soft regions pull the hand with.
AddedPull soft_pull(const ToolState& tool, const RigidPose& X_WT, const Vector3& p_WD) {
  AddedPull sum;
  for (const auto& region : tool.soft_regions) {
    const AddedPull pull = region->pull(X_WT, p_WD);
    sum.wrench.force_W += pull.wrench.force_W;
    sum.wrench.torque_W += pull.wrench.torque_W;
    sum.stored += pull.stored;
  }
  return sum;
}

// The wrench for a device where it is, or where it last was.
void tell_wrench(ToolState& tool, DeviceFilter::Verdict verdict, Scalar dt, HapticTick& tick) {
  if (verdict == DeviceFilter::Verdict::Moved) tool.coupling.rebase();
  if (verdict == DeviceFilter::Verdict::Invalid || !tool.filter.goal()) {
    tool.coupling.release();
    tick.wrench = {};
    return;
  }
  const RigidPose& X_WD = tool.filter.goal()->X_WT;
  const RigidPose& X_WT = tick.tool.X_WT;
  tick.wrench = tool.coupling.update(X_WD, X_WT, dt, soft_pull(tool, X_WT, X_WD.translation()));
  tick.energy_returned = tool.coupling.energy_returned();
}

void tell_tissue(const SessionState& state, Scalar late, HapticTick& tick) {
  tick.tissue_stopped = late;
  tick.tissue_lag = 0;
  tick.tissue_behind = 0;
  const auto obstacles = state.obstacles();
  for (std::size_t k = 0; k < obstacles.size(); ++k) {
    tick.tissue_lag = std::max(tick.tissue_lag, obstacles[k]->lag());
    tick.tissue_behind = std::max(tick.tissue_behind, obstacles[k]->behind());
    tick.snapshots[k] = obstacles[k]->snapshots_seen();
    tick.progress[k] = obstacles[k]->progress();
    tick.inputs[k] = obstacles[k]->input();
  }
  for (const ToolState& tool : state.tools) {
    for (const auto& region : tool.soft_regions) {
      tick.tissue_lag = std::max(tick.tissue_lag, region->region().lag());
      tick.tissue_behind = std::max(tick.tissue_behind, region->region().behind());
    }
  }
}

// What came of a tick, before it is told.
struct Outcome {
  PerTool<DeviceFilter::Verdict> verdicts;
  Scalar dt;  // that passed
  FollowReport report = {};
  bool was_cut = false;
  ToolSteps steps = {};
  Scalar late = 0;  // time in which tissue stood
};

// Each region's own proxy goes where its tool is now.
void follow_in_soft_regions(SessionState& state, Scalar dt, TickStatistics& work) {
  for (std::size_t k = 0; k < state.tools.size(); ++k) {
    for (const auto& region : state.tools[k].soft_regions) {
      region->region().let_see(state.obstacles()[region->obstacle()]->snapshots_seen());
      region->follow(state.proxy.poses()[k], dt, state.clock, work);
    }
  }
}

// The energy that springs hold must not grow with their stiffness, so that waits until they hold
// none.
void stiffen(SessionState& state, std::size_t number, bool is_free) {
  ToolState& tool = state.tools[number];
  const auto allowed = [&](const Vector3& now, const Vector3& wanted) {
    return is_free ? wanted : Vector3(now.cwiseMin(wanted));
  };
  const CouplingOptions& now = tool.coupling.options();
  CouplingOptions next = tool.wanted;
  next.stiffness = allowed(now.stiffness, next.stiffness);
  next.rotational_stiffness = allowed(now.rotational_stiffness, next.rotational_stiffness);
  tool.coupling.set_options(next);
  state.proxy.set_coupling(number, next);
  tool.is_stiffening = next.stiffness != tool.wanted.stiffness ||
                       next.rotational_stiffness != tool.wanted.rotational_stiffness;
}

// The stages of a tick up to the clearances. Without a device pose the proxy stays where it is,
// unless tissue pushes it. A tick that only has to leave soft regions and clearances to the next
// has done all that its status tells.
Outcome run_stages(SessionState& state, std::span<const DevicePose> devices, Scalar dt,
                   TickStatistics& work) {
  using Verdict = DeviceFilter::Verdict;
  const std::size_t tools = state.tools.size();
  const ToolPoses before = state.proxy.poses();
  Outcome outcome{PerTool<Verdict>(tools), dt >= 0 && dt < kInfinity ? dt : 0};
  PerTool<std::optional<ToolPose>> goals(tools);
  for (std::size_t k = 0; k < tools; ++k) {
    outcome.verdicts[k] = state.tools[k].filter.judge(devices[k], dt);
    if (outcome.verdicts[k] != Verdict::Invalid) goals[k] = state.tools[k].filter.goal();
  }
  outcome.report = state.proxy.follow(goals, outcome.dt, state.clock, work);
  outcome.was_cut = state.clock.cutoff().has_value();
  follow_in_soft_regions(state, outcome.dt, work);
  state.proxy.measure({state.clock, state.options.clearance_work}, work);
  const haptics_internal::NewNeighbours beside_new = state.proxy.beside_new();
  outcome.report.recovering |= beside_new.recovering;
  outcome.report.overlapping |= beside_new.overlapping;
  outcome.steps = haptics_internal::step_between(before, state.proxy.poses());
  const Scalar late = outcome.dt - outcome.report.committed;
  if (late > kTimeNoise * outcome.dt) outcome.late = late;
  return outcome;
}

HapticStatus status_of(const Outcome& outcome, std::size_t tool) {
  switch (outcome.verdicts[tool]) {
    case DeviceFilter::Verdict::Invalid:
      return HapticStatus::InvalidInput;
    case DeviceFilter::Verdict::Outlier:
      return HapticStatus::Outlier;
    case DeviceFilter::Verdict::Usable:
    case DeviceFilter::Verdict::Moved:
      break;
  }
  return status_of(outcome.report, tool, outcome.was_cut, outcome.late > 0);
}

void tell(SessionState& state, const Outcome& outcome, std::size_t number, Scalar dt) {
  HapticTick& tick = state.ticks[number];
  ToolState& tool = state.tools[number];
  tick.time = state.time;
  tick.tool = state.proxy.poses()[number];
  tick.path = state.proxy.path(number);
  tick.path_progress = state.proxy.path_progress();
  tick.cutoff = state.clock.cutoff();
  tell_tissue(state, outcome.late, tick);
  tell_wrench(tool, outcome.verdicts[number], dt, tick);
  tick.status = status_of(outcome, number);
  if (tool.is_stiffening) stiffen(state, number, tick.status == HapticStatus::Free);
}

void run_tick(SessionState& state, std::span<const DevicePose> devices, Scalar dt) {
  DYOP_REQUIRE(devices.size() == state.tools.size(), "HapticSession: ", devices.size(),
               " device poses for ", state.tools.size(), " tools");
  const auto start = std::chrono::steady_clock::now();
  state.is_fresh = false;
  TickStatistics work;
  const Outcome outcome = run_stages(state, devices, dt, work);
  state.time += outcome.dt;
  work.checkpoints = state.clock.checkpoints();
  work.work = state.clock.work();
  for (const auto& obstacle : state.obstacles()) obstacle->stop(outcome.late);
  tell_contacts(state);
  tell_clearances(state, outcome.steps, outcome.dt);
  for (std::size_t k = 0; k < state.tools.size(); ++k) tell(state, outcome, k, dt);
  const auto latency = std::chrono::steady_clock::now() - start;
  for (HapticTick& tick : state.ticks) {
    tick.statistics = work;
    tick.latency = latency;
  }
  if (state.observer) state.observer->on_tick(devices, dt, state.ticks);
}

void require_tool(const SessionState& state, std::size_t tool) {
  DYOP_REQUIRE(tool < state.tools.size(), "HapticSession: there is no tool ", tool, " of ",
               state.tools.size());
}

DeformingObstacle& deforming(const SessionState& state, std::size_t number) {
  DYOP_REQUIRE(number < state.obstacles().size(), "HapticSession: there is no obstacle ", number,
               " of ", state.obstacles().size());
  auto* obstacle = dynamic_cast<DeformingObstacle*>(state.obstacles()[number].get());
  DYOP_REQUIRE(obstacle, "HapticSession: obstacle ", number, " does not deform");
  return *obstacle;
}

void require_places(const SessionState& state, const char* name,
                    std::span<const Vector3> vertices) {
  const Scalar most = haptics_internal::largest_coordinate(state.options);
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    DYOP_REQUIRE(vertices[k].cwiseAbs().maxCoeff() <= most, name, ": vertex ", k, " is (",
                 vertices[k].transpose(), "), its coordinates must be finite and at most ", most);
  }
}

void require_duration(const SessionState& state, const char* name, Scalar duration) {
  // As constructed: another thread may ask.
  const Scalar least = kLeastDuration * state.options.coupling.period;
  DYOP_REQUIRE(duration >= least && duration < kInfinity, name,
               ": duration must be finite and at least a millionth of the period, ", least,
               ", not ", duration);
}

void require_valid(const ContactSearch& search, const ObstacleProgress& progress) {
  DYOP_REQUIRE(search.reach > 0 && search.reach < kInfinity,
               "find_contacts: reach must be finite and > 0, not ", search.reach);
  DYOP_REQUIRE(search.rise >= 0 && search.rise <= 1, "find_contacts: rise must be in [0, 1], not ",
               search.rise);
  DYOP_REQUIRE(search.spread >= 0, "find_contacts: spread must be >= 0, not ", search.spread);
  DYOP_REQUIRE(progress.fraction >= 0 && progress.fraction <= 1,
               "find_contacts: fraction must be in [0, 1], not ", progress.fraction);
}

bool is_crowded(const ToolContactPoint& point, Scalar spread,
                std::span<const ToolContactPoint> contacts) {
  return std::any_of(contacts.begin(), contacts.end(), [&](const ToolContactPoint& contact) {
    return contact.part == point.part && (contact.p_W - point.p_W).norm() < spread;
  });
}

// An obstacle after the copies of it that soft regions have, one for each tool.
std::vector<DeformingObstacle*> with_copies(const SessionState& state, std::size_t number) {
  DeformingObstacle& tissue = deforming(state, number);
  std::vector<DeformingObstacle*> all;
  for (const ToolState& tool : state.tools) {
    for (const auto& region : tool.soft_regions) {
      if (region->obstacle() != number) continue;
      all.push_back(static_cast<DeformingObstacle*>(&region->region()));
    }
  }
  all.push_back(&tissue);
  return all;
}

// To all or to none. To the copies first, so that what the tick has seen of the obstacle is there
// of them.
template <typename Give>
bool give(SessionState& state, const char* name, std::size_t number,
          std::span<const Vector3> vertices, const Give& give_to) {
  const std::vector<DeformingObstacle*> all = with_copies(state, number);
  require_places(state, name, vertices);
  // None of them gets a next one meanwhile.
  const std::lock_guard one_giver(state.giving);
  if (std::ranges::any_of(all, &DeformingObstacle::has_next)) return false;
  return std::ranges::all_of(all, give_to,
                             [](DeformingObstacle* one) -> DeformingObstacle& { return *one; });
}

}  // namespace

Eigen::MatrixXd tool_jacobian(std::span<const ToolHinge> hinges, const ToolPose& tool,
                              const ToolPoint& point) {
  const auto cross = [](const Vector3& r) {
    Matrix3 m;
    m << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    return m;
  };
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, 6 + Eigen::Index(hinges.size()));
  J.leftCols<3>().setIdentity();
  J.middleCols<3>(3) = -cross(point.p_W - tool.X_WT.translation());
  if (!point.hinge) return J;
  DYOP_REQUIRE(*point.hinge < hinges.size(), "tool_jacobian: the point names hinge ", *point.hinge,
               " of ", hinges.size());
  const RigidPose X_WJ = tool.X_WT * hinges[*point.hinge].X_TJ;
  J.col(6 + Eigen::Index(*point.hinge)) =
      X_WJ.rotation().col(2).cross(point.p_W - X_WJ.translation());
  return J;
}

Eigen::VectorXd tool_displacement(std::size_t hinges, const ToolPose& from, const ToolPose& to) {
  DYOP_REQUIRE(hinges <= kMostHinges, "tool_displacement: a tool has at most ", kMostHinges,
               " hinges, not ", hinges);
  const ToolStep step = haptics_internal::step_between(from, to);
  Eigen::VectorXd x(6 + Eigen::Index(hinges));
  x.head<3>() = step.v_W;
  x.segment<3>(3) = step.w_W;
  for (std::size_t k = 0; k < hinges; ++k) x[6 + Eigen::Index(k)] = step.angles[k];
  return x;
}

ToolPose displaced(const ToolPose& from, const Eigen::VectorXd& displacement) {
  const Eigen::Index hinges = displacement.size() - 6;
  DYOP_REQUIRE(hinges >= 0 && hinges <= Eigen::Index(kMostHinges),
               "displaced: a displacement has 6 to ", 6 + kMostHinges, " numbers, not ",
               displacement.size());
  ToolStep step{displacement.head<3>(), displacement.segment<3>(3), {}};
  for (Eigen::Index k = 0; k < hinges; ++k) step.angles[std::size_t(k)] = displacement[6 + k];
  return haptics_internal::ToolMotion(from, step, 1, {}).at(1);
}

Eigen::VectorXd coupling_compliance(const CouplingOptions& coupling,
                                    std::span<const ToolHinge> hinges) {
  Eigen::VectorXd compliance(6 + Eigen::Index(hinges.size()));
  compliance.head<3>() = coupling.stiffness.cwiseInverse();
  compliance.segment<3>(3) = coupling.rotational_stiffness.cwiseInverse();
  for (std::size_t k = 0; k < hinges.size(); ++k) {
    compliance[6 + Eigen::Index(k)] = 1 / hinges[k].stiffness;
  }
  return compliance;
}

Eigen::MatrixXd coupling_compliance(const CouplingOptions& coupling,
                                    std::span<const ToolHinge> hinges, const ToolPose& tool,
                                    std::span<const ToolPoint> points) {
  Eigen::MatrixXd J(3 * Eigen::Index(points.size()), 6 + Eigen::Index(hinges.size()));
  for (std::size_t k = 0; k < points.size(); ++k) {
    J.middleRows<3>(3 * Eigen::Index(k)) = tool_jacobian(hinges, tool, points[k]);
  }
  return J * coupling_compliance(coupling, hinges).asDiagonal() * J.transpose();
}

HapticSession::HapticSession(const HapticScene& scene, const HapticOptions& options) {
  require_valid(options);
  require_valid(scene);
  state_ = std::make_unique<SessionState>(scene, options);
  // Without a limit, so that the first tick knows what is far.
  haptics_internal::WorkClock unlimited;
  TickStatistics work;
  state_->proxy.measure(haptics_internal::WorkShare(unlimited), work);
  for (std::size_t k = 0; k < state_->tools.size(); ++k) {
    HapticTick& tick = state_->ticks[k];
    tick.tool = state_->proxy.poses()[k];
    tick.clearances.resize(scene.obstacles.size());
    tick.snapshots.resize(scene.obstacles.size());
    tick.progress.resize(scene.obstacles.size());
    tick.inputs.resize(scene.obstacles.size());
    tick.contacts.reserve(std::size_t(options.max_contacts));
    tick.candidates.reserve(std::size_t(options.max_contacts));
  }
}

HapticSession::~HapticSession() = default;
HapticSession::HapticSession(HapticSession&&) noexcept = default;
HapticSession& HapticSession::operator=(HapticSession&&) noexcept = default;

const HapticTick& HapticSession::update(const DevicePose& device, Scalar dt,
                                        const Deadline& deadline) {
  return update(std::span(&device, 1), dt, deadline).front();
}

std::span<const HapticTick> HapticSession::update(std::span<const DevicePose> devices, Scalar dt,
                                                  const Deadline& deadline) {
  state_->clock.start(deadline);
  run_tick(*state_, devices, dt);
  return state_->ticks;
}

const HapticTick& HapticSession::replay(const DevicePose& device, Scalar dt,
                                        const std::optional<TickCutoff>& cutoff) {
  return replay(std::span(&device, 1), dt, cutoff).front();
}

std::span<const HapticTick> HapticSession::replay(std::span<const DevicePose> devices, Scalar dt,
                                                  const std::optional<TickCutoff>& cutoff) {
  state_->clock.start(cutoff);
  run_tick(*state_, devices, dt);
  return state_->ticks;
}

void HapticSession::replay_turn(std::size_t obstacle, Scalar end) {
  deforming(*state_, obstacle).replay_turn(end);
}

bool HapticSession::is_fresh() const {
  const auto is_fresh = [](const auto& obstacle) {
    const auto* tissue = dynamic_cast<const DeformingObstacle*>(obstacle.get());
    return !tissue || tissue->is_fresh();
  };
  return state_->is_fresh && std::ranges::all_of(state_->obstacles(), is_fresh);
}

void HapticSession::observe(std::shared_ptr<HapticObserver> observer) {
  const std::lock_guard no_giver(state_->giving);
  DYOP_REQUIRE(!observer || is_fresh(), "HapticSession: ",
               "it can be observed from its start only, before ticks and inputs");
  state_->observer = std::move(observer);
  for (std::size_t k = 0; k < state_->obstacles().size(); ++k) {
    auto* tissue = dynamic_cast<DeformingObstacle*>(state_->obstacles()[k].get());
    if (tissue) tissue->observe(state_->observer.get(), k);
  }
}

const std::shared_ptr<HapticObserver>& HapticSession::observer() const {
  return state_->observer;
}

const HapticScene& HapticSession::scene() const {
  return state_->scene;
}

const HapticOptions& HapticSession::options() const {
  return state_->options;
}

void HapticSession::set_coupling(const CouplingOptions& coupling, std::size_t tool) {
  require_tool(*state_, tool);
  const VirtualCoupling checked(coupling);
  state_->is_fresh = false;
  if (state_->observer) state_->observer->on_coupling(tool, checked.options());
  state_->tools[tool].wanted = checked.options();
  const HapticStatus last = state_->ticks[tool].status;
  stiffen(*state_, tool, last == HapticStatus::Free || last == HapticStatus::NotRun);
}

const CouplingOptions& HapticSession::coupling(std::size_t tool) const {
  require_tool(*state_, tool);
  return state_->tools[tool].coupling.options();
}

void HapticSession::reset(const ToolPose& pose, std::size_t tool) {
  require_tool(*state_, tool);
  const Scalar most = haptics_internal::largest_coordinate(state_->options);
  const Vector3& p_WT = pose.X_WT.translation();
  DYOP_REQUIRE(p_WT.cwiseAbs().maxCoeff() <= most, "HapticSession: reset to (", p_WT.transpose(),
               "), coordinates must be at most ", most);
  for (const Scalar angle : pose.angles) {
    DYOP_REQUIRE(std::isfinite(angle), "HapticSession: reset to an angle of ", angle);
  }
  state_->is_fresh = false;
  if (state_->observer) state_->observer->on_reset(tool, pose);
  state_->proxy.reset(tool, pose);
  ToolState& changed = state_->tools[tool];
  for (const auto& region : changed.soft_regions) region->reset(pose);
  changed.filter.reset();
  changed.coupling.release();
  haptics_internal::WorkClock unlimited;
  TickStatistics work;
  state_->proxy.measure(haptics_internal::WorkShare(unlimited), work);
  state_->ticks[tool].status = HapticStatus::NotRun;
  state_->ticks[tool].tool = pose;
}

const HapticTick& HapticSession::last(std::size_t tool) const {
  require_tool(*state_, tool);
  return state_->ticks[tool];
}

Scalar HapticSession::time() const {
  return state_->time;
}

bool HapticSession::is_passive() const {
  return std::all_of(state_->tools.begin(), state_->tools.end(), [](const ToolState& tool) {
    const CouplingOptions& springs = tool.coupling.options();
    const bool is_soft =
        std::all_of(tool.soft_regions.begin(), tool.soft_regions.end(), [&](const auto& region) {
          return springs.device_damping >
                 least_passive_damping(region->stiffness(), 0, springs.period);
        });
    return is_soft && tool.coupling.is_passive();
  });
}

std::size_t HapticSession::tool_count() const {
  return state_->tools.size();
}

std::size_t HapticSession::obstacle_count() const {
  return state_->obstacles().size();
}

bool HapticSession::give_snapshot(std::size_t obstacle, std::span<const Vector3> vertices,
                                  Scalar duration) {
  require_duration(*state_, "give_snapshot", duration);
  return give(*state_, "give_snapshot", obstacle, vertices,
              [&](DeformingObstacle& tissue) { return tissue.give(vertices, duration); });
}

void HapticSession::expect_snapshots(std::size_t obstacle) {
  for (DeformingObstacle* one : with_copies(*state_, obstacle)) one->expect_snapshots();
}

bool HapticSession::give_mesh(std::size_t obstacle, std::span<const Vector3> vertices,
                              std::span<const TriangleIndices> triangles) {
  return give(*state_, "give_mesh", obstacle, vertices,
              [&](DeformingObstacle& tissue) { return tissue.give_mesh(vertices, triangles); });
}

bool HapticSession::retarget(std::size_t obstacle, std::span<const Vector3> vertices,
                             Scalar duration, Scalar lead) {
  require_duration(*state_, "retarget", duration);
  DeformingObstacle& tissue = deforming(*state_, obstacle);
  require_places(*state_, "retarget", vertices);
  for (const auto& region : state_->tools[0].soft_regions) {
    DYOP_REQUIRE(region->obstacle() != obstacle, "retarget: obstacle ", obstacle,
                 " is a soft region; give it snapshots");
  }
  const std::lock_guard one_giver(state_->giving);
  return tissue.retarget(vertices, duration, lead);
}

bool HapticSession::find_contacts(std::size_t obstacle, const ObstacleProgress& progress,
                                  const ToolPose& pose, const ContactSearch& search,
                                  std::vector<ToolContactPoint>& contacts, std::size_t tool) {
  const DeformingObstacle& tissue = deforming(*state_, obstacle);
  require_valid(search, progress);
  require_tool(*state_, tool);
  const std::lock_guard one_giver(state_->giving);
  const LoopScene& scene = state_->proxy.scene();
  std::vector<HoldPoint>& found = state_->found;
  found.clear();
  for (std::size_t k = scene.first_body[tool]; k < scene.first_body[tool + 1]; ++k) {
    const haptics_internal::ToolBody& body = scene.bodies[k];
    const RigidPose X_WB =
        pose.X_WT * haptics_internal::body_in_tool(body, scene.tools[tool].hinges, pose);
    const std::size_t first = found.size();
    if (!tissue.find_holds(progress, body, X_WB, search, state_->search_memory, found)) {
      return false;
    }
    for (std::size_t i = first; i < found.size(); ++i) {
      found[i].body = k;
      found[i].obstacle = obstacle;
    }
  }
  std::sort(found.begin(), found.end(), [](const HoldPoint& x, const HoldPoint& y) {
    return std::tuple(x.gap(), x.body, x.key) < std::tuple(y.gap(), y.body, y.key);
  });
  contacts.clear();
  for (const HoldPoint& hold : found) {
    const ToolContactPoint point = point_of(hold, scene);
    if (!is_crowded(point, search.spread, contacts)) contacts.push_back(point);
  }
  return true;
}

std::vector<Vector3> HapticSession::tissue_vertices(std::size_t obstacle) const {
  const DeformingObstacle& tissue = deforming(*state_, obstacle);
  std::vector<Vector3> vertices;
  for (std::size_t k = 0; k < tissue.shown().begin().size(); ++k) {
    vertices.push_back(tissue.place(std::int32_t(k)));
  }
  return vertices;
}

// Copies may have been stopped for longer.
std::int64_t HapticSession::snapshots_taken(std::size_t obstacle) const {
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  for (const DeformingObstacle* one : with_copies(*state_, obstacle)) {
    least = std::min(least, one->snapshots_taken());
  }
  return least;
}

const char* words_of(HapticStatus status) {
  switch (status) {
    case HapticStatus::NotRun:
      return "not run";
    case HapticStatus::Free:
      return "free";
    case HapticStatus::Held:
      return "held by contact";
    case HapticStatus::Blocked:
      return "behind the device";
    case HapticStatus::Deadline:
      return "cut off by a limit";
    case HapticStatus::Trapped:
      return "trapped, tissue stopped";
    case HapticStatus::Recovering:
      return "leaving a margin";
    case HapticStatus::Overlapping:
      return "leaving tissue";
    case HapticStatus::InvalidInput:
      return "bad input";
    case HapticStatus::Outlier:
      return "outlier ignored";
  }
  throw InternalError("unknown status of a tick");
}

}  // namespace dyop
