// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::testing {

/// A tool's motion from one pose to another: its origin on a line, turning at a constant rate about
/// one axis, by less than half a turn.
struct ToolSpan {
  RigidPose X_WT0;
  RigidPose X_WT1;

  RigidPose at(Scalar s) const;
};

/// Vertices of a tissue that move on straight lines in the meantime.
struct TissueSpan {
  std::vector<Vector3> start;
  std::vector<Vector3> end;

  std::vector<Vector3> at(Scalar s) const;
};

/// The least distance of two moving surfaces over a span, by sampling.
struct SampledDistance {
  Scalar least = kInfinity;   ///< of the samples
  Scalar proven = kInfinity;  ///< also between them: least of (d0 + d1 - travel) / 2
  int samples = 0;
};

/// Samples until `proven` is at least `wanted`, or less than `resolution` is left between samples.
/// The travel is measured on the vertices; nothing of the tool room is used.
SampledDistance sample_distance(const TriangleMesh& tool, const ToolSpan& tool_span,
                                const std::vector<TriangleIndices>& tissue,
                                const TissueSpan& tissue_span, Scalar wanted, Scalar resolution);

}  // namespace dyop::testing
