// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/link_rows.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/tolerance.h"

namespace dyop::dynamics_internal {

// Rows of joints and springs.

namespace {

Scalar mobility(const ContactBody& body, const Vector3& j_v, const Vector3& j_w) {
  return j_v.dot(body.inverse_mass_W * j_v) + j_w.dot(body.inverse_inertia_W * j_w);
}

JointRow row_along(const Vector3& axis, const Vector3& arm_a, const Vector3& arm_b) {
  JointRow row;
  row.j_av_W = -axis;
  row.j_aw_W = -arm_a.cross(axis);
  row.j_bv_W = axis;
  row.j_bw_W = arm_b.cross(axis);
  return row;
}

// Whether half a step of a spring's or damper's force cannot turn the motion along its row round.
bool is_resolved(Scalar stiffness, Scalar damping, const JointRow& row,
                 const SubstepProblem& substep, Scalar tau) {
  const Scalar weight = mobility(substep.problem().bodies[row.body_a], row.j_av_W, row.j_aw_W) +
                        mobility(substep.problem().bodies[row.body_b], row.j_bv_W, row.j_bw_W);
  return (damping + stiffness * tau / 2) * tau / 2 * weight <= 1;
}

}  // namespace

// Where joints are.

namespace {

/// How far a body turns until the time of interest, a rotation vector; to count turns.
using Turn =
    std::function<Vector3(const std::optional<std::size_t>& member, const BodyRecord& body)>;

JointPlace place_of(const IslandRun& run, const JointState& joint, const EndPose& pose,
                    const Turn& turn) {
  const BodyRecord& a = run.context().body(joint.definition.a.slot);
  const BodyRecord& b = run.context().body(joint.definition.b.slot);
  const auto member_a = run.member_at(a.id);
  const auto member_b = run.member_at(b.id);
  const RigidPose X_WA = pose(member_a, a);
  Scalar expected = joint.angle;
  if (joint.has_angle()) {
    const Vector3 z = X_WA.rotation() * joint.definition.X_AJ.rotation().col(2);
    expected += z.dot(turn(member_b, b) - turn(member_a, a));
  }
  return joint_place(joint.definition, a, X_WA, b, pose(member_b, b), expected);
}

JointPlaces places_of(const IslandRun& run, const JointState& joint, const EndPose& pose,
                      const Turn& turn) {
  if (joint.definition.kind != JointKind::Coupling) return {place_of(run, joint, pose, turn), {}};
  return {place_of(run, *joint.coupled[0], pose, turn),
          place_of(run, *joint.coupled[1], pose, turn)};
}

Vector3 prescribed_turn(const BodyRecord& body, Scalar t, Scalar tau) {
  if (body.definition.kind != BodyKind::Kinematic) return Vector3::Zero();
  return tau * body.definition.motion->twist(t).w_WB;
}

}  // namespace

JointPlaces joint_places(const IslandRun& run, const JointState& joint) {
  return places_of(
      run, joint, [&](const auto& member, const auto& body) { return run.pose_of(member, body); },
      [](const auto&, const auto&) { return Vector3(Vector3::Zero()); });
}

void follow_joint_angles(IslandRun& run, const std::vector<Vector3>& w_W, Scalar tau) {
  const auto pose = [&](const auto& member, const BodyRecord& body) {
    return run.pose_of(member, body);
  };
  const auto turn = [&](const std::optional<std::size_t>& member, const BodyRecord& body) {
    if (member) return w_W.empty() ? Vector3(Vector3::Zero()) : Vector3(tau * w_W[*member]);
    return prescribed_turn(body, run.now(), tau);
  };
  for (JointState* joint : run.joints()) {
    if (joint->has_angle()) joint->angle = place_of(run, *joint, pose, turn).angle;
  }
}

// Rows of joints.

namespace {

// If the predicted joint error still changes by more than this fraction of the closable error,
// reject the substep.
constexpr Scalar kGuessedPart = 0.1;
// If joints close by so many times what the substep's turns take from them, the turns are those of
// the recovery.
constexpr Scalar kPrevailing = 10;
// Smaller recoveries, in changes that repeat a solve, close what solves themselves have left.
constexpr Scalar kLeftErrors = 10;

// The largest error that a joint closes in one substep.
Scalar recovery_of_substep(const SubstepProblem& substep, const JointState& joint) {
  const BodyRecord& a = substep.run().context().body(joint.definition.a.slot);
  const BodyRecord& b = substep.run().context().body(joint.definition.b.slot);
  return kSeparationRadiusFraction * std::min(a.radius, b.radius);
}

bool is_held(const SubstepRow& entry) {
  return !entry.is_left_out && (entry.equation.kind == JointEquation::Kind::Equality ||
                                entry.equation.kind == JointEquation::Kind::Limit);
}

}  // namespace

bool joint_recovery_prevails(const SubstepProblem& substep, Scalar tau) {
  Scalar recovery = 0;
  Scalar bending = 0;
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    const SubstepRow& entry = substep.rows()[i];
    if (entry.equation.kind != JointEquation::Kind::Equality || entry.is_left_out) continue;
    const Scalar physical = -entry.error / tau;
    recovery = std::max(recovery, std::abs(substep.problem().rows[i].target - physical));
    bending = std::max(bending, std::abs(physical));
  }
  return recovery > kPrevailing * bending &&
         tau * recovery > kLeftErrors * kErrorChange * substep.rest_offset();
}

