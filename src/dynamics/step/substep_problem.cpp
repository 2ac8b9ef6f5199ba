// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/substep_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/tolerance.h"
#include "dynamics/step/link_rows.h"
#include "dynamics/step/self_stress.h"

namespace dyop::dynamics_internal {

namespace {

// Above this many contacts an island is "large": tolerance = 1e-2 x speed, falling quadratically
// below one rest offset per step where no static balance could put it to sleep: else what stands
// creeps. Ten times larger: it sways longer. Where something slides slowly beside redundant
// contacts, solvers hardly reach that, and gain next to nothing once so many factorisations have
// not halved the residual.
constexpr std::size_t kLargeContacts = 300;
constexpr Scalar kLargeSpeedTolerance = 1e-2;
constexpr int kLargePatience = 30;
// Balls roll and spin for long beside others that lie. An island of more than kCrowdBodies, most of
// whose contacts are those of balls, counts as large with fewer contacts, too, but is then solved to
// so many rest offsets per substep at least, however fast its fastest body is: else the others
// creep. Found by measurement.
constexpr Scalar kBallTolerance = 0.01;
// A large one in which something moves by so many rest offsets per step is solved coarsely if it
// has more contacts per body than this, that is, one and a half times as many impulses as
// velocities: many cheap substeps beat few exact ones. With fewer, as of links, impulses are nearly
// unique, and Newton's method finds them soon. Its residual, in rest offsets per substep: so much
// less may a gap become than asked for. All found by measurement.
constexpr Scalar kCoarseTravel = 20;
constexpr std::size_t kCoarseContactsPerBody = 3;
constexpr Scalar kCoarseTolerance = 0.3;
// More than kCrowdBodies that move by so many rest offsets per step are a crowd that falls or is
// thrown, not a structure: a thousandth of its speed is exact enough, up to what a gap may lose in a
// substep. Without joints even so many sweeps find that sooner than factorisations. Ropes and
// linkages, with joints and fewer contacts than one to so many bodies, are no crowd. Found by
// measurement on poured spheres and ragdolls.
constexpr Scalar kCrowdTravel = 100;
constexpr Scalar kCrowdSpeedTolerance = 1e-3;
constexpr std::size_t kHeapBodiesPerContact = 6;
constexpr int kCrowdSweeps = 1000;
constexpr int kCoarseCrowdSweeps = 150;
// Also a large island in which something moves by so many rest offsets per step is solved by so many
// sweeps first, unless it has joints, for which sweeps are slow. Found by measurement on what poured
// spheres and boxes do until they lie.
constexpr Scalar kMovingTravel = 10;
constexpr int kMovingSweeps = 100;
// Radians. Past this, the end-gap correction feeds back on itself and diverges.
constexpr Scalar kMostContactTurn = 1;
// An island moves if its fastest body's way in a substep is this part of the rest offset or more,
// as for sleep.
constexpr Scalar kDriftTravel = 0.01;
// The coefficient of a friction law depends on the sliding that it is asked for.
constexpr Scalar kUnknownFriction = std::numeric_limits<Scalar>::quiet_NaN();
// How much farther a contact is pushed that was hit, in rest offsets; doubled each time.
constexpr Scalar kHitPush = 0.5;

// What lies on a belt is at rest, and is solved as exactly as on a floor.
Vector3 carrying_velocity(IslandRun& run) {
  Vector3 carried_W = Vector3::Zero();
  for (const IslandRun::RunPair& pair : run.pairs()) {
    if (!pair.is_near || (pair.member_a && pair.member_b)) continue;
    const BodyRecord& body = pair.member_a ? *pair.b : *pair.a;
    const Vector3 v_W = run.central_twist(std::nullopt, body).v_WB;
    if (carried_W.isZero(0)) carried_W = v_W;
    if (v_W != carried_W) return Vector3::Zero();
  }
  return carried_W;
}

}  // namespace

SubstepProblem::SubstepProblem(IslandRun& run) : run_(run), carried_W_(carrying_velocity(run)) {
  std::vector<SubstepMemory>& spare = run.workspace().spare;
  if (!spare.empty()) {
    memory_ = std::move(spare.back());
    spare.pop_back();
  }
  for (const IslandRun::Member& member : run.members()) {
    ContactBody body;
    body.inverse_mass_W = member.body->linear_mobility();
    problem_.bodies.push_back(body);
    centers_.push_back(member.state.X_WM.translation());
    set_mobility(problem_.bodies.size() - 1, member.state.X_WM.rotation());
    const Vector3 w_W = problem_.bodies.back().inverse_inertia_W * member.state.L_W;
    start_speed_ = std::max(
        start_speed_, (member.state.v_W - carried_W_).norm() + w_W.norm() * member.body->radius);
  }
  for (const IslandRun::RunPair& pair : run.pairs()) {
    rest_offset_ = std::min(rest_offset_, pair.state->lengths.rest_offset);
  }
}

SubstepProblem::~SubstepProblem() {
  contacts_.clear();
  problem_.bodies.clear();
  problem_.contacts.clear();
  problem_.rows.clear();
  problem_.friction_law = nullptr;
  run_.workspace().spare.push_back(std::move(memory_));
}

void SubstepProblem::set_mobility(std::size_t member, const Matrix3& R_WB) {
  problem_.bodies[member].inverse_inertia_W = run_.members()[member].body->angular_mobility(R_WB);
}

void SubstepProblem::set_supports(Scalar tau) {
  for (const auto& [slot, index] : supports_) {
    const BodyRecord& body = run_.context().body(slot);
    if (body.definition.kind != BodyKind::Kinematic) continue;
    const Motion& motion = *body.definition.motion;
    ContactBody& support = problem_.bodies[index];
    if (tau > 0) {
      const RigidPose begin = motion.pose(run_.now());
      const RigidPose end = motion.pose(run_.now() + tau);
      support.free_v_W = (end.translation() - begin.translation()) / tau;
      support.free_w_W = rotation_vector(end.rotation() * begin.rotation().transpose()) / tau;
    } else {
      const Twist twist = run_.central_twist(std::nullopt, body);
      support.free_v_W = twist.v_WB;
      support.free_w_W = twist.w_WB;
    }
    support.v_W = support.free_v_W;
    support.w_W = support.free_w_W;
  }
}

std::size_t SubstepProblem::body_index(const std::optional<std::size_t>& member,
                                       const BodyRecord& body) const {
  if (member) return *member;
  for (const auto& [slot, index] : supports_) {
    if (slot == body.id.slot) return index;
  }
  throw InternalError("contact with a body outside its island");
}

void SubstepProblem::ensure_support(const std::optional<std::size_t>& member,
                                    const BodyRecord& body) {
  if (member) return;
  for (const auto& [slot, index] : supports_) {
    if (slot == body.id.slot) return;
  }
  supports_.emplace_back(body.id.slot, problem_.bodies.size());
  problem_.bodies.emplace_back();
  centers_.push_back(central_pose(body, run_.pose_of(member, body)).translation());
}

std::size_t SubstepProblem::take_body(const BodyRecord& body) {
  const auto member = run_.member_at(body.id);
  ensure_support(member, body);
  rest_offset_ = std::min(rest_offset_, kRestOffsetTargets * kTargetRadiusFraction * body.radius);
  return body_index(member, body);
}

void SubstepProblem::take_joints(Scalar tau) {
  for (JointState* joint : run_.joints()) {
    const BodyRecord& a = run_.context().body(joint->definition.a.slot);
    const BodyRecord& b = run_.context().body(joint->definition.b.slot);
    const std::size_t body_a = take_body(a);
    const std::size_t body_b = take_body(b);
    const std::vector<JointEquation> equations =
        joint_equations(*joint, joint_places(run_, *joint), std::min(a.radius, b.radius));
    joint->impulses.resize(equations.size(), 0);
    for (std::size_t k = 0; k < equations.size(); ++k) {
      JointRow row = equations[k].row;
      row.body_a = body_a;
      row.body_b = body_b;
      row.impulse = joint->impulses[k];
      if (equations[k].kind == JointEquation::Kind::Limit) row.lower = 0;
      const bool is_driven = equations[k].kind == JointEquation::Kind::Motor ||
                             equations[k].kind == JointEquation::Kind::Drive;
      if (is_driven) {
        row.lower = tau > 0 ? tau * row.lower : 0;
        row.upper = tau > 0 ? tau * row.upper : 0;
      }
      problem_.rows.push_back(row);
      rows_.push_back({joint, k, equations[k], 0});
    }
  }
  leave_out_rows();
}

void SubstepProblem::leave_out_rows() {
  std::vector<HeldRow> held;
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const SubstepRow& entry = rows_[i];
    if (entry.equation.kind != JointEquation::Kind::Equality) continue;
    const JointDefinition& joint = entry.joint->definition;
    const Scalar radius = std::min(run_.context().body(joint.a.slot).radius,
                                   run_.context().body(joint.b.slot).radius);
    held.push_back({entry.joint->id.number, &problem_.rows[i], entry.equation.value, radius});
    numbers.push_back(i);
  }
  for (const std::size_t k :
       find_contradicting_rows(held, problem_.bodies, run_.members().size())) {
    JointRow& row = problem_.rows[numbers[k]];
    row.lower = row.upper = row.impulse = 0;
    rows_[numbers[k]].is_left_out = true;
  }
}

