// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/haptics/haptic_session.h"
#include "haptics/hold_solver.h"
#include "haptics/obstacle.h"
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

/// What is proven about a body and an obstacle at their current poses.
struct ProxyPair {
  std::size_t body = 0;
  std::size_t obstacle = 0;
  PairDistance distance;  ///< bounds hold; points are those of the last measurement
  Scalar target = 0;      ///< what the next motion keeps: the margin, or less if it is nearer
  Scalar tolerance = 0;
  /// What the motions tried since the last commit have been proven to keep, up to their safe times.
  Scalar proven = kInfinity;
  bool is_overlapping = false;  ///< not proven apart: left out of the proof
  Scalar eased_from = 0;        ///< while nearer than what is kept: the largest distance since then
  int level = 0;                ///< how much of its slack it has used up: see Proxy::set_band()
  PairMemory kept;
};

/// How far the proxy followed the device in one tick.
struct FollowReport {
  Scalar committed = 0;  ///< time
  bool is_at_goal = false;
  bool is_held = false;  ///< the last motion went to its end, against holds
  bool was_recovering = false;
  bool was_overlapping = false;
};

/// The tool's proxy among the obstacles: makes only proven motions.
class Proxy {
 public:
  Proxy(const HapticScene& scene, const HapticOptions& options);

  const ToolPose& pose() const { return pose_; }
  /// The motions of the last follow().
  const std::vector<ToolWaypoint>& path() const { return path_; }
  std::span<const HoldPoint> holds() const { return holds_; }
  std::span<const ProxyPair> pairs() const { return pairs_; }
  std::span<const std::unique_ptr<Obstacle>> obstacles() const { return obstacles_; }
  std::span<const ToolBody> bodies() const { return bodies_; }
  RigidPose body_pose(std::size_t body) const {
    return pose_.X_WT * body_in_tool(bodies_[body], hinges_, pose_);
  }

  /// Moves towards the goal while time dt passes, within the clock's budget. Without a goal it
  /// stays where it is, as long as tissue lets it.
  FollowReport follow(const std::optional<ToolPose>& goal, Scalar dt, WorkClock& clock,
                      TickStatistics& work);
  /// Measures again the clearances whose bounds have become loose, as far as the share lasts.
  void measure(WorkShare share, TickStatistics& work);

 private:
  /// A motion and how far it is proven.
  struct Proof {
    Scalar t_safe = 0;
    bool is_undecided = false;  // the budget ended
    bool has_hit = false;
    HoldPoint hit;
  };
  struct Piece {
    Scalar duration;
    Scalar remaining;  // of the tick
    bool is_standing = false;
  };

  Scalar move(const ToolPose& goal, const Piece& piece, WorkClock& clock, TickStatistics& work,
              FollowReport& report);
  Scalar stay(Scalar duration, WorkClock& clock, TickStatistics& work, FollowReport& report);
  void move_among_standing(const ToolPose& goal, Scalar duration, WorkClock& clock,
                           TickStatistics& work, FollowReport& report);
  void look_for_escape(WorkClock& clock, TickStatistics& work);
  void gather_holds(const ToolStep& wish, const Piece& piece, WorkClock& clock);
  Scalar likely_step(const ToolBody& body, const ToolMotion& wished, Scalar duration) const;
  Scalar size_of(const ToolBody& body, const ToolStep& step) const;
  Scalar horizon_of(const ToolStep& step, Scalar duration) const;
  void expect(const ProxyPair& pair, Scalar duration, ExpectedApproach& approach) const;
  void carry_holds();
  void release_holds();
  void keep_found();
  void add_if_new(const HoldPoint& hold);
  std::size_t most_holds() const;
  void thin_holds();
  void warm_start();
  Scalar bend_holds(const ToolMotion& motion, const ToolStep& step, Scalar part, Scalar end_time);
  ToolStep solve(const StepGoal& goal, WorkClock& clock, TickStatistics& work);
  void add_hit(const HoldPoint& hit);
  Proof prove(const ToolMotion& motion, Scalar duration, WorkClock& clock, TickStatistics& work,
              FollowReport& report);
  PairImpact ask(ProxyPair& pair, const BodyMotion& motion, WorkClock& clock, TickStatistics& work);
  void set_band(ProxyPair& pair) const;
  bool has_band_below(ProxyPair& pair, Scalar distance) const;
  void choose_band(ProxyPair& pair, Scalar noise) const;
  PairImpact ask_again(ProxyPair& pair, const BodyMotion& motion, Scalar noise, WorkClock& clock,
                       TickStatistics& work);
  void measure(ProxyPair& pair, const DistanceWish& wish, WorkShare& share, TickStatistics& work);
  void commit(const ToolMotion& motion, Scalar t);
  void forget(std::size_t obstacle);
  Scalar piece_time(Scalar remaining) const;
  bool is_at(const ToolPose& goal) const;
  DistanceWish wish_for(std::size_t obstacle) const;
  Scalar excess(const ProxyPair& pair, const DistanceWish& wish) const;
  static void take(const PairDistance& found, ProxyPair& pair);
  void refresh(std::size_t obstacle);
  void take_pace(bool was_cut, bool has_moved);

  const HapticOptions options_;
  const Scalar tolerance_;  // of impacts
  std::vector<ToolHinge> hinges_;
  std::vector<std::unique_ptr<Obstacle>> obstacles_;
  std::vector<ToolBody> bodies_;
  std::vector<ProxyPair> pairs_;
  /// A pair whose bounds are farther apart than allowed: how many times.
  struct Loose {
    Scalar excess;
    std::size_t pair;
  };
  std::vector<Loose> loose_;
  Scalar pace_ = 1;  // part of the way to the device that is tried
  HoldSolver solver_;
  QueryMemory memory_;
  Escape escape_;
  ToolPose pose_;
  ToolStep last_step_;       // of the last motion
  ToolStep last_tick_step_;  // of all motions of the last tick
  int stuck_ticks_ = 0;      // in a row, in which nothing moved
  bool is_short_ = false;    // the last motion ends before its step does
  ToolStep rate_;            // the last motion's, per time
  ToolStep rate_before_;     // of the motion before it
  ToolStep goal_step_;       // of the device, since the last tick
  ToolStep last_goal_step_;  // in the tick before
  std::optional<ToolPose> last_goal_;
  std::vector<ToolWaypoint> path_;
  std::vector<HoldPoint> holds_;
  ToolPose holds_from_;           // where they were found
  Scalar holds_since_ = 0;        // time since then
  bool was_hasty_ = false;        // the last search for holds was cut off
  std::int64_t search_work_ = 0;  // pieces of the last search for holds
  bool was_escape_cut_ = false;
  std::vector<HoldPoint> last_holds_;
  std::vector<HoldPoint> found_;
};

}  // namespace dyop::haptics_internal
