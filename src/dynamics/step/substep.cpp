// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/substep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/tolerance.h"
#include "dynamics/step/free_turns.h"
#include "dynamics/step/island.h"
#include "dynamics/step/link_rows.h"
#include "dynamics/step/substep_problem.h"
#include "geometry/shape_tree.h"
#include "motion/guarded_state.h"

namespace dyop::dynamics_internal {

// How long the next attempt is.

namespace {

// Fraction of the proven time that is used, so that rounding does not use up the room that is left.
constexpr Scalar kUsedRoom = 0.9;
constexpr Scalar kShorter = 0.25;

}  // namespace

void Horizon::shorten(const BlockedSubstep& substep) {
  lands_ = substep.must_land;
  only_uses_room_ = !substep.must_land && substep.is_infeasible && was_infeasible_;
  was_infeasible_ = substep.is_infeasible;
  if (substep.must_land) {
    tau_ = substep.safe;
  } else if (only_uses_room_) {
    tau_ = kUsedRoom * substep.safe;
  } else {
    const Scalar shorter = kShorter * tau_;
    tau_ = substep.safe > shorter ? std::max(kUsedRoom * substep.safe, shorter) : shorter;
  }
}

// Where contacts are at the end.

namespace {

/// Poses of a pair before and after a substep.
struct PairPoses {
  RigidPose X_WA, X_WB;
  RigidPose X_WA_end, X_WB_end;
};

using RunPair = IslandRun::RunPair;

/// Poses of the members before and after a substep, and its length.
struct MemberPoses {
  std::vector<RigidPose> start, end;
  Scalar tau = 0;

  RigidPose end_of(const IslandRun& run, const std::optional<std::size_t>& member,
                   const BodyRecord& body) const {
    if (member) return end[*member];
    if (body.definition.kind != BodyKind::Kinematic) return body.X_WB();
    return body.definition.motion->pose(run.now() + tau);
  }
  RigidPose start_of(const IslandRun& run, const std::optional<std::size_t>& member,
                     const BodyRecord& body) const {
    return member ? start[*member] : run.pose_of(member, body);
  }
  PairPoses of(const IslandRun& run, const RunPair& pair) const {
    return {start_of(run, pair.member_a, *pair.a), start_of(run, pair.member_b, *pair.b),
            end_of(run, pair.member_a, *pair.a), end_of(run, pair.member_b, *pair.b)};
  }
};

// A contact's features say where it is.
EndGap end_of_features(const SubstepProblem& substep, std::size_t contact, const RunPair& pair,
                       const PairPoses& poses, Scalar tau) {
  const ContactPoint& point = substep.contacts()[contact].point;
  EndGap end =
      end_gap(point, *pair.a, poses.X_WA, poses.X_WA_end, *pair.b, poses.X_WB, poses.X_WB_end);
  if (end.may_overstate) end.gap = std::min(end.gap, substep.linear_gap(contact, tau));
  return end;
}

/// Contacts on curved surfaces of one pair: a range of find_ends()'s.
struct CurvedRange {
  std::size_t first = 0;
  std::size_t last = 0;
};

// Finds where contacts of a substep are at its end, after the last solve.
class EndSearch {
 public:
  EndSearch(SubstepProblem& substep, const MemberPoses& poses,
            std::span<const std::size_t> contacts)
      : substep_(substep), poses_(poses), contacts_(contacts), ends_(contacts.size()) {}

  // In the order of the contacts; none if the search was cut off, see measured_end_gaps().
  std::optional<std::vector<EndGap>> run();

 private:
  std::size_t pair_of(std::size_t k) const { return substep_.contacts()[contacts_[k]].pair; }
  const RunPair& run_pair(std::size_t k) const { return substep_.run().pairs()[pair_of(k)]; }
  EndGap end_of_contact(std::size_t k) const {
    const RunPair& pair = run_pair(k);
    return end_of_features(substep_, contacts_[k], pair, poses_.of(substep_.run(), pair),
                           poses_.tau);
  }
  bool stays_at_its_corner(std::size_t k) const;
  std::vector<CurvedRange> sort_curved();
  bool measure(const CurvedRange& range, StepWorkspace& workspace);

