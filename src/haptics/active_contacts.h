// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "haptics/hold_solver.h"
#include "haptics/obstacle.h"
#include "haptics/pair_proofs.h"

namespace dyop::haptics_internal {

/// Where the tools are, and how they and the devices have moved of late: what tells how they will
/// go on.
struct Course {
  explicit Course(const ToolPoses& start)
      : pose(start),
        last_step(start.size()),
        last_tick_step(start.size()),
        rate(start.size()),
        rate_before(start.size()),
        goal_step(start.size()),
        last_goal_step(start.size()) {}

  ToolPoses pose;
  Scalar pace = 1;           ///< part of the way to the devices that is tried
  ToolSteps last_step;       ///< of the last motion
  ToolSteps last_tick_step;  ///< of all motions of the last tick
  ToolSteps rate;            ///< the last motion's, per time
  ToolSteps rate_before;     ///< of the motion before it
  ToolSteps goal_step;       ///< of the devices, since the last tick
  ToolSteps last_goal_step;  ///< in the tick before
};

/// The places where obstacles hold the tools, or tools each other, or may do so in the next motion.
class ActiveContacts {
 public:
  ActiveContacts(const LoopScene& scene, const ToolPoses& start);

  std::span<const HoldPoint> holds() const { return holds_; }
  /// Whether anything is in the way of a step; otherwise it need not be solved for.
  bool can_hold() const;
  /// The trocar's force on a tool in the last solve.
  const Vector3& trocar_force_W(std::size_t tool) const { return solver_.trocar_force_W(tool); }

  /// Finds them for a motion that shall go by `wish` in the time `duration`. Starts with the
  /// impulses that they had.
  void gather(const Course& course, const ToolSteps& wish, Scalar duration, PairProofs& proofs,
              WorkClock& clock);
  /// Whether that searched, and did not go on with what was known.
  bool has_searched() const { return has_searched_; }
  /// The next gather() goes on with what is known: nothing has moved since.
  void skip_next_search() { skips_search_ = true; }
  /// What holds stands now.
  void release();
  /// The step nearest to the goal's wish that they admit.
  ToolSteps solve(const Course& course, const StepGoal& goal, WorkClock& clock,
                  TickStatistics& work);
  /// Whether the last solve found no step that keeps all gaps from shrinking.
  bool is_contradiction() const { return solver_.is_contradiction(); }
  /// How much of a step's duration is tried at once.
  Scalar horizon_of(const Course& course, const ToolSteps& steps, Scalar duration) const;
  /// How much of a step can be made at once without leaving a trocar; 1 if there is none.
  Scalar trocar_part(const ToolPoses& from, const ToolSteps& steps) const;
  /// How much of a wish a solve may get, which takes turns about a trocar for linear.
  Scalar linear_part(const ToolPoses& from, const ToolSteps& wish) const;
  /// A place where a proof found that the tool is held.
  void add_hit(const HoldPoint& hit);
  /// Time in which they move with the tool and with tissue.
  void pass(Scalar time) { holds_since_ += time; }
  /// Keeps what is known now while other motions are solved for; restore() goes back to it.
  void keep();
  void restore();
  /// The obstacle is another mesh now.
  void forget(std::size_t obstacle);
  /// The tool is elsewhere.
  void forget_all();
  void set_coupling(std::size_t tool, const CouplingOptions& coupling) {
    solver_.set_coupling(tool, coupling);
  }

 private:
  Scalar likely_step(const Course& course, const ToolBody& body, const ToolMotions& wished,
                     Scalar duration) const;
  Scalar size_of(const Course& course, const ToolBody& body, const ToolStep& step) const;
  /// How far a step turns a tool about its trocar, a displacement across the axis included, and the
  /// length of the lever.
  struct TrocarTurn {
    Scalar turn = 0;
    Scalar lever = 0;
  };
  TrocarTurn trocar_turn(std::size_t tool, const ToolPose& from, const ToolStep& step) const;
  Scalar trocar_part(std::size_t tool, const ToolPose& from, const ToolStep& step) const;
  void expect(const Course& course, const ProxyPair& pair, Scalar duration,
              ExpectedApproach& approach) const;
  void adapt_reach(std::int64_t pieces);
  Scalar least_reach(const Obstacle& obstacle, Scalar part) const;
  void carry(const Course& course, const PairProofs& proofs);
  void keep_found(const Course& course, const PairProofs& proofs);
  void add_if_new(const HoldPoint& hold);
  std::size_t most_holds(const Course& course) const;
  void thin(const Course& course);
  void add_spread(std::size_t first, std::size_t last, std::size_t most);
  void warm_start();
  Vector3 bend_of(std::size_t body, const Vector3& p_W, const ToolPoses& from, const ToolPoses& end,
                  const ToolSteps& steps, Scalar part) const;
  Scalar bend(const ToolPoses& from, const ToolMotions& motion, const ToolSteps& steps, Scalar part,
              Scalar end_time);

  const LoopScene& scene_;
  HoldSolver solver_;
  struct Kept {
    std::vector<HoldPoint> holds;
    ToolPoses from;
    Scalar since = 0;
  };

  std::vector<HoldPoint> holds_;
  Kept kept_;
  ToolPoses holds_from_;          // where they were found
  Scalar holds_since_ = 0;        // time since then
  bool has_searched_ = false;     // in the last gather()
  bool skips_search_ = false;     // in the next one
  std::int64_t search_work_ = 0;  // pieces of the last search
  Scalar reach_part_ = 1;         // of the reach beyond the rest gap
  std::vector<HoldPoint> last_holds_;
  std::vector<HoldPoint> found_;
  std::vector<Scalar> apart_;  // scratch of thin()
};

}  // namespace dyop::haptics_internal