namespace {

void add_reaction(const SubstepRow& entry, Scalar impulse) {
  const JointRow& row = entry.equation.row;
  JointState& joint = *entry.joint;
  const Vector3 force = impulse * row.j_bv_W;
  joint.impulse_W += force;
  joint.angular_impulse_W += impulse * row.j_bw_W - entry.equation.arm_b_W.cross(force);
  joint.drive_impulse += entry.equation.scale * impulse;
}

// With q at the part s of the move, 1/2 or 1: impulse = -tau/2 [k (q + s tau (J v) + s error) +
// c (J v + error / tau - speed)], solved for J v.
void set_drive_target(SubstepProblem& substep, std::size_t index, Scalar tau) {
  SubstepRow& entry = substep.rows()[index];
  const JointEquation& equation = entry.equation;
  JointRow& row = substep.problem().rows[index];
  entry.ahead =
      is_resolved(equation.stiffness, equation.damping, row, substep, tau) ? Scalar{0.5} : 1;
  const Scalar weight = equation.stiffness * entry.ahead * tau + equation.damping;
  row.compliance = 1 / (tau / 2 * weight);
  row.target = -(equation.stiffness * (equation.value + entry.ahead * entry.error) +
                 equation.damping * (entry.error / tau - equation.speed)) /
               weight;
}

}  // namespace

// Over a short substep an error is closed no faster than over a step: an impact in the middle of it
// takes the speed for the bodies' own.
void set_joint_targets(SubstepProblem& substep, Scalar tau) {
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    const SubstepRow& entry = substep.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Drive) set_drive_target(substep, i, tau);
    if (!is_held(entry)) continue;
    const Scalar most = recovery_of_substep(substep, *entry.joint) / substep.run().context().h;
    const bool is_limit = entry.equation.kind == JointEquation::Kind::Limit;
    // What the turn of the bodies takes from the joint is not bounded: that would tear it open.
    const Scalar recovery =
        std::clamp(-entry.equation.value / tau, is_limit ? -kInfinity : -most, most);
    substep.set_row_target(i, recovery - entry.error / tau);
  }
}

bool update_joint_errors(SubstepProblem& substep, Scalar tau, const EndPose& end_pose) {
  bool has_changed = false;
  std::vector<JointEquation> ends;
  const JointState* of = nullptr;
  const auto turn = [&](const std::optional<std::size_t>& member, const BodyRecord& body) {
    if (member) return Vector3(tau * substep.problem().bodies[*member].w_W);
    return prescribed_turn(body, substep.run().now(), tau);
  };
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    SubstepRow& entry = substep.rows()[i];
    if (!is_held(entry) && !(entry.equation.stiffness > 0)) continue;
    if (entry.joint != of) {
      of = entry.joint;
      const IslandRun& run = substep.run();
      const BodyRecord& a = run.context().body(of->definition.a.slot);
      const BodyRecord& b = run.context().body(of->definition.b.slot);
      ends =
          joint_equations(*of, places_of(run, *of, end_pose, turn), std::min(a.radius, b.radius));
    }
    const Scalar linear = entry.equation.value + tau * substep.row_velocity(i);
    const Scalar error = ends[entry.index].value - linear;
    has_changed =
        has_changed || std::abs(error - entry.error) > kErrorChange * substep.rest_offset();
    entry.change = is_held(entry) ? std::abs(error - entry.error) : 0;
    entry.error = error;
  }
  return has_changed;
}

void add_drive_ends(SubstepProblem& node, Scalar tau, std::vector<Vector3>& free_L_W,
                    VelocityChange* change) {
  for (std::size_t i = 0; i < node.rows().size(); ++i) {
    const SubstepRow& entry = node.rows()[i];
    const JointEquation& equation = entry.equation;
    if (equation.kind != JointEquation::Kind::Drive) continue;
    JointRow& row = node.problem().rows[i];
    if (!is_resolved(equation.stiffness, equation.damping, row, node, tau)) {
      const Scalar weight = equation.damping + equation.stiffness * tau / 2;
      row.compliance = 1 / (tau / 2 * weight);
      row.target =
          (equation.damping * equation.speed - equation.stiffness * equation.value) / weight;
      continue;
    }
    const Scalar impulse = entry.joint->impulses[entry.index];
    row.lower = 0;
    row.upper = 0;
    row.target = 0;
    const auto kick = [&](std::size_t body, const Vector3& j_v, const Vector3& j_w) {
      if (body >= free_L_W.size()) return;
      ContactBody& moved = node.problem().bodies[body];
      free_L_W[body] += impulse * j_w;
      moved.free_v_W += moved.inverse_mass_W * (impulse * j_v);
      moved.free_w_W = moved.inverse_inertia_W * free_L_W[body];
    };
    kick(row.body_a, row.j_av_W, row.j_aw_W);
    kick(row.body_b, row.j_bv_W, row.j_bw_W);
    add_reaction(entry, impulse);
    if (change == nullptr || impulse == 0) continue;
    const JointDefinition& joint = entry.joint->definition;
    change->links.push_back({LinkImpulse::Kind::Joint, joint.a, joint.b, impulse * row.j_bv_W,
                             impulse * row.j_aw_W, impulse * row.j_bw_W});
  }
}

void cut_drives(const SubstepProblem& substep, Scalar share, std::vector<Vector3>& v_W,
                std::vector<Vector3>& L_W) {
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    const SubstepRow& entry = substep.rows()[i];
    if (entry.equation.kind != JointEquation::Kind::Drive) continue;
    const JointRow& row = substep.problem().rows[i];
    const Scalar cut = (share - 1) * row.impulse;
    const auto take = [&](std::size_t body, const Vector3& j_v, const Vector3& j_w) {
      if (body >= v_W.size()) return;
      v_W[body] += substep.problem().bodies[body].inverse_mass_W * (cut * j_v);
      L_W[body] += cut * j_w;
    };
    take(row.body_a, row.j_av_W, row.j_aw_W);
    take(row.body_b, row.j_bv_W, row.j_bw_W);
    add_reaction(entry, cut);
    entry.joint->impulses[entry.index] = share * row.impulse;
  }
}