  SubstepProblem& substep_;
  const MemberPoses& poses_;
  std::span<const std::size_t> contacts_;
  std::vector<EndGap> ends_;
  std::vector<char> is_curved_;
  std::vector<std::size_t> curved_;  // by pair
};

// A merged contact stands for all corners that it reaches in a step. In a much shorter substep it
// does not get to the next corner, and a push for that one would act at the wrong place.
bool EndSearch::stays_at_its_corner(std::size_t k) const {
  constexpr Scalar kMuchShorter = 0.1;
  const ContactPoint& point = substep_.contacts()[contacts_[k]].point;
  if (!(point.merged_way > 0) || poses_.tau > kMuchShorter * substep_.run().context().h) {
    return false;
  }
  const CurvedMove move = substep_.curved_move(contacts_[k], poses_.tau);
  const Scalar way = move.sliding + move.rolling * run_pair(k).state->lengths.radius;
  return kContactMeasuredWays * way < point.merged_way;
}

// The facet of a contact on a curved surface says little about its end: other facets may have come
// nearer by then. Those of one pair are looked for together.
std::vector<CurvedRange> EndSearch::sort_curved() {
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    if (is_curved_[k]) curved_.push_back(k);
  }
  std::stable_sort(curved_.begin(), curved_.end(),
                   [&](std::size_t x, std::size_t y) { return pair_of(x) < pair_of(y); });
  std::vector<CurvedRange> ranges;
  for (std::size_t i = 0; i < curved_.size(); ++i) {
    if (i == 0 || pair_of(curved_[i]) != pair_of(curved_[i - 1])) ranges.push_back({i, i});
    ranges.back().last = i + 1;
  }
  return ranges;
}

// Returns false if it was cut off.
bool EndSearch::measure(const CurvedRange& range, StepWorkspace& workspace) {
  const std::size_t number = pair_of(curved_[range.first]);
  const RunPair& pair = run_pair(curved_[range.first]);
  const PairPoses at = poses_.of(substep_.run(), pair);
  std::vector<CurvedContact> together;
  for (std::size_t k = range.first; k < range.last; ++k) {
    const std::size_t contact = contacts_[curved_[k]];
    together.push_back(
        {&substep_.contacts()[contact].point, substep_.curved_move(contact, poses_.tau)});
  }
  std::vector<Vector3> points_W;
  for (const SubstepContact& entry : substep_.contacts()) {
    if (entry.pair == number) points_W.push_back(at.X_WA_end * entry.point.p_ACa);
  }
  const PairAtEnd at_end{pair.state->lengths, *pair.a->definition.shape,
                         at.X_WA_end,         *pair.b->definition.shape,
                         at.X_WB_end,         points_W};
  if (together.size() > 1) {
    list_end(*pair.state, at_end.a, at_end.X_WA, at_end.b, at_end.X_WB);
  }
  const auto measured = measured_end_gaps(at_end, together, pair.state->neighbours,
                                          substep_.run().context().limits, workspace.contacts);
  if (!measured) return false;
  for (std::size_t k = range.first; k < range.last; ++k) {
    const std::optional<EndGap>& end = (*measured)[k - range.first];
    ends_[curved_[k]] = end ? *end : end_of_contact(curved_[k]);
    const ContactPoint& point = *together[k - range.first].point;
    ends_[curved_[k]].least = least_corner_gap(
        point, {shape_part(at_end.a, point.key.a.piece), shape_part(at_end.b, point.key.b.piece),
                at.X_WA, at.X_WB, at.X_WA_end, at.X_WB_end});
  }
  return true;
}

std::optional<std::vector<EndGap>> EndSearch::run() {
  const IslandRun& run = substep_.run();
  is_curved_.resize(contacts_.size());
  run.for_all(contacts_.size(), [&](std::size_t k, StepWorkspace&) {
    const RunPair& pair = run_pair(k);
    const ContactPoint& point = substep_.contacts()[contacts_[k]].point;
    is_curved_[k] = is_on_curved_surface(point, *pair.a, *pair.b) && !stays_at_its_corner(k);
    if (!is_curved_[k]) ends_[k] = end_of_contact(k);
  });
  const std::vector<CurvedRange> ranges = sort_curved();
  std::vector<char> is_measured(ranges.size());
  run.for_all(ranges.size(), [&](std::size_t i, StepWorkspace& workspace) {
    is_measured[i] = measure(ranges[i], workspace);
  });
  if (std::find(is_measured.begin(), is_measured.end(), char{0}) != is_measured.end()) {
    return std::nullopt;
  }
  return std::move(ends_);
}

/// The proofs of all pairs of an island for one substep, round after round from the same start.
class SubstepProofs {
 public:
  SubstepProofs(IslandRun& run, Scalar tau) : run_(run), tau_(tau) {}

  /// Proves what can be proven of moves with constant twists, by member. A pair whose bodies move
  /// nearly as they did when it was last proven keeps that proof: from the second round on queries
  /// ask for a margin more than is kept. No point of a body is farther than t (|dv| + |dw| r) from
  /// where it was at time t of a twist that differs by dv and dw, so a sum over both bodies below
  /// the margin is enough.
  void find(const std::vector<BodyMove>& moves);

  /// By pair.
  const std::vector<Certificate>& certificates() const { return certificates_; }
  bool is_complete() const { return hits_ == 0; }
  /// Whether so many pairs are left, and hardly fewer than in the round before, that a shorter
  /// substep is sooner found than the rest of their answers.
  bool is_hopeless() const;
  /// The pair that is hit first, if some is.
  std::size_t first_hit() const;

 private:
  struct Proven {
    std::size_t round = 0;  // of the last proof, from 1 on
    Scalar margin = 0;      // what it has to spare
  };

  Scalar change_since(std::size_t round, const std::optional<std::size_t>& member,
                      const BodyRecord& body) const;
  bool still_holds(std::size_t pair, const BodyMove& a, const BodyMove& b) const;
  Certificate prove(std::size_t pair, const BodyMove& a, const BodyMove& b,
                    StepWorkspace& workspace);

  IslandRun& run_;
  Scalar tau_;
  std::vector<Certificate> certificates_;
  std::vector<Proven> proven_;              // by pair
  std::vector<std::vector<Twist>> twists_;  // of the members, by round
  std::size_t hits_ = 0;
  std::size_t last_hits_ = 0;  // of the round before
};

}  // namespace

// Proofs.

namespace {

// Asked for besides what is kept, in rest offsets. Larger: contacts at rest are nearer than that;
// smaller: fewer proofs serve again.
constexpr Scalar kProofMargin = 0.25;
// A round may leave so many hits, or more if they are at most this part of those of the one before.
constexpr std::size_t kMostHits = 10;
constexpr Scalar kFewerHits = 0.9;

}  // namespace

// How far a point of a body can be from where it was in that round. Bodies outside the island move
// in every round alike.
Scalar SubstepProofs::change_since(std::size_t round, const std::optional<std::size_t>& member,
                                   const BodyRecord& body) const {
  if (!member) return 0;
  const Twist& now = twists_.back()[*member];
  const Twist& before = twists_[round - 1][*member];
  return (1 + kMotionNoise) * tau_ *
         ((now.v_WB - before.v_WB).norm() + (now.w_WB - before.w_WB).norm() * body.radius);
}

bool SubstepProofs::still_holds(std::size_t pair, const BodyMove& a, const BodyMove& b) const {
  const Proven& proven = proven_[pair];
  if (!(proven.margin > 0)) return false;
  const RunPair& bodies = run_.pairs()[pair];
  return change_since(proven.round, bodies.member_a, *bodies.a) +
             change_since(proven.round, bodies.member_b, *bodies.b) + pair_noise(a, b) <
         proven.margin;
}

