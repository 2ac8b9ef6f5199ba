// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_session.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/haptics/haptic_tick.h"
#include "haptics/deforming_obstacle.h"
#include "haptics/device_filter.h"
#include "haptics/proxy.h"
#include "haptics/soft_region.h"

namespace dyop {
namespace haptics_internal {

struct SessionState {
  SessionState(const HapticScene& scene, const HapticOptions& given)
      : options(given),
        proxy(scene, given),
        filter(given, reach_of(proxy.bodies())),
        coupling(given.coupling),
        clock(given.max_work) {
    for (std::size_t k = 0; k < scene.obstacles.size(); ++k) {
      const ToolObstacle& obstacle = scene.obstacles[k];
      if (obstacle.role != ObstacleRole::SoftRegion || !(obstacle.soft_stiffness > 0)) continue;
      soft_regions.push_back(std::make_unique<SoftRegion>(scene, k, given));
    }
  }

  HapticOptions options;
  Proxy proxy;
  std::vector<std::unique_ptr<SoftRegion>> soft_regions;
  DeviceFilter filter;
  VirtualCoupling coupling;
  WorkClock clock;
  // Springs that shall act as soon as they may.
  CouplingOptions wanted = options.coupling;
  bool is_stiffening = false;  // not all of them do
  HapticTick tick;
  Scalar time = 0;
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
using haptics_internal::Obstacle;
using haptics_internal::ProxyPair;
using haptics_internal::SessionState;
using haptics_internal::ToolStep;

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

void require_valid(const HapticScene& scene) {
  DYOP_REQUIRE(scene.hinges.size() <= kMostHinges, "HapticSession: a tool has at most ",
               kMostHinges, " hinges, not ", scene.hinges.size());
  for (const ToolHinge& hinge : scene.hinges) {
    require_positive("a hinge's stiffness", hinge.stiffness);
    DYOP_REQUIRE(std::isfinite(hinge.angle), "HapticSession: a hinge's angle must be finite, not ",
                 hinge.angle);
  }
  if (scene.trocar) {
    const ToolTrocar& trocar = *scene.trocar;
    const Scalar length = trocar.axis_T.norm();
    DYOP_REQUIRE(
        length > 0 && length < kInfinity && trocar.p_W.allFinite() && trocar.p_T.allFinite(),
        "HapticSession: the trocar's points must be finite, and its axis not (",
        trocar.axis_T.transpose(), ")");
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

HapticStatus status_of(const FollowReport& report, bool was_cut, bool is_late) {
  if (report.was_overlapping) return HapticStatus::Overlapping;
  if (report.was_recovering) return HapticStatus::Recovering;
  if (was_cut) return HapticStatus::Deadline;
  if (is_late) return HapticStatus::Trapped;
  if (report.is_at_goal) return HapticStatus::Free;
  return report.is_held ? HapticStatus::Held : HapticStatus::Blocked;
}

ContactState state_of(const Vector3& force_W, const Vector3& nhat_W, Scalar friction) {
  if (force_W.isZero(0)) return ContactState::Open;
  const Scalar pressure = nhat_W.dot(force_W);
  const Scalar across = (force_W - pressure * nhat_W).norm();
  return across < (1 - kConeEdge) * friction * pressure ? ContactState::Stick : ContactState::Slip;
}

// Without its force.
ToolContactPoint point_of(const HoldPoint& hold,
                          std::span<const haptics_internal::ToolBody> bodies) {
  ToolContactPoint contact;
  contact.obstacle = hold.obstacle;
  contact.part = hold.body;
  contact.p_W = hold.p_WB;
  contact.nhat_W = hold.nhat_AB_W;
  contact.gap = hold.gap();
  contact.hinge = bodies[hold.body].hinge;
  contact.p_WO = hold.p_WA;
  contact.v_WO = hold.v_WA;
  contact.surface = hold.surface;
  return contact;
}

void tell_contacts(const SessionState& state, HapticTick& tick) {
  tick.contacts.clear();
  tick.candidates.clear();
  const haptics_internal::Proxy& proxy = state.proxy;
  for (const HoldPoint& hold : proxy.holds()) {
    ToolContactPoint contact = point_of(hold, proxy.bodies());
    contact.force_W = proxy.force_W(hold);
    contact.state =
        state_of(contact.force_W, hold.nhat_AB_W, proxy.obstacles()[hold.obstacle]->friction);
    (contact.state == ContactState::Open ? tick.candidates : tick.contacts).push_back(contact);
  }
  tick.impulses = proxy.impulses();
  tick.trocar_force_W = proxy.trocar_force_W();
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

// What soft regions pull the hand with.
AddedPull soft_pull(const SessionState& state, const Vector3& p_WD) {
  AddedPull sum;
  for (const auto& region : state.soft_regions) {
    const AddedPull pull = region->pull(state.proxy.pose().X_WT, p_WD);
    sum.wrench.force_W += pull.wrench.force_W;
    sum.wrench.torque_W += pull.wrench.torque_W;
    sum.stored += pull.stored;
  }
  return sum;
}

// The wrench for a device where it is, or where it last was.
void tell_wrench(SessionState& state, DeviceFilter::Verdict verdict, Scalar dt, HapticTick& tick) {
  if (verdict == DeviceFilter::Verdict::Moved) state.coupling.rebase();
  if (verdict == DeviceFilter::Verdict::Invalid || !state.filter.goal()) {
    state.coupling.release();
    tick.wrench = {};
    return;
  }
  const RigidPose& X_WD = state.filter.goal()->X_WT;
  tick.wrench =
      state.coupling.update(X_WD, tick.tool.X_WT, dt, soft_pull(state, X_WD.translation()));
  tick.energy_returned = state.coupling.energy_returned();
}

void tell_tissue(const SessionState& state, Scalar late, HapticTick& tick) {
  tick.tissue_stopped = late;
  tick.tissue_lag = 0;
  const auto& obstacles = state.proxy.obstacles();
  for (std::size_t k = 0; k < obstacles.size(); ++k) {
    obstacles[k]->stop(late);
    tick.tissue_lag = std::max(tick.tissue_lag, obstacles[k]->lag());
    tick.snapshots[k] = obstacles[k]->snapshots_seen();
    tick.progress[k] = obstacles[k]->progress();
  }
  for (const auto& region : state.soft_regions) {
    tick.tissue_lag = std::max(tick.tissue_lag, region->region().lag());
  }
}

// What came of a tick, before it is told.
struct Outcome {
  DeviceFilter::Verdict verdict;
  Scalar dt;  // that passed
  FollowReport report;
  bool was_cut = false;
  ToolStep step;    // of the tool
  Scalar late = 0;  // time in which tissue stood
};

// Each region's own proxy goes where the tool is now.
void follow_in_soft_regions(SessionState& state, Scalar dt) {
  for (const auto& region : state.soft_regions) {
    region->region().let_see(state.proxy.obstacles()[region->obstacle()]->snapshots_seen());
    region->follow(state.proxy.pose(), dt, state.clock, state.tick.statistics);
  }
}

// The energy that springs hold must not grow with their stiffness, so that waits until they hold
// none.
void stiffen(SessionState& state, bool is_free) {
  const auto allowed = [&](const Vector3& now, const Vector3& wanted) {
    return is_free ? wanted : Vector3(now.cwiseMin(wanted));
  };
  const CouplingOptions& now = state.coupling.options();
  CouplingOptions next = state.wanted;
  next.stiffness = allowed(now.stiffness, next.stiffness);
  next.rotational_stiffness = allowed(now.rotational_stiffness, next.rotational_stiffness);
  state.coupling.set_options(next);
  state.proxy.set_coupling(next);
  state.is_stiffening = next.stiffness != state.wanted.stiffness ||
                        next.rotational_stiffness != state.wanted.rotational_stiffness;
}

// The stages of a tick up to the clearances. Without a device pose the proxy stays where it is,
// unless tissue pushes it. A tick that only has to leave soft regions and clearances to the next
// has done all that its status tells.
Outcome run_stages(SessionState& state, const DevicePose& device, Scalar dt) {
  using Verdict = DeviceFilter::Verdict;
  TickStatistics& work = state.tick.statistics;
  const ToolPose before = state.proxy.pose();
  Outcome outcome{state.filter.judge(device, dt), dt >= 0 && dt < kInfinity ? dt : 0, {}, {}, {}};
  const std::optional<ToolPose> goal =
      outcome.verdict == Verdict::Invalid ? std::nullopt : state.filter.goal();
  outcome.report = state.proxy.follow(goal, outcome.dt, state.clock, work);
  outcome.was_cut = state.clock.cutoff().has_value();
  follow_in_soft_regions(state, outcome.dt);
  state.proxy.measure({state.clock, state.options.clearance_work}, work);
  outcome.step = haptics_internal::step_between(before, state.proxy.pose());
  const Scalar late = outcome.dt - outcome.report.committed;
  if (late > kTimeNoise * outcome.dt) outcome.late = late;
  return outcome;
}

HapticStatus status_of(const Outcome& outcome) {
  switch (outcome.verdict) {
    case DeviceFilter::Verdict::Invalid:
      return HapticStatus::InvalidInput;
    case DeviceFilter::Verdict::Outlier:
      return HapticStatus::Outlier;
    case DeviceFilter::Verdict::Usable:
    case DeviceFilter::Verdict::Moved:
      break;
  }
  return status_of(outcome.report, outcome.was_cut, outcome.late > 0);
}

const HapticTick& run_tick(SessionState& state, const DevicePose& device, Scalar dt) {
  HapticTick& tick = state.tick;
  tick.statistics = {};
  const Outcome outcome = run_stages(state, device, dt);
  state.time += outcome.dt;
  tick.time = state.time;
  tick.tool = state.proxy.pose();
  tick.path = state.proxy.path();
  tick.cutoff = state.clock.cutoff();
  tick.statistics.checkpoints = state.clock.checkpoints();
  tick.statistics.work = state.clock.work();
  tell_tissue(state, outcome.late, tick);
  tell_contacts(state, tick);
  tell_clearances(state, outcome.step, outcome.dt, tick);
  tell_wrench(state, outcome.verdict, dt, tick);
  tick.status = status_of(outcome);
  if (state.is_stiffening) stiffen(state, tick.status == HapticStatus::Free);
  return tick;
}

DeformingObstacle& deforming(const SessionState& state, std::size_t number) {
  DYOP_REQUIRE(number < state.proxy.obstacles().size(), "HapticSession: there is no obstacle ",
               number, " of ", state.proxy.obstacles().size());
  auto* obstacle = dynamic_cast<DeformingObstacle*>(state.proxy.obstacles()[number].get());
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

bool is_crowded(const HoldPoint& hold, Scalar spread, std::span<const ToolContactPoint> contacts) {
  return std::any_of(contacts.begin(), contacts.end(), [&](const ToolContactPoint& contact) {
    return contact.part == hold.body && (contact.p_W - hold.p_WB).norm() < spread;
  });
}

// To an obstacle and, of a soft region, the copy of it; first to that, so that what the tick has
// seen of the obstacle is there of the copy.
template <typename Give>
bool give(const SessionState& state, const char* name, std::size_t number,
          std::span<const Vector3> vertices, const Give& give_to) {
  DeformingObstacle& tissue = deforming(state, number);
  require_places(state, name, vertices);
  if (tissue.has_next()) return false;
  for (const auto& region : state.soft_regions) {
    if (region->obstacle() != number) continue;
    if (!give_to(static_cast<DeformingObstacle&>(region->region()))) return false;
  }
  return give_to(tissue);
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
  state_->proxy.measure(haptics_internal::WorkShare(unlimited), state_->tick.statistics);
  state_->tick.tool = state_->proxy.pose();
  state_->tick.clearances.resize(scene.obstacles.size());
  state_->tick.snapshots.resize(scene.obstacles.size());
  state_->tick.progress.resize(scene.obstacles.size());
  state_->tick.contacts.reserve(std::size_t(options.max_contacts));
  state_->tick.candidates.reserve(std::size_t(options.max_contacts));
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

void HapticSession::set_coupling(const CouplingOptions& coupling) {
  const VirtualCoupling checked(coupling);
  state_->wanted = checked.options();
  const HapticStatus last = state_->tick.status;
  stiffen(*state_, last == HapticStatus::Free || last == HapticStatus::NotRun);
}

const CouplingOptions& HapticSession::coupling() const {
  return state_->coupling.options();
}

void HapticSession::reset(const ToolPose& tool) {
  const Scalar most = haptics_internal::largest_coordinate(state_->options);
  const Vector3& p_WT = tool.X_WT.translation();
  DYOP_REQUIRE(p_WT.cwiseAbs().maxCoeff() <= most, "HapticSession: reset to (", p_WT.transpose(),
               "), coordinates must be at most ", most);
  for (const Scalar angle : tool.angles) {
    DYOP_REQUIRE(std::isfinite(angle), "HapticSession: reset to an angle of ", angle);
  }
  state_->proxy.reset(tool);
  for (const auto& region : state_->soft_regions) region->reset(tool);
  state_->filter.reset();
  state_->coupling.release();
  haptics_internal::WorkClock unlimited;
  state_->proxy.measure(haptics_internal::WorkShare(unlimited), state_->tick.statistics);
  state_->tick.status = HapticStatus::NotRun;
  state_->tick.tool = tool;
}

const HapticTick& HapticSession::last() const {
  return state_->tick;
}

Scalar HapticSession::time() const {
  return state_->time;
}

bool HapticSession::is_passive() const {
  const CouplingOptions& springs = state_->coupling.options();
  const bool is_soft = std::all_of(
      state_->soft_regions.begin(), state_->soft_regions.end(), [&](const auto& region) {
        return springs.device_damping >
               least_passive_damping(region->stiffness(), 0, springs.period);
      });
  return is_soft && state_->coupling.is_passive();
}

std::size_t HapticSession::obstacle_count() const {
  return state_->proxy.obstacles().size();
}

bool HapticSession::give_snapshot(std::size_t obstacle, std::span<const Vector3> vertices,
                                  Scalar duration) {
  require_duration(*state_, "give_snapshot", duration);
  return give(*state_, "give_snapshot", obstacle, vertices,
              [&](DeformingObstacle& tissue) { return tissue.give(vertices, duration); });
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
  for (const auto& region : state_->soft_regions) {
    DYOP_REQUIRE(region->obstacle() != obstacle, "retarget: obstacle ", obstacle,
                 " is a soft region; give it snapshots");
  }
  return tissue.retarget(vertices, duration, lead);
}

bool HapticSession::find_contacts(std::size_t obstacle, const ObstacleProgress& progress,
                                  const ToolPose& tool, const ContactSearch& search,
                                  std::vector<ToolContactPoint>& contacts) {
  const DeformingObstacle& tissue = deforming(*state_, obstacle);
  require_valid(search, progress);
  const auto bodies = state_->proxy.bodies();
  std::vector<HoldPoint>& found = state_->found;
  found.clear();
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    const RigidPose X_WB =
        tool.X_WT * haptics_internal::body_in_tool(bodies[body], state_->proxy.hinges(), tool);
    const std::size_t first = found.size();
    if (!tissue.find_holds(progress, bodies[body], X_WB, search, state_->search_memory, found)) {
      return false;
    }
    for (std::size_t k = first; k < found.size(); ++k) {
      found[k].body = body;
      found[k].obstacle = obstacle;
    }
  }
  std::sort(found.begin(), found.end(), [](const HoldPoint& x, const HoldPoint& y) {
    return std::tuple(x.gap(), x.body, x.key) < std::tuple(y.gap(), y.body, y.key);
  });
  contacts.clear();
  for (const HoldPoint& hold : found) {
    if (!is_crowded(hold, search.spread, contacts)) contacts.push_back(point_of(hold, bodies));
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

std::int64_t HapticSession::snapshots_taken(std::size_t obstacle) const {
  return deforming(*state_, obstacle).snapshots_taken();
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
