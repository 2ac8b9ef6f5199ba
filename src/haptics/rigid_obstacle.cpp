// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "contact/generation/contact_search.h"
#include "distance/distance_traversal.h"
#include "dyop/motion/steady_motions.h"
#include "haptics/obstacle.h"

namespace dyop::haptics_internal {
namespace {

class RigidObstacle final : public Obstacle {
 public:
  RigidObstacle(std::shared_ptr<const Shape> shape, const RigidPose& X_WA)
      : shape_(std::move(shape)), X_WA_(X_WA), motion_(X_WA) {}

  void move_to(const RigidPose& X_WA) override { X_WA_ = X_WA; }
  void prepare(const ToolBody& body, QueryMemory& memory) const override;
  PairImpact first_impact(const BodyMotion& motion, const ToiOptions& options, WorkClock& clock,
                          PairMemory& kept, QueryMemory& memory) const override;
  void add_holds(const ToolBody& body, const RigidPose& X_WB, const ExpectedApproach& approach,
                 WorkShare& share, PairMemory& kept, QueryMemory& memory,
                 std::vector<HoldPoint>& holds) const override;
  PairDistance measure(const ToolBody& body, const RigidPose& X_WB, const DistanceWish& wish,
                       WorkShare& share, PairMemory& kept) const override;
  std::optional<bool> is_apart_at(const ToolBody& body, const RigidPose& X_WB, WorkClock& clock,
                                  PairMemory& kept) const override;

 private:
  std::shared_ptr<const Shape> shape_;
  RigidPose X_WA_;
  RestMotion motion_;  // of an obstacle of the scene
};

// Two triangles of a contact search take no longer than a small piece of work.
class SmallPieces final : public Interrupt {
 public:
  explicit SmallPieces(WorkClock& clock) : clock_(clock) {}

  bool is_over() override { return clock_.is_over_small(); }

 private:
  WorkClock& clock_;
};

// Meshes find out which of their features can touch anything when contacts are first asked for.
void RigidObstacle::prepare(const ToolBody& body, QueryMemory& memory) const {
  const Scalar radius = geometry_internal::radius_beside(*shape_, *body.shape, 0);
  const Vector3 away(4 * (radius + body.shape->bounding_radius()), 0, 0);
  generate_contacts(*shape_, X_WA_, *body.shape, RigidPose(Vector3(X_WA_.translation() + away)), 0,
                    {}, memory.contact_workspace, memory.contacts);
}

PairImpact RigidObstacle::first_impact(const BodyMotion& motion, const ToiOptions& options,
                                       WorkClock& clock, PairMemory& /*kept*/,
                                       QueryMemory& memory) const {
  PairImpact impact;
  if (clock.is_over()) {
    impact.status = ToiStatus::BudgetExhausted;
    return impact;
  }
  ToiOptions lent = options;
  clock.lend(lent);
  const Motion& X_WA = motion.X_WA ? *motion.X_WA : motion_;
  const ToiResult result = time_of_impact(*shape_, X_WA, *motion.body.shape, motion.X_WB,
                                          {0, motion.duration}, lent, memory.workspace);
  clock.take_back(result);
  impact.status = result.status;
  impact.t_safe = safe_time(result);
  impact.queries = 1;
  impact.node_pairs = result.statistics.node_pairs;
  if (result.status != ToiStatus::Impact || !result.contact) return impact;
  const ImpactContact& contact = *result.contact;
  impact.has_hit = true;
  impact.hit.p_WA = motion.X_WA ? X_WA_ * (result.X_WA.inverse() * contact.p_WCa) : contact.p_WCa;
  impact.hit.p_WB = motion.X_WB.pose(0) * (result.X_WB.inverse() * contact.p_WCb);
  impact.hit.nhat_AB_W = contact.nhat_AB_W;
  return impact;
}

void RigidObstacle::add_holds(const ToolBody& body, const RigidPose& X_WB,
                              const ExpectedApproach& approach, WorkShare& share,
                              PairMemory& /*kept*/, QueryMemory& memory,
                              std::vector<HoldPoint>& holds) const {
  // All or nothing: only the tick's end ends it.
  SmallPieces interrupt(share.clock);
  const contact_internal::ScopedUse use(memory.contact_workspace.impl().approach, approach);
  generate_contacts(*shape_, X_WA_, *body.shape, X_WB, approach.largest_needed_gap(), {},
                    memory.contact_workspace, memory.contacts, &interrupt);
  for (const ContactPoint& contact : memory.contacts) {
    HoldPoint hold;
    hold.p_WA = contact.p_WCa;
    hold.p_WB = contact.p_WCb;
    hold.nhat_AB_W = contact.nhat_AB_W;
    hold.key = contact.key;
    holds.push_back(hold);
  }
}

PairDistance RigidObstacle::measure(const ToolBody& body, const RigidPose& X_WB,
                                    const DistanceWish& wish, WorkShare& share,
                                    PairMemory& kept) const {
  kept.resize(1);
  DistanceOptions options;
  options.absolute_tolerance = wish.tight;
  options.max_distance = std::max(Scalar{0}, wish.farthest - wish.tight);
  // All or nothing: what it has found when it is ended is lost.
  const auto result =
      distance_until(*shape_, X_WA_, *body.shape, X_WB, options, kept[0].cache, share.clock);
  if (!result) return {};
  return {result->lower, result->upper, result->p_WCa, result->p_WCb};
}

std::optional<bool> RigidObstacle::is_apart_at(const ToolBody& body, const RigidPose& X_WB,
                                               WorkClock& clock, PairMemory& kept) const {
  kept.resize(1);
  DistanceOptions options;
  options.max_distance = margin;
  const auto result =
      distance_until(*shape_, X_WA_, *body.shape, X_WB, options, kept[0].cache, clock);
  if (!result) return std::nullopt;
  return result->lower > margin;
}

}  // namespace

std::unique_ptr<Obstacle> make_rigid_obstacle(const ToolObstacle& obstacle) {
  return std::make_unique<RigidObstacle>(obstacle.shape, obstacle.X_WO);
}

}  // namespace dyop::haptics_internal