Certificate SubstepProofs::prove(std::size_t pair, const BodyMove& a, const BodyMove& b,
                                 StepWorkspace& workspace) {
  PairState& state = *run_.pairs()[pair].state;
  const TimeInterval interval{run_.now(), run_.now() + tau_};
  const auto prove_more = [&](Scalar margin) {
    Certificate certificate = certify(state, a, b, interval, state.kept_distance() + margin,
                                      run_.context().limits, workspace.toi);
    if (certificate.result) {
      add(workspace.proofs, certificate.result->statistics);
      state.advancement_steps += certificate.result->statistics.node_pairs;
    }
    return certificate;
  };
  proven_[pair].margin = 0;
  // A pair that began too near has nothing to spare.
  const bool is_ordinary = !state.uncertified_gap && !state.overlaps;
  if (twists_.size() > 1 && is_ordinary) {
    const Scalar margin = kProofMargin * state.lengths.rest_offset;
    Certificate certificate = prove_more(margin);
    if (certificate.proof && !state.uncertified_gap && !state.overlaps) {
      proven_[pair] = {twists_.size(), margin};
      return certificate;
    }
  }
  return prove_more(0);
}

void SubstepProofs::find(const std::vector<BodyMove>& moves) {
  const PartTimer timing = run_.timer(&StepTimes::proofs);
  const std::size_t count = run_.pairs().size();
  certificates_.resize(count);
  proven_.resize(count);
  std::vector<Twist>& twists = twists_.emplace_back();
  for (const BodyMove& move : moves) twists.push_back({move.v_W, move.w_W});
  run_.for_all(count, [&](std::size_t i, StepWorkspace& workspace) {
    const RunPair& pair = run_.pairs()[i];
    BodyMove support;
    const BodyMove& a = run_.move_of(pair.member_a, *pair.a, moves, support);
    const BodyMove& b = run_.move_of(pair.member_b, *pair.b, moves, support);
    if (still_holds(i, a, b)) {
      certificates_[i].closing = closing_bound(a, b, {run_.now(), run_.now() + tau_});
    } else {
      certificates_[i] = prove(i, a, b, workspace);
    }
  });
  run_.add_proof_costs();
  last_hits_ = hits_;
  hits_ = std::size_t(std::count_if(certificates_.begin(), certificates_.end(),
                                    [](const Certificate& it) { return !it.proof; }));
}

bool SubstepProofs::is_hopeless() const {
  return twists_.size() > 1 && hits_ > kMostHits && Scalar(hits_) > kFewerHits * Scalar(last_hits_);
}

std::size_t SubstepProofs::first_hit() const {
  std::size_t first = certificates_.size();
  for (std::size_t i = 0; i < certificates_.size(); ++i) {
    if (certificates_[i].proof) continue;
    if (first == certificates_.size() ||
        certificates_[i].result->t_safe < certificates_[first].result->t_safe) {
      first = i;
    }
  }
  return first;
}

// Corners.

namespace {

/// Where the members would be after a substep of length tau with the velocities that they have.
class UnforcedMoves {
 public:
  UnforcedMoves(IslandRun& run, Scalar tau);

  /// The end of a contact of two corners that closes fast enough to meet, but will pass. None for
  /// any other contact.
  std::optional<PredictedEnd> corner_end(const RunPair& pair, const ContactPoint& point) const;
  /// Velocity of B's point relative to A's.
  Vector3 relative_velocity(const RunPair& pair, const ContactPoint& point) const;

 private:
  Vector3 velocity(const std::optional<std::size_t>& member, const BodyRecord& body,
                   const Vector3& p_W) const;
  RigidPose end_of(const std::optional<std::size_t>& member, const BodyRecord& body) const;

  IslandRun& run_;
  Scalar tau_;
  std::vector<CentralState> states_;  // of the members
  std::vector<Twist> twists_;         // of their centres of mass
};

}  // namespace

UnforcedMoves::UnforcedMoves(IslandRun& run, Scalar tau) : run_(run), tau_(tau) {
  for (std::size_t i = 0; i < run.members().size(); ++i) {
    states_.push_back(run.members()[i].state);
    twists_.push_back(run.central_twist(i, *run.members()[i].body));
  }
}

Vector3 UnforcedMoves::velocity(const std::optional<std::size_t>& member, const BodyRecord& body,
                                const Vector3& p_W) const {
  const Twist twist = member ? twists_[*member] : run_.central_twist(member, body);
  const Vector3 center = central_pose(body, run_.pose_of(member, body)).translation();
  return twist.v_WB + twist.w_WB.cross(p_W - center);
}

Vector3 UnforcedMoves::relative_velocity(const RunPair& pair, const ContactPoint& point) const {
  const Vector3 middle = (point.p_WCa + point.p_WCb) / 2;
  return velocity(pair.member_b, *pair.b, middle) - velocity(pair.member_a, *pair.a, middle);
}

RigidPose UnforcedMoves::end_of(const std::optional<std::size_t>& member,
                                const BodyRecord& body) const {
  if (member) {
    const Twist& twist = twists_[*member];
    return twist_move(body, states_[*member], run_.now(), twist.v_WB, twist.w_WB)
        .motion->pose(run_.now() + tau_);
  }
  if (body.definition.kind != BodyKind::Kinematic) return body.X_WB();
  return body.definition.motion->pose(run_.now() + tau_);
}

std::optional<PredictedEnd> UnforcedMoves::corner_end(const RunPair& pair,
                                                      const ContactPoint& point) const {
  const Scalar rest_gap = pair.state->lengths.rest_gap();
  if (is_on_face(point) || point.gap <= rest_gap) return std::nullopt;
  const Scalar linear_gap = point.gap + tau_ * point.nhat_AB_W.dot(relative_velocity(pair, point));
  if (linear_gap >= rest_gap) return std::nullopt;
  const EndGap end =
      end_gap(point, *pair.a, run_.pose_of(pair.member_a, *pair.a), end_of(pair.member_a, *pair.a),
              *pair.b, run_.pose_of(pair.member_b, *pair.b), end_of(pair.member_b, *pair.b));
  if (!end.passes && !end.least) return std::nullopt;
  return PredictedEnd{end, linear_gap};
}

// Wrenches.

