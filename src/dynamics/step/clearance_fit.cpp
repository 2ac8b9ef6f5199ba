// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/clearance_fit.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "dynamics/step/island.h"
#include "dynamics/step/link_rows.h"
#include "dynamics/step/nonnegative_fit.h"

namespace dyop::dynamics_internal {

namespace {

// If every normal has at least this cosine to their sum, a shift along it opens all contacts.
constexpr Scalar kOneSided = 1e-2;
// The shortest motion that meets the demands is about 1 / residual times the largest demand. Below
// this residual it is not small.
constexpr Scalar kLeastResidual = 1e-3;
constexpr Scalar kLeastGain = 1e-9;  // literal: rounding
constexpr int kMostColumns = 60;

}  // namespace

// By Farkas' lemma there is no such motion if and only if some forces along the normals balance
// while the demands, weighted by them, add up to more than zero: that is, if a nonnegative
// combination of the columns (force, torque / lever arm, demand) equals (0, 0, 1). The nearer the
// best combination comes, the longer the motion that meets the demands.
bool can_meet(std::span<const GapDemand> demands, std::span<const MotionHold> holds) {
  Scalar most = 0;
  Vector3 center = Vector3::Zero();
  for (const GapDemand& demand : demands) {
    most = std::max(most, demand.missing);
    center += demand.p_W / Scalar(demands.size());
  }
  if (!(most > 0)) return true;
  Scalar length = 0;
  for (const GapDemand& demand : demands) length = std::max(length, (demand.p_W - center).norm());
  using Row = Eigen::Matrix<Scalar, 7, 1>;
  std::vector<Row> rows;
  for (const GapDemand& demand : demands) {
    Row& row = rows.emplace_back(Row::Zero());
    row.head<3>() = demand.nhat_W;
    if (length > 0) row.segment<3>(3) = (demand.p_W - center).cross(demand.nhat_W) / length;
    row[6] = demand.missing / most;
  }
  for (const MotionHold& hold : holds) {
    Row row = Row::Zero();
    row.head<3>() = hold.j_v;
    const Vector3 torque = hold.j_w - center.cross(hold.j_v);
    if (length > 0) row.segment<3>(3) = torque / length;
    if (row.isZero(0)) continue;
    rows.push_back(row.normalized());
    rows.push_back(-rows.back());
  }
  NonnegativeFit fit(Row::Unit(6));
  for (int k = 0; k < kMostColumns; ++k) {
    std::size_t best = rows.size();
    Scalar gain = kLeastGain;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Scalar next = rows[i].dot(fit.residual()) / rows[i].norm();
      if (next > gain) best = i;
      gain = std::max(gain, next);
    }
    if (best == rows.size()) return true;  // the residual, scaled, is such a motion
    if (!fit.add(rows[best], best)) return true;
    if (fit.residual().norm() < kLeastResidual) return false;
  }
  return true;
}

namespace {

// Least fraction of the usual rest offset. Smaller ones would make queries slow.
constexpr Scalar kLeastFraction = 1. / 64;
// Room beyond the target distance, in rest offsets. With too little the rest offset is halved until
// the room is enough; with ample room it is doubled again.
constexpr Scalar kTooLittleRoom = 1.5;
constexpr Scalar kEnoughRoom = 2;
constexpr Scalar kAmpleRoom = 8;

using RunPair = IslandRun::RunPair;

// The contacts of one body with what surrounds it.
struct Surroundings {
  std::vector<const RunPair*> pairs;
  std::vector<char> moves_a;  // by pair: whether the body is A
  std::vector<MotionHold> holds;

  void add(const RunPair& pair, bool is_of_a) {
    pairs.push_back(&pair);
    moves_a.push_back(is_of_a);
  }

  Vector3 normal(std::size_t pair, const ContactPoint& point) const {
    return moves_a[pair] ? Vector3(-point.nhat_AB_W) : point.nhat_AB_W;
  }
  bool are_one_sided() const;
  bool have_room(Scalar rest_offsets) const;
  void fit() const;
};

// The usual case: contacts with a floor, or with one side of another body.
bool Surroundings::are_one_sided() const {
  if (!holds.empty()) return false;
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (const ContactPoint& point : pairs[i]->state->points()) sum += normal(i, point);
  }
  const Scalar least = kOneSided * sum.norm();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (const ContactPoint& point : pairs[i]->state->points()) {
      if (!(normal(i, point).dot(sum) > least)) return false;
    }
  }
  return true;
}

bool Surroundings::have_room(Scalar rest_offsets) const {
  std::vector<GapDemand> demands;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const PairState& state = *pairs[i]->state;
    const Scalar least = state.lengths.target + rest_offsets * state.lengths.rest_offset;
    for (const ContactPoint& point : state.points()) {
      demands.push_back({normal(i, point), (point.p_WCa + point.p_WCb) / 2, least - point.gap});
    }
  }
  return can_meet(demands, holds);
}