Scalar SubstepProblem::row_velocity(std::size_t row) const {
  const JointRow& entry = problem_.rows[row];
  const ContactBody& a = problem_.bodies[entry.body_a];
  const ContactBody& b = problem_.bodies[entry.body_b];
  return entry.j_av_W.dot(a.v_W) + entry.j_aw_W.dot(a.w_W) + entry.j_bv_W.dot(b.v_W) +
         entry.j_bw_W.dot(b.w_W);
}

void SubstepProblem::keep_row_impulses() {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    rows_[i].joint->impulses[rows_[i].index] = problem_.rows[i].impulse;
  }
}

void SubstepProblem::add(const SubstepContact& contact) {
  const IslandRun::RunPair& pair = run_.pairs()[contact.pair];
  ensure_support(pair.member_a, *pair.a);
  ensure_support(pair.member_b, *pair.b);
  PointContact row;
  row.body_a = body_index(pair.member_a, *pair.a);
  row.body_b = body_index(pair.member_b, *pair.b);
  // Both bodies get the impulse at the middle of the gap, so that it adds no torque of its own.
  const Vector3 p_W = contact.index ? Vector3((contact.point.p_WCa + contact.point.p_WCb) / 2)
                                    : acting_point(contact.point, problem_.bodies[row.body_a],
                                                   problem_.bodies[row.body_b]);
  row.r_a_W = p_W - center_of(row.body_a);
  row.r_b_W = p_W - center_of(row.body_b);
  row.nhat_AB_W = contact.point.nhat_AB_W;
  row.friction = pair.friction;
  row.rolling_friction = pair.state->material.rolling_friction;
  row.torsional_friction = pair.state->material.torsional_friction;
  row.impulse_W = contact.point.impulse_W;
  problem_.contacts.push_back(row);
  contacts_.push_back(contact);
  ball_contacts_ += pair.has_ball ? 1 : 0;
}

