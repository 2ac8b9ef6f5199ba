// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// How far the proxy followed the device in one tick.
struct FollowReport {
  Scalar committed = 0;  ///< time
  bool is_at_goal = false;
  bool is_held = false;  ///< the last motion went to its end, against holds
  bool was_recovering = false;
  bool was_overlapping = false;
};

/// The tool's proxy among the obstacles: makes only proven motions.
///
/// follow() divides a tick where an obstacle takes its next snapshot. In each part move() goes
/// through the stages, each of which takes what the one before it returns:
///
///   plan()                   the step that leads to the device
///   ActiveContacts::gather   where obstacles hold the tool
///   ActiveContacts::solve    the step nearest to the planned one that they admit       <--+
///   PairProofs::prove        how far it is free; a hit is another active contact       ---+
///   commit()                 tool, obstacles and distances go on to where that is proven
///
/// Then stay() lets tissue go on as far as that is proven while the tool waits, and
/// PairProofs::measure() tightens the clearances.
class Proxy {
 public:
  Proxy(const HapticScene& scene, const HapticOptions& options);
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;

  const ToolPose& pose() const { return course_.pose; }
  /// The motions of the last follow().
  const std::vector<ToolWaypoint>& path() const { return path_; }
  std::span<const HoldPoint> holds() const { return contacts_.holds(); }
  /// The force of a hold on the tool in the last solve, as if that had been for the whole way to
  /// the goal.
  Vector3 force_W(const HoldPoint& hold) const { return hold.impulse_W / goal_part_; }
  /// The same of the trocar.
  Vector3 trocar_force_W() const { return contacts_.trocar_force_W() / goal_part_; }
  /// Impulses of the holds over the last follow(), in its unit of time.
  const std::vector<ToolImpulse>& impulses() const { return impulses_; }
  std::span<const ProxyPair> pairs() const { return proofs_.pairs(); }
  std::span<const std::unique_ptr<Obstacle>> obstacles() const { return scene_.obstacles; }
  std::span<const ToolBody> bodies() const { return scene_.bodies; }
  std::span<const ToolHinge> hinges() const { return scene_.hinges; }

  /// Moves towards the goal while time dt passes, within the clock's budget. Without a goal it
  /// stays where it is, as long as tissue lets it.
  FollowReport follow(const std::optional<ToolPose>& goal, Scalar dt, WorkClock& clock,
                      TickStatistics& work);
  /// The tool is elsewhere: nothing is known.
  void reset(const ToolPose& pose);
  void set_coupling(const CouplingOptions& coupling) { contacts_.set_coupling(coupling); }
  /// Measures again the clearances whose bounds have become loose, as far as the share lasts.
  void measure(WorkShare share, TickStatistics& work) {
    proofs_.measure(course_.pose, share, work);
  }

 private:
  /// What a tick is about, and how far it has come.
  struct Following {
    ToolPose goal;
    bool is_pulled;  ///< or the goal is where the tool is, for want of another
    Scalar dt;
    WorkClock& clock;
    TickStatistics& work;
    FollowReport report = {};
    bool is_short = false;  ///< the last motion ends before its step does

    bool has_time() const;
  };
  /// A part of a tick.
  struct Piece {
    Scalar duration;
    Scalar remaining;  ///< of the tick
    bool is_standing = false;
  };
  struct Plan {
    ToolStep wish;
    Scalar part;  ///< of the way to the goal
  };
  struct Motion {
    ToolStep step;
    Scalar t_safe = 0;
  };

  void start(const Following& tick);
  void finish(bool was_standing, Following& tick);
  Piece next_piece(const Following& tick);
  Scalar move(const ToolPose& goal, const Piece& piece, Following& tick);
  Plan plan(const ToolPose& goal, const Piece& piece) const;
  Motion find_motion(const StepGoal& goal, Following& tick);
  Scalar stay(Scalar duration, Following& tick);
  void wait(Following& tick);
  void move_in_rounds(Following& tick);
  void move_among_standing(Following& tick);
  void look_for_escape(WorkClock& clock, TickStatistics& work);
  Proof prove(const ToolMotion& motion, Scalar duration, Following& tick);
  void commit(const ToolMotion& motion, Scalar t);
  void add_impulses(Scalar time);
  void forget(std::size_t obstacle);
  bool is_at(const ToolPose& goal) const;
  void take_pace(bool was_cut, bool has_moved);

  LoopScene scene_;
  PairProofs proofs_;
  ActiveContacts contacts_;
  Escape escape_;
  Course course_;
  std::optional<ToolPose> last_goal_;
  int stuck_ticks_ = 0;  // in a row, in which nothing moved
  bool was_escape_cut_ = false;
  Scalar goal_part_ = 1;  // of the way to the goal that the last solve was for
  std::vector<ToolWaypoint> path_;
  std::vector<ToolImpulse> impulses_;
};

}  // namespace dyop::haptics_internal
