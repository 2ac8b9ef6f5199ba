// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/island.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>
#include <utility>
#include <vector>

#include "core/batch_run.h"
#include "core/tolerance.h"
#include "distance/pivot_seed.h"
#include "dynamics/body_record.h"
#include "dynamics/step/clearance_fit.h"
#include "dynamics/step/ledger.h"
#include "dynamics/step/link_rows.h"
#include "dynamics/step/substep.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_point.h"
#include "dyop/distance/gjk.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::dynamics_internal {

/// Contacts that push two overlapping bodies apart: an estimate, for a pair without a certificate.
///
/// A direction is guessed: the penetration of two convex shapes; of meshes the mean normal of the
/// faces that cross, if there are closed meshes; else the axis along which the bodies' boxes
/// overlap least. B is taken out along it until `gap` is free, the contacts there are found, and
/// carried back, so that they have negative gaps. If none pushes that way, as where B slides along
/// A on the way out, they push along the direction itself. Empty if that does not work out.
/// @param nhat_AB_W The last direction, which stays if it still is the shorter way: else bodies
/// that interlock may be pushed to and fro. Zero if there is none.
std::vector<ContactPoint> estimate_overlap(const BodyRecord& a, const RigidPose& X_WA,
                                           const BodyRecord& b, const RigidPose& X_WB, Scalar gap,
                                           Vector3& nhat_AB_W, ContactWorkspace& workspace);

namespace {

// The direction of least overlap of the bodies' boxes, towards B.
Vector3 direction_of_boxes(const Shape& a, const RigidPose& X_WA, const Shape& b,
                           const RigidPose& X_WB) {
  const AlignedBox box_a = posed_box(a, X_WA);
  const AlignedBox box_b = posed_box(b, X_WB);
  const Vector3 up = box_a.max() - box_b.min();    // how far B must go along each axis
  const Vector3 down = box_b.max() - box_a.min();  // and against it
  Eigen::Index axis_up = 0;
  Eigen::Index axis_down = 0;
  const Scalar least_up = up.minCoeff(&axis_up);
  const Scalar least_down = down.minCoeff(&axis_down);
  return least_up <= least_down ? Vector3(Vector3::Unit(axis_up))
                                : Vector3(-Vector3::Unit(axis_down));
}

// The normal of a triangle of a closed mesh, out of it; zero for anything else.
Vector3 outward_normal(const Shape& shape, const RigidPose& X_WS,
                       const std::optional<std::int32_t>& triangle) {
  if (shape.kind() != ShapeKind::TriangleMesh || !triangle) return Vector3::Zero();
  const auto& mesh = static_cast<const TriangleMesh&>(shape);
  if (!mesh.is_closed()) return Vector3::Zero();
  const Triangle corners = mesh.triangle(*triangle);
  const Vector3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  return normal.norm() > 0 ? Vector3(X_WS.rotation() * normal.normalized()) : Vector3::Zero();
}

// The mean normal of the faces that cross, from A to B; zero if they say nothing.
Vector3 direction_of_faces(const Shape& a, const RigidPose& X_WA, const Shape& b,
                           const RigidPose& X_WB) {
  Vector3 sum = Vector3::Zero();
  for (const Contact& contact : find_contacts(a, X_WA, b, X_WB, 0)) {
    sum +=
        outward_normal(a, X_WA, contact.triangle_a) - outward_normal(b, X_WB, contact.triangle_b);
  }
  constexpr Scalar kClear = 0.1;  // faces that point everywhere leave less than this of each
  return sum.norm() > kClear ? Vector3(sum.normalized()) : Vector3::Zero();
}

Vector3 direction_of(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB) {
  if (const HalfSpace* plane = as_half_space(a)) return X_WA.rotation() * plane->normal();
  if (const HalfSpace* plane = as_half_space(b)) return -(X_WB.rotation() * plane->normal());
  if (a.kind() == ShapeKind::Convex && b.kind() == ShapeKind::Convex) {
    const auto found = find_penetration(static_cast<const ConvexShape&>(a), X_WA,
                                        static_cast<const ConvexShape&>(b), X_WB);
    if (found && std::abs(found->nhat_AB_W.norm() - 1) < kRotationTolerance) {
      return found->nhat_AB_W;
    }
    return direction_of_boxes(a, X_WA, b, X_WB);
  }
  const Vector3 faces = direction_of_faces(a, X_WA, b, X_WB);
  return faces.isZero(0) ? direction_of_boxes(a, X_WA, b, X_WB) : faces;
}

// Contacts push bodies apart that overlap if their normals are within 60 degrees of the way out.
constexpr Scalar kPushedCosine = 0.5;

// How far B has to go along the direction to be free, coming from far outside.
std::optional<Scalar> way_out(const Shape& a, const RigidPose& X_WA, const Shape& b,
                              const RigidPose& X_WB, const Vector3& nhat_AB_W, Scalar gap) {
  const Scalar apart = (X_WB.translation() - X_WA.translation()).norm();
  const Scalar far = apart + radius_beside(a, b, apart) + radius_beside(b, a, apart) + 2 * gap;
  const RigidPose start(X_WB.rotation(), X_WB.translation() + far * nhat_AB_W);
  const ConstantTwistMotion approach(start, Twist{-nhat_AB_W, Vector3::Zero()});
  ToiOptions options;
  options.target_distance = gap / 2;
  options.distance_tolerance = gap / 2;
  const ToiResult met =
      time_of_impact(a, RestMotion(X_WA), b, approach, TimeInterval{0, far}, options);
  if (met.status != ToiStatus::Impact) return std::nullopt;
  return far - met.t_safe;
}

}  // namespace