namespace {

// At a state of a member's centre of mass, with that angular velocity.
Wrench wrench_at(const IslandRun& run, const IslandRun::Member& member, Scalar t,
                 const CentralState& state, const Vector3& w_W) {
  const MassProperties& properties = member.body->definition.mass_properties;
  return total_wrench(*member.body, run.context().gravity_W, t,
                      motion_state(properties, state.X_WM, state.v_W, w_W));
}

Wrench wrench_of(const IslandRun& run, const IslandRun::Member& member) {
  const Matrix3 mobility = member.body->angular_mobility(member.state.X_WM.rotation());
  return wrench_at(run, member, run.now(), member.state, mobility * member.state.L_W);
}

// Substeps are not cut below this part of the step because wrenches are stiff.
constexpr Scalar kLeastStiffPart = 1. / 256;

// A wrench acts at the two ends of a substep. That is stable while a substep changes no more than
// the velocities themselves: returns tau, or less.
Scalar resolved_by_wrench(const IslandRun& run, const IslandRun::Member& member, Scalar tau) {
  const BodyRecord& body = *member.body;
  const Matrix3 mobility = body.angular_mobility(member.state.X_WM.rotation());
  const Vector3 w_W = mobility * member.state.L_W;
  // As accelerations of the centre of mass, and of the farthest points by turning.
  const auto accelerations = [&](const Wrench& wrench) {
    return std::array<Vector3, 2>{body.inverse_mass * wrench.force,
                                  body.radius * (mobility * wrench.torque)};
  };
  const std::array<Vector3, 2> first = accelerations(wrench_of(run, member));
  const auto change_over = [&](Scalar duration) {
    CentralState end = member.state;
    end.X_WM = RigidPose(rotation_from_vector(duration * w_W) * end.X_WM.rotation(),
                         end.X_WM.translation() + duration * end.v_W);
    end.v_W += duration * first[0];
    const Vector3 end_w_W = w_W + duration / body.radius * first[1];
    const std::array<Vector3, 2> last =
        accelerations(wrench_at(run, member, run.now() + duration, end, end_w_W));
    return duration * ((last[0] - first[0]).norm() + (last[1] - first[1]).norm());
  };
  const Scalar speed = member.state.v_W.norm() + body.radius * w_W.norm();
  const Scalar pull = first[0].norm() + first[1].norm();
  const Scalar least = kLeastStiffPart * run.context().h;
  while (tau > least && change_over(tau) > speed + tau * pull) tau = std::max(least, tau / 2);
  return tau;
}

Scalar resolved_by_wrenches(IslandRun& run, Scalar tau) {
  for (const IslandRun::Member& member : run.members()) {
    if (member.body->definition.wrench) tau = resolved_by_wrench(run, member, tau);
  }
  return tau;
}

}  // namespace

// The end of a substep.

namespace {

// The part of its impulses with which the next solve of an island that moves begins. How four
// corners share a load, or where two jaws press on what they hold, is not determined: a solve keeps
// what it begins with and adds a little error, so that over many steps the loads drift to a corner.
// Where friction acts depends on it. Decaying the warm start removes the indeterminate component;
// the solve restores the rest.
constexpr Scalar kKeptLoad = 0.7;

// The impulses of a substep, per contact: those of its move and of its end. The latter warm-start
// the next move.
void keep_impulses(IslandRun& run, const SubstepProblem& node, const std::vector<Vector3>& moving,
                   Scalar tau) {
  const Scalar kept = node.loads_may_drift(tau) ? kKeptLoad : 1;
  for (IslandRun::RunPair& pair : run.pairs()) {
    pair.state->impulses.assign(pair.is_near ? pair.state->points().size() : 0, Vector3::Zero());
  }
  for (std::size_t i = 0; i < node.contacts().size(); ++i) {
    const SubstepContact& entry = node.contacts()[i];
    PairState& state = *run.pairs()[entry.pair].state;
    const Vector3& impulse = node.problem().contacts[i].impulse_W;
    state.impulses[*entry.index] = moving[i] + impulse;
    // What a crowd suffers in one half of a step only is a blow, and no part of the next.
    const bool is_blow = node.is_crowd() && impulse.norm() > moving[i].norm();
    state.points()[*entry.index].impulse_W = kept * (is_blow ? moving[i] : impulse);
  }
}

void add_kick(MomentumChange& change, const Wrench& wrench, Scalar tau) {
  change.impulse_W += tau * wrench.force;
  change.angular_impulse_W += tau * wrench.torque;
}

// Gives a member half a kick more.
void kick(IslandRun& run, SubstepProblem& node, std::size_t i, const Wrench& wrench, Scalar tau,
          std::vector<Vector3>& free_L_W, VelocityChange* change) {
  ContactBody& body = node.problem().bodies[i];
  body.free_v_W += tau / 2 * run.members()[i].body->inverse_mass * wrench.force;
  free_L_W[i] += tau / 2 * wrench.torque;
  body.free_w_W = body.inverse_inertia_W * free_L_W[i];
  if (change != nullptr) add_kick(change->bodies[i], wrench, tau / 2);
}

// The first kick took the wrenches at the velocity in the middle of the substep. Replaces it by
// that at its end, which the solve has found. Returns whether that makes a difference.
bool correct_kicks(IslandRun& run, SubstepProblem& node, std::vector<Wrench>& wrenches, Scalar tau,
                   std::vector<Vector3>& free_L_W, VelocityChange* change) {
  bool has_changed = false;
  for (std::size_t i = 0; i < run.members().size(); ++i) {
    const IslandRun::Member& member = run.members()[i];
    if (!member.body->definition.wrench) continue;
    CentralState end = member.state;
    end.v_W = node.problem().bodies[i].v_W;
    const Wrench wrench = wrench_at(run, member, run.now(), end, node.problem().bodies[i].w_W);
    const Wrench difference{wrench.force - wrenches[i].force, wrench.torque - wrenches[i].torque};
    if (difference.force.isZero(0) && difference.torque.isZero(0)) continue;
    kick(run, node, i, difference, tau, free_L_W, change);
    wrenches[i] = wrench;
    has_changed = true;
  }
  return has_changed;
}

}  // namespace