// The contact that a hit repeats: near it, and moving with the last velocities by less than a push
// differently along the hit's normal. What slides into the next facet of a polygon hits another
// contact, however small the angle: no push along the first facet's normal answers that one.
SubstepContact* SubstepProblem::known_at(std::size_t pair, const ContactPoint& point, Scalar tau) {
  const PairLengths& lengths = run_.pairs()[pair].state->lengths;
  SubstepContact* known = nullptr;
  Scalar least = kHitPush * lengths.rest_offset;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const ContactPoint& other = contacts_[i].point;
    if (contacts_[i].pair != pair || !(other.nhat_AB_W.dot(point.nhat_AB_W) > 0.9)) continue;
    if (!((other.p_WCa - point.p_WCa).norm() < 0.05 * lengths.radius)) continue;
    const Vector3 travel = tau * relative_velocity(i);
    const Scalar difference = std::abs(travel.dot(other.nhat_AB_W - point.nhat_AB_W));
    if (!(difference < least)) continue;
    least = difference;
    known = &contacts_[i];
  }
  return known;
}

Scalar SubstepProblem::add_hit(std::size_t pair, const ContactPoint& point, Scalar tau) {
  if (SubstepContact* known = known_at(pair, point, tau)) {
    const Scalar rest_offset = run_.pairs()[pair].state->lengths.rest_offset;
    known->push += kHitPush * rest_offset * std::exp2(std::min(known->hits++, 4));
    return known->push;
  }
  add_beside_hit(pair, point, tau, 0);
  return 0;
}

void SubstepProblem::add_beside_hit(std::size_t pair, const ContactPoint& point, Scalar tau,
                                    Scalar push) {
  if (SubstepContact* known = known_at(pair, point, tau)) {
    known->push = std::max(known->push, push);
    return;
  }
  SubstepContact entry;
  entry.pair = pair;
  entry.point = point;
  add(entry);
}

void SubstepProblem::add_from_below(std::vector<Place> places) {
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& x, const Place& y) { return x.height < y.height; });
  for (const Place& place : places) {
    const PairState& state = *run_.pairs()[place.pair].state;
    add({place.pair, place.index, state.points()[place.index]});
  }
  first_contacts_ = contacts_.size();
}

// To a part of the speed with which the island moves. Of bodies at rest that is what the last
// solves left, not what gravity would give them in a step: else stacks sway with the solver's
// error.
Scalar SubstepProblem::tolerance(Scalar tau) const {
  tau = std::max(tau, least_substep());
  Scalar fastest = start_speed_;
  for (const ContactBody& body : problem_.bodies) {
    if (!body.inverse_mass_W.isZero(0)) continue;
    fastest = std::max(fastest, (body.free_v_W - carried_W_).norm());
  }
  Scalar usual = contact_tolerance(fastest, rest_offset_, tau);
  if (is_crowd()) {
    usual = std::max(
        usual, std::min(kCrowdSpeedTolerance * fastest, kCoarseTolerance * rest_offset_ / tau));
  }
  // So few bodies are solved exactly in no time.
  const bool is_small = run_.members().size() <= kContactFewBodies;
  const Scalar exact =
      std::max(kContactSpeedTolerance * fastest, kContactRestTolerance * rest_offset_ / tau);
  if (is_large()) {
    // In a substep, in rest offsets.
    const Scalar travel = may_sleep() ? Scalar{1} : fastest * tau / rest_offset_;
    const Scalar loose =
        (contacts_.size() > kLargeContacts ? kContactLooseTolerance : kBallTolerance) *
        rest_offset_ / tau;
    return std::max(usual,
                    std::min(kLargeSpeedTolerance * std::min(travel, Scalar{1}) * fastest, loose));
  }
  return is_small ? std::min(usual, exact) : usual;
}