std::vector<ContactPoint> estimate_overlap(const BodyRecord& a, const RigidPose& X_WA,
                                           const BodyRecord& b, const RigidPose& X_WB, Scalar gap,
                                           Vector3& nhat_AB_W, ContactWorkspace& workspace) {
  const Shape& shape_a = *a.definition.shape;
  const Shape& shape_b = *b.definition.shape;
  const Vector3 last = std::exchange(nhat_AB_W, direction_of(shape_a, X_WA, shape_b, X_WB));
  auto travel = way_out(shape_a, X_WA, shape_b, X_WB, nhat_AB_W, gap);
  if (!last.isZero(0)) {
    const auto same_way = way_out(shape_a, X_WA, shape_b, X_WB, last, gap);
    if (same_way && !(travel && *travel < *same_way)) {
      nhat_AB_W = last;
      travel = same_way;
    }
  }
  const Vector3& nhat = nhat_AB_W;
  std::vector<ContactPoint> points;
  if (!travel) return points;
  const RigidPose X_WB_out(X_WB.rotation(), X_WB.translation() + *travel * nhat);
  generate_contacts(shape_a, X_WA, shape_b, X_WB_out, 2 * gap, {}, workspace, points);
  // Only what is pushed on the way out, and not all of it.
  const auto is_pushed = [&](const ContactPoint& point) {
    return point.nhat_AB_W.dot(nhat) > kPushedCosine;
  };
  if (std::any_of(points.begin(), points.end(), is_pushed)) {
    std::erase_if(points, [&](const ContactPoint& point) { return !is_pushed(point); });
  } else {
    for (ContactPoint& point : points) point.nhat_AB_W = nhat;
  }
  reduce_contacts({}, points);
  for (ContactPoint& point : points) {
    point.p_WCb -= *travel * nhat;
    point.gap = point.nhat_AB_W.dot(point.p_WCb - point.p_WCa);
    point.lower = 0;
    point.upper = 0;
  }
  return points;
}

void Island::clear() {
  bodies.clear();
  pairs.clear();
  joints.clear();
  springs.clear();
}

void IslandOutcome::restart() {
  std::vector<Track> memory = std::move(tracks);
  *this = {};
  tracks = std::move(memory);
}

void add_cost(AdvanceReport& report, const IslandOutcome& outcome) {
  report.work.unconverged += outcome.work.unconverged;
  report.times.flight += outcome.times.flight;
  report.times.contacts += outcome.times.contacts;
  report.times.solve += outcome.times.solve;
  report.times.ends += outcome.times.ends;
  report.times.proofs += outcome.times.proofs;
  add(report.toi, outcome.toi);
  report.integrator.steps += outcome.integrator.steps;
  report.integrator.rejected_steps += outcome.integrator.rejected_steps;
  report.integrator.function_evaluations += outcome.integrator.function_evaluations;
}

IslandRuns StepMemory::take_runs(const std::vector<bool>& is_dirty, AdvanceReport& report) {
  IslandRuns kept;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    const std::vector<std::uint32_t>& bodies = islands[i].bodies;
    const bool must_rerun = std::any_of(bodies.begin(), bodies.end(),
                                        [&](std::uint32_t slot) { return is_dirty[slot]; });
    if (!outcomes[i].has_run) continue;
    if (must_rerun) {
      ++report.work.discarded_runs;
      add_cost(report, outcomes[i]);
    } else {
      kept.emplace(bodies, std::move(outcomes[i]));
    }
  }
  return kept;
}

void StepMemory::place_runs(std::size_t count, IslandRuns kept) {
  islands.resize(count);
  outcomes.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    outcomes[i].has_run = false;
    const auto known = kept.empty() ? kept.end() : kept.find(islands[i].bodies);
    if (known != kept.end()) outcomes[i] = std::move(known->second);
  }
}

