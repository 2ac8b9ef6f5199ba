// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/gaps/substep_ends.h"

#include <algorithm>

namespace dyop::dynamics_internal {
namespace {

using RunPair = IslandRun::RunPair;

// A contact's features say where it is.
EndGap end_of_features(const SubstepProblem& substep, std::size_t contact, const RunPair& pair,
                       const PairPoses& poses, Scalar tau) {
  const ContactPoint& point = substep.contacts()[contact].point;
  EndGap end =
      end_gap(point, *pair.a, poses.X_WA, poses.X_WA_end, *pair.b, poses.X_WB, poses.X_WB_end);
  if (is_edge_pair(point)) end.gap = std::min(end.gap, substep.linear_gap(contact, tau));
  return end;
}

}  // namespace

std::optional<std::vector<EndGap>> find_ends(SubstepProblem& substep, Scalar tau,
                                             std::span<const PairPoses> poses,
                                             std::span<const std::size_t> contacts) {
  std::vector<EndGap> ends(contacts.size());
  // The facet of a contact on a curved surface says little about its end: other facets may have come
  // nearer by then. Those of one pair are looked for together.
  std::vector<std::size_t> curved;
  const auto pair_of = [&](std::size_t k) { return substep.contacts()[contacts[k]].pair; };
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const RunPair& pair = substep.run().pairs()[pair_of(k)];
    const ContactPoint& point = substep.contacts()[contacts[k]].point;
    if (is_on_curved_surface(point, *pair.a, *pair.b)) {
      curved.push_back(k);
    } else {
      ends[k] = end_of_features(substep, contacts[k], pair, poses[pair_of(k)], tau);
    }
  }
  std::stable_sort(curved.begin(), curved.end(),
                   [&](std::size_t x, std::size_t y) { return pair_of(x) < pair_of(y); });
  std::vector<CurvedContact> together;
  std::vector<Vector3> points_W;
  for (std::size_t first = 0, last = 0; first < curved.size(); first = last) {
    const std::size_t number = pair_of(curved[first]);
    const RunPair& pair = substep.run().pairs()[number];
    const PairPoses& at = poses[number];
    together.clear();
    for (; last < curved.size() && pair_of(curved[last]) == number; ++last) {
      const std::size_t contact = contacts[curved[last]];
      together.push_back({&substep.contacts()[contact].point, substep.curved_move(contact, tau)});
    }
    points_W.clear();
    for (const SubstepContact& entry : substep.contacts()) {
      if (entry.pair == number) points_W.push_back(at.X_WA_end * entry.point.p_ACa);
    }
    const PairAtEnd at_end{pair.state->lengths, *pair.a->definition.shape,
                           at.X_WA_end,         *pair.b->definition.shape,
                           at.X_WB_end,         points_W};
    if (together.size() > 1) {
      list_end(*pair.state, at_end.a, at_end.X_WA, at_end.b, at_end.X_WB);
    }
    const auto measured =
        measured_end_gaps(at_end, together, pair.state->neighbours, substep.run().context().limits,
                          substep.run().workspace().contacts);
    if (!measured) return std::nullopt;
    for (std::size_t k = first; k < last; ++k) {
      const std::optional<EndGap>& end = (*measured)[k - first];
      ends[curved[k]] = end ? *end : end_of_features(substep, contacts[curved[k]], pair, at, tau);
    }
  }
  return ends;
}

}  // namespace dyop::dynamics_internal