void add_reactions(SubstepProblem& substep) {
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    add_reaction(substep.rows()[i], substep.problem().rows[i].impulse);
  }
}

bool joints_are_guessed(const SubstepProblem& substep, Scalar tau) {
  if (!(tau > kLeastJointedSubstep * substep.run().context().h)) return false;
  return std::any_of(substep.rows().begin(), substep.rows().end(), [&](const SubstepRow& entry) {
    return entry.change > kGuessedPart * recovery_of_substep(substep, *entry.joint);
  });
}

bool release_joint_recovery(SubstepProblem& substep, Scalar tau, bool bends) {
  bool has_recovery = false;
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    const SubstepRow& entry = substep.rows()[i];
    if (!is_held(entry)) continue;
    const Scalar wanted = substep.problem().rows[i].target;
    Scalar physical = bends ? -entry.error / tau : 0;
    if (entry.equation.kind == JointEquation::Kind::Limit) {
      physical = std::min(wanted, std::max(0.0, physical));
    }
    has_recovery = has_recovery || physical != wanted;
    substep.set_row_target(i, physical);
  }
  return has_recovery;
}

// Loops.

namespace {

// A row is implied by others if so small a part of it is left, in misfits over the radius: the
// misfit itself makes rows differ by about one. Larger: mechanisms near a dead centre lose rows.
constexpr Scalar kMisfits = 10;
constexpr Scalar kMostImpliedPart = 0.3;
constexpr Scalar kLeastImpliedPart = 1e-7;  // literal: of a row, above rounding
// Joints fit together if they contradict each other by no more than this part of the radius: what
// rounding leaves.
constexpr Scalar kFittingPart = 1e-12;  // literal: of the radius, above rounding
// A loop's rows are compared with each other, each comparison of the length of its bodies.
constexpr std::size_t kMostLoopRows = 400;

/// A joint between two bodies; those that cannot be moved are one.
struct Link {
  std::size_t a = 0;
  std::size_t b = 0;
  std::size_t first = 0;  // row
  std::size_t last = 0;
  bool is_in_loop = true;
};

std::vector<Link> links_of(std::span<const HeldRow> rows, std::size_t movable) {
  std::vector<Link> links;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (links.empty() || rows[links.back().first].joint != rows[i].joint) {
      const JointRow& row = *rows[i].row;
      links.push_back({std::min(row.body_a, movable), std::min(row.body_b, movable), i, i});
    }
    links.back().last = i + 1;
  }
  return links;
}

// Takes out the links that hang on a loop, or on nothing, from their ends. Of a body with one link
// left, the exclusive or of its links' numbers is that link.
void prune_trees(std::vector<Link>& links, std::size_t movable) {
  std::vector<std::size_t> degree(movable + 1, 0);
  std::vector<std::size_t> numbers(movable + 1, 0);
  std::vector<std::size_t> ends;
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (const std::size_t end : {links[i].a, links[i].b}) {
      ++degree[end];
      numbers[end] ^= i;
    }
  }
  for (std::size_t body = 0; body <= movable; ++body) {
    if (degree[body] == 1) ends.push_back(body);
  }
  while (!ends.empty()) {
    const std::size_t body = ends.back();
    ends.pop_back();
    if (degree[body] != 1) continue;
    const std::size_t number = numbers[body];
    Link& link = links[number];
    link.is_in_loop = false;
    for (const std::size_t end : {link.a, link.b}) {
      --degree[end];
      numbers[end] ^= number;
      if (degree[end] == 1) ends.push_back(end);
    }
  }
  std::erase_if(links, [](const Link& link) { return !link.is_in_loop; });
}

// Links that share bodies other than the ground, together.
std::vector<std::vector<Link>> loops_of(const std::vector<Link>& links, std::size_t movable) {
  std::vector<std::size_t> group(movable + 1);
  std::iota(group.begin(), group.end(), std::size_t{0});
  const auto root = [&](std::size_t body) {
    while (group[body] != body) body = group[body] = group[group[body]];
    return body;
  };
  for (const Link& link : links) {
    if (link.a < movable && link.b < movable) group[root(link.a)] = root(link.b);
  }
  std::vector<std::vector<Link>> loops;
  std::vector<std::size_t> loop_of(movable + 1, links.size());
  for (const Link& link : links) {
    std::size_t& loop = loop_of[root(link.a < movable ? link.a : link.b)];
    if (loop == links.size()) {
      loop = loops.size();
      loops.emplace_back();
    }
    loops[loop].push_back(link);
  }
  return loops;
}

Matrix3 square_root(const Matrix3& mobility) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(mobility);
  const Matrix3& V = eigen.eigenvectors();
  return V * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * V.transpose();
}

// The rows of one loop, in the metric of the kinetic energy.
class Loop {
 public:
  Loop(const std::vector<Link>& links, std::span<const HeldRow> rows,
       std::span<const ContactBody> bodies, std::size_t movable)
      : rows_(rows), bodies_(bodies), movable_(movable) {
    for (const Link& link : links) {
      for (std::size_t i = link.first; i < link.last; ++i) numbers_.push_back(i);
    }
  }

  // Appends the rows to be left out.
  void find(std::vector<std::size_t>& found);