void Surroundings::fit() const {
  const auto scale = [this](Scalar factor) {
    bool may_go_on = true;
    for (const RunPair* pair : pairs) {
      PairLengths& lengths = pair->state->lengths;
      const Scalar least = kLeastFraction * lengths.usual_rest_offset;
      lengths.rest_offset =
          std::clamp(factor * lengths.rest_offset, least, lengths.usual_rest_offset);
      may_go_on = may_go_on && lengths.rest_offset > least;
    }
    return may_go_on;
  };
  const bool is_usual = std::all_of(pairs.begin(), pairs.end(), [](const RunPair* pair) {
    return pair->state->lengths.rest_offset == pair->state->lengths.usual_rest_offset;
  });
  if (are_one_sided()) {
    if (!is_usual) scale(2);
  } else if (!have_room(kTooLittleRoom)) {
    while (scale(0.5) && !have_room(kEnoughRoom)) continue;
  } else if (!is_usual && have_room(kAmpleRoom)) {
    scale(2);
  }
}

bool is_ordinary(const RunPair& pair) {
  return pair.is_near && !pair.state->overlaps && !pair.state->uncertified_gap;
}

/// The members that joints connect with each other.
class JoinedGroups {
 public:
  explicit JoinedGroups(IslandRun& run) : parent_(run.members().size()) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (const JointState* joint : run.joints()) {
      const auto a = run.member_at(joint->definition.a);
      const auto b = run.member_at(joint->definition.b);
      if (!a || !b || of(*a) == of(*b)) continue;
      has_any_ = true;
      parent_[of(*a)] = of(*b);
    }
  }
  bool has_any() const { return has_any_; }
  std::size_t of(std::size_t member) {
    while (parent_[member] != member) {
      parent_[member] = parent_[parent_[member]];
      member = parent_[member];
    }
    return member;
  }
  std::vector<std::size_t> sizes() {
    std::vector<std::size_t> sizes(parent_.size(), 0);
    for (std::size_t i = 0; i < parent_.size(); ++i) ++sizes[of(i)];
    return sizes;
  }

 private:
  std::vector<std::size_t> parent_;
  bool has_any_ = false;
};

// Adds what joints with bodies that cannot be moved leave of the members' motions.
void add_holds(IslandRun& run, std::vector<Surroundings>& fixed) {
  for (const JointState* joint : run.joints()) {
    const auto a = run.member_at(joint->definition.a);
    const auto b = run.member_at(joint->definition.b);
    if (a && b) continue;
    Surroundings& around = fixed[a ? *a : *b];
    if (around.pairs.empty()) continue;
    const JointPlaces places = joint_places(run, *joint);
    const Vector3 center = a ? places[0].center_a_W : places[0].center_b_W;
    for (const JointEquation& equation : joint_equations(*joint, places, 1)) {
      if (equation.kind != JointEquation::Kind::Equality) continue;
      const Vector3& j_v = a ? equation.row.j_av_W : equation.row.j_bv_W;
      const Vector3& j_w = a ? equation.row.j_aw_W : equation.row.j_bw_W;
      around.holds.push_back({j_v, j_w + center.cross(j_v)});
    }
  }
}

// The pairs of bodies of which one is joined to others: each body with the group around it.
void fit_joined(std::span<const RunPair* const> pairs, JoinedGroups& groups) {
  std::map<std::pair<std::size_t, std::size_t>, Surroundings> joined;
  const std::vector<std::size_t> sizes = groups.sizes();
  for (const RunPair* pair : pairs) {
    const std::size_t a = *pair->member_a;
    const std::size_t b = *pair->member_b;
    const bool meets_a = groups.of(a) != groups.of(b) && sizes[groups.of(a)] > 1;
    const bool meets_b = groups.of(a) != groups.of(b) && sizes[groups.of(b)] > 1;
    if (meets_a) joined[{b, groups.of(a)}].add(*pair, false);
    if (meets_b) joined[{a, groups.of(b)}].add(*pair, true);
    if (meets_a || meets_b) continue;
    Surroundings alone;
    alone.add(*pair, false);
    alone.fit();
  }
  for (auto& [body, around] : joined) around.fit();
}

}  // namespace

void fit_rest_offsets(IslandRun& run) {
  JoinedGroups groups(run);
  std::vector<Surroundings> fixed(run.members().size());
  std::vector<const RunPair*> joined;
  for (const RunPair& pair : run.pairs()) {
    if (!is_ordinary(pair)) continue;
    if (!pair.member_a || !pair.member_b) {
      fixed[pair.member_a ? *pair.member_a : *pair.member_b].add(pair, pair.member_a.has_value());
    } else if (groups.has_any()) {
      joined.push_back(&pair);
    } else {
      Surroundings alone;
      alone.add(pair, false);
      alone.fit();
    }
  }
  if (!joined.empty()) fit_joined(joined, groups);
  add_holds(run, fixed);
  for (const Surroundings& around : fixed) {
    if (!around.pairs.empty()) around.fit();
  }
}

}  // namespace dyop::dynamics_internal
