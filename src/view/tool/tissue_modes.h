// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::view_internal {

/// Snapshots of a mesh as sums of few displacement fields: tissue that breathes or is pressed moves
/// in few ways. Every snapshot that the fields known so far do not give closely enough adds the
/// rest as a new one, while there is room.
class TissueModes {
 public:
  /// @param tolerance Greatest error of a vertex, length, > 0.
  TissueModes(std::vector<Vector3> vertices, Scalar tolerance, std::size_t most_modes);

  /// Returns the weights of the modes known then; later ones have the weight zero.
  std::vector<Scalar> add(std::span<const Vector3> snapshot);

  const std::vector<std::vector<Vector3>>& modes() const { return modes_; }
  /// Greatest error of a vertex of any snapshot.
  Scalar worst() const { return worst_; }

 private:
  std::vector<Vector3> vertices_;
  Scalar tolerance_;
  std::size_t most_modes_;
  std::vector<std::vector<Vector3>> modes_;  // orthonormal, over all vertices
  std::vector<Vector3> rest_;
  Scalar worst_ = 0;
};

}  // namespace dyop::view_internal