 private:
  Eigen::VectorXd column(const JointRow& row);
  void take_body(std::size_t body, const Vector3& j_v, const Vector3& j_w, Eigen::VectorXd& column);

  std::span<const HeldRow> rows_;
  std::span<const ContactBody> bodies_;
  std::size_t movable_;
  std::vector<std::size_t> numbers_;                // of the loop's rows
  std::vector<std::size_t> members_;                // its bodies
  std::vector<std::pair<Matrix3, Matrix3>> roots_;  // of their mobilities
};

void Loop::take_body(std::size_t body, const Vector3& j_v, const Vector3& j_w,
                     Eigen::VectorXd& column) {
  if (body >= movable_) return;
  const auto known = std::find(members_.begin(), members_.end(), body);
  const auto place = std::size_t(known - members_.begin());
  if (known == members_.end()) {
    members_.push_back(body);
    roots_.emplace_back(square_root(bodies_[body].inverse_mass_W),
                        square_root(bodies_[body].inverse_inertia_W));
  }
  const auto first = Eigen::Index(6 * place);
  if (column.size() < first + 6) column.conservativeResizeLike(Eigen::VectorXd::Zero(first + 6));
  column.segment<3>(first) += roots_[place].first * j_v;
  column.segment<3>(first + 3) += roots_[place].second * j_w;
}

Eigen::VectorXd Loop::column(const JointRow& row) {
  Eigen::VectorXd column = Eigen::VectorXd::Zero(Eigen::Index(6 * members_.size()));
  take_body(row.body_a, row.j_av_W, row.j_aw_W, column);
  take_body(row.body_b, row.j_bv_W, row.j_bw_W, column);
  return column;
}

void Loop::find(std::vector<std::size_t>& found) {
  if (numbers_.size() > kMostLoopRows) return;
  Scalar misfit = 0;
  Scalar radius = kInfinity;
  for (const std::size_t i : numbers_) {
    misfit = std::max(misfit, std::abs(rows_[i].value));
    radius = std::min(radius, rows_[i].radius);
  }
  const Scalar implied =
      std::clamp(kMisfits * misfit / radius, kLeastImpliedPart, kMostImpliedPart);
  // Orthonormal, and the values that go with them.
  std::vector<std::pair<Eigen::VectorXd, Scalar>> basis;
  std::vector<std::size_t> left_out;
  Scalar contradiction = 0;
  for (const std::size_t i : numbers_) {
    Eigen::VectorXd rest = column(*rows_[i].row);
    const Scalar length = rest.norm();
    Scalar value = rows_[i].value;
    for (const auto& [direction, along] : basis) {
      const Scalar part = direction.dot(rest.head(direction.size()));
      rest.head(direction.size()) -= part * direction;
      value -= part * along;
    }
    const Scalar left = rest.norm();
    if (left > implied * length) {
      basis.emplace_back(rest / left, value / left);
    } else {
      left_out.push_back(i);
      contradiction = std::max(contradiction, std::abs(value));
    }
  }
  if (contradiction <= kFittingPart * radius) return;
  found.insert(found.end(), left_out.begin(), left_out.end());
}

}  // namespace

std::vector<std::size_t> find_contradicting_rows(std::span<const HeldRow> rows,
                                                 std::span<const ContactBody> bodies,
                                                 std::size_t movable) {
  std::vector<Link> links = links_of(rows, movable);
  prune_trees(links, movable);
  std::vector<std::size_t> found;
  for (const std::vector<Link>& loop : loops_of(links, movable)) {
    Loop(loop, rows, bodies, movable).find(found);
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Tension.

namespace {

// A body is stiff if a turn changes the torque of its joints in half a substep by this part of its
// angular momentum. The rows at a move's start and end are unstable above 1.
constexpr Scalar kResolvedTension = 0.1;
// Radians in a move: a smaller change of a stiff body's turn repeats no solve. Larger: errors of
// the fast links are seen as energy.
constexpr Scalar kTensionTurn = 1e-5;  // literal: the next change would be about its square

// The part of M that resists: without negative eigenvalues.
Matrix3 resisting_part(const Matrix3& M) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(M);
  const Matrix3& V = eigen.eigenvectors();
  return V * eigen.eigenvalues().cwiseMax(0).asDiagonal() * V.transpose();
}

Matrix3 turning_stiffness(const Vector3& arm, const Vector3& force) {
  const Matrix3 outer = arm * force.transpose();
  return force.dot(arm) * Matrix3::Identity() - (outer + outer.transpose()) / 2;
}

}  // namespace

JointTension::JointTension(SubstepProblem& substep, Scalar tau) : substep_(substep), tau_(tau) {
  const std::vector<SubstepRow>& rows = substep.rows();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].joint->definition.kind == JointKind::Coupling) continue;
    if (joints_.empty() || joints_.back().state != rows[i].joint) {
      const JointEquation& equation = rows[i].equation;
      joints_.push_back({rows[i].joint, i, i, equation.arm_a_W, equation.arm_b_W});
    }
    joints_.back().last_row = i + 1;
  }
  for (Joint& joint : joints_) joint.rod = rod_of(joint);
}