// The other half of the kick and the contacts at the end.
void solve_substep_end(IslandRun& run, Scalar tau, bool may_bounce) {
  run.find_contacts();
  SubstepProblem node(run);
  const UnforcedMoves unforced(run, tau);
  VelocityChange* change = run.begin_change(VelocityChangeKind::End, {run.now() - tau, run.now()});
  std::vector<Vector3> free_L_W;
  std::vector<Wrench> wrenches;
  for (std::size_t i = 0; i < run.members().size(); ++i) {
    IslandRun::Member& member = run.members()[i];
    wrenches.push_back(wrench_of(run, member));
    node.problem().bodies[i].free_v_W = member.state.v_W;
    free_L_W.push_back(member.state.L_W);
    kick(run, node, i, wrenches.back(), tau, free_L_W, change);
    member.state.v_W = node.problem().bodies[i].free_v_W;
    member.state.L_W = free_L_W.back();
  }
  node.take_contacts([&](const IslandRun::RunPair& pair, const ContactPoint& point) {
    if (pair.hit) return false;  // left to the impact law
    if (!may_bounce || !(pair.restitution > 0)) return true;
    return !bounces(run, pair, normal_velocity(run, pair, point));
  });
  node.take_joints(tau / 2);
  add_spring_ends(node, tau, free_L_W, change);
  add_drive_ends(node, tau, free_L_W, change);
  add_tension_ends(node, free_L_W, change);
  node.set_supports(0);
  for (std::size_t i = 0; i < node.rows().size(); ++i) {
    const SubstepRow& entry = node.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Equality) node.set_row_target(i, 0);
    if (entry.equation.kind == JointEquation::Kind::Limit) {
      node.set_row_target(i, std::min(0.0, -entry.equation.value / tau));
    }
  }
  for (std::size_t i = 0; i < node.contacts().size(); ++i) {
    const SubstepContact& entry = node.contacts()[i];
    const RunPair& pair = run.pairs()[entry.pair];
    if (const auto end = unforced.corner_end(pair, entry.point)) node.predict_end(i, *end);
    const Scalar missing = pair.state->lengths.rest_gap() - entry.point.gap;
    node.set_target(i, missing >= 0 ? 0 : node.least_velocity(i, tau));
    // The midpoint rule: both halves have the coefficient of the velocity in the middle.
    node.fix_friction(i, unforced.relative_velocity(pair, entry.point));
  }
  std::vector<Vector3> moving;  // impulses of the move
  for (const PointContact& row : node.problem().contacts) moving.push_back(row.impulse_W);
  node.solve(tau);
  if (correct_kicks(run, node, wrenches, tau, free_L_W, change)) node.solve(tau);
  add_reactions(node);
  keep_impulses(run, node, moving, tau);
  const std::vector<Vector3> L_W = node.angular_momenta(std::move(free_L_W));
  for (std::size_t i = 0; i < run.members().size(); ++i) {
    run.members()[i].state.v_W = node.problem().bodies[i].v_W;
    run.members()[i].state.L_W = L_W[i];
  }
  if (change != nullptr) node.add_impulses(*change);
  run.end_change(change);
}

// The substep.

namespace {

using Member = IslandRun::Member;
using RunPair = IslandRun::RunPair;

// Limits on one attempt and on one substep.
constexpr int kMostRounds = 8;
constexpr int kMostErrorSolves = 4;
// Where joints alone act, nothing takes away the energy that an inexact turn adds: there solves go on
// as long as each changes the move by at most this part of what the one before did.
constexpr int kMostJointSolves = 32;
constexpr Scalar kConverging = 0.8;
// A larger change by the last of them asks for a shorter substep.
constexpr Scalar kGuessedTurn = 1e-3;  // literal: radians, far above what solves leave
constexpr int kMostAttempts = 8;
// Attempts that begin with what hits have found before. After that they may contradict each other.
constexpr int kHitAttempts = 3;
// How far contacts beside a hit are from touching at its time, in rest offsets.
constexpr Scalar kHitReach = 2;
// A round has brought nothing if it leaves this part of the residual of the one before.
constexpr Scalar kNoProgress = 0.9;
// Infeasible substeps that only use the room that is left, in one step. By then it is so at more
// than one pose.
constexpr int kMostInfeasible = 3;
// Per pair and step. A substep that is cut to end at a hit moves the bodies a little differently, and
// fast spinning ones may miss each other, by less each time. If they still do not meet, the hit
// exists only in the longer substep (as where a joint swings the body): there it becomes a contact.
constexpr int kMostMissedLandings = 5;
// While bodies are pushed apart, the substep after one that had to be shortened tries this many
// times its length: what blocked the longer ones has hardly changed.
constexpr Scalar kLonger = 4;
// So many solves of a run may miss their tolerance before the island stands still for the rest of
// the step; bodies that began inside each other and are held by joints may have no way apart, and
// every shorter substep would ask for one again.
constexpr std::int64_t kMostFailedSolves = 1000;
constexpr std::int64_t kMostFailedPushes = 4;
constexpr std::int64_t kMostFailedJointSolves = 100;  // of an island without pairs
// Substep length of a coarsely solved island, as a fraction of the step.
constexpr Scalar kCoarseSubstepPart = 0.25;

// Whether bodies that started too near are being pushed apart.
bool pushes_apart(IslandRun& run) {
  return std::any_of(run.pairs().begin(), run.pairs().end(), [](const RunPair& pair) {
    return pair.state->overlaps || pair.state->uncertified_gap;
  });
}

bool has_spent_its_solves(IslandRun& run) {
  const std::int64_t failed = run.outcome().work.unconverged;
  if (run.pairs().empty()) return failed > kMostFailedJointSolves;
  return failed > (pushes_apart(run) ? kMostFailedPushes : kMostFailedSolves);
}

enum class AttemptResult { Committed, Blocked, Failed };

// One attempt to step to one horizon.
class Substep {
 public:
  Substep(IslandRun& run, Scalar tau, bool may_bounce, bool lands);
  AttemptResult attempt();

