#include "dyop/toi/time_of_impact.h"

#include "toi/best_first_search.h"
#include "toi/rigid/rigid_pair.h"
#include "toi/toi_check.h"
#include "toi/toi_memory.h"

namespace dyop {
namespace {

using internal::ImpactBand;
using internal::RigidPair;
using internal::ToiMemory;
using internal::ToiSubject;

using RigidSearch = internal::BestFirstSearch<RigidPair>;

}  // namespace

ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options) {
  internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  const ImpactBand band(options.target_distance, options.distance_tolerance);
  RigidPair pair(a, X_WA, b, X_WB, interval, band);
  ToiMemory memory;
  return RigidSearch(pair, interval, options, band, memory).run();
}

ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace) {
  internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  const ImpactBand band(options.target_distance, options.distance_tolerance);
  RigidPair pair(a, X_WA, b, X_WB, interval, band);
  const internal::WorkspaceUse use(workspace);
  ToiMemory& memory = use.memory();
  memory.subject = ToiSubject(&a, &X_WA, &b, &X_WB, interval, options);
  return RigidSearch(pair, interval, options, band, memory).run();
}

ToiResult resume_time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                const Motion& X_WB, const TimeInterval& interval,
                                const ToiOptions& options, ToiWorkspace& workspace) {
  internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  const internal::WorkspaceUse use(workspace);
  ToiMemory& memory = use.memory();
  internal::require_resumable(memory, ToiSubject(&a, &X_WA, &b, &X_WB, interval, options));
  const ImpactBand band(options.target_distance, options.distance_tolerance);
  RigidPair pair(a, X_WA, b, X_WB, interval, band);
  return RigidSearch(pair, interval, options, band, memory).resume();
}

}  // namespace dyop