// The row of a distance that is fixed, or is at its upper limit and stays there: what becomes taut
// only in the move jerks, and would do so twice.
std::optional<std::size_t> JointTension::rod_of(const Joint& joint) const {
  const JointDefinition& definition = joint.state->definition;
  if (definition.kind != JointKind::Distance) return std::nullopt;
  const std::size_t last = joint.last_row - 1;  // of two limits the upper one
  const JointEquation& equation = substep_.rows()[last].equation;
  if (equation.kind == JointEquation::Kind::Equality) return last;
  const IslandRun& run = substep_.run();
  const auto twist_of = [&](BodyId id) {
    return run.central_twist(run.member_at(id), run.context().body(id.slot));
  };
  const Twist a = twist_of(definition.a);
  const Twist b = twist_of(definition.b);
  const JointRow& row = equation.row;
  const Scalar rate = row.j_av_W.dot(a.v_WB) + row.j_aw_W.dot(a.w_WB) + row.j_bv_W.dot(b.v_WB) +
                      row.j_bw_W.dot(b.w_WB);
  const Scalar small = substep_.rest_offset();
  const bool is_taut = equation.value <= small && tau_ * std::abs(rate) <= small;
  return is_taut ? std::optional(last) : std::nullopt;
}

// Whether the row is one of those that are taken in the middle of the move.
bool JointTension::is_in_middle(const Joint& joint, std::size_t row) const {
  return substep_.rows()[row].equation.kind == JointEquation::Kind::Equality || joint.rod == row;
}

// Mass: an impulse across the rod per velocity.
Scalar JointTension::stiffness_across(const Joint& rod) const {
  const JointRow& row = substep_.problem().rows[*rod.rod];
  const JointLimits& limits = *rod.state->definition.limits;
  // The coordinate of a limit is the length that is left.
  const bool is_equality = substep_.rows()[*rod.rod].equation.kind == JointEquation::Kind::Equality;
  const Scalar tension = is_equality ? -row.impulse : row.impulse;
  return std::max(0.0, tau_ / 2 * tension / limits.max);
}

// Soft rows that have no impulse at the velocities of the last solve.
void JointTension::set_across(Joint& rod) {
  ContactProblem& problem = substep_.problem();
  const JointRow along = problem.rows[*rod.rod];
  if (!rod.first_across) {
    rod.first_across = problem.rows.size();
    substep_.add_soft_joint_rows(2);
  }
  const Scalar stiffness = stiffness_across(rod);
  const Vector3 u = along.j_bv_W;
  const Vector3 x = u.unitOrthogonal();
  const std::array<Vector3, 2> axes{x, u.cross(x)};
  for (std::size_t k = 0; k < 2; ++k) {
    JointRow& row = problem.rows[*rod.first_across + k];
    row = row_along(axes[k], rod.arm_a_W, rod.arm_b_W);
    row.body_a = along.body_a;
    row.body_b = along.body_b;
    row.target = substep_.row_velocity(*rod.first_across + k);
    row.compliance = stiffness > 0 ? 1 / stiffness : 0;
    if (!(stiffness > 0)) row.lower = row.upper = 0;
  }
}