  /// Begins with contacts that hits have found from the same start.
  void begin_with(const std::vector<SubstepContact>& hits);
  /// Those that this attempt has found.
  void keep_hits(std::vector<SubstepContact>& hits) const;
  BlockedSubstep blocked() const { return {blocked_at_ - run_.now(), must_land_, is_infeasible_}; }
  bool is_coarse() const { return substep_.is_coarse(); }
  std::optional<PairKey> locked_by_friction() const { return substep_.locked_by_friction(); }

 private:
  void predict_corners();
  void set_free_velocities();
  void solve_move();
  // A larger residual shows that constraints contradict each other.
  Scalar contradiction() const {
    return kContradictionTolerances * 0.001 * substep_.rest_offset() / tau_;
  }
  std::optional<bool> update_errors();
  void make_moves();
  void note_change();
  bool turns_are_guessed() const;
  bool converges() const { return substep_.is_held_by_joints() && is_solved_ && converges_; }
  bool answer_hits();
  void store_velocities();
  void commit(Scalar tau);

  IslandRun& run_;
  Scalar tau_;
  bool may_bounce_;
  bool lands_;  // the horizon ends at a hit to be resolved there
  SubstepProblem substep_;
  FreeTurns turns_;
  std::optional<JointTension> tension_;
  std::optional<SpringRows> springs_;  // after the joints' rows
  std::vector<Wrench> wrenches_;
  std::vector<Vector3> free_L_W_;
  std::vector<BodyMove> moves_;
  MemberPoses poses_;
  SubstepProofs proofs_;
  std::vector<Vector3> stored_v_W_;
  std::vector<Vector3> stored_L_W_;
  Scalar residual_ = 0;
  bool is_solved_ = false;
  std::optional<Scalar> change_;  // of the turns, by the last solve but the first; radians
  bool converges_ = false;        // whether it is smaller than the one before
  bool ends_short_ = false;       // some contact, below what is kept
  bool targets_are_zero_ = false;
  Scalar blocked_at_ = run_.now();
  bool must_land_ = false;
  bool is_infeasible_ = false;
  std::optional<AdvanceStatus> failure_;
};

Substep::Substep(IslandRun& run, Scalar tau, bool may_bounce, bool lands)
    : run_(run),
      tau_(tau),
      may_bounce_(may_bounce),
      lands_(lands),
      substep_(run),
      turns_(run, tau),
      proofs_(run, tau) {
  for (const Member& member : run.members()) wrenches_.push_back(wrench_of(run, member));
  substep_.take_contacts([&](const RunPair& pair, const ContactPoint& point) {
    // Contacts about to bounce are left to the impact law, and those that have bounced are none: a
    // push there, so that another corner does not come down, would be a blow at the wrong place.
    if (!may_bounce_ || !(pair.restitution > 0)) return true;
    const Scalar speed = normal_velocity(run_, pair, point);
    const bool is_pushed = pair.state->overlaps || pair.state->uncertified_gap;
    return !bounces(run_, pair, is_pushed ? speed : -std::abs(speed));
  });
  poses_.tau = tau_;
  for (std::size_t i = 0; i < run.members().size(); ++i) {
    poses_.start.push_back(run.pose_of(i, *run.members()[i].body));
  }
  substep_.take_joints(tau_ / 2);
  tension_.emplace(substep_, tau_);
  springs_.emplace(substep_, tau_);
}

// Velocities after half a kick.
void Substep::set_free_velocities() {
  const bool is_first = moves_.empty();
  std::vector<ContactBody>& bodies = substep_.problem().bodies;
  free_L_W_.clear();
  for (std::size_t i = 0; i < run_.members().size(); ++i) {
    const Member& member = run_.members()[i];
    bodies[i].free_v_W =
        member.state.v_W + tau_ / 2 * member.body->inverse_mass * wrenches_[i].force;
    free_L_W_.push_back(member.state.L_W + tau_ / 2 * wrenches_[i].torque);
  }
  turns_.set_free_velocities(free_L_W_, substep_.problem());
  for (std::size_t i = 0; i < run_.members().size() && is_first; ++i) {
    bodies[i].v_W = bodies[i].free_v_W;
    bodies[i].w_W = bodies[i].free_w_W;
  }
  tension_->stiffen();
  substep_.set_supports(tau_);
}

void Substep::begin_with(const std::vector<SubstepContact>& hits) {
  for (const SubstepContact& hit : hits) substep_.add(hit);
}

// Not what was found while targets were zero: bodies then move as they never will.
void Substep::keep_hits(std::vector<SubstepContact>& hits) const {
  if (targets_are_zero_) return;
  hits.clear();
  for (const SubstepContact& entry : substep_.contacts()) {
    if (!entry.index) hits.push_back({entry.pair, std::nullopt, entry.point});
  }
}

void Substep::solve_move() {
  set_free_velocities();
  set_joint_targets(substep_, tau_);
  springs_->set_targets();
  const auto solve = [this] {
    substep_.set_targets(tau_, !targets_are_zero_);
    const ContactReport report = substep_.solve(tau_);
    residual_ = report.residual;
    is_solved_ = report.status == ContactStatus::Converged;
  };
  solve();
  if (residual_ > contradiction() && !targets_are_zero_) {
    // Extrapolated constraints can contradict each other; "move along together" is always feasible.
    targets_are_zero_ = true;
    solve();
  }
}

void Substep::make_moves() {
  note_change();
  moves_.clear();
  poses_.end.clear();
  for (std::size_t i = 0; i < run_.members().size(); ++i) {
    const Member& member = run_.members()[i];
    const ContactBody& body = substep_.problem().bodies[i];
    moves_.push_back(twist_move(*member.body, member.state, run_.now(), body.v_W, body.w_W));
    poses_.end.push_back(moves_.back().motion->pose(run_.now() + tau_));
  }
}

// Between the moves of the solve before, if there was one, and the last solve.
void Substep::note_change() {
  if (moves_.empty()) return;
  Scalar change = 0;
  for (std::size_t i = 0; i < moves_.size(); ++i) {
    change = std::max(change, tau_ * (substep_.problem().bodies[i].w_W - moves_[i].w_W).norm());
  }
  converges_ = !change_ || change <= kConverging * *change_;
  change_ = change;
}

// Whether joints alone act, and the last solve still turned the members elsewhere.
bool Substep::turns_are_guessed() const {
  return substep_.is_held_by_joints() && change_ && *change_ > kGuessedTurn &&
         tau_ > kLeastJointedSubstep * run_.context().h;
}

// Returns whether the prediction of some gap has changed so much that the solve must be repeated;
// none if it was cut off.
std::optional<bool> Substep::update_errors() {
  const PartTimer timing = run_.timer(&StepTimes::ends);
  bool has_changed = false;
  ends_short_ = false;
  std::vector<std::size_t> sought;
  for (std::size_t i = 0; i < substep_.contacts().size(); ++i) {
    if (!substep_.end_is_known(i, tau_)) sought.push_back(i);
  }
  const std::optional<std::vector<EndGap>> ends = EndSearch(substep_, poses_, sought).run();
  if (!ends) return std::nullopt;
  for (std::size_t k = 0; k < sought.size(); ++k) {
    has_changed = substep_.take_end(sought[k], (*ends)[k], tau_) || has_changed;
  }
  for (std::size_t i = 0; i < substep_.contacts().size() && !ends_short_; ++i) {
    ends_short_ = substep_.ends_short(i, tau_);
  }
  const auto end = [this](const auto& member, const auto& body) {
    return poses_.end_of(run_, member, body);
  };
  has_changed = springs_->update(end) || has_changed;
  has_changed = tension_->follow() || has_changed;
  has_changed = turns_.follow(substep_, substep_.angular_momenta(free_L_W_)) || has_changed;
  return update_joint_errors(substep_, tau_, end) || has_changed;
}

// Turns hits into contacts. Returns false if a hit must be resolved where it happened instead.
bool Substep::answer_hits() {
  const std::vector<Certificate>& certificates = proofs_.certificates();
  const std::size_t first = proofs_.first_hit();
  const ToiResult& met = *certificates[first].result;
  blocked_at_ = met.t_safe;
  failure_ = failure_of(met.status);
  if (failure_) {
    run_.fail(*failure_, run_.pairs()[first].state->key);
    return false;
  }
  RunPair& pair = run_.pairs()[first];
  const Scalar speed = met.contact->closing_speed;
  const bool is_violent = speed * tau_ > pair.state->lengths.radius / 4;
  const bool is_event = run_.context().options->policy != ImpactPolicy::Impulse &&
                        speed > run_.restitution_speed(pair);
  const bool may_land = pair.missed_landings < kMostMissedLandings && met.t_safe > run_.now();
  if (may_bounce_ && may_land && (is_violent || is_event || bounces(run_, pair, -speed))) {
    pair.hit = std::make_shared<const ToiResult>(met);
    must_land_ = true;
    return false;
  }
  for (std::size_t i = 0; i < certificates.size(); ++i) {
    const auto& result = certificates[i].result;
    if (certificates[i].proof || result->status != ToiStatus::Impact) continue;
    const RunPair& hit = run_.pairs()[i];
    const HitPair bodies{*hit.a, poses_.start_of(run_, hit.member_a, *hit.a), *hit.b,
                         poses_.start_of(run_, hit.member_b, *hit.b)};
    const PairLengths& lengths = hit.state->lengths;
    const Scalar reach = lengths.rest_gap() + kHitReach * lengths.rest_offset;
    const std::vector<ContactPoint> points =
        contacts_of_hit(*result, bodies, reach, run_.workspace().contacts);
    const Scalar push = substep_.add_hit(i, points.front(), tau_);
    for (std::size_t k = 1; k < points.size(); ++k) {
      substep_.add_beside_hit(i, points[k], tau_, push);
    }
  }
  return true;
}

// The velocity that moved the bodies, minus what only recovered their gaps.
void Substep::store_velocities() {
  // How contacts and joints bend while bodies are pushed apart or together is a matter of that push,
  // and would turn it into energy.
  const bool prevails = joint_recovery_prevails(substep_, tau_);
  if (prevails) tension_->relax(free_L_W_);
  const bool bends = !pushes_apart(run_) && !prevails;
  bool has_recovery = false;
  std::vector<Scalar> targets;
  for (std::size_t i = 0; i < substep_.contacts().size(); ++i) {
    const SubstepContact& entry = substep_.contacts()[i];
    const PointContact& row = substep_.problem().contacts[i];
    const Scalar bend =
        bends ? std::min(-entry.error / tau_, substep_.bending_velocity(i, tau_)) : 0;
    const Scalar physical = std::min(row.target, std::max(0.0, bend));
    targets.push_back(physical);
    if (row.target > physical && row.impulse_W.dot(row.nhat_AB_W) > 0) has_recovery = true;
  }
  substep_.keep_row_impulses();
  has_recovery = release_joint_recovery(substep_, tau_, bends) || has_recovery;
  if (has_recovery) {
    springs_->set_targets();
    for (std::size_t i = 0; i < targets.size(); ++i) substep_.set_target(i, targets[i]);
    residual_ = std::max(residual_, substep_.solve(tau_).residual);
  }
  for (std::size_t i = 0; i < run_.members().size(); ++i) {
    stored_v_W_.push_back(substep_.problem().bodies[i].v_W);
  }
  stored_L_W_ = substep_.angular_momenta(free_L_W_);
}

// Advances to now + tau, tau <= tau_, with the proofs at hand and the velocities stored.
void Substep::commit(Scalar tau) {
  add_reactions(substep_);
  cut_drives(substep_, tau / tau_, stored_v_W_, stored_L_W_);
  const Scalar t_end = run_.now() + tau;
  VelocityChange* change = run_.begin_change(VelocityChangeKind::Move, {run_.now(), t_end});
  for (const RunPair& pair : run_.pairs()) pair.state->residual = residual_;
  for (const SubstepContact& entry : substep_.contacts()) {
    if (!entry.index) continue;
    const std::size_t row = static_cast<std::size_t>(&entry - substep_.contacts().data());
    run_.pairs()[entry.pair].state->points()[*entry.index].impulse_W =
        substep_.problem().contacts[row].impulse_W;
  }
  for (std::size_t i = 0; i < run_.members().size(); ++i) {
    Member& member = run_.members()[i];
    const RigidPose X_WB =
        without_drift(tau == tau_ ? poses_.end[i] : moves_[i].motion->pose(t_end));
    // A truncated substep received too large a half-kick; subtract the excess.
    member.state.v_W =
        stored_v_W_[i] + (tau - tau_) / 2 * member.body->inverse_mass * wrenches_[i].force;
    member.state.L_W = stored_L_W_[i] + (tau - tau_) / 2 * wrenches_[i].torque;
    springs_->add_cut(tau / tau_, i, member.state.v_W, member.state.L_W);
    member.state.X_WM = central_pose(*member.body, X_WB);
    if (change != nullptr) add_kick(change->bodies[i], wrenches_[i], tau / 2);
  }
  if (change != nullptr) substep_.add_impulses(*change, tau / tau_);
  run_.end_change(change);
  springs_->keep_impulses(tau / tau_);
  tension_->keep_ends(tau < tau_);
  run_.commit_substep(t_end, moves_, proofs_.certificates());
  std::vector<Vector3> turns_W;
  for (const BodyMove& move : moves_) turns_W.push_back(move.w_W);
  follow_joint_angles(run_, turns_W, tau);
}

// Corners that would pass each other must not be stopped by the first solve, which could not tell.
void Substep::predict_corners() {
  const UnforcedMoves unforced(run_, tau_);
  for (std::size_t i = 0; i < substep_.contacts().size(); ++i) {
    const SubstepContact& entry = substep_.contacts()[i];
    const auto end = unforced.corner_end(run_.pairs()[entry.pair], entry.point);
    if (end) substep_.predict_end(i, *end);
  }
}

AttemptResult Substep::attempt() {
  predict_corners();
  Scalar hopeless = contradiction();
  for (int round = 0; round < kMostRounds; ++round) {
    if (run_.must_stop()) return AttemptResult::Failed;
    for (int k = 0; k < kMostErrorSolves || (k < kMostJointSolves && converges()); ++k) {
      solve_move();
      if (substep_.turns_too_far(tau_)) return AttemptResult::Blocked;
      make_moves();
      const std::optional<bool> has_changed = update_errors();
      if (!has_changed) return run_.must_stop() ? AttemptResult::Failed : AttemptResult::Blocked;
      // A coarsely solved island is solved again only for what would be hit.
      if (!(substep_.is_coarse() ? ends_short_ : *has_changed)) break;
    }
    if (joints_are_guessed(substep_, tau_) || turns_are_guessed()) return AttemptResult::Blocked;
    if (turns_.change_energy(substep_)) return AttemptResult::Blocked;
    proofs_.find(moves_);
    if (proofs_.is_complete()) {
      const bool recovers = joint_recovery_prevails(substep_, tau_);
      store_velocities();
      if (!recovers && turns_.joints_add_energy(substep_, stored_v_W_, stored_L_W_, poses_.end)) {
        return AttemptResult::Blocked;
      }
      commit(tau_);
      solve_substep_end(run_, tau_, may_bounce_);
      return AttemptResult::Committed;
    }
    ++run_.outcome().work.rounds;
    const std::size_t known = substep_.contacts().size();
    if (answer_hits()) {
      if (proofs_.is_hopeless()) return AttemptResult::Blocked;
      // The next round would only fail to solve the same problem.
      const bool is_same = targets_are_zero_ && !substep_.asks_more(known, tau_, false);
      is_infeasible_ = is_same && !is_solved_ && residual_ > hopeless && !substep_.is_coarse();
      hopeless = std::min(hopeless, kNoProgress * residual_);
      if (is_same && is_solved_) return AttemptResult::Blocked;
      if (is_infeasible_) return AttemptResult::Blocked;
      continue;
    }
    if (failure_) return AttemptResult::Failed;
    if (!lands_) return AttemptResult::Blocked;
    const Scalar tau = blocked_at_ - run_.now();
    store_velocities();
    commit(tau);
    solve_substep_end(run_, tau, may_bounce_);
    return AttemptResult::Committed;
  }
  return AttemptResult::Blocked;
}

}  // namespace

