// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/haptic_recording.h"
#include "dyop/view/page_encoder.h"
#include "view/tool/tool_page.h"

namespace dyop::view_internal {

inline constexpr std::size_t kMostModes = 48;

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

/// An obstacle becomes another mesh, which is drawn as another body.
struct TissueSwap {
  Scalar time;
  std::size_t obstacle;
  BodyId body;
};

/// Where the tissue of a recorded run is: from snapshot to snapshot, as ticks took them.
class TissueTracks {
 public:
  /// @param tolerance How far drawn vertices may be from the recorded ones.
  TissueTracks(const HapticRecordingReader& reader, const std::filesystem::path& file,
               const ToolBodies& bodies, Scalar tolerance);

  /// Adds the deformations, and a body for every later mesh, to a scene with the other bodies.
  void add_to(PageScene& scene) const;
  /// In the order of time.
  const std::vector<TissueSwap>& swaps() const { return swaps_; }

 private:
  // From one snapshot to the next.
  struct Motion {
    std::size_t keyframes;  // before it
    Scalar duration;        // to its goal
    std::vector<Scalar> start;
    std::vector<Scalar> goal;
    Scalar end = 1;  // part of the way at which it ends
  };
  // One mesh, and how it deforms.
  struct Track {
    BodyId body;
    std::size_t obstacle;
    std::shared_ptr<const TriangleMesh> mesh;  // null: as the scene has it
    TissueModes modes;
    std::vector<Scalar> times;
    std::vector<std::vector<Scalar>> weights;
    std::vector<Motion> motions = {};

    void add_keyframe(Scalar t, const std::vector<Scalar>& at) {
      times.push_back(t);
      weights.push_back(at);
    }
    void remove_keyframes(std::size_t left) {
      times.resize(left);
      weights.resize(left);
    }
    void take_back();
    void end_motion(Scalar part, Scalar t);
  };

  Track start(std::size_t obstacle, Scalar t, const RecordedSnapshot* mesh);
  void add(std::size_t obstacle, Scalar t, const RecordedSnapshot& snapshot);
  void turn(Scalar t, const RecordedTurn& turn);
  void delay(Scalar by, Scalar t);

  const HapticScene& scene_;
  const ToolBodies& bodies_;
  const Scalar tolerance_;
  std::vector<Track> tracks_;
  std::vector<std::optional<std::size_t>> shown_;  // per obstacle: its last track
  std::vector<std::int64_t> given_;                // per obstacle, without what was taken back
  std::size_t mesh_count_ = 0;
  std::vector<TissueSwap> swaps_;
};

}  // namespace dyop::view_internal
