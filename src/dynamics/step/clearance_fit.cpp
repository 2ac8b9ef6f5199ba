// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/clearance_fit.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "dynamics/step/island.h"
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
bool can_meet(std::span<const GapDemand> demands) {
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

  Vector3 normal(std::size_t pair, const ContactPoint& point) const {
    return moves_a[pair] ? Vector3(-point.nhat_AB_W) : point.nhat_AB_W;
  }
  bool are_one_sided() const;
  bool have_room(Scalar rest_offsets) const;
  void fit() const;
};

// The usual case: contacts with a floor, or with one side of another body.
bool Surroundings::are_one_sided() const {
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
  return can_meet(demands);
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

}  // namespace

void fit_rest_offsets(IslandRun& run) {
  std::vector<Surroundings> fixed(run.members().size());
  for (const RunPair& pair : run.pairs()) {
    if (!is_ordinary(pair)) continue;
    if (!pair.member_a || !pair.member_b) {
      Surroundings& around = fixed[pair.member_a ? *pair.member_a : *pair.member_b];
      around.pairs.push_back(&pair);
      around.moves_a.push_back(pair.member_a.has_value());
    } else {
      Surroundings{{&pair}, {0}}.fit();
    }
  }
  for (const Surroundings& around : fixed) around.fit();
}

}  // namespace dyop::dynamics_internal