bool SubstepProblem::may_sleep() const {
  const bool has_wrench = std::any_of(
      run_.members().begin(), run_.members().end(),
      [](const IslandRun::Member& member) { return bool(member.body->definition.wrench); });
  return run_.context().options->sleep_steps > 0 && run_.joints().empty() &&
         run_.springs().empty() && !has_wrench;
}

bool SubstepProblem::is_crowd() const {
  const bool is_heap =
      run_.joints().empty() || kHeapBodiesPerContact * contacts_.size() > run_.members().size();
  return run_.members().size() > kCrowdBodies && is_heap &&
         start_speed_ * run_.context().h > kCrowdTravel * rest_offset_;
}

bool SubstepProblem::is_large() const {
  const bool has_many = contacts_.size() > kLargeContacts;
  return is_of_balls() || (has_many && run_.members().size() > kContactFewBodies);
}

bool SubstepProblem::is_of_balls() const {
  return run_.members().size() > kCrowdBodies && 2 * ball_contacts_ > contacts_.size();
}

bool SubstepProblem::is_large_and_moves() const {
  return is_large() && !is_coarse() &&
         start_speed_ * run_.context().h > kMovingTravel * rest_offset_;
}

int SubstepProblem::first_sweeps() const {
  if (!run_.joints().empty()) return 0;
  if (is_crowd()) return is_coarse() ? kCoarseCrowdSweeps : kCrowdSweeps;
  return is_large_and_moves() ? kMovingSweeps : 0;
}

bool SubstepProblem::turns_too_far(Scalar tau) const {
  for (std::size_t i = 0; i < run_.members().size(); ++i) {
    const ContactBody& body = problem_.bodies[i];
    if (tau * (body.w_W - body.free_w_W).norm() > kMostContactTurn) return true;
  }
  return false;
}

bool SubstepProblem::is_coarse() const {
  return first_contacts_ > kLargeContacts && run_.members().size() > kContactFewBodies &&
         first_contacts_ > kCoarseContactsPerBody * run_.members().size() &&
         start_speed_ * run_.context().h > kCoarseTravel * rest_offset_;
}

bool SubstepProblem::loads_may_drift(Scalar tau) const {
  return !is_large() && start_speed_ * tau > kDriftTravel * rest_offset_;
}

Scalar SubstepProblem::impact_tolerance(Scalar tau) const {
  Scalar fastest = 0;
  for (const ContactBody& body : problem_.bodies) {
    fastest = std::max(fastest, body.free_v_W.norm());
  }
  constexpr Scalar kLeast = 1e-10;  // literal: of the rest offset per step
  return std::max(kImpactSpeedNoise * fastest, kLeast * rest_offset_ / tau);
}

// Sweeps alone first, if asked for: what they do not solve, factorisations may.
ContactReport SubstepProblem::solve_with(const ContactSolverOptions& options, int first_sweeps) {
  ContactCascade& solver = run_.workspace().solver;
  if (first_sweeps == 0) return solver.solve(problem_, options);
  ContactSolverOptions sweeps = options;
  sweeps.sweep_limit = std::max(sweeps.sweep_limit, first_sweeps);
  if (options.newton_limit == 0) return solver.solve(problem_, sweeps);
  sweeps.newton_limit = 0;
  sweeps.admm_limit = 0;
  sweeps.cascade_rounds = 1;
  sweeps.restart_contacts = 0;
  const ContactReport report = solver.solve(problem_, sweeps);
  return report.status == ContactStatus::Converged ? report : solver.solve(problem_, options);
}

Scalar SubstepProblem::friction_by_law(std::size_t contact, const Vector3& sliding_W) const {
  const IslandRun::RunPair& pair = run_.pairs()[contacts_[contact].pair];
  return run_.context().options->friction_law(pair.a->id, pair.b->id, sliding_W);
}

void SubstepProblem::fix_friction(std::size_t contact, const Vector3& velocity_W) {
  if (!run_.context().options->friction_law) return;
  PointContact& row = problem_.contacts[contact];
  row.friction =
      friction_by_law(contact, velocity_W - row.nhat_AB_W * row.nhat_AB_W.dot(velocity_W));
  has_fixed_friction_ = true;
}

