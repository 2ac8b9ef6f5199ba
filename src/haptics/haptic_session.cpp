// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_session.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "haptics/deforming_obstacle.h"
#include "haptics/proxy.h"

namespace dyop {
namespace haptics_internal {

struct SessionState {
  SessionState(const HapticScene& scene, const HapticOptions& given)
      : options(given), proxy(scene, given), coupling(given.coupling), clock(given.max_work) {}

  HapticOptions options;
  Proxy proxy;
  VirtualCoupling coupling;
  WorkClock clock;
  HapticTick tick;
  Scalar time = 0;
};

}  // namespace haptics_internal

namespace {

using haptics_internal::DeformingObstacle;
using haptics_internal::FollowReport;
using haptics_internal::HoldPoint;
using haptics_internal::Obstacle;
using haptics_internal::ProxyPair;
using haptics_internal::SessionState;
using haptics_internal::ToolStep;

// Time that a tick may miss by rounding.
constexpr Scalar kTimeNoise = 0x1p-20;

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

void require_valid(const HapticScene& scene) {
  DYOP_REQUIRE(scene.hinges.size() <= kMostHinges, "HapticSession: a tool has at most ",
               kMostHinges, " hinges, not ", scene.hinges.size());
  for (const ToolHinge& hinge : scene.hinges) {
    require_positive("a hinge's stiffness", hinge.stiffness);
    DYOP_REQUIRE(std::isfinite(hinge.angle), "HapticSession: a hinge's angle must be finite, not ",
                 hinge.angle);
  }
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

// A pose that a device may be at; devices send quaternions in single precision.
std::optional<ToolPose> checked(const DevicePose& device) {
  const Scalar norm = device.q_WD.norm();
  const bool is_sound = device.p_WD.allFinite() &&
                        device.p_WD.cwiseAbs().maxCoeff() <= kLargestCoordinate &&
                        std::abs(norm - 1) <= kDeviceRotationTolerance;
  if (!is_sound) return std::nullopt;
  ToolPose pose{RigidPose(device.q_WD.normalized(), device.p_WD), device.angles};
  for (const Scalar angle : pose.angles) {
    if (!std::isfinite(angle)) return std::nullopt;
  }
  return pose;
}

HapticStatus status_of(const FollowReport& report, bool was_cut, bool is_late) {
  if (report.was_overlapping) return HapticStatus::Overlapping;
  if (report.was_recovering) return HapticStatus::Recovering;
  if (was_cut) return HapticStatus::Deadline;
  if (is_late) return HapticStatus::Trapped;
  if (report.is_at_goal) return HapticStatus::Free;
  return report.is_held ? HapticStatus::Held : HapticStatus::Blocked;
}

void tell_contacts(const SessionState& state, HapticTick& tick) {
  tick.contacts.clear();
  for (const HoldPoint& hold : state.proxy.holds()) {
    if (hold.impulse_W.isZero(0)) continue;
    tick.contacts.push_back(
        {hold.obstacle, hold.body, hold.p_WB, hold.nhat_AB_W, hold.gap(), hold.impulse_W});
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

void tell_clearances(const SessionState& state, const ToolStep& step, Scalar dt, HapticTick& tick) {
  for (ToolClearance& clearance : tick.clearances) {
    clearance = {};
    clearance.lower = kInfinity;
  }
  for (const ProxyPair& pair : state.proxy.pairs()) {
    const Obstacle& obstacle = *state.proxy.obstacles()[pair.obstacle];
    ToolClearance& clearance = tick.clearances[pair.obstacle];
    clearance.lower = std::min(clearance.lower, pair.distance.lower);
    const Scalar speed = body_speed(state.proxy.bodies()[pair.body], step, dt) + obstacle.speed();
    const Scalar free = pair.distance.lower - obstacle.margin;
    const Scalar time = free > 0 ? (speed > 0 ? free / speed : kInfinity) : 0;
    clearance.time_to_breach = std::min(clearance.time_to_breach, time);
    if (!(pair.distance.upper < clearance.upper)) continue;
    clearance.upper = pair.distance.upper;
    clearance.p_WT = pair.distance.p_WB;
    clearance.p_WO = pair.distance.p_WA;
    clearance.is_breached = pair.distance.upper < obstacle.margin;
  }
}

// Soft regions push the tool, and so the hand, away from their nearest points.
void add_soft_forces(const SessionState& state, HapticTick& tick) {
  for (std::size_t k = 0; k < tick.clearances.size(); ++k) {
    const Obstacle& obstacle = *state.proxy.obstacles()[k];
    if (obstacle.role != ObstacleRole::SoftRegion) continue;
    const ToolClearance& clearance = tick.clearances[k];
    const Scalar depth = obstacle.margin - clearance.upper;
    const Vector3 apart = clearance.p_WT - clearance.p_WO;
    const Scalar length = apart.norm();
    if (!(depth > 0) || !(length > 0)) continue;
    const Vector3 force = obstacle.soft_stiffness * depth / length * apart;
    tick.wrench.force_W += force;
    tick.wrench.torque_W += (clearance.p_WT - tick.tool.X_WT.translation()).cross(force);
  }
}

const HapticTick& run_tick(SessionState& state, const DevicePose& device, Scalar dt) {
  HapticTick& tick = state.tick;
  tick.statistics = {};
  tick.cutoff.reset();
  const std::optional<ToolPose> goal = checked(device);
  const bool is_valid = goal && dt >= 0 && dt < kInfinity;
  const ToolPose before = state.proxy.pose();
  const Scalar passed = dt >= 0 && dt < kInfinity ? dt : 0;
  // Without a device pose the proxy stays where it is, unless tissue pushes it.
  const FollowReport report =
      state.proxy.follow(is_valid ? goal : std::nullopt, passed, state.clock, tick.statistics);
  // A tick that only has to leave clearances to the next has done all that its status tells.
  const bool was_cut = state.clock.cutoff().has_value();
  state.proxy.measure({state.clock, state.options.clearance_work}, tick.statistics);
  const Scalar late = passed - report.committed;
  const bool is_late = late > kTimeNoise * passed;
  state.time += passed;
  tick.tissue_stopped = is_late ? late : 0;
  tick.tissue_lag = 0;
  for (const auto& obstacle : state.proxy.obstacles()) {
    obstacle->stop(tick.tissue_stopped);
    tick.tissue_lag = std::max(tick.tissue_lag, obstacle->lag());
  }
  tick.tool = state.proxy.pose();
  tick.path = state.proxy.path();
  tick.cutoff = state.clock.cutoff();
  tick.statistics.checkpoints = state.clock.checkpoints();
  tick.statistics.work = state.clock.work();
  for (std::size_t k = 0; k < tick.snapshots.size(); ++k) {
    tick.snapshots[k] = state.proxy.obstacles()[k]->snapshots_seen();
  }
  tell_contacts(state, tick);
  tell_clearances(state, haptics_internal::step_between(before, tick.tool), passed, tick);
  if (is_valid) {
    tick.wrench = state.coupling.update(goal->X_WT, tick.tool.X_WT, dt);
    tick.energy_returned = state.coupling.energy_returned();
    add_soft_forces(state, tick);
  } else {
    state.coupling.release();
    tick.wrench = {};
  }
  tick.status = is_valid ? status_of(report, was_cut, is_late) : HapticStatus::InvalidInput;
  return tick;
}

DeformingObstacle& deforming(const SessionState& state, std::size_t number) {
  DYOP_REQUIRE(number < state.proxy.obstacles().size(), "HapticSession: there is no obstacle ",
               number, " of ", state.proxy.obstacles().size());
  auto* obstacle = dynamic_cast<DeformingObstacle*>(state.proxy.obstacles()[number].get());
  DYOP_REQUIRE(obstacle, "HapticSession: obstacle ", number, " does not deform");
  return *obstacle;
}

}  // namespace

HapticSession::HapticSession(const HapticScene& scene, const HapticOptions& options) {
  require_valid(options);
  require_valid(scene);
  state_ = std::make_unique<SessionState>(scene, options);
  // Without a limit, so that the first tick knows what is far.
  haptics_internal::WorkClock unlimited;
  state_->proxy.measure(haptics_internal::WorkShare(unlimited), state_->tick.statistics);
  state_->tick.tool = state_->proxy.pose();
  state_->tick.clearances.resize(scene.obstacles.size());
  state_->tick.snapshots.resize(scene.obstacles.size());
  state_->tick.contacts.reserve(std::size_t(options.max_contacts));
}

HapticSession::~HapticSession() = default;
HapticSession::HapticSession(HapticSession&&) noexcept = default;
HapticSession& HapticSession::operator=(HapticSession&&) noexcept = default;

const HapticTick& HapticSession::update(const DevicePose& device, Scalar dt,
                                        const Deadline& deadline) {
  const auto start = std::chrono::steady_clock::now();
  state_->clock.start(deadline);
  const HapticTick& tick = run_tick(*state_, device, dt);
  state_->tick.latency = std::chrono::steady_clock::now() - start;
  return tick;
}

const HapticTick& HapticSession::replay(const DevicePose& device, Scalar dt,
                                        const std::optional<TickCutoff>& cutoff) {
  const auto start = std::chrono::steady_clock::now();
  state_->clock.start(cutoff);
  const HapticTick& tick = run_tick(*state_, device, dt);
  state_->tick.latency = std::chrono::steady_clock::now() - start;
  return tick;
}

const HapticTick& HapticSession::last() const {
  return state_->tick;
}

Scalar HapticSession::time() const {
  return state_->time;
}

bool HapticSession::is_passive() const {
  return state_->coupling.is_passive();
}

std::size_t HapticSession::obstacle_count() const {
  return state_->proxy.obstacles().size();
}

bool HapticSession::give_snapshot(std::size_t obstacle, std::span<const Vector3> vertices,
                                  Scalar duration) {
  return deforming(*state_, obstacle).give(vertices, duration);
}

bool HapticSession::give_mesh(std::size_t obstacle, std::span<const Vector3> vertices,
                              std::span<const TriangleIndices> triangles) {
  return deforming(*state_, obstacle).give_mesh(vertices, triangles);
}

std::vector<Vector3> HapticSession::tissue_vertices(std::size_t obstacle) const {
  const DeformingObstacle& tissue = deforming(*state_, obstacle);
  std::vector<Vector3> vertices;
  for (std::size_t k = 0; k < tissue.shown().begin().size(); ++k) {
    vertices.push_back(tissue.place(std::int32_t(k)));
  }
  return vertices;
}

std::int64_t HapticSession::snapshots_taken(std::size_t obstacle) const {
  return deforming(*state_, obstacle).snapshots_taken();
}

}  // namespace dyop
