// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/haptics/haptic_session.h"
#include "haptics/active_contacts.h"
#include "haptics/hold_solver.h"
#include "haptics/obstacle.h"
#include "haptics/pair_proofs.h"
#include "haptics/tool_body.h"
#include "haptics/work_clock.h"

namespace dyop::haptics_internal {

/// The search for the shortest straight path out of an obstacle that crosses the tool, along an
/// axis or diagonal of the world, to a position where both are proven apart. Each tick tries a few
/// positions.
class Escape {
 public:
  /// @param first_length Distance of the first positions; each next one is 1.5 times as far.
  void start(std::size_t pair, Scalar first_length);
  void stop() { pair_.reset(); }
  bool is_for(std::size_t pair) const { return pair_ == pair; }
  const std::optional<std::size_t>& pair() const { return pair_; }

  /// Tries the next position: is_apart(displacement) is true if the two are proven apart there.
  /// What could not be decided in time is passed over: it would take as long again.
  template <typename IsApart>
  void try_next(const IsApart& is_apart);

  /// The unit direction of the shortest path, once all have been tried.
  std::optional<Vector3> direction() const;
  /// All have been tried, and none leads out.
  bool has_failed() const { return is_through() && !(shortest_ < kInfinity); }

  static constexpr int kDirections = 26;
  static constexpr int kLengths = 16;

 private:
  bool is_through() const { return number_ >= kDirections; }
  static Vector3 direction_of(int number);

  std::optional<std::size_t> pair_;
  Scalar first_length_ = 0;
  int number_ = 0;  // of the direction
  int steps_ = 0;   // along it
  Scalar length_ = 0;
  Scalar shortest_ = kInfinity;
  int best_ = 0;
};

template <typename IsApart>
void Escape::try_next(const IsApart& is_apart) {
  if (!pair_ || is_through()) return;
  const std::optional<bool> answer = is_apart(Vector3(length_ * direction_of(number_)));
  const bool is_out = answer.value_or(false);
  if (is_out) {
    shortest_ = length_;
    best_ = number_;
  }
  length_ *= 1.5;
  ++steps_;
  if (!is_out && steps_ < kLengths && length_ < shortest_) return;
  ++number_;
  steps_ = 0;
  length_ = first_length_;
}

/// How far the proxies followed the devices in one tick.
struct FollowReport {
  Scalar committed = 0;  ///< time
  ToolSet at_goal;
  ToolSet held;  ///< whose last motion went to its end, against holds
  ToolSet recovering;
  ToolSet overlapping;
};

/// The tools' proxies among the obstacles: makes only proven motions, of all tools at once.
///
/// follow() divides a tick where an obstacle takes its next snapshot. In each part move() goes
/// through the stages, each of which takes what the one before it returns:
///
///   plan()                   the step that leads to the devices
///   ActiveContacts::gather   where obstacles hold a tool, or tools each other
///   ActiveContacts::solve    the step nearest to the planned one that they admit       <--+
///   PairProofs::prove        how far it is free; a hit is another active contact       ---+
///   commit()                 tools, obstacles and distances go on to where that is proven
///
/// Then stay() lets tissue go on as far as that is proven while the tools wait, and
/// PairProofs::measure() tightens the clearances.
class Proxy {
 public:
  Proxy(const HapticScene& scene, const HapticOptions& options);
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;

