#pragma once

#include <map>
#include <utility>
#include <vector>

#include "dynamics/body_record.h"
#include "dynamics/broad_phase.h"
#include "dynamics/smooth_dynamics.h"
#include "dyop/dynamics/world.h"

namespace dyop {

using BodyPair = std::pair<BodyId, BodyId>;

/// What a World holds, and the stages of one sub-step.
struct World::Impl {
  explicit Impl(const WorldOptions& the_options);

  // world.cpp: stepping
  AdvanceReport advance(Scalar dt, const std::stop_token& stop);
  void sub_step(Scalar t_end, const std::stop_token& stop, AdvanceReport& report);
  std::vector<std::shared_ptr<const Motion>> motions_of_step() const;
  std::vector<BodyPair> candidate_pairs(const std::vector<std::shared_ptr<const Motion>>& motions,
                                        const TimeInterval& interval);
  std::vector<ToiResult> query_pairs(const std::vector<BodyPair>& pairs,
                                     const std::vector<std::shared_ptr<const Motion>>& motions,
                                     const TimeInterval& interval,
                                     const std::stop_token& stop) const;
  void commit(const std::vector<std::shared_ptr<const Motion>>& motions, Scalar t,
              AdvanceReport& report);
  Scalar margin(BodyId a, BodyId b) const;
  Scalar tolerance() const;

  // world_impact.cpp: what happens at an impact
  void handle_impact(ImpactEvent event, const std::vector<BodyPair>& pairs, AdvanceReport& report);
  std::vector<WorldContact> gather_contacts(const std::vector<BodyPair>& pairs) const;
  void wake_struck_bodies(const std::vector<WorldContact>& contacts);
  void apply_impulses(std::vector<WorldContact>& contacts);
  std::vector<BodyId> settle_bodies(const ImpactEvent& event);

  WorldOptions options;
  std::vector<internal::BodyRecord> bodies;
  std::map<BodyPair, bool> pair_enabled;
  std::map<BodyPair, Scalar> pair_margin;
  internal::SmoothDynamics smooth;
  internal::BroadPhase broad_phase;
  Scalar time = 0;
  bool must_restart = true;  // the solver's state is not that of the bodies any more
};

}  // namespace dyop