void run_parallel(int thread_count, std::size_t count, std::size_t portion, StepWorkspaces& pool,
                  const std::function<void(std::size_t, StepWorkspace&)>& item) {
  BatchOptions batch;
  batch.thread_count = thread_count;
  const std::size_t portions = (count + portion - 1) / portion;
  const std::size_t workers = portions < 2 ? 1 : core_internal::batch_worker_count(portions, batch);
  while (pool.size() < workers) pool.push_back(std::make_unique<StepWorkspace>());
  if (workers == 1) {
    for (std::size_t i = 0; i < count; ++i) item(i, *pool.front());
    return;
  }
  std::vector<std::exception_ptr> errors(portions);
  core_internal::run_batch(portions, batch, [&](std::size_t k, std::size_t worker) {
    try {
      const std::size_t end = std::min((k + 1) * portion, count);
      for (std::size_t i = k * portion; i < end; ++i) item(i, *pool[worker]);
    } catch (...) {
      errors[k] = std::current_exception();
    }
  });
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
}

namespace {

void add_difference(IntegratorStatistics& sum, const IntegratorStatistics& before,
                    const IntegratorStatistics& after) {
  sum.steps += after.steps - before.steps;
  sum.rejected_steps += after.rejected_steps - before.rejected_steps;
  sum.function_evaluations += after.function_evaluations - before.function_evaluations;
}

}  // namespace

std::shared_ptr<const Motion> fly(const StepContext& context, const BodyRecord& body,
                                  const CentralState& state, const TimeInterval& interval,
                                  std::shared_ptr<FreeFlight>& flight, IntegratorStatistics& sum) {
  if (!flight) {
    flight =
        std::make_shared<FreeFlight>(body, state, context.gravity_W, context.options->integrator,
                                     context.options->integrator_options, interval.begin);
  }
  const IntegratorStatistics before = flight->statistics();
  std::shared_ptr<const Motion> motion = flight->motion(interval.begin, interval.end);
  add_difference(sum, before, flight->statistics());
  return motion;
}

Scalar known_travel(const BodyRecord& body, const FreeFlight& flight,
                    const TimeInterval& interval) {
  const std::optional<TwistBound> bound = flight.known_bound(interval);
  if (!bound) return kInfinity;
  return interval.length() * (bound->linear_speed + bound->angular_speed * body.radius_B);
}

bool is_alone(const StepContext& context, const Island& island) {
  return island.bodies.size() == 1 && island.pairs.empty() && island.joints.empty() &&
         island.springs.empty() && !context.body(island.bodies.front()).definition.locked.any();
}

void fly_alone(const StepContext& context, const Island& island, IslandOutcome& outcome) {
  const BodyRecord& body = context.body(island.bodies.front());
  const TimeInterval interval{context.t, context.t_end};
  outcome.restart();
  outcome.tracks.resize(1);
  Track& track = outcome.tracks.front();
  track.flight = body.flight;
  track.pieces.clear();
  const PartTimer timing(context.options->measures_time, outcome.times.flight);
  track.pieces.push_back(
      {interval, fly(context, body, body.state, interval, track.flight, outcome.integrator)});
  track.end = track.flight->state(interval.end);
  track.most_travel = known_travel(body, *track.flight, interval);
  outcome.work.substeps = 1;
  outcome.reached = interval.end;
  outcome.has_run = true;
}

namespace {

// Limits on one island in one step of the World.
constexpr int kMostSubsteps = 100;
constexpr int kMostImpacts = 50;
// So many pairs or contacts are worth several threads, which take so many at a time: a microsecond
// each, and as much as a dozen of them to wake a thread.
constexpr std::size_t kManyItems = 256;
constexpr std::size_t kItemPortion = 32;
// How long before its end the twist with which a substep ends is taken, over the substep's length.
constexpr Scalar kJustBefore = 1e-6;  // literal: of a time, above the rounding of its sums
std::optional<std::size_t> member_of(const std::vector<std::uint32_t>& bodies, std::uint32_t slot) {
  const auto found = std::lower_bound(bodies.begin(), bodies.end(), slot);
  if (found == bodies.end() || *found != slot) return std::nullopt;
  return static_cast<std::size_t>(found - bodies.begin());
}

bool is_sphere(const BodyRecord& body) {
  return dynamic_cast<const Sphere*>(body.definition.shape.get()) != nullptr;
}

bool is_convex(const BodyRecord& body) {
  return body.definition.shape->kind() == ShapeKind::Convex;
}

IslandRun::Member member_of_body(const StepContext& context, const BodyRecord& body) {
  IslandRun::Member member{&body, body.state, body.flight, context.gravity_W, 0};
  if (!body.definition.wrench) return member;
  const Wrench wrench = total_wrench(body, context.gravity_W, context.t, body.motion_state());
  member.acceleration_W = body.inverse_mass * wrench.force;
  member.turning_acceleration =
      (body.angular_mobility(body.state.X_WM.rotation()) * wrench.torque).norm() * body.radius;
  return member;
}

// Two bodies in common free fall still count as pressing at g, since only one may be supported.
Scalar pressing_acceleration(const IslandRun::Member* a, const IslandRun::Member* b,
                             const Vector3& gravity_W) {
  Vector3 relative_W = Vector3::Zero();
  Scalar turning = 0;
  if (a) relative_W -= a->acceleration_W;
  if (b) relative_W += b->acceleration_W;
  for (const auto* member : {a, b}) turning += member ? member->turning_acceleration : 0;
  return std::max(gravity_W.norm(), relative_W.norm() + turning);
}

}  // namespace

