// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/time_of_impact.h"

#include "toi/best_first_search.h"
#include "toi/rigid/listed_impact.h"
#include "toi/rigid/rigid_pair.h"
#include "toi/toi_check.h"
#include "toi/toi_memory.h"

namespace dyop {
namespace {

using toi_internal::ImpactBand;
using toi_internal::RigidPair;
using toi_internal::ToiMemory;
using toi_internal::ToiSubject;
using toi_internal::WorkspaceUse;

using RigidSearch = toi_internal::BestFirstSearch<RigidPair>;

ImpactBand band_of(const Shape& a, const Shape& b, const ToiOptions& options) {
  return {options.target_distance,
          toi_internal::tolerance_of(options, a.bounding_radius(), b.bounding_radius())};
}

}  // namespace

ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options) {
  toi_internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  const ImpactBand band = band_of(a, b, options);
  RigidPair pair(a, X_WA, b, X_WB, interval, band);
  ToiMemory memory;
  return RigidSearch(pair, interval, options, band, memory).run();
}

ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace) {
  return toi_internal::time_of_listed_impact(a, X_WA, b, X_WB, interval, options, workspace,
                                             {&distance_internal::kRootPair, 1});
}

ToiResult resume_time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                const Motion& X_WB, const TimeInterval& interval,
                                const ToiOptions& options, ToiWorkspace& workspace) {
  toi_internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  const WorkspaceUse use(workspace);
  toi_internal::require_resumable(use.memory(),
                                  ToiSubject(&a, &X_WA, &b, &X_WB, interval, options));
  const ImpactBand band = band_of(a, b, options);
  RigidPair pair(a, X_WA, b, X_WB, interval, band);
  return RigidSearch(pair, interval, options, band, use.memory()).resume();
}

ToiResult toi_internal::time_of_listed_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                              const Motion& X_WB, const TimeInterval& interval,
                                              const ToiOptions& options, ToiWorkspace& workspace,
                                              std::span<const BoxPair> pairs) {
  require_valid_query(a, X_WA, b, X_WB, interval, options);
  const WorkspaceUse use(workspace);
  const ImpactBand band = band_of(a, b, options);
  RigidPair pair(a, X_WA, b, X_WB, interval, band, pairs);
  use.memory().subject = ToiSubject(&a, &X_WA, &b, &X_WB, interval, options);
  return RigidSearch(pair, interval, options, band, use.memory()).run();
}

}  // namespace dyop
