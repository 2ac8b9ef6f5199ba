#pragma once

#include <map>
#include <utility>
#include <vector>

#include "dynamics/body_record.h"
#include "dynamics/broad_phase.h"
#include "dynamics/impact_law.h"
#include "dynamics/smooth_dynamics.h"
#include "dyop/dynamics/world.h"

namespace dyop {

using BodyPair = std::pair<BodyId, BodyId>;

inline std::size_t index_of(BodyId id) {
  return static_cast<std::size_t>(id);
}

inline BodyPair ordered(BodyId a, BodyId b) {
  return a < b ? BodyPair(a, b) : BodyPair(b, a);
}

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
  std::vector<WorldContact> contacts_of(const BodyPair& pair) const;
  std::vector<WorldContact> gather_contacts(const ImpactEvent& event,
                                            const std::vector<BodyPair>& pairs) const;
  Scalar apply_impulses(std::vector<WorldContact>& contacts);
  void part_contacts(std::vector<WorldContact>& contacts,
                     std::vector<internal::ImpactPoint>& points,
                     std::vector<internal::ImpactBody>& impact_bodies) const;
  Scalar parting_speed(const WorldContact& contact,
                       const std::vector<internal::ImpactBody>& impact_bodies) const;

  // world_rest.cpp: the Zeno guard
  std::vector<BodyId> settle_bodies(const ImpactEvent& event);
  bool may_settle(BodyId id, Scalar t) const;
  bool is_jammed(BodyId id, Scalar t) const;
  void drop_unsteady(const std::vector<WorldContact>& contacts, std::vector<bool>& is_candidate)
      const;
  bool drop_moving(const ImpactEvent& event, std::vector<bool>& is_candidate) const;
  std::vector<bool> would_move(const std::vector<bool>& is_resting,
                               const std::vector<WorldContact>& contacts) const;
  void wake_struck_bodies(std::vector<WorldContact>& contacts);
  void wake_unsupported_bodies();
  void wake_neighbours(std::vector<BodyId> awake);
  std::vector<WorldContact> contacts_at_rest(BodyId id) const;
  bool is_at_rest(BodyId id) const;
  bool is_pair_enabled(const BodyPair& pair) const;

  WorldOptions options;
  std::vector<internal::BodyRecord> bodies;
  std::map<BodyPair, bool> pair_enabled;
  std::map<BodyPair, Scalar> pair_margin;
  internal::SmoothDynamics smooth;
  internal::BroadPhase broad_phase;
  Scalar time = 0;
  bool must_restart = true;  // the solver's state is not that of the bodies any more
  bool must_check_rest = false;  // the user changed something that settled bodies may lean on
};

}  // namespace dyop