IslandRun::IslandRun(const StepContext& context, const Island& island, StepWorkspace& workspace)
    : context_(context), island_(island), workspace_(workspace), now_(context.t) {
  acceleration_ = context.gravity_W.norm();
  members_.reserve(island.bodies.size());
  for (const std::uint32_t slot : island.bodies) {
    members_.push_back(member_of_body(context, context.body(slot)));
    const Member& member = members_.back();
    acceleration_ =
        std::max(acceleration_, member.acceleration_W.norm() + member.turning_acceleration);
  }
  outcome_.tracks.resize(members_.size());
  for (Track& track : outcome_.tracks) track.most_travel = 0;
  pairs_.reserve(island.pairs.size());
  for (JointState* joint : island.joints) joint->start_from_committed();
  for (PairState* state : island.pairs) {
    RunPair pair;
    pair.state = state;
    pair.a = &context.body(state->key.a);
    pair.b = &context.body(state->key.b);
    pair.member_a = member_of(island.bodies, state->key.a);
    pair.member_b = member_of(island.bodies, state->key.b);
    pair.friction = state->material.friction;
    pair.restitution = state->material.restitution;
    pair.acceleration = pressing_acceleration(pair.member_a ? &members_[*pair.member_a] : nullptr,
                                              pair.member_b ? &members_[*pair.member_b] : nullptr,
                                              context.gravity_W);
    pair.has_ball =
        is_convex(*pair.a) && is_convex(*pair.b) && (is_sphere(*pair.a) || is_sphere(*pair.b));
    pair.most_reach = most_reach(pair);
    state->start_from_committed();
    pairs_.push_back(std::move(pair));
  }
}

std::optional<std::size_t> IslandRun::member_at(BodyId id) const {
  return member_of(island_.bodies, id.slot);
}

RigidPose IslandRun::pose_of(const std::optional<std::size_t>& member,
                             const BodyRecord& body) const {
  if (member) {
    const RigidPose& X_WM = members_[*member].state.X_WM;
    return RigidPose::from_trusted(
        X_WM.rotation(),
        X_WM.translation() - X_WM.rotation() * body.definition.mass_properties.p_BoBcm);
  }
  if (body.definition.kind == BodyKind::Kinematic) return body.definition.motion->pose(now_);
  return body.X_WB();
}

BodyMove IslandRun::support_move(const BodyRecord& body) const {
  if (body.definition.kind != BodyKind::Kinematic) return rest_move(body, body.rest);
  BodyMove move = motion_move(body, body.definition.motion, now_);
  const TwistBound bound = body.definition.motion->twist_bound({now_, context_.t_end});
  move.is_rest = bound.linear_speed == 0 && bound.angular_speed == 0;
  return move;
}

const BodyMove& IslandRun::move_of(const std::optional<std::size_t>& member, const BodyRecord& body,
                                   const std::vector<BodyMove>& moves, BodyMove& support) const {
  if (member) return moves[*member];
  support = support_move(body);
  return support;
}

Twist IslandRun::central_twist(const std::optional<std::size_t>& member,
                               const BodyRecord& body) const {
  if (member) {
    const CentralState& state = members_[*member].state;
    return {state.v_W, body.angular_velocity(state.X_WM.rotation(), state.L_W)};
  }
  if (body.definition.kind == BodyKind::Kinematic)
    return body.definition.motion->twist(prescribed_at_);
  return {};
}

namespace {

// Times sqrt(r a): the speed of a fall by r / 200. Any faster impact is reported, however long the
// step.
constexpr Scalar kReportedSpeed = 0.1;

}  // namespace

