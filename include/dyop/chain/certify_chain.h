// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "dyop/chain/joint_path.h"
#include "dyop/chain/kinematic_chain.h"
#include "dyop/core/batch_options.h"
#include "dyop/toi/obstacle_set.h"
#include "dyop/toi/time_of_impact.h"

namespace DYOP_EXPORT dyop {

namespace chain_internal {
struct ChainMemory;
}

struct ChainOptions {
  /// As for time_of_impact(), for each pair of bodies; solid_a and solid_b must be false:
  /// Link::is_solid and Obstacle::is_solid replace them. Budget, deadline and stop are those of the
  /// whole call.
  ToiOptions toi = {};
  /// Which of the obstacles that share a group with a link (Link::groups) to consider.
  ObstacleFilter obstacles = {};
  /// Check KinematicChain::self_pairs() too.
  bool with_self_collision = true;
};

/// Result of certify(). What `toi` states about the distance of two shapes holds for the distances
/// of all links from their obstacles and of all pairs of links: Separated, t_safe, rounding
/// allowance and statistics cover all of them. A is `link_a`; B is `link_b` or `obstacle`; points,
/// normal and poses are in the world.
struct ChainResult {
  ToiResult toi;
  /// The link that the status refers to: the one hit first, or that could not be decided. Empty if
  /// Separated.
  std::optional<std::size_t> link_a;
  std::optional<std::size_t> link_b;   ///< the other link, in self-collision
  std::optional<ObstacleId> obstacle;  ///< otherwise
  /// The fraction of the path's time proven free: 1 if Separated.
  Scalar free_fraction = 0;
};

/// Memory of certify(), kept by the caller between queries. Serves one query at a time.
class ChainWorkspace {
 public:
  ChainWorkspace();
  ~ChainWorkspace();
  ChainWorkspace(ChainWorkspace&&) noexcept;
  ChainWorkspace& operator=(ChainWorkspace&&) noexcept;

  chain_internal::ChainMemory& memory() { return *memory_; }

 private:
  std::unique_ptr<chain_internal::ChainMemory> memory_;
};

/// Proves that a chain on a joint path stays clear of obstacles and of itself for the whole time of
/// the path, or tells until when, and what is hit first.
///
/// Pairs of links are examined in the frame of the link where their branches meet, so motion that
/// they share costs nothing.
///
/// If the budget is used up, bodies not yet examined are proven free at no time: t_safe is then the
/// start of the path.
///
/// @param path      With as many coordinates as the chain; its domain is the interval.
/// @param obstacles Moving ones are placed at the path's time.
/// @throws InvalidArgument if the number of coordinates differs, or as ObstacleSet::first_impact().
/// Reads its arguments only; thread-safe, deterministic unless a deadline or stop ends it.
/// See docs/algorithms/chain.md.
ChainResult certify(const KinematicChain& chain, const JointPath& path,
                    const ObstacleSet& obstacles, const ChainOptions& options = {});
/// The same, in the memory of `workspace`. Same result, bit for bit.
ChainResult certify(const KinematicChain& chain, const JointPath& path,
                    const ObstacleSet& obstacles, const ChainOptions& options,
                    ChainWorkspace& workspace);

/// certify() for many paths of one chain, on several threads. Results are those of single calls,
/// bit for bit. After the batch is stopped, a path that was being examined is Cancelled; one that
/// had not been started is NotRun.
/// @param results As many as paths.
/// @throws InvalidArgument as certify(), naming the path, before any is examined. An exception of
///         the obstacles' filter or of the progress callback ends the batch.
void certify_batch(const KinematicChain& chain, std::span<const JointPath> paths,
                   const ObstacleSet& obstacles, std::span<ChainResult> results,
                   const ChainOptions& options = {}, const BatchOptions& batch = {});

}  // namespace dyop