ContactReport SubstepProblem::solve(Scalar tau, bool is_impact) {
  StepStatistics& work = run_.outcome().work;
  work.contacts = std::max(work.contacts, std::int64_t(contacts_.size()));
  if (contacts_.empty() && problem_.rows.empty()) {
    for (ContactBody& body : problem_.bodies) {
      body.v_W = body.free_v_W;
      body.w_W = body.free_w_W;
    }
    ContactReport report;
    report.status = ContactStatus::Converged;
    return report;
  }
  ContactSolverOptions options = run_.context().options->solver;
  options.thread_count = run_.context().options->thread_count;
  options.tolerance = is_impact ? impact_tolerance(tau) : tolerance(tau);
  if (is_large()) {
    // What one round does not solve there a second hardly ever does, at the price of the first.
    options.cascade_rounds = std::min(options.cascade_rounds, 1);
    options.patience = std::min(options.patience, kLargePatience);
  }
  if (is_crowd() && !is_impact) {
    options.patience = std::min(options.patience, kLargePatience);
    options.cascade_rounds = std::min(options.cascade_rounds, 1);
  }
  if (is_coarse()) {
    options.tolerance = std::max(options.tolerance, kCoarseTolerance * rest_offset_ / tau);
    options.newton_limit = 0;
    options.admm_limit = 0;
  }
  if (run_.context().options->friction_law && !has_fixed_friction_) {
    problem_.friction_law = [this](std::size_t contact, const Vector3& sliding_W) {
      return friction_by_law(contact, sliding_W);
    };
  }
  LimitInterrupt interrupt(run_.context().limits);
  if (!options.interrupt) options.interrupt = &interrupt;
  const PartTimer timing = run_.timer(&StepTimes::solve);
  const int sweeps = is_impact ? 0 : first_sweeps();
  slack_ = !is_impact && (sweeps > 0 || is_crowd()) ? options.tolerance * tau : 0;
  const ContactReport report = solve_with(options, sweeps);
  work.residual = std::max(work.residual, report.residual);
  if (report.status != ContactStatus::Converged) ++work.unconverged;
  return report;
}

Vector3 SubstepProblem::relative_velocity(std::size_t contact) const {
  const PointContact& row = problem_.contacts[contact];
  const ContactBody& a = problem_.bodies[row.body_a];
  const ContactBody& b = problem_.bodies[row.body_b];
  return b.v_W + b.w_W.cross(row.r_b_W) - a.v_W - a.w_W.cross(row.r_a_W);
}

Vector3 SubstepProblem::relative_turn(std::size_t contact) const {
  const PointContact& row = problem_.contacts[contact];
  return problem_.bodies[row.body_b].w_W - problem_.bodies[row.body_a].w_W;
}

std::vector<Vector3> SubstepProblem::angular_momenta(std::vector<Vector3> free_L_W) const {
  const std::size_t count = free_L_W.size();
  for (const PointContact& row : problem_.contacts) {
    if (row.body_a < count) {
      free_L_W[row.body_a] -= row.r_a_W.cross(row.impulse_W) + row.angular_impulse_W;
    }
    if (row.body_b < count) {
      free_L_W[row.body_b] += row.r_b_W.cross(row.impulse_W) + row.angular_impulse_W;
    }
  }
  for (const JointRow& row : problem_.rows) {
    if (row.body_a < count) free_L_W[row.body_a] += row.impulse * row.j_aw_W;
    if (row.body_b < count) free_L_W[row.body_b] += row.impulse * row.j_bw_W;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const LockedAxes& locked = run_.members()[i].body->definition.locked;
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (locked.rotation[static_cast<std::size_t>(k)]) free_L_W[i][k] = 0;
    }
  }
  return free_L_W;
}

bool SubstepProblem::is_held_by_joints() const {
  return !rows_.empty() &&
         std::all_of(problem_.contacts.begin(), problem_.contacts.end(),
                     [](const PointContact& row) { return row.impulse_W.isZero(0); });
}

bool SubstepProblem::has_gained_energy(Scalar tau) const {
  const Scalar speed_noise = impact_tolerance(tau);
  Scalar work = 0;
  Scalar noise = 0;
  const auto add = [&](Scalar impulse, Scalar before, Scalar after) {
    work += impulse * (before + after) / 2;
    noise += std::abs(impulse) *
             (kImpactEnergyNoise * (std::abs(before) + std::abs(after)) / 2 + speed_noise);
  };
  for (const PointContact& row : problem_.contacts) {
    const ContactBody& a = problem_.bodies[row.body_a];
    const ContactBody& b = problem_.bodies[row.body_b];
    const Vector3 before_W =
        b.free_v_W + b.free_w_W.cross(row.r_b_W) - a.free_v_W - a.free_w_W.cross(row.r_a_W);
    const Vector3 after_W = b.v_W + b.w_W.cross(row.r_b_W) - a.v_W - a.w_W.cross(row.r_a_W);
    const Vector3 turn_before_W = b.free_w_W - a.free_w_W;
    const Vector3 turn_after_W = b.w_W - a.w_W;
    for (Eigen::Index k = 0; k < 3; ++k) {
      add(row.impulse_W[k], before_W[k], after_W[k]);
      add(row.angular_impulse_W[k], turn_before_W[k], turn_after_W[k]);
    }
  }
  for (const JointRow& row : problem_.rows) {
    const ContactBody& a = problem_.bodies[row.body_a];
    const ContactBody& b = problem_.bodies[row.body_b];
    const auto rate = [&](const Vector3& v_a, const Vector3& w_a, const Vector3& v_b,
                          const Vector3& w_b) {
      return row.j_av_W.dot(v_a) + row.j_aw_W.dot(w_a) + row.j_bv_W.dot(v_b) + row.j_bw_W.dot(w_b);
    };
    add(row.impulse, rate(a.free_v_W, a.free_w_W, b.free_v_W, b.free_w_W),
        rate(a.v_W, a.w_W, b.v_W, b.w_W));
  }
  return work > noise;
}

