// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "dyop/haptics/haptic_tick.h"
#include "tissue_path.h"

namespace dyop::testing {

/// The tool's motion from one waypoint to the next: its origin on a line, turning at a constant
/// rate about one axis, as its hinges do.
class ToolSpanPath {
 public:
  ToolSpanPath(const ToolPose& from, const ToolPose& to);
  ToolPose at(Scalar s) const;
  /// Bound of the path of a point at `reach` from the tool's origin and from all hinges.
  Scalar travel(Scalar reach) const { return shift_.norm() + turn_ * reach; }
  /// How far such a point leaves its chord in a part of the way.
  Scalar bow(Scalar reach, Scalar part) const { return part * part * turn_ * turn_ * reach / 4; }

 private:
  ToolPose from_;
  ToolPose to_;
  Vector3 shift_;
  Vector3 axis_;
  Scalar angle_;
  Scalar turn_;  // with that of the hinges
};

/// A part of a tool's tick: s from s0 to s1 of a span, during `time`, which begins `later` than the
/// tissue's present.
struct SpanPart {
  const ToolSpanPath& path;
  Scalar s0;
  Scalar s1;
  Scalar time;
  Scalar later = 0;
};

struct SpanDistance {
  Scalar least = kInfinity;     ///< of the samples; at most the cap
  Scalar proven = kInfinity;    ///< also between them: least of (d0 + d1 - travel) / 2
  Scalar at_start = kInfinity;  ///< at least the cap if there is no pair nearer than it
  Scalar at_end = kInfinity;
  std::int64_t samples = 0;
};

/// Longer motions are checked piece by piece, so that few pairs come near in each.
inline constexpr Scalar kLongest = 1;

/// The triangles of a part of a tool.
struct SpanBody {
  std::vector<Vector3> vertices;  // in T, or in the hinge's frame at angle 0
  std::vector<TriangleIndices> triangles;
  std::optional<RigidPose> X_TJ = {};  // of its hinge, number `hinge`
  std::size_t hinge = 0;
  Scalar reach = 0;  // from T's origin

  RigidPose pose(const ToolPose& tool) const;
};
std::vector<SpanBody> span_bodies(const HapticTool& tool);

/// Samples the distance of a part of a tool from an obstacle over a part of a span, both moving,
/// with plain_distance() of all pairs of triangles whose boxes come closer than `cap`.
class SpanOracle {
 public:
  explicit SpanOracle(const HapticTool& tool) : parts_(span_bodies(tool)) {}

  std::size_t part_count() const { return parts_.size(); }
  /// Until it is proven to stay at `wanted`, or the samples are closer than `resolution`.
  SpanDistance check(std::size_t part, const SpanPart& span, const TissuePath& tissue, Scalar cap,
                     Scalar wanted, Scalar resolution);

 private:
  struct Pair {
    std::size_t tool, tissue;
    Scalar distance, s;  // where it was measured last
  };

  SpanDistance check_short(const SpanPart& span, Scalar cap);
  void find_pairs(const SpanBody& part, const SpanPart& span, const TissuePath& tissue, Scalar cap);
  Scalar distance_at(Scalar s);
  void sample(Scalar s0, Scalar d0, Scalar s1, Scalar d1);

  std::vector<SpanBody> parts_;
  // The current check.
  const SpanBody* part_ = nullptr;
  const SpanPart* span_ = nullptr;
  const TissuePath* tissue_ = nullptr;
  Scalar cap_ = 0, wanted_ = 0, resolution_ = 0, travel_ = 0;
  SpanDistance result_;
  std::vector<AlignedBox> boxes_;
  std::vector<std::size_t> near_;
  std::vector<Pair> pairs_;
};

}  // namespace dyop::testing
