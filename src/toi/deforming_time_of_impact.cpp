// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/deforming_time_of_impact.h"

#include <algorithm>
#include <optional>

#include "dyop/core/error.h"
#include "toi/best_first_search.h"
#include "toi/deforming/deforming_pair.h"
#include "toi/deforming/deforming_traversal.h"
#include "toi/deforming/standing_pair.h"
#include "toi/toi_check.h"
#include "toi/toi_memory.h"

namespace dyop {
namespace {

using toi_internal::DeformingSide;
using toi_internal::RigidSide;

void require_triangles(const DeformingMesh& mesh, const char* name) {
  DYOP_REQUIRE(!mesh.nodes().empty(), "time_of_impact: the deforming mesh ", name,
               " was moved from and holds no triangles");
}

void require_valid(const TimeInterval& interval, const ToiOptions& options) {
  require_valid(interval, "time_of_impact: interval");
  toi_internal::require_valid_options(options);
  DYOP_REQUIRE(!options.solid_a && !options.solid_b,
               "time_of_impact: deforming meshes are surfaces, solid_a and solid_b must be false");
}

enum class Start { Fresh, Resumed };

// Half the diagonal of the box at the start.
Scalar radius_of(const DeformingMesh& mesh) {
  return mesh.nodes()[0].at_begin.diagonal().norm() / 2;
}

void require_span(const DeformingSpan& span) {
  DYOP_REQUIRE(span.begin >= 0 && span.begin <= span.end && span.end <= 1,
               "time_of_impact: the span of a deforming mesh must be a part of [0, 1], not [",
               span.begin, ", ", span.end, "]");
}

template <typename SideB>
ToiResult run_search(const DeformingMesh& a, SideB& side_b, const TimeInterval& interval,
                     const ToiOptions& options, Scalar size_b, toi_internal::ToiMemory& memory,
                     Start start, const DeformingSpan& span = {},
                     std::span<const distance_internal::BoxPair> first = {
                         &distance_internal::kRootPair, 1}) {
  using Pair = toi_internal::DeformingPair<SideB>;
  const toi_internal::ImpactBand band(options.target_distance,
                                      toi_internal::tolerance_of(options, radius_of(a), size_b));
  DeformingSide side_a(a, interval, span);
  Pair pair(side_a, side_b, interval, band, first);
  toi_internal::BestFirstSearch<Pair> search(pair, interval, options, band, memory);
  return start == Start::Fresh ? search.run() : search.resume();
}

// Stores what the query is about, or checks that it is still the same.
void take_up(toi_internal::ToiMemory& memory, const toi_internal::ToiSubject& subject,
             Start start) {
  if (start == Start::Fresh) {
    memory.subject = subject;
    memory.is_unfinished = false;
  } else {
    toi_internal::require_resumable(memory, subject);
  }
}

ToiResult answer(const DeformingMesh& a, const DeformingMesh& b, const TimeInterval& interval,
                 const ToiOptions& options, toi_internal::ToiMemory& memory, Start start) {
  require_valid(interval, options);
  require_triangles(a, "A");
  require_triangles(b, "B");
  take_up(memory, {&a, nullptr, &b, nullptr, interval, options}, start);
  DeformingSide side_b(b, interval);
  return run_search(a, side_b, interval, options, radius_of(b), memory, start);
}

ToiResult answer(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                 const TimeInterval& interval, const ToiOptions& options,
                 toi_internal::ToiMemory& memory, Start start) {
  require_valid(interval, options);
  require_triangles(a, "A");
  require_defined(X_WB, interval, toi_internal::kMotionOfB);
  take_up(memory, {&a, nullptr, &b, &X_WB, interval, options}, start);
  RigidSide side_b(b, X_WB, interval);
  return run_search(a, side_b, interval, options, toi_internal::size_of(b), memory, start);
}

}  // namespace

ToiResult time_of_impact(const DeformingMesh& a, const DeformingMesh& b,
                         const TimeInterval& interval, const ToiOptions& options) {
  toi_internal::ToiMemory memory;
  return answer(a, b, interval, options, memory, Start::Fresh);
}

ToiResult time_of_impact(const DeformingMesh& a, const DeformingMesh& b,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace) {
  return answer(a, b, interval, options, toi_internal::WorkspaceUse(workspace).memory(),
                Start::Fresh);
}

ToiResult resume_time_of_impact(const DeformingMesh& a, const DeformingMesh& b,
                                const TimeInterval& interval, const ToiOptions& options,
                                ToiWorkspace& workspace) {
  return answer(a, b, interval, options, toi_internal::WorkspaceUse(workspace).memory(),
                Start::Resumed);
}

ToiResult time_of_impact(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options) {
  toi_internal::ToiMemory memory;
  return answer(a, b, X_WB, interval, options, memory, Start::Fresh);
}

ToiResult time_of_impact(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace) {
  return answer(a, b, X_WB, interval, options, toi_internal::WorkspaceUse(workspace).memory(),
                Start::Fresh);
}

ToiResult resume_time_of_impact(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                                const TimeInterval& interval, const ToiOptions& options,
                                ToiWorkspace& workspace) {
  return answer(a, b, X_WB, interval, options, toi_internal::WorkspaceUse(workspace).memory(),
                Start::Resumed);
}

ToiResult time_of_impact(const DeformingMesh& a, const DeformingSpan& span, const TriangleMesh& b,
                         const Motion& X_WB, const TimeInterval& interval,
                         const ToiOptions& options, ToiWorkspace& workspace) {
  return toi_internal::time_of_listed_impact(a, span, b, X_WB, interval, options, workspace,
                                             {&distance_internal::kRootPair, 1});
}

ToiResult toi_internal::time_of_listed_impact(const DeformingMesh& a, const DeformingSpan& span,
                                              const TriangleMesh& b, const Motion& X_WB,
                                              const TimeInterval& interval,
                                              const ToiOptions& options, ToiWorkspace& workspace,
                                              std::span<const BoxPair> pairs) {
  const WorkspaceUse use(workspace);
  require_valid(interval, options);
  require_triangles(a, "A");
  require_defined(X_WB, interval, kMotionOfB);
  require_span(span);
  use.memory().subject = {};
  use.memory().is_unfinished = false;
  RigidSide side_b(b, X_WB, interval);
  ToiResult result = run_search(a, side_b, interval, options, toi_internal::size_of(b),
                                use.memory(), Start::Fresh, span, pairs);
  use.memory().is_unfinished = false;
  return result;
}

namespace {

using distance_internal::PieceDistance;
using toi_internal::DeformingTraversal;
using toi_internal::RigidSide;
using toi_internal::StandingPair;

void require_fraction(Scalar s) {
  DYOP_REQUIRE(s >= 0 && s <= 1, "the fraction of a deforming mesh's interval must be in [0, 1], ",
               "not ", s);
}

WitnessPair witness_of(const PieceDistance& piece, std::int32_t triangle_a,
                       std::int32_t triangle_b) {
  return {piece.lower,     piece.upper, piece.p_a,  piece.p_b,    piece.nhat_AB, piece.feature_a,
          piece.feature_b, triangle_a,  triangle_b, std::nullopt, std::nullopt};
}

}  // namespace

DistanceResult distance(const DeformingMesh& a, Scalar s, const TriangleMesh& b,
                        const RigidPose& X_WB, const DistanceOptions& options,
                        DistanceCache& cache) {
  require_fraction(s);
  DYOP_REQUIRE(options.max_distance >= 0, "distance: max_distance must be >= 0, not ",
               options.max_distance);
  const StandingPair sides(a, s, b, X_WB);
  DeformingTraversal<RigidSide> traversal(sides.a, sides.b, sides.noise, options.max_distance,
                                          cache.stack);
  const auto& seed = cache.nearest;
  if (seed && sides.a.has_leaf(seed->a) && sides.b.has_leaf(seed->b)) {
    traversal.seed(seed->a, seed->b);
  }
  traversal.start();
  traversal.run_portion(std::numeric_limits<std::int64_t>::max());

  DistanceResult result;
  result.statistics = traversal.statistics;
  const PieceDistance& best = traversal.best;
  if (best.upper < kInfinity) {
    cache.nearest = {traversal.leaf_a, traversal.leaf_b};
    static_cast<WitnessPair&>(result) =
        witness_of(best, sides.a.triangle(traversal.leaf_a), sides.b.triangle(traversal.leaf_b));
  }
  result.lower = best.is_overlapping ? 0 : std::min(traversal.lower, result.upper);
  if (best.is_overlapping) {
    result.status = DistanceStatus::Overlapping;
  } else if (result.lower > options.max_distance) {
    result.status = DistanceStatus::FartherThanMaxDistance;
  } else {
    result.status = result.lower > 0 ? DistanceStatus::Separated : DistanceStatus::Inconclusive;
  }
  return result;
}

void find_near_pairs(const DeformingMesh& a, Scalar s, const TriangleMesh& b, const RigidPose& X_WB,
                     Scalar max_distance, std::size_t limit, DistanceCache& cache,
                     std::vector<WitnessPair>& pairs) {
  require_fraction(s);
  DYOP_REQUIRE(max_distance >= 0 && max_distance < kInfinity,
               "find_near_pairs: max_distance must be finite and >= 0, not ", max_distance);
  pairs.clear();
  const StandingPair sides(a, s, b, X_WB);
  DeformingTraversal<RigidSide> traversal(sides.a, sides.b, sides.noise, max_distance, cache.stack);
  traversal.for_each_leaf_pair(
      [&](const PieceDistance& piece, std::int32_t leaf_a, std::int32_t leaf_b) {
        if (piece.lower <= max_distance) {
          pairs.push_back(witness_of(piece, sides.a.triangle(leaf_a), sides.b.triangle(leaf_b)));
        }
        return pairs.size() < limit;
      });
}

}  // namespace dyop
