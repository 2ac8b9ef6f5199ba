// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/substep_proofs.h"

#include <utility>

#include "core/tolerance.h"

namespace dyop::dynamics_internal {
namespace {

// Asked for besides what is kept, in rest offsets. Larger: contacts at rest are nearer than that;
// smaller: fewer proofs serve again.
constexpr Scalar kProofMargin = 0.25;
// A round may leave so many hits, or more if they are at most this part of those of the one before.
constexpr std::size_t kMostHits = 10;
constexpr Scalar kFewerHits = 0.9;

// How far a point can be from where it was in the other move after tau.
Scalar largest_change(const BodyMove& now, const BodyMove& before, Scalar tau) {
  if (!now.is_twist || !before.is_twist) return now.motion == before.motion ? 0 : kInfinity;
  return (1 + kMotionNoise) * tau *
         ((now.v_W - before.v_W).norm() + (now.w_W - before.w_W).norm() * now.body->radius);
}

}  // namespace

bool SubstepProofs::still_holds(std::size_t pair, const BodyMove& a, const BodyMove& b) const {
  const Proven& proven = proven_[pair];
  if (!(proven.margin > 0)) return false;
  return largest_change(a, proven.a, tau_) + largest_change(b, proven.b, tau_) + pair_noise(a, b) <
         proven.margin;
}

Certificate SubstepProofs::prove(std::size_t pair, const BodyMove& a, const BodyMove& b) {
  PairState& state = *run_.pairs()[pair].state;
  const TimeInterval interval{run_.now(), run_.now() + tau_};
  const auto prove_more = [&](Scalar margin) {
    Certificate certificate = certify(state, a, b, interval, state.kept_distance() + margin,
                                      run_.context().limits, run_.workspace().toi);
    if (certificate.result) {
      add(run_.outcome().toi, certificate.result->statistics);
      state.advancement_steps += certificate.result->statistics.node_pairs;
    }
    return certificate;
  };
  proven_[pair].margin = 0;
  // A pair that began too near has nothing to spare.
  const bool is_ordinary = !state.granted && !state.overlaps;
  if (rounds_ > 1 && is_ordinary) {
    const Scalar margin = kProofMargin * state.lengths.rest_offset;
    Certificate certificate = prove_more(margin);
    if (certificate.proof && !state.granted && !state.overlaps) {
      proven_[pair] = {a, b, margin};
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
  ++rounds_;
  last_hits_ = std::exchange(hits_, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const IslandRun::RunPair& pair = run_.pairs()[i];
    const BodyMove a = pair.member_a ? moves[*pair.member_a] : run_.support_move(*pair.a);
    const BodyMove b = pair.member_b ? moves[*pair.member_b] : run_.support_move(*pair.b);
    if (still_holds(i, a, b)) {
      certificates_[i].closing = closing_bound(a, b, {run_.now(), run_.now() + tau_});
    } else {
      certificates_[i] = prove(i, a, b);
    }
    if (!certificates_[i].proof) ++hits_;
  }
}

bool SubstepProofs::is_hopeless() const {
  return rounds_ > 1 && hits_ > kMostHits && Scalar(hits_) > kFewerHits * Scalar(last_hits_);
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

}  // namespace dyop::dynamics_internal