bool run_substep(IslandRun& run, bool may_bounce) {
  Horizon horizon(resolved_by_wrenches(run, std::min(run.remaining(), run.longest_substep)));
  std::vector<SubstepContact> hits;
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    if (!(run.now() + horizon.tau() > run.now())) return false;
    if (has_spent_its_solves(run)) return false;
    Substep substep(run, horizon.tau(), may_bounce, horizon.lands());
    const Scalar coarse_tau = kCoarseSubstepPart * run.context().h;
    // literal: rounding cuts no substep
    if (attempt == 0 && horizon.tau() > coarse_tau * (1 + 1e-9) && substep.is_coarse()) {
      horizon.set(coarse_tau);
      continue;
    }
    if (!horizon.lands()) {
      for (RunPair& pair : run.pairs()) pair.hit.reset();
    }
    if (attempt < kHitAttempts) substep.begin_with(hits);
    const AttemptResult result = substep.attempt();
    if (result == AttemptResult::Committed) {
      const bool is_shortened = attempt > 0 && !horizon.lands() && pushes_apart(run);
      run.longest_substep = is_shortened ? kLonger * horizon.tau() : kLonger * run.longest_substep;
      return true;
    }
    if (result == AttemptResult::Failed) return true;
    substep.keep_hits(hits);
    horizon.shorten(substep.blocked());
    const bool is_last = attempt + 1 == kMostAttempts || !(run.now() + horizon.tau() > run.now());
    const bool is_given_up = horizon.only_uses_room() && run.count_infeasible() > kMostInfeasible;
    if (!is_last && !is_given_up) continue;
    if (const auto pair = substep.locked_by_friction()) {
      run.fail(AdvanceStatus::Blocked, *pair);
      return true;
    }
  }
  return false;
}

}  // namespace dyop::dynamics_internal