void JointTension::measure() {
  const std::size_t count = substep_.run().members().size();
  const ContactProblem& problem = substep_.problem();
  stiffness_.assign(count, Matrix3::Zero());
  for (const Joint& joint : joints_) {
    Vector3 impulse_W = Vector3::Zero();
    for (std::size_t i = joint.first_row; i < joint.last_row; ++i) {
      if (!is_in_middle(joint, i)) continue;
      const JointRow& row = substep_.problem().rows[i];
      impulse_W += row.impulse * row.j_bv_W;
    }
    const JointRow& row = substep_.problem().rows[joint.first_row];
    if (row.body_a < count) stiffness_[row.body_a] -= turning_stiffness(joint.arm_a_W, impulse_W);
    if (row.body_b < count) stiffness_[row.body_b] += turning_stiffness(joint.arm_b_W, impulse_W);
    if (!is_stiff_ && joint.rod) {
      const Scalar weight = problem.bodies[row.body_a].inverse_mass_W.trace() / 3 +
                            problem.bodies[row.body_b].inverse_mass_W.trace() / 3;
      is_stiff_ = stiffness_across(joint) * weight > kResolvedTension;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Matrix3& mobility = substep_.problem().bodies[i].inverse_inertia_W;
    stiffness_[i] *= tau_ / 2;
    // A bound on what is asked below.
    if (!is_stiff_ && stiffness_[i].norm() * mobility.trace() <= kResolvedTension) continue;
    stiffness_[i] = resisting_part(stiffness_[i]);
    is_stiff_ = is_stiff_ || (mobility * stiffness_[i]).trace() > kResolvedTension;
  }
}

void JointTension::stiffen() {
  if (joints_.empty()) return;
  measure();
  if (!is_stiff_) return;
  around_W_.clear();
  for (std::size_t i = 0; i < stiffness_.size(); ++i) {
    around_W_.push_back(substep_.problem().bodies[i].w_W);
  }
  for (Joint& joint : joints_) {
    if (joint.rod) set_across(joint);
  }
  for (std::size_t i = 0; i < stiffness_.size(); ++i) {
    if (substep_.run().members()[i].body->definition.locked.any_rotation()) continue;
    ContactBody& body = substep_.problem().bodies[i];
    const Matrix3 inertia = body.inverse_inertia_W.inverse();
    const Vector3 L_W = inertia * body.free_w_W;
    const Matrix3 mobility = (inertia + stiffness_[i]).inverse();
    body.inverse_inertia_W = (mobility + mobility.transpose()) / 2;
    body.free_w_W = body.inverse_inertia_W * (L_W + stiffness_[i] * body.w_W);
  }
}

void JointTension::relax(const std::vector<Vector3>& free_L_W) {
  if (!is_stiff_) return;
  is_stiff_ = false;
  for (std::size_t i = 0; i < stiffness_.size(); ++i) {
    substep_.set_mobility(i, substep_.run().members()[i].state.X_WM.rotation());
    ContactBody& body = substep_.problem().bodies[i];
    body.free_w_W = body.inverse_inertia_W * free_L_W[i];
  }
  for (const Joint& joint : joints_) {
    if (!joint.first_across) continue;
    for (std::size_t k = 0; k < 2; ++k) {
      JointRow& row = substep_.problem().rows[*joint.first_across + k];
      row.lower = row.upper = 0;
    }
  }
}

// Where the joint is after a part of the move.
JointPlace JointTension::place_at(Scalar part, const JointState& joint) const {
  const IslandRun& run = substep_.run();
  const Scalar tau = part * tau_;
  const auto pose = [&](const std::optional<std::size_t>& member, const BodyRecord& body) {
    if (body.definition.kind == BodyKind::Kinematic) {
      return body.definition.motion->pose(run.now() + tau);
    }
    if (!member) return body.X_WB();
    const ContactBody& moved = substep_.problem().bodies[*member];
    const RigidPose& X_WM = run.members()[*member].state.X_WM;
    const Matrix3 R_WB = rotation_from_vector(tau * moved.w_W) * X_WM.rotation();
    const Vector3 center = X_WM.translation() + tau * moved.v_W;
    return RigidPose(R_WB, center - R_WB * body.definition.mass_properties.p_BoBcm);
  };
  const auto turn = [&](const std::optional<std::size_t>& member, const BodyRecord& body) {
    if (member) return Vector3(tau * substep_.problem().bodies[*member].w_W);
    return prescribed_turn(body, run.now(), tau);
  };
  return place_of(run, joint, pose, turn);
}

// The mean of the arms at both ends, not the arm in the middle: a body then gains no angular
// momentum about an axis through all its joints, however fast it turns about it.
void JointTension::take_middle_rows(Joint& joint) {
  const BodyRecord& a = substep_.run().context().body(joint.state->definition.a.slot);
  const BodyRecord& b = substep_.run().context().body(joint.state->definition.b.slot);
  const JointPlace start = joint_places(substep_.run(), *joint.state)[0];
  const JointPlace end = place_at(1, *joint.state);
  JointPlace middle = place_at(0.5, *joint.state);
  const auto set_mean = [](const RigidPose& x, const RigidPose& y, RigidPose& mean) {
    mean = RigidPose(mean.rotation(), (x.translation() + y.translation()) / 2);
  };
  set_mean(start.X_WJa, end.X_WJa, middle.X_WJa);
  set_mean(start.X_WJb, end.X_WJb, middle.X_WJb);
  middle.center_a_W = (start.center_a_W + end.center_a_W) / 2;
  middle.center_b_W = (start.center_b_W + end.center_b_W) / 2;
  const JointPlaces places{middle, {}};
  const std::vector<JointEquation> equations =
      joint_equations(*joint.state, places, std::min(a.radius, b.radius));
  joint.arm_a_W = equations.front().arm_a_W;
  joint.arm_b_W = equations.front().arm_b_W;
  for (std::size_t i = joint.first_row; i < joint.last_row; ++i) {
    SubstepRow& entry = substep_.rows()[i];
    if (!is_in_middle(joint, i)) continue;
    const JointEquation& there = equations[entry.index];
    entry.equation.arm_b_W = there.arm_b_W;
    JointRow& row = substep_.problem().rows[i];
    joint.has_turned = joint.rod && (there.row.j_bv_W - row.j_bv_W).norm() > kTensionTurn;
    row.j_av_W = there.row.j_av_W;
    row.j_aw_W = there.row.j_aw_W;
    row.j_bv_W = there.row.j_bv_W;
    row.j_bw_W = there.row.j_bw_W;
  }
}

bool JointTension::follow() {
  if (joints_.empty()) return false;
  if (!is_stiff_) measure();
  if (!is_stiff_) return false;
  for (Joint& joint : joints_) take_middle_rows(joint);
  if (around_W_.empty()) return true;
  for (const Joint& joint : joints_) {
    if (joint.has_turned) return true;
  }
  for (std::size_t i = 0; i < around_W_.size(); ++i) {
    const Vector3 change = substep_.problem().bodies[i].w_W - around_W_[i];
    if (!stiffness_[i].isZero(0) && tau_ * change.norm() > kTensionTurn) return true;
  }
  return false;
}

void JointTension::keep_ends(bool is_cut) const {
  for (const Joint& joint : joints_) {
    JointState& state = *joint.state;
    state.half_impulse_W.setZero();
    state.half_turn_a_W.setZero();
    state.half_turn_b_W.setZero();
    if (!is_stiff_ || is_cut) continue;
    for (std::size_t i = joint.first_row; i < joint.last_row; ++i) {
      if (!is_in_middle(joint, i)) continue;
      const JointRow& row = substep_.problem().rows[i];
      state.half_impulse_W += row.impulse * row.j_bv_W;
      state.half_turn_a_W += row.impulse * row.j_aw_W;
      state.half_turn_b_W += row.impulse * row.j_bw_W;
    }
    state.half_arm_b_W = joint.arm_b_W;
  }
}

void add_tension_ends(SubstepProblem& node, std::vector<Vector3>& free_L_W,
                      VelocityChange* change) {
  const std::size_t count = free_L_W.size();
  for (std::size_t i = 0; i < node.rows().size(); ++i) {
    JointState& joint = *node.rows()[i].joint;
    if (joint.half_impulse_W.isZero(0) && joint.half_turn_b_W.isZero(0)) continue;
    JointRow& row = node.problem().rows[i];
    if (node.rows()[i].equation.kind == JointEquation::Kind::Equality) row.impulse = 0;
    if (i > 0 && node.rows()[i - 1].joint == &joint) continue;
    const auto kick = [&](std::size_t index, const Vector3& impulse, const Vector3& turn) {
      if (index >= count) return;
      ContactBody& body = node.problem().bodies[index];
      free_L_W[index] += turn;
      body.free_v_W += body.inverse_mass_W * impulse;
      body.free_w_W = body.inverse_inertia_W * free_L_W[index];
    };
    kick(row.body_a, -joint.half_impulse_W, joint.half_turn_a_W);
    kick(row.body_b, joint.half_impulse_W, joint.half_turn_b_W);
    joint.impulse_W += joint.half_impulse_W;
    joint.angular_impulse_W += joint.half_turn_b_W - joint.half_arm_b_W.cross(joint.half_impulse_W);
    if (change == nullptr) continue;
    change->links.push_back({LinkImpulse::Kind::Joint, joint.definition.a, joint.definition.b,
                             joint.half_impulse_W, joint.half_turn_a_W, joint.half_turn_b_W});
  }
}

// Springs.

namespace {

// A solve is repeated if the length or direction of a spring has changed by more than this relative
// to the rest offset. Larger: springs lose energy.
constexpr Scalar kSpringErrorChange = 4e-4;  // literal: a fiftieth of what gaps need

// Weight of a spring's row across the spring where it has no stiffness, relative to that along it.
constexpr Scalar kSpringLeastShare = 1e-9;  // literal: nothing, but the row stays solvable

// Columns x, y, z with x along `direction`; those of the world if it is zero.
Matrix3 axes_along(const Vector3& direction) {
  const Scalar length = direction.norm();
  if (!(length > 0)) return Matrix3::Identity();
  const Vector3 x = direction / length;
  Matrix3 axes;
  axes.col(0) = x;
  axes.col(1) = x.unitOrthogonal();
  axes.col(2) = x.cross(axes.col(1));
  return axes;
}

struct Law {
  Scalar stiffness = 0;
  Scalar damping = 0;
  Scalar rest = 0;
};

// Along axis k of the rows.
Law law_along(Eigen::Index k, const SpringState& spring, Scalar middle_length) {
  const SpringDefinition& definition = spring.definition;
  if (k == 0 || spring.rest_length() == 0) {
    return {definition.stiffness, definition.damping, k == 0 ? spring.rest_length() : 0};
  }
  const Scalar share =
      middle_length > 0 ? std::max(0.0, 1 - spring.rest_length() / middle_length) : 0;
  return {share * definition.stiffness, 0, 0};
}

}  // namespace

SpringRows::SpringRows(SubstepProblem& substep, Scalar tau) : substep_(substep), tau_(tau) {
  const IslandRun& run = substep.run();
  for (SpringState* spring : run.springs()) {
    const BodyRecord& a = run.context().body(spring->definition.a.slot);
    const BodyRecord& b = run.context().body(spring->definition.b.slot);
    const RigidPose X_WA = run.pose_of(run.member_at(a.id), a);
    const RigidPose X_WB = run.pose_of(run.member_at(b.id), b);
    Entry entry;
    entry.spring = spring;
    entry.body_a = substep.take_body(a);
    entry.body_b = substep.take_body(b);
    entry.arm_a_W = X_WA * spring->definition.p_AP - substep.center_of(entry.body_a);
    entry.arm_b_W = X_WB * spring->definition.p_BQ - substep.center_of(entry.body_b);
    entry.begin_W = spring_vector(spring->definition, X_WA, X_WB);
    entry.axes_W =
        spring->rest_length() > 0 ? axes_along(entry.begin_W) : Matrix3(Matrix3::Identity());
    entry.first_row = substep.problem().rows.size();
    substep.problem().rows.resize(entry.first_row + 3);
    for (Eigen::Index k = 0; k < 3; ++k) {
      substep.problem().rows[entry.first_row + std::size_t(k)].impulse =
          entry.axes_W.col(k).dot(spring->half_impulse_W);
    }
    set_rows(entry);
    if (!is_resolved(spring->definition.stiffness, spring->definition.damping,
                     substep.problem().rows[entry.first_row], substep, tau)) {
      entry.ahead = 1;
    }
    entries_.push_back(entry);
  }
}

// Jacobians, and impulses turned to the axes.
void SpringRows::set_rows(const Entry& entry) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    JointRow& row = substep_.problem().rows[entry.first_row + std::size_t(k)];
    const Scalar impulse = row.impulse;
    row = row_along(entry.axes_W.col(k), entry.arm_a_W, entry.arm_b_W);
    row.body_a = entry.body_a;
    row.body_b = entry.body_b;
    row.impulse = impulse;
  }
}