Scalar IslandRun::restitution_speed(const RunPair& pair) const {
  if (context_.options->restitution_speed) {
    // Lower hops end in the band in which landings are found, and are not told from rest.
    const bool is_answered = context_.options->policy == ImpactPolicy::Impulse;
    const Scalar least = std::sqrt(2 * pair.acceleration * pair.state->lengths.tolerance());
    return std::max(*context_.options->restitution_speed, is_answered ? least : Scalar{0});
  }
  const auto speed_of = [this](const auto& member, const BodyRecord& body) {
    const Twist twist = central_twist(member, body);
    return twist.v_WB.norm() + twist.w_WB.norm() * body.radius;
  };
  const Scalar fastest =
      std::max(speed_of(pair.member_a, *pair.a), speed_of(pair.member_b, *pair.b));
  Scalar usual = 2 * context_.h * pair.acceleration;
  if (context_.options->policy != ImpactPolicy::Impulse) {
    usual =
        std::min(usual, kReportedSpeed * std::sqrt(pair.acceleration * pair.state->lengths.radius));
  }
  return std::max(usual, contact_tolerance(fastest, pair.state->lengths.rest_offset, context_.h));
}

Scalar IslandRun::contact_restitution_speed(const RunPair& pair) const {
  return std::max(restitution_speed(pair), context_.h * pair.acceleration);
}

// Whether a contact that now opens at this speed will bounce where it lands, or be reported. Flights
// then follow a ball to where the sum of its bounces ends, whatever the length of the step.
bool IslandRun::will_bounce(const RunPair& pair, const ContactPoint& point, Scalar speed) const {
  const bool is_reported = context_.options->policy != ImpactPolicy::Impulse;
  const bool may_bounce = context_.options->restitution_speed && pair.restitution > 0;
  if (!may_bounce && !is_reported) return false;
  // What a callback left as it is does not bounce any more.
  if (speed < 0 && pair.state->answered_at == now_) return false;
  if (impact_count_ >= kMostImpacts) return false;
  const Scalar height = std::max(point.gap - pair.state->lengths.rest_gap(), Scalar{0});
  if (!(speed > 0) && !(height > 0)) return false;
  const Scalar landing = std::sqrt(speed * speed + 2 * height * pair.acceleration);
  return landing > restitution_speed(pair);
}

// Free flight for all while every contact in reach opens, or stays open without help.
bool IslandRun::may_fly() const {
  const Scalar h = remaining();
  if (!island_.joints.empty() || !island_.springs.empty()) return false;
  for (const Member& member : members_) {
    if (member.body->definition.locked.any()) return false;
  }
  for (const RunPair& pair : pairs_) {
    if (pair.state->uncertified_gap || pair.state->overlaps) return false;
    if (!pair.is_near) continue;
    const PairLengths& lengths = pair.state->lengths;
    const Scalar fall =
        (pair.member_a && pair.member_b ? 0.0 : 0.5) * h * h * context_.gravity_W.norm();
    for (const ContactPoint& point : pair.state->points()) {
      const Scalar speed = normal_velocity(*this, pair, point);
      if (point.gap < lengths.rest_gap() - 0.7 * kCertifiedFraction * lengths.rest_offset)
        return false;
      if (point.gap + h * speed - fall < lengths.rest_gap() && !will_bounce(pair, point, speed)) {
        return false;
      };
    }
  }
  return true;
}

std::vector<BodyMove> IslandRun::flights_to(Scalar t_end) {
  const PartTimer timing = timer(&StepTimes::flight);
  std::vector<BodyMove> moves;
  for (Member& member : members_) {
    BodyMove move;
    move.body = member.body;
    move.motion = fly(context_, *member.body, member.state, {now_, t_end}, member.flight,
                      outcome_.integrator);
    move.center = member.state.X_WM.translation();
    moves.push_back(std::move(move));
  }
  return moves;
}

// Flies to the end of the step, or to the first hit that bounces. Returns false if the bodies do
// not come apart, or meet too slowly to bounce: then contacts have to be solved.
bool IslandRun::try_flight() {
  const TimeInterval interval{now_, context_.t_end};
  std::vector<BodyMove> moves = flights_to(interval.end);
  const PartTimer timing = timer(&StepTimes::proofs);
  if (pairs_.size() > 1) {
    for (BodyMove& move : moves) move.bound_speed(interval);
  }
  std::size_t first = pairs_.size();  // the pair hit first
  std::vector<Certificate> certificates;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    certificates.push_back(prove_flight(pairs_[i], moves, interval));
    const Certificate& certificate = certificates.back();
    if (certificate.proof) continue;
    const ToiStatus status = certificate.result->status;
    if (status == ToiStatus::InitiallyWithinTarget) return false;
    if (const auto failure = failure_of(status)) {
      fail(*failure, pairs_[i].state->key);
      return true;
    }
    if (first == pairs_.size() || certificate.result->t_safe < certificates[first].result->t_safe) {
      first = i;
    }
  }
  if (first == pairs_.size()) {
    commit_flight(interval.end, moves, certificates);
    return true;
  }
  const ToiResult& met = *certificates[first].result;
  const bool is_fast = met.contact && met.contact->closing_speed > restitution_speed(pairs_[first]);
  if (!is_fast || impact_count_ >= kMostImpacts || !(met.t_safe > now_)) return false;
  pairs_[first].hit = std::make_shared<const ToiResult>(met);
  commit_flight(met.t_safe, moves, certificates);
  for (Member& member : members_) member.flight = nullptr;
  return true;
}

