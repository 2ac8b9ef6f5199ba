// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <span>
#include <vector>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/haptics/haptic_scene.h"

namespace dyop::testing {

/// A deforming obstacle that is cut again and again: which of its triangles are left, and which
/// vertex of the mesh it had at the start each vertex of what is left was.
class TissueCuts {
 public:
  explicit TissueCuts(const ToolObstacle& obstacle);

  /// The vertices of what is left, from those of the whole.
  std::vector<Vector3> gather(std::span<const Vector3> whole) const;
  /// Takes away the triangles with a corner in a ball, and the vertices that are then unused;
  /// nothing if less than half of the obstacle would be left.
  /// @param whole Where the vertices of the whole are.
  /// @return Whether anything was taken away.
  bool take_away(const Vector3& center, Scalar radius, std::span<const Vector3> whole);
  /// Gives both sides of a plane their own vertices.
  void slit(const Vector3& center, const Vector3& normal, std::span<const Vector3> whole);
  /// Back to the whole.
  void sew();
  /// What a scene's own cut has left.
  void take(const TissueMesh& mesh);

  const std::vector<TriangleIndices>& triangles() const { return triangles_; }
  bool is_whole() const { return triangles_.size() == all_.size(); }

 private:
  const std::vector<TriangleIndices> all_;
  const std::size_t count_;  // of vertices of the whole
  std::vector<TriangleIndices> triangles_;
  std::vector<std::size_t> source_;
};

}  // namespace dyop::testing