BodyId SubstepProblem::id_of(std::size_t body) const {
  if (body < run_.members().size()) return run_.members()[body].body->id;
  for (const auto& [slot, index] : supports_) {
    if (index == body) return run_.context().body(slot).id;
  }
  throw InternalError("an impulse on a body outside its island");
}

void SubstepProblem::add_soft_joint_rows(std::size_t count) {
  first_soft_row_ = std::min(first_soft_row_, problem_.rows.size());
  problem_.rows.resize(problem_.rows.size() + count);
}

// After the rows of joints come those of springs, and then the soft ones of joints.
bool SubstepProblem::is_of_joint(std::size_t row) const {
  return row < rows_.size() || row >= first_soft_row_;
}

namespace {

// A pulley pulls both its bodies up: what bears that is a static body that carries its joints.
std::optional<BodyId> static_carrier(const IslandRun& run, const JointState& joint) {
  if (joint.definition.kind != JointKind::Coupling) return std::nullopt;
  for (const JointState* coupled : joint.coupled) {
    for (const BodyId& id : {coupled->definition.a, coupled->definition.b}) {
      if (run.context().body(id.slot).definition.kind == BodyKind::Static) return id;
    }
  }
  return std::nullopt;
}

}  // namespace

void SubstepProblem::add_impulses(VelocityChange& change, Scalar share) const {
  for (const PointContact& row : problem_.contacts) {
    const BodyId a = id_of(row.body_a);
    const BodyId b = id_of(row.body_b);
    if (!row.impulse_W.isZero(0)) {
      change.contacts.push_back(
          {a, b, center_of(row.body_b) + row.r_b_W, row.nhat_AB_W, row.impulse_W, row.target,
           run_.context().options->friction_law ? kUnknownFriction : row.friction});
    }
    if (row.angular_impulse_W.isZero(0)) continue;
    change.links.push_back({LinkImpulse::Kind::Rolling, a, b, Vector3::Zero(),
                            -row.angular_impulse_W, row.angular_impulse_W});
  }
  for (std::size_t i = 0; i < problem_.rows.size(); ++i) {
    const JointRow& row = problem_.rows[i];
    const bool is_joint = is_of_joint(i);
    const bool is_drive = i < rows_.size() && rows_[i].equation.kind == JointEquation::Kind::Drive;
    const bool is_whole = is_joint && !is_drive;
    const Scalar impulse = is_whole ? row.impulse : share * row.impulse;
    if (impulse == 0) continue;
    const BodyId a = id_of(row.body_a);
    const BodyId b = id_of(row.body_b);
    const auto kind = is_joint ? LinkImpulse::Kind::Joint : LinkImpulse::Kind::Spring;
    const auto carrier = i < rows_.size() ? static_carrier(run_, *rows_[i].joint) : std::nullopt;
    if (!carrier) {
      change.links.push_back(
          {kind, a, b, impulse * row.j_bv_W, impulse * row.j_aw_W, impulse * row.j_bw_W});
      continue;
    }
    change.links.push_back(
        {kind, *carrier, a, impulse * row.j_av_W, Vector3::Zero(), impulse * row.j_aw_W});
    change.links.push_back(
        {kind, *carrier, b, impulse * row.j_bv_W, Vector3::Zero(), impulse * row.j_bw_W});
  }
}

// Targets.

namespace {

using RunPair = IslandRun::RunPair;

// The solve is repeated if a contact would slip by this part of the rest offset because it sticks
// at another place than before. Larger: what spins or pivots gains or loses energy at first order.
constexpr Scalar kStickingChange = 0.001;
// kErrorChange for smooth contacts. Larger values make slow rolling jitter by this amount.
constexpr Scalar kSmoothErrorChange = 0.0001;  // literal: of the rest offset

// What a gap may not dip below: what is proven, plus half a rest offset for the tolerance of the
// proof.
Scalar least_allowed(const RunPair& pair) {
  return pair.state->kept_distance() + 0.5 * pair.state->lengths.rest_offset;
}

// How far the linear gap may close over the substep without such a dip.
Scalar most_closing(const RunPair& pair, const SubstepContact& contact) {
  const Scalar room = contact.point.gap - least_allowed(pair);
  return std::max(closing_at_dip(room, contact.error), contact.safe_closing);
}

// An end is found again if the bodies move by this part of what would repeat the solve.
constexpr Scalar kKnownEnd = 0.25;

// In a substep in which an island moves by less than this fraction of the rest offset, the residual
// gap-recovery velocity would exceed the physical one.
constexpr Scalar kLeastTravel = 0.001;

// Motors and springs can accelerate an island at rest by an unknown amount, so cap the time scale
// at this many steps. More: tolerances below rounding.
constexpr Scalar kMostShortSteps = 100;

// A hit asks more of a contact if it raises its target by this part of the rest offset.
constexpr Scalar kLeastRise = 0.1;

}  // namespace

