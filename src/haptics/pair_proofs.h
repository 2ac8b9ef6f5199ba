// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "haptics/obstacle.h"

namespace dyop::haptics_internal {

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
  bool is_new = false;          ///< the obstacle is another mesh, of which nothing is proven yet
  Scalar eased_from = 0;        ///< while nearer than what is kept: the largest distance since then
  int level = 0;  ///< how much of its slack it has used up: see PairProofs::set_band()
  PairMemory kept;
};

/// A motion and how far it is proven.
struct Proof {
  Scalar t_safe = 0;
  bool is_undecided = false;  ///< the budget ended
  bool has_hit = false;
  HoldPoint hit;
  ToolSet recovering;   ///< in a pair that was nearer than its target
  ToolSet overlapping;  ///< in a pair that crosses, and is left out
};

/// The tools beside another mesh of which nothing is proven yet, by what is measured.
struct NewNeighbours {
  ToolSet recovering;   ///< within the margin
  ToolSet overlapping;  ///< not known to be apart
};

/// The proofs that the tool's bodies and the hard obstacles stay apart, and the clearances: for
/// each pair of a body and an obstacle bounds of their distance, kept from motion to motion.
class PairProofs {
 public:
  explicit PairProofs(const LoopScene& scene);

  std::vector<ProxyPair>& pairs() { return pairs_; }
  const std::vector<ProxyPair>& pairs() const { return pairs_; }
  /// Of a body and one of the obstacles of its tool.
  const ProxyPair& pair(std::size_t body, std::size_t obstacle) const {
    return pairs_[first_pair_[body] + obstacle];
  }
  QueryMemory& memory() { return memory_; }

  /// Nothing is proven of the next motion.
  void start_motion();
  /// How far a motion from a pose is free. What several attempts prove of one motion is kept until
  /// it is committed.
  Proof prove(const ToolPoses& from, const ToolMotions& motion, Scalar duration, WorkClock& clock,
              TickStatistics& work);
  /// The motion has been made until t; obstacles move after this call.
  void commit(const ToolPoses& from, const ToolMotions& motion, Scalar t);
  /// The obstacle is another mesh now.
  void forget(std::size_t obstacle);
  /// Measures the pairs whose obstacle is another mesh, however long it takes: where the tools are
  /// beside it must be known even in a tick that is cut off.
  void measure_new(const ToolPoses& poses, TickStatistics& work);
  /// Measures again the clearances whose bounds have become loose, as far as the share lasts.
  void measure(const ToolPoses& poses, WorkShare share, TickStatistics& work);
  NewNeighbours beside_new() const;
  /// Measures the pairs that were last found crossing, with little work. Nothing is proven of their
  /// motions, so they may have come apart since, and a tick that was cut off has not looked.
  /// @return The tools that are apart again, but within the margin.
  ToolSet measure_crossing(const ToolPoses& poses, TickStatistics& work);
  /// The tools of a pair.
  ToolSet tools_of(const ProxyPair& pair) const;

 private:
  /// A pair whose bounds are farther apart than allowed: how many times.
  struct Loose {
    Scalar excess;
    std::size_t pair;
  };

  PairImpact ask(ProxyPair& pair, const BodyMotion& motion, WorkClock& clock, TickStatistics& work);
  PairImpact ask_again(const ToolPoses& from, ProxyPair& pair, const BodyMotion& motion,
                       Scalar noise, WorkClock& clock, TickStatistics& work);
  void set_band(ProxyPair& pair) const;
  bool has_band_below(ProxyPair& pair, Scalar distance) const;
  void choose_band(ProxyPair& pair, Scalar noise) const;
  Scalar moved_by_obstacle(const ProxyPair& pair, const ToolMotions& motion, Scalar t) const;
  Scalar size_of(const ToolPoses& from, const ProxyPair& pair, Scalar moved) const;
  bool is_far(const ProxyPair& pair, Scalar moved, Scalar noise) const;
  static void take_as_far(ProxyPair& pair);
  static void end_at(const PairImpact& impact, const ProxyPair& pair,
                     const std::optional<std::size_t>& other, Proof& proof);
  void measure(const ToolPoses& poses, ProxyPair& pair, const DistanceWish& wish, WorkShare& share,
               TickStatistics& work);
  DistanceWish wish_for(std::size_t tool, std::size_t obstacle) const;
  static Scalar excess(const ProxyPair& pair, const DistanceWish& wish);
  static void take(const PairDistance& found, ProxyPair& pair);
  void refresh(const ToolPoses& poses, std::size_t tool, std::size_t obstacle);

  const LoopScene& scene_;
  const Scalar tolerance_;               // of impacts
  std::vector<ProxyPair> pairs_;         // by body, then by obstacle
  std::vector<std::size_t> first_pair_;  // by body
  std::vector<Loose> loose_;
  QueryMemory memory_;
};

}  // namespace dyop::haptics_internal