// Landing ends at the rest gap, so that nothing needs pushing there.
Certificate IslandRun::prove_flight(RunPair& pair, const std::vector<BodyMove>& moves,
                                    const TimeInterval& interval) {
  PairState& state = *pair.state;
  BodyMove support;
  const BodyMove& a = move_of(pair.member_a, *pair.a, moves, support);
  const BodyMove& b = move_of(pair.member_b, *pair.b, moves, support);
  const Scalar kept = state.lengths.rest_gap() - state.lengths.tolerance();
  Certificate certificate = certify(state, a, b, interval, kept, context_.limits, workspace_.toi);
  if (certificate.result) {
    add(outcome_.toi, certificate.result->statistics);
    state.advancement_steps += certificate.result->statistics.node_pairs;
  }
  return certificate;
}

void IslandRun::commit_substep(Scalar t, const std::vector<BodyMove>& moves,
                               const std::vector<Certificate>& certificates) {
  for (std::size_t i = 0; i < members_.size(); ++i) {
    Track& track = outcome_.tracks[i];
    track.pieces.push_back({{now_, t}, moves[i].motion, moves[i].is_rest});
    track.most_travel += most_travel(moves[i], t - now_);
  }
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    PairState& state = *pairs_[i].state;
    const Certificate& certificate = certificates[i];
    const PairProof proof = certificate.proof
                                ? *certificate.proof
                                : *PairProof::by_query(state, {now_, t}, *certificate.result);
    outcome_.proofs.push_back(proof);
    state.loosen_bounds(certificate.closing);
    // What has been proven need not be measured.
    if (proof.kind() == ProofKind::ByBound || proof.kind() == ProofKind::ByQuery) {
      state.gap_lower = std::max(state.gap_lower, state.kept_distance());
    }
  }
  ++outcome_.work.substeps;
  prescribed_at_ = t - kJustBefore * (t - now_);
  now_ = t;
}

// In free flight.
void IslandRun::commit_flight(Scalar t, const std::vector<BodyMove>& moves,
                              const std::vector<Certificate>& certificates) {
  for (Member& member : members_) member.state = member.flight->state(t);
  commit_substep(t, moves, certificates);
}

VelocityChange* IslandRun::begin_change(VelocityChangeKind kind, const TimeInterval& interval) {
  if (!context_.options->records_impulses) return nullptr;
  VelocityChange& change = outcome_.changes.emplace_back();
  change.kind = kind;
  change.interval = interval;
  for (const Member& member : members_) {
    MomentumChange& body = change.bodies.emplace_back();
    body.body = member.body->id;
    body.v_before_W = member.state.v_W;
    body.L_before_W = member.state.L_W;
  }
  return &change;
}

void IslandRun::end_change(VelocityChange* change) const {
  if (change == nullptr) return;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    change->bodies[i].v_W = members_[i].state.v_W;
    change->bodies[i].L_W = members_[i].state.L_W;
  }
}

void IslandRun::fail(AdvanceStatus status, PairKey pair) {
  outcome_.failure = IslandFailure{status, pair};
}

// Last resort: no motion that keeps all distances was found, so nothing moves. Counted as a stall.
void IslandRun::stand_still() {
  const TimeInterval interval{now_, context_.t_end};
  std::vector<BodyMove> moves;
  for (Member& member : members_) {
    const RigidPose X_WB = motion_state(member.body->definition.mass_properties, member.state.X_WM,
                                        Vector3::Zero(), Vector3::Zero())
                               .X_WB;
    BodyMove move = twist_move(*member.body, member.state, now_, Vector3::Zero(), Vector3::Zero());
    move.motion = std::make_shared<RestMotion>(X_WB);
    move.is_rest = true;
    moves.push_back(std::move(move));
  }
  ++outcome_.work.stalls;
  Scalar reached = interval.end;
  PairKey blocked;
  std::vector<Certificate> certificates;
  for (RunPair& pair : pairs_) {
    PairState& state = *pair.state;
    BodyMove support;
    const BodyMove& a = move_of(pair.member_a, *pair.a, moves, support);
    const BodyMove& b = move_of(pair.member_b, *pair.b, moves, support);
    certificates.push_back(
        certify(state, a, b, interval, state.kept_distance(), context_.limits, workspace_.toi));
    if (!certificates.back().proof && certificates.back().result->t_safe < reached) {
      reached = certificates.back().result->t_safe;
      blocked = state.key;
    }
  }
  if (reached < interval.end) fail(AdvanceStatus::Blocked, blocked);
  if (!(reached > now_)) return;
  VelocityChange* change = begin_change(VelocityChangeKind::Stall, {now_, now_});
  for (Member& member : members_) {
    member.state.v_W.setZero();
    member.state.L_W.setZero();
  }
  end_change(change);
  commit_substep(reached, moves, certificates);
}

