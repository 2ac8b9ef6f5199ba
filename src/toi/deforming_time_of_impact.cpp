// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/deforming_time_of_impact.h"

#include "dyop/core/error.h"
#include "toi/best_first_search.h"
#include "toi/deforming/deforming_pair.h"
#include "toi/deforming/listed_impact.h"
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
                     const ToiOptions& options, Scalar radius_b, toi_internal::ToiMemory& memory,
                     Start start, const DeformingSpan& span = {},
                     std::span<const distance_internal::BoxPair> first = {
                         &distance_internal::kRootPair, 1}) {
  using Pair = toi_internal::DeformingPair<SideB>;
  const toi_internal::ImpactBand band(options.target_distance,
                                      toi_internal::tolerance_of(options, radius_of(a), radius_b));
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
  return run_search(a, side_b, interval, options, b.bounding_radius(), memory, start);
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
  ToiResult result = run_search(a, side_b, interval, options, b.bounding_radius(), use.memory(),
                                Start::Fresh, span, pairs);
  use.memory().is_unfinished = false;
  return result;
}

}  // namespace dyop
