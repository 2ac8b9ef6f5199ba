// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/task_arena.h>

#include <cmath>
#include <mutex>
#include <optional>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::geometry_internal {

/// The surface of a core, built by one thread when it is first asked for: most queries of boxes and
/// capsules take closed forms and never need it.
class SurfaceOnDemand {
 public:
  /// `make` returns the TriangleMesh; the same one in every call.
  template <typename Make>
  const TriangleMesh& get(const Make& make) const {
    // Isolated: while it waits for the tree to be built, this thread must not take up a task that
    // asks for the same surface.
    std::call_once(is_made_,
                   [&] { tbb::this_task_arena::isolate([&] { surface_.emplace(make()); }); });
    return *surface_;
  }

 private:
  mutable std::once_flag is_made_;
  mutable std::optional<TriangleMesh> surface_;
};

inline void require_density(Scalar density) {
  DYOP_REQUIRE(std::isfinite(density) && density > 0, "density must be finite and > 0, not ",
               density);
}

inline void require_length(const char* what, Scalar length) {
  DYOP_REQUIRE(length > 0 && length <= kLargestCoordinate, what, " must be > 0 and at most ",
               kLargestCoordinate, ", not ", length);
}

// Returns mass properties whose mass neither overflowed nor underflowed, so that it can divide.
inline MassProperties require_representable(const MassProperties& properties) {
  DYOP_REQUIRE(std::isnormal(properties.mass) && properties.mass > 0 &&
                   properties.I_BBcm.allFinite() && properties.p_BoBcm.allFinite(),
               "mass properties are out of the range of double: mass ", properties.mass);
  return properties;
}

}  // namespace dyop::geometry_internal