// D' with the velocities of the last solve.
Vector3 SpringRows::rate(const Entry& entry) const {
  const ContactBody& a = substep_.problem().bodies[entry.body_a];
  const ContactBody& b = substep_.problem().bodies[entry.body_b];
  return b.v_W + b.w_W.cross(entry.arm_b_W) - a.v_W - a.w_W.cross(entry.arm_a_W);
}

Vector3 SpringRows::impulse(const Entry& entry) const {
  Vector3 sum = Vector3::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    sum += substep_.problem().rows[entry.first_row + std::size_t(k)].impulse * entry.axes_W.col(k);
  }
  return sum;
}

// With D at the part s of the move, 1/2 or 1: impulse = -tau/2 [k (x . (D + s tau (J v) + s error)
// - rest) + c (J v + x . error / tau)], solved for J v. A stiffness over a time weighs like a
// damper.
void SpringRows::set_targets() {
  for (const Entry& entry : entries_) {
    const Vector3 middle = entry.begin_W + entry.ahead * entry.error_W;
    for (Eigen::Index k = 0; k < 3; ++k) {
      JointRow& row = substep_.problem().rows[entry.first_row + std::size_t(k)];
      const Law law = law_along(k, *entry.spring, middle.norm());
      const Vector3 axis = entry.axes_W.col(k);
      // A row without any stiffness stays a row, of no weight.
      const Scalar least =
          kSpringLeastShare * (entry.spring->definition.stiffness * entry.ahead * tau_ +
                               entry.spring->definition.damping);
      const Scalar weight = std::max(law.stiffness * entry.ahead * tau_ + law.damping, least);
      row.compliance = 1 / (tau_ / 2 * weight);
      row.target = -(law.stiffness * (axis.dot(middle) - law.rest) +
                     law.damping * axis.dot(entry.error_W) / tau_) /
                   weight;
    }
  }
}

