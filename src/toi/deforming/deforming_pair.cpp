// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/deforming_pair.h"

#include <algorithm>

#include "dyop/distance/distance.h"

namespace dyop::toi_internal {

template <typename SideB>
DeformingPair<SideB>::DeformingPair(DeformingSide& a, SideB& b, const TimeInterval& interval,
                                    const ImpactBand& band, std::span<const BoxPair> first)
    : a_(a), b_(b), interval_(interval), band_(band), first_(first) {
  now_.noise = kStepNoise * (a_.size() + b_.size());
  set_time(interval.begin);
}

template <typename SideB>
void DeformingPair<SideB>::set_time(Scalar t) {
  a_.set_time(t);
  b_.set_time(t);
  time_ = t;
  now_.remaining = std::max(0.0, interval_.end - t);
  now_.horizon = std::min(now_.remaining, b_.smooth_until(t) - t);
  b_.set_horizon(t, std::min(interval_.end, t + now_.horizon));
}

template <typename SideB>
Scalar DeformingPair<SideB>::leaf_step(const PieceDistance& piece, const QueuedPair& pair,
                                       Scalar least) const {
  const Vector3& n_W = piece.nhat_AB;
  return safe_step(pair, a_.triangle_support(pair.a, n_W), b_.triangle_support(pair.b, -n_W), least)
      .time;
}

// Closing by more than rounding, and fast enough to matter: triangles of a sheet are flat only up
// to the rounding of their vertices, so the normal of two nearly parallel edges tilts, and a side
// that slides along seems to come nearer. A speed that would not use up the slack of a resting pair
// by the end counts as rest.
template <typename SideB>
bool DeformingPair<SideB>::is_closing(const PieceDistance& piece, const QueuedPair& pair) const {
  const Scalar closing = closing_speed(piece, pair);
  const Scalar loss = piece.lower - band_.resting_target(piece.lower, noise());
  return closing > kPoseNoise * (a_.speed(pair.a) + b_.speed(pair.b)) &&
         closing * now_.remaining > loss;
}

template <typename SideB>
WitnessPair DeformingPair<SideB>::witness_pair(const PieceDistance& piece,
                                               const QueuedPair& pair) const {
  return {piece.lower,         piece.upper,     piece.p_a,       piece.p_b,
          piece.nhat_AB,       piece.feature_a, piece.feature_b, a_.triangle(pair.a),
          b_.triangle(pair.b), std::nullopt,    std::nullopt};
}

template <typename SideB>
std::vector<Contact> DeformingPair<SideB>::contacts_within(Scalar reach) const {
  const TriangleMesh mesh_a = a_.mesh_now();
  // A rigid side is not copied.
  const auto& mesh_b = b_.mesh_now();
  return find_contacts(mesh_a, a_.pose(), mesh_b, b_.pose(), reach);
}

template class DeformingPair<DeformingSide>;
template class DeformingPair<RigidSide>;

}  // namespace dyop::toi_internal