Scalar SubstepProblem::recovery_cap(std::size_t contact, Scalar tau) const {
  const SubstepContact& entry = contacts_[contact];
  const RunPair& pair = run_.pairs()[entry.pair];
  const PairLengths& lengths = pair.state->lengths;
  if (pair.state->uncertified_gap || pair.state->overlaps) {
    return run_.context().options->separation_speed.value_or(kSeparationRadiusFraction *
                                                             lengths.radius / run_.context().h);
  }
  const Scalar time = std::max({tau, run_.context().h, least_substep()});
  return 0.5 * lengths.rest_offset / time + entry.push / tau + bending_velocity(contact, tau);
}

Scalar SubstepProblem::least_substep() const {
  const Scalar travel = kLeastTravel * rest_offset_;
  const Scalar by_weight = std::sqrt(2 * travel / run_.acceleration());
  const Scalar time = std::min(travel / start_speed_, by_weight);
  if (!std::isfinite(time)) return 0;
  if (std::isfinite(by_weight)) return time;
  return std::min(time, kMostShortSteps * run_.context().h);
}

Scalar SubstepProblem::bending_velocity(std::size_t contact, Scalar tau) const {
  const SubstepContact& entry = contacts_[contact];
  const RunPair& pair = run_.pairs()[entry.pair];
  const auto turn = [&](const std::optional<std::size_t>& member, const BodyRecord& body) {
    if (!member) return Scalar{0};
    const Vector3& w = problem_.bodies[*member].w_W;
    return w.squaredNorm() * body.radius;
  };
  const Vector3& n = entry.point.nhat_AB_W;
  const Vector3 v_W = relative_velocity(contact);
  const Vector3 sliding_W = v_W - n * n.dot(v_W);
  return tau * (turn(pair.member_a, *pair.a) + turn(pair.member_b, *pair.b)) +
         3 * tau * sliding_W.squaredNorm() / pair.state->lengths.radius +
         relative_turn(contact).norm() * entry.point.merged_way;
}

Scalar SubstepProblem::linear_gap(std::size_t contact, Scalar tau) const {
  const ContactPoint& point = contacts_[contact].point;
  return point.gap + tau * point.nhat_AB_W.dot(relative_velocity(contact));
}

CurvedMove SubstepProblem::curved_move(std::size_t contact, Scalar tau) const {
  const Vector3 turn_W = relative_turn(contact);
  return {linear_gap(contact, tau) + contacts_[contact].error,
          tau * relative_velocity(contact).norm(), tau * turn_W.norm(),
          tau * turn_W.cross(contacts_[contact].point.nhat_AB_W).norm()};
}

// Difference in slip velocity between mid-path and the start of the contact's path, with the
// velocities of the last solve.
Scalar SubstepProblem::stick_midway(std::size_t contact, const Vector3& p_W_end, Scalar tau) {
  PointContact& row = problem_.contacts[contact];
  const Vector3 travel = (p_W_end - (center_of(row.body_a) + row.r_a_W)) / 2;
  const auto change = [&](const ContactBody& body) -> Vector3 {
    return body.w_W.cross(travel - tau / 2 * body.v_W);
  };
  Vector3 velocity_W = change(problem_.bodies[row.body_a]) - change(problem_.bodies[row.body_b]);
  velocity_W -= row.nhat_AB_W * row.nhat_AB_W.dot(velocity_W);
  std::swap(row.sticking_velocity_W, velocity_W);
  return row.friction > 0 ? (row.sticking_velocity_W - velocity_W).norm() : 0;
}

bool SubstepProblem::end_is_known(std::size_t contact, Scalar tau) const {
  // The features of an estimate touch only where the bodies would be apart: what is between them
  // here is no gap.
  if (run_.pairs()[contacts_[contact].pair].state->overlaps) return true;
  if (contact >= ends_.size()) return false;
  const TakenEnd& end = ends_[contact];
  const IslandRun::RunPair& pair = run_.pairs()[contacts_[contact].pair];
  const PointContact& row = problem_.contacts[contact];
  const ContactBody& a = problem_.bodies[row.body_a];
  const ContactBody& b = problem_.bodies[row.body_b];
  const Scalar change = (a.v_W - end.v_a_W).norm() + (a.w_W - end.w_a_W).norm() * pair.a->radius +
                        (b.v_W - end.v_b_W).norm() + (b.w_W - end.w_b_W).norm() * pair.b->radius;
  return tau * change <= end.tolerance;
}

bool SubstepProblem::ends_short(std::size_t contact, Scalar tau) const {
  const SubstepContact& entry = contacts_[contact];
  return linear_gap(contact, tau) + entry.error < run_.pairs()[entry.pair].state->kept_distance();
}

