// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "haptics/hold_solver.h"
#include "haptics/obstacle.h"
#include "haptics/pair_proofs.h"

namespace dyop::haptics_internal {

/// Where the tool is, and how it and the device have moved of late: what tells how it will go on.
struct Course {
  ToolPose pose;
  Scalar pace = 1;          ///< part of the way to the device that is tried
  ToolStep last_step;       ///< of the last motion
  ToolStep last_tick_step;  ///< of all motions of the last tick
  ToolStep rate;            ///< the last motion's, per time
  ToolStep rate_before;     ///< of the motion before it
  ToolStep goal_step;       ///< of the device, since the last tick
  ToolStep last_goal_step;  ///< in the tick before
};

/// The places where obstacles hold the tool or may do so in its next motion.
class ActiveContacts {
 public:
  explicit ActiveContacts(const LoopScene& scene);

  std::span<const HoldPoint> holds() const { return holds_; }
  /// Whether anything is in the way of a step; otherwise it need not be solved for.
  bool can_hold() const { return !holds_.empty() || scene_.trocar; }
  /// The trocar's force in the last solve.
  const Vector3& trocar_force_W() const { return solver_.trocar_force_W(); }

  /// Finds them for a motion that shall go by `wish` in the time `duration`. Starts with the
  /// impulses that they had.
  void gather(const Course& course, const ToolStep& wish, Scalar duration, PairProofs& proofs,
              WorkClock& clock);
  /// Whether the last search was cut off.
  bool was_hasty() const { return was_hasty_; }
  /// What holds stands now.
  void release();
  /// The step nearest to the goal's wish that they admit.
  ToolStep solve(const Course& course, const StepGoal& goal, WorkClock& clock,
                 TickStatistics& work);
  /// Whether the last solve found no step that keeps all gaps from shrinking.
  bool is_contradiction() const { return solver_.is_contradiction(); }
  /// How much of a step's duration is tried at once.
  Scalar horizon_of(const Course& course, const ToolStep& step, Scalar duration) const;
  /// How much of a step can be made at once without leaving the trocar; 1 if there is none.
  Scalar trocar_part(const ToolPose& from, const ToolStep& step) const;
  /// A place where a proof found that the tool is held.
  void add_hit(const HoldPoint& hit);
  /// Time in which they move with the tool and with tissue.
  void pass(Scalar time) { holds_since_ += time; }
  /// The obstacle is another mesh now.
  void forget(std::size_t obstacle);
  /// The tool is elsewhere.
  void forget_all();
  void set_coupling(const CouplingOptions& coupling) { solver_.set_coupling(coupling); }

 private:
  Scalar likely_step(const Course& course, const ToolBody& body, const ToolMotion& wished,
                     Scalar duration) const;
  Scalar size_of(const Course& course, const ToolBody& body, const ToolStep& step) const;
  void expect(const Course& course, const ProxyPair& pair, Scalar duration,
              ExpectedApproach& approach) const;
  void carry(const Course& course, std::span<const ProxyPair> pairs);
  void keep_found(const Course& course, std::span<const ProxyPair> pairs);
  void add_if_new(const HoldPoint& hold);
  std::size_t most_holds(const Course& course) const;
  void thin(const Course& course);
  void warm_start();
  Scalar bend(const ToolPose& from, const ToolMotion& motion, const ToolStep& step, Scalar part,
              Scalar end_time);

  const LoopScene& scene_;
  HoldSolver solver_;
  std::vector<HoldPoint> holds_;
  ToolPose holds_from_;           // where they were found
  Scalar holds_since_ = 0;        // time since then
  bool was_hasty_ = false;        // the last search was cut off
  std::int64_t search_work_ = 0;  // pieces of the last search
  std::vector<HoldPoint> last_holds_;
  std::vector<HoldPoint> found_;
};

}  // namespace dyop::haptics_internal
