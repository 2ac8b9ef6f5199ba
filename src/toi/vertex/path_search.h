// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "dyop/toi/vertex_time_of_impact.h"
#include "toi/impact_band.h"
#include "toi/nearest_difference.h"

namespace dyop::toi_internal {

template <int N>
using Values = std::array<Scalar, static_cast<std::size_t>(N)>;

// A fixed direction n and what it proves: the slab gap min_k n.D_k(s) is a minimum of linear
// functions, given by its values at both ends.
template <int N>
struct PathSlab {
  Vector3 nhat = Vector3::UnitX();
  Values<N> at_begin{};
  Values<N> at_end{};

  Scalar value(std::size_t k, Scalar s) const { return (1 - s) * at_begin[k] + s * at_end[k]; }
  Scalar gap(Scalar s) const {
    Scalar least = value(0, s);
    for (std::size_t k = 1; k < at_begin.size(); ++k) least = std::min(least, value(k, s));
    return least;
  }
};

// The pair at one instant s in [0, 1].
template <int N>
struct Instant {
  Scalar s = 0;
  Differences<N> corners;
  NearestDifference<N> nearest;
  PathSlab<N> slab;
  Scalar lower = 0;
  Scalar upper = 0;
};

// What a search found, in the parameter s.
template <int N>
struct Finding {
  ToiStatus status = ToiStatus::Separated;
  Instant<N> instant;
};

// Conservative advancement of one pair, given by the differences of its points at both ends of the
// interval: s runs from 0 to 1. `paths` are the same points, for the exact decision.
template <int N>
class PathSearch {
 public:
  using Paths = std::conditional_t<N == 3, VertexFacePaths, EdgeEdgePaths>;

  PathSearch(const Differences<N>& begin, const Differences<N>& end, const Paths& paths,
             const VertexToiOptions& options);

  // Whether one of the axes separates the pair at all times.
  bool is_apart_along_an_axis() const;
  Finding<N> run();

  Scalar noise() const { return noise_; }
  std::int64_t steps() const { return steps_; }

 private:
  PathSlab<N> make_slab(const Vector3& nhat) const;
  Instant<N> make_instant(Scalar s);
  void use_normal(const Vector3& normal, Instant<N>& instant) const;
  bool is_apart_between(const Instant<N>& first, const Instant<N>& last, Scalar floor) const;
  Scalar slab_end(const Instant<N>& here, Scalar floor) const;
  Scalar closing_speed(const Instant<N>& here) const;
  Instant<N> advance(const Instant<N>& here, Scalar safe_until, Scalar floor);
  bool may_touch();
  Finding<N> found(ToiStatus status, const Instant<N>& instant);

  const Differences<N> begin_;
  const Differences<N> end_;
  const Paths& paths_;
  const VertexToiOptions& options_;
  const bool is_exact_;
  Scalar noise_ = 0;
  const ImpactBand band_;
  Scalar reach_ = 1;  // the reach of the next turning direction
  std::optional<bool> has_contact_;
  std::int64_t steps_ = 0;
};

}  // namespace dyop::toi_internal