bool SpringRows::update(const EndPose& end_pose) {
  bool has_changed = false;
  const IslandRun& run = substep_.run();
  for (Entry& entry : entries_) {
    const SpringDefinition& definition = entry.spring->definition;
    const BodyRecord& a = run.context().body(definition.a.slot);
    const BodyRecord& b = run.context().body(definition.b.slot);
    const Vector3 end = spring_vector(definition, end_pose(run.member_at(a.id), a),
                                      end_pose(run.member_at(b.id), b));
    const Vector3 error = end - entry.begin_W - tau_ * rate(entry);
    const Scalar enough = kSpringErrorChange * substep_.rest_offset();
    has_changed = has_changed || (error - entry.error_W).norm() > enough;
    entry.error_W = error;
    if (entry.spring->rest_length() == 0) continue;
    const Vector3 middle = (1 - entry.ahead) * entry.begin_W + entry.ahead * end;
    const Matrix3 axes = axes_along(middle);
    has_changed =
        has_changed || (axes.col(0) - entry.axes_W.col(0)).norm() * middle.norm() > enough;
    const Vector3 known = impulse(entry);
    entry.axes_W = axes;
    for (Eigen::Index k = 0; k < 3; ++k) {
      substep_.problem().rows[entry.first_row + std::size_t(k)].impulse = axes.col(k).dot(known);
    }
    set_rows(entry);
  }
  return has_changed;
}

void SpringRows::keep_impulses(Scalar share) {
  for (const Entry& entry : entries_) entry.spring->half_impulse_W = share * impulse(entry);
}

void SpringRows::add_cut(Scalar share, std::size_t member, Vector3& v_W, Vector3& L_W) const {
  const Matrix3& inverse_mass_W = substep_.problem().bodies[member].inverse_mass_W;
  for (const Entry& entry : entries_) {
    const Vector3 cut = (share - 1) * impulse(entry);
    if (entry.body_a == member) {
      v_W -= inverse_mass_W * cut;
      L_W -= entry.arm_a_W.cross(cut);
    }
    if (entry.body_b == member) {
      v_W += inverse_mass_W * cut;
      L_W += entry.arm_b_W.cross(cut);
    }
  }
}

void add_spring_ends(SubstepProblem& node, Scalar tau, std::vector<Vector3>& free_L_W,
                     VelocityChange* change) {
  const IslandRun& run = node.run();
  for (const SpringState* spring : run.springs()) {
    const SpringDefinition& definition = spring->definition;
    const BodyRecord& a = run.context().body(definition.a.slot);
    const BodyRecord& b = run.context().body(definition.b.slot);
    const RigidPose X_WA = run.pose_of(run.member_at(a.id), a);
    const RigidPose X_WB = run.pose_of(run.member_at(b.id), b);
    const std::size_t body_a = node.take_body(a);
    const std::size_t body_b = node.take_body(b);
    const Vector3 arm_a = X_WA * definition.p_AP - node.center_of(body_a);
    const Vector3 arm_b = X_WB * definition.p_BQ - node.center_of(body_b);
    const Vector3 between = spring_vector(definition, X_WA, X_WB);
    const bool is_line = spring->rest_length() > 0;
    const Matrix3 axes = is_line ? axes_along(between) : Matrix3(Matrix3::Identity());
    Vector3 impulse = spring->half_impulse_W;
    for (Eigen::Index k = 0; k < (is_line ? 1 : 3); ++k) {
      const Vector3 axis = axes.col(k);
      JointRow row = row_along(axis, arm_a, arm_b);
      row.body_a = body_a;
      row.body_b = body_b;
      if (is_resolved(definition.stiffness, definition.damping, row, node, tau)) continue;
      impulse -= axis * axis.dot(impulse);
      const Scalar implicit = definition.damping + definition.stiffness * tau / 2;
      row.compliance = 1 / (tau / 2 * implicit);
      row.target = -definition.stiffness * (axis.dot(between) - spring->rest_length()) / implicit;
      node.problem().rows.push_back(row);
    }
    const auto kick = [&](std::size_t body, const Vector3& arm, Scalar sign) {
      if (body >= free_L_W.size()) return;
      ContactBody& moved = node.problem().bodies[body];
      free_L_W[body] += sign * arm.cross(impulse);
      moved.free_v_W += sign * (moved.inverse_mass_W * impulse);
      moved.free_w_W = moved.inverse_inertia_W * free_L_W[body];
    };
    kick(body_a, arm_a, -1);
    kick(body_b, arm_b, 1);
    if (change == nullptr) continue;
    change->links.push_back({LinkImpulse::Kind::Spring, a.id, b.id, impulse, -arm_a.cross(impulse),
                             arm_b.cross(impulse)});
  }
}

}  // namespace dyop::dynamics_internal
