// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/haptics/haptic_scene.h"

namespace dyop::testing {

/// Where an obstacle's vertices are, from the snapshots that were given: straight lines from one to
/// the next, each over its duration; at rest without a next one, and after another mesh. A rigid
/// obstacle always rests.
class TissuePath {
 public:
  explicit TissuePath(const ToolObstacle& obstacle);

  /// The snapshot after all those that are waiting.
  void give(std::vector<Vector3> vertices, Scalar duration);
  /// Another mesh, at rest, after all that is waiting.
  void give_mesh(std::vector<Vector3> vertices, std::vector<TriangleIndices> triangles);
  /// At the start of a tick: obstacles at rest set off.
  void start_tick();
  /// Begins the next line, where one has ended but for rounding.
  void go_on();
  std::int64_t lines_begun() const { return lines_begun_; }
  /// The last line that was begun is another mesh, at rest.
  bool is_new_mesh() const { return is_new_mesh_; }
  /// How long the current line lasts; infinite at rest.
  Scalar time_left() const;
  void pass(Scalar time);

  Vector3 place(std::size_t vertex, Scalar later = 0) const;
  Triangle triangle(std::size_t number, Scalar later = 0) const;
  std::size_t vertex_count() const { return begin_.size(); }
  /// Largest displacement of a vertex in this time on the current line.
  Scalar travel(Scalar time) const;
  /// The triangles that may come into a box on the current line.
  void find_near(const AlignedBox& box, std::vector<std::size_t>& found) const;

 private:
  struct Next {
    std::vector<Vector3> vertices;
    std::vector<TriangleIndices> triangles;  // of another mesh
    Scalar duration;                         // 0: another mesh
  };

  void fit_boxes();
  Scalar fraction(Scalar later) const;

  std::vector<Vector3> begin_, end_;
  std::vector<TriangleIndices> triangles_;
  std::vector<AlignedBox> boxes_, block_boxes_;  // over the whole line
  std::deque<Next> next_;
  Scalar duration_ = 0;  // 0: at rest
  Scalar elapsed_ = 0;
  bool is_new_mesh_ = false;
  std::int64_t lines_begun_ = 0;
  Scalar largest_ = 0;  // displacement over the line
};

}  // namespace dyop::testing