void IslandRun::for_all(std::size_t count,
                        const std::function<void(std::size_t, StepWorkspace&)>& item) const {
  if (count < kManyItems || context_.options->thread_count == 1) {
    for (std::size_t i = 0; i < count; ++i) item(i, workspace_);
  } else {
    run_parallel(context_.options->thread_count, count, kItemPortion, workspace_.helpers, item);
  }
}

void IslandRun::add_proof_costs() {
  add(outcome_.toi, std::exchange(workspace_.proofs, {}));
  for (const auto& helper : workspace_.helpers) {
    add(outcome_.toi, std::exchange(helper->proofs, {}));
  }
}

bool IslandRun::must_stop() {
  if (const auto status = context_.limits.exceeded()) fail(*status, {});
  return outcome_.failure.has_value();
}

IslandOutcome IslandRun::run() {
  for (int substep = 0; now_ < context_.t_end && !outcome_.failure && !outcome_.stopped_at_impact;
       ++substep) {
    if (must_stop()) break;
    prescribed_at_ = now_;
    find_contacts();
    fit_rest_offsets(*this);
    const bool may_bounce = impact_count_ < kMostImpacts;
    if (resolve_impacts(*this, may_bounce)) {
      ++impact_count_;
      if (outcome_.stopped_at_impact) break;
    }
    outcome_.in_contact = false;
    if (may_fly() && try_flight()) continue;
    outcome_.in_contact = true;
    for (Member& member : members_) member.flight = nullptr;
    if (substep >= kMostSubsteps || !run_substep(*this, may_bounce)) stand_still();
  }
  for (RunPair& pair : pairs_) {
    PairState& state = *pair.state;
    const Scalar reach =
        state.lengths.rest_gap() + kContactReachRestOffsets * state.lengths.usual_rest_offset;
    const auto points = state.points();
    state.has_contacts = outcome_.in_contact && pair.is_near &&
                         std::any_of(points.begin(), points.end(),
                                     [&](const ContactPoint& point) { return point.gap <= reach; });
    if (!state.has_contacts) state.impulses.clear();
  }
  follow_joint_angles(*this, {}, 0);  // of what was carried while nothing else moved
  outcome_.reached = now_;
  outcome_.has_run = true;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    Member& member = members_[i];
    Track& track = outcome_.tracks[i];
    if (member.flight && track.pieces.size() == 1) {
      track.most_travel = known_travel(*member.body, *member.flight, track.pieces.front().interval);
    }
    track.end = member.state;
    track.flight = std::move(member.flight);
  }
  return std::move(outcome_);
}

// Contacts.

namespace {

// Contacts are sought as far as those of the last substep close in so many steps: impulses of
// others may speed that up. Larger: more contacts that carry nothing; smaller: more hits.
constexpr Scalar kApproaches = 2;
// A reach in use may be so many times what is needed.
constexpr Scalar kMostReach = 4;
// How far contacts of spheres are sought at most in an island of many bodies, over the radius. One
// that is not needed costs next to nothing, and a hit costs a round. Of hulls, other features have
// come nearer by then.
constexpr Scalar kSphereReachRadiusFraction = 0.1;

// The reach in use if it serves, else the one asked for: changing the reach costs a regeneration.
Scalar steady_reach(Scalar in_use, Scalar base, Scalar travel, Scalar most) {
  Scalar wanted = std::min(travel, most);
  const Scalar most_in_use = base + kMostReach * std::max(wanted, base);
  if (in_use >= base + wanted && in_use <= most_in_use) return in_use;
  return base + std::min(2 * wanted, most);
}

}  // namespace

// How much nearer the surfaces of a pair in contact may come to each other in a step, as far as its
// contacts tell: bodies that slide along each other get no nearer by it, except where they curve.
Scalar IslandRun::expected_approach(const RunPair& pair, Scalar travel) const {
  const PairState& state = *pair.state;
  if (state.overlaps || !(state.has_contacts || pair.is_near)) return kInfinity;
  Scalar closing = context_.h / 2 * pair.acceleration;
  for (const ContactPoint& point : state.points()) {
    closing = std::max(closing, -normal_velocity(*this, pair, point));
  }
  return kApproaches * context_.h * closing + travel * travel / state.lengths.radius;
}