void SubstepProblem::predict_end(std::size_t contact, const PredictedEnd& predicted) {
  SubstepContact& entry = contacts_[contact];
  const RunPair& pair = run_.pairs()[entry.pair];
  const EndGap& end = predicted.end;
  // Corners that pass each other need no push away from each other, however low they are.
  const bool passes = end.passes && end.gap >= pair.state->kept_distance();
  const Scalar gap = passes ? std::max(end.gap, pair.state->lengths.rest_gap()) : end.gap;
  entry.error = gap - predicted.linear_gap;
  // A faster one may dip: a way that is fine now is no leave to go faster.
  const bool is_safe = end.least && *end.least >= least_allowed(pair);
  const Scalar closing = is_safe ? entry.point.gap - predicted.linear_gap : 0;
  entry.safe_closing = passes ? kInfinity : closing;
}

bool SubstepProblem::take_end(std::size_t contact, const EndGap& end, Scalar tau) {
  SubstepContact& entry = contacts_[contact];
  const PairLengths& lengths = run_.pairs()[entry.pair].state->lengths;
  const Scalar last_error = entry.error;
  predict_end(contact, {end, linear_gap(contact, tau)});
  const Scalar change = std::abs(entry.error - last_error);
  const Scalar slip = end.p_W ? tau * stick_midway(contact, *end.p_W, tau) : 0;
  const Scalar fraction = end.is_smooth ? kSmoothErrorChange : kErrorChange;
  const Scalar most_change = std::max(fraction * lengths.rest_offset, slack_);
  const PointContact& row = problem_.contacts[contact];
  const ContactBody& a = problem_.bodies[row.body_a];
  const ContactBody& b = problem_.bodies[row.body_b];
  ends_.resize(contacts_.size());
  ends_[contact] = {a.v_W, a.w_W, b.v_W, b.w_W, kKnownEnd * most_change};
  const bool carries = !problem_.contacts[contact].impulse_W.isZero(0);
  if (!carries && end.gap >= lengths.rest_gap() + lengths.rest_offset) return false;
  return change > most_change || slip > std::max(kStickingChange * lengths.rest_offset, slack_);
}

Scalar SubstepProblem::least_velocity(std::size_t contact, Scalar tau) const {
  const SubstepContact& entry = contacts_[contact];
  const RunPair& pair = run_.pairs()[entry.pair];
  const Scalar missing = pair.state->lengths.rest_gap() - entry.point.gap;
  const Scalar rate = missing > 0 ? kGapRecovery * missing : missing;
  const Scalar value = (rate - entry.error + entry.push) / tau;
  if (value <= 0) return std::max(value, -most_closing(pair, entry) / tau);
  return std::min(value, recovery_cap(contact, tau));
}

void SubstepProblem::set_targets(Scalar tau, bool recovers) {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    set_target(i, target_of_substep(i, tau, recovers));
  }
}

bool SubstepProblem::asks_more(std::size_t known, Scalar tau, bool recovers) const {
  if (contacts_.size() > known) return true;
  const Scalar noise = kLeastRise * rest_offset_ / tau;
  for (std::size_t i = 0; i < known; ++i) {
    if (target_of_substep(i, tau, recovers) > problem_.contacts[i].target + noise) return true;
  }
  return false;
}

Scalar SubstepProblem::target_of_substep(std::size_t contact, Scalar tau, bool recovers) const {
  const Scalar value = least_velocity(contact, tau);
  return recovers ? value : std::min(value, Scalar{0});
}

// Locks.

namespace {

// Coefficients of friction, and the places of contacts between bodies that rest a gap apart, are
// not known to a smaller part. Just short of a lock solutions exist, but ask for impulses of
// thousands of times what drives the bodies, until no solver finds them, or no substep is short
// enough for what they do to the bodies.
constexpr Scalar kLockImbalance = 1e-3;

}  // namespace

std::optional<PairKey> SubstepProblem::locked_by_friction() const {
  const auto key_of = [this](std::size_t contact) {
    return run_.pairs()[contacts_[contact].pair].state->key;
  };
  const std::size_t movable = run_.members().size();
  if (const auto stress = find_self_stress(problem_, movable, kLockImbalance)) {
    return key_of(stress->hardest_contact);
  }
  // A substep asks contacts for different ways, as their gaps are not alike. What carries closes
  // its gap: then they move along together, or lock.
  ContactProblem closed = problem_;
  closed.contacts.clear();
  std::vector<std::size_t> carrying;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (problem_.contacts[i].impulse_W.isZero(0)) continue;
    carrying.push_back(i);
    closed.contacts.push_back(problem_.contacts[i]);
    closed.contacts.back().target = 0;
    closed.contacts.back().sticking_velocity_W.setZero();
  }
  const auto stress = find_self_stress(closed, movable, kLockImbalance);
  if (!stress) return std::nullopt;
  return key_of(carrying[stress->hardest_contact]);
}

}  // namespace dyop::dynamics_internal
