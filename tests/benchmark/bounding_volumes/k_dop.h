// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "benchmark/bounding_volumes/bounding_volumes.h"

namespace dyop::testing {

/// A direction v as the sum of weights[i] * d[i], weights[i] >= 0 and d[i] the normal, not of unit
/// length, of planes[i]: a k-DOP reaches no farther along v than the same sum of its reaches along
/// d[i].
struct PlaneCone {
  std::array<int, 3> planes{};
  Vector3 weights = Vector3::Zero();
};

/// The intersection of k half spaces along fixed directions of the body [Klosowski1998]: the axes
/// and the diagonals of faces (k = 18), and of cubes (k = 26).
template <int k>
struct Dop {
  static constexpr int kAxes = k / 2;

  /// The normals of one body's planes in the frame of the other.
  struct Placement {
    struct Axis {
      PlaneCone cone;     ///< of the normal, in the frame of the other body
      Scalar offset = 0;  ///< of the origin of B from that of A along the normal
      Vector3 normal_A;
      Scalar inverse_length = 1;
    };
    explicit Placement(const RigidPose& pose);

    RigidPose X_AB;
    std::array<Axis, kAxes> of_a;
    std::array<Axis, kAxes> of_b;
  };
  static constexpr const char* kName = k == 18 ? "18-DOP" : "26-DOP";

  static Dop fit(std::span<const Vector3> points);

  Vector3 center() const {
    return {(reach[0] - reach[1]) / 2, (reach[2] - reach[3]) / 2, (reach[4] - reach[5]) / 2};
  }

  /// Largest coordinate along direction i at 2i, along its opposite at 2i + 1.
  std::array<Scalar, k> reach;
};

/// The largest gap along the normals of both and the line of centers. How far a k-DOP reaches along
/// a direction that is not one of its own is bounded by PlaneCone: there is no short formula.
template <int k>
Separation separation(const typename Dop<k>::Placement& placement, const Dop<k>& a,
                      const Dop<k>& b);

}  // namespace dyop::testing