// How far the contacts of a pair are sought at most.
Scalar IslandRun::most_reach(const RunPair& pair) const {
  const bool reaches_far = members_.size() > kCrowdBodies && pair.has_ball;
  return pair.state->lengths.radius *
         (reaches_far ? kSphereReachRadiusFraction : kContactReachRadiusFraction);
}

void IslandRun::find_contacts() {
  const PartTimer timing = timer(&StepTimes::contacts);
  std::vector<Twist> twists;
  twists.reserve(members_.size());
  for (std::size_t i = 0; i < members_.size(); ++i) {
    twists.push_back(central_twist(i, *members_[i].body));
  }
  for_all(pairs_.size(), [&](std::size_t i, StepWorkspace& workspace) {
    find_contacts(pairs_[i], twists, workspace.contacts);
  });
}

// `twists`: of the members' centres of mass at now().
void IslandRun::find_contacts(RunPair& pair, const std::vector<Twist>& twists,
                              ContactWorkspace& workspace) {
  const Scalar h = context_.h;
  const auto twist_of = [&](const std::optional<std::size_t>& member, const BodyRecord& body) {
    return member ? twists[*member] : central_twist(member, body);
  };
  const auto travel_of = [&](const Twist& twist, const std::optional<std::size_t>& member,
                             const BodyRecord& body) {
    return h * (twist.v_WB.norm() + twist.w_WB.norm() * body.radius +
                (member ? h * context_.gravity_W.norm() : 0));
  };
  PairState& state = *pair.state;
  const PairLengths& lengths = state.lengths;
  const Scalar base = lengths.rest_gap() + kContactReachRestOffsets * lengths.usual_rest_offset;
  pair.is_near = false;
  // No reach is longer.
  if (state.gap_lower > std::max(state.reach, base + pair.most_reach)) return;
  const Twist twist_a = twist_of(pair.member_a, *pair.a);
  const Twist twist_b = twist_of(pair.member_b, *pair.b);
  const Scalar travel =
      travel_of(twist_a, pair.member_a, *pair.a) + travel_of(twist_b, pair.member_b, *pair.b);
  const Scalar reach = steady_reach(
      state.reach, base, std::min(travel, expected_approach(pair, travel)), pair.most_reach);
  if (state.gap_lower > reach) return;
  const RigidPose X_WA = pose_of(pair.member_a, *pair.a);
  const RigidPose X_WB = pose_of(pair.member_b, *pair.b);
  // A distance that begins at the pivot costs less than to find that there are no contacts.
  if (state.gap_lower < 0 || state.overlaps || state.points().empty()) {
    measure_gap(state, *pair.a, X_WA, *pair.b, X_WB, reach);
    if (state.gap_lower > reach) return;
    if (push_apart(pair, X_WA, X_WB, workspace)) return;
  }
  state.reach = reach;
  const auto shift = [&](const Twist& twist, const BodyRecord& body, const RigidPose& X_W) {
    const Vector3 center = central_pose(body, X_W).translation();
    return Vector3(h * (twist.v_WB - twist.w_WB.cross(center)));
  };
  pair.is_near = refresh_contacts(state, *pair.a, X_WA, *pair.b, X_WB, reach,
                                  shift(twist_b, *pair.b, X_WB) - shift(twist_a, *pair.a, X_WA),
                                  h * (twist_b.w_WB - twist_a.w_WB), workspace);
  if (!pair.is_near) measure_gap(state, *pair.a, X_WA, *pair.b, X_WB, reach);
}

// Contacts of a pair that overlaps. Returns whether it does.
bool IslandRun::push_apart(RunPair& pair, const RigidPose& X_WA, const RigidPose& X_WB,
                           ContactWorkspace& workspace) {
  PairState& state = *pair.state;
  const bool did_overlap = state.overlaps;
  state.overlaps = !(state.gap_lower > 0);
  // It is free again, but not yet far enough apart to count as parted.
  const bool is_too_near = state.gap_lower <= state.lengths.target + state.lengths.tolerance() / 2;
  if (did_overlap && !state.overlaps && is_too_near) state.uncertified_gap = state.gap_lower / 2;
  state.known_shortest_gap.reset();
  if (!did_overlap) state.overlap_direction_W.setZero();
  if (!state.overlaps) return false;
  state.overlap_contacts = estimate_overlap(*pair.a, X_WA, *pair.b, X_WB, state.lengths.rest_gap(),
                                            state.overlap_direction_W, workspace);
  pair.is_near = !state.overlap_contacts.empty();
  return true;
}

}  // namespace dyop::dynamics_internal