  const ToolPoses& poses() const { return course_.pose; }
  /// The motions of the last follow().
  const std::vector<ToolWaypoint>& path(std::size_t tool) const { return paths_[tool]; }
  /// Where the scene's obstacles were at each waypoint, one after the other.
  const std::vector<ObstacleProgress>& path_progress() const { return path_progress_; }
  std::span<const HoldPoint> holds() const { return contacts_.holds(); }
  /// The force of a hold on its body's tool in the last solve, as if that had been for the whole
  /// way to the goal.
  Vector3 force_W(const HoldPoint& hold) const {
    return hold.impulse_W / goal_parts_[scene_.bodies[hold.body].tool];
  }
  /// The same of the tool's trocar.
  Vector3 trocar_force_W(std::size_t tool) const {
    return contacts_.trocar_force_W(tool) / goal_parts_[tool];
  }
  /// Impulses of the scene's obstacles over the last follow(), in its unit of time.
  const std::vector<ToolImpulse>& impulses(std::size_t tool) const { return impulses_[tool]; }
  std::span<const ProxyPair> pairs() const { return proofs_.pairs(); }
  const LoopScene& scene() const { return scene_; }

  /// Moves towards the goals while time dt passes, within the clock's budget. A tool without a goal
  /// stays where it is, as long as tissue lets it.
  FollowReport follow(const PerTool<std::optional<ToolPose>>& goals, Scalar dt, WorkClock& clock,
                      TickStatistics& work);
  /// A tool is elsewhere: nothing is known.
  void reset(std::size_t tool, const ToolPose& pose);
  void set_coupling(std::size_t tool, const CouplingOptions& coupling) {
    contacts_.set_coupling(tool, coupling);
  }
  /// See PairProofs.
  NewNeighbours beside_new() const { return proofs_.beside_new(); }
  /// Measures again the clearances whose bounds have become loose, as far as the share lasts.
  void measure(WorkShare share, TickStatistics& work) {
    proofs_.measure(course_.pose, share, work);
  }

 private:
  /// What a tick is about, and how far it has come.
  struct Following {
    ToolPoses goal;
    bool is_pulled;  ///< or the goals are where the tools are, for want of others
    Scalar dt;
    WorkClock& clock;
    TickStatistics& work;
    FollowReport report = {};
    bool is_short = false;     ///< the last motion ends before its step does
    bool ended_early = false;  ///< a motion did, or was proven no farther

    bool has_time() const;
  };
  /// A part of a tick.
  struct Piece {
    Scalar duration;
    Scalar remaining;  ///< of the tick
    bool is_standing = false;
    ToolSet moving = all_tools();  ///< the others stand
  };
  struct Plan {
    ToolSteps wish;
    PerTool<Scalar> part;  ///< of the way to the goal
  };
  struct Motion {
    ToolSteps steps;
    Scalar t_safe = 0;
  };

  void start(const Following& tick);
  void finish(bool was_standing, Following& tick);
  Piece next_piece(const Following& tick);
  Scalar move(const Piece& piece, Following& tick);
  Plan plan(const ToolPoses& goal, const Piece& piece) const;
  Motion find_motion(const StepGoal& goal, Following& tick);
  Scalar stay(Scalar duration, Following& tick);
  void wait(Following& tick);
  void move_in_rounds(Following& tick);
  void move_among_standing(Following& tick);
  void move_one_by_one(Following& tick);
  void look_for_escape(WorkClock& clock, TickStatistics& work);
  Proof prove(const ToolMotions& motion, Scalar duration, Following& tick);
  void commit(const ToolMotions& motion, Scalar t, ToolSet moving);
  void note_progress();
  void add_impulses(Scalar time);
  void forget(std::size_t obstacle);
  bool is_at(std::size_t tool, const ToolPose& goal) const;
  void take_pace(bool was_cut, bool has_moved);

  LoopScene scene_;
  PairProofs proofs_;
  ActiveContacts contacts_;
  Escape escape_;
  Course course_;
  std::optional<ToolPoses> last_goal_;
  int stuck_ticks_ = 0;  // in a row, in which nothing moved
  bool was_escape_cut_ = false;
  PerTool<Scalar> goal_parts_;  // of the way to the goal that the last solve was for
  std::array<std::vector<ToolWaypoint>, kMostTools> paths_;
  std::vector<ObstacleProgress> path_progress_;
  std::array<std::vector<ToolImpulse>, kMostTools> impulses_;
};

}  // namespace dyop::haptics_internal
