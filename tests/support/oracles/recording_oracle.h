// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dyop/io/scene_file.h"
#ifdef DYOP_HAS_RECORDING
#include "dyop/io/recording.h"
#endif

namespace dyop::testing {

/// Result of an independent check of a recording.
struct RecordingReport {
  std::int64_t steps = 0;
  std::int64_t poses = 0;           ///< times at which all bodies were posed
  std::int64_t pairs = 0;           ///< pairs of bodies considered, over all times
  std::int64_t examined_pairs = 0;  ///< those whose boxes meet: decided triangle by triangle
  std::vector<std::string> faults;  ///< descriptions of the first hundred; empty: no fault
};

/// Checks that no two bodies of a run intersect in the poses that a page or a glTF file draws, at
/// each of `times`, which start with 0 and increase.
///
/// Two surfaces of triangles are decided by CGAL (oracle_meshes_intersect), a pair with a rounded
/// body (sphere, capsule) by fast_oracle_distance: of the library only the recording's reader and
/// RigidPose are used. Whether a body is wholly inside a solid is checked only at the first and the
/// last time: nothing gets inside without surfaces that meet on the way in.
///
/// @param scene The scene that was run: its shapes, and the pairs that are not examined.
RecordingReport check_poses(const Scene& scene, const std::vector<Scalar>& times,
                            const std::function<RigidPose(BodyId body, std::size_t time)>& pose);

#ifdef DYOP_HAS_RECORDING
/// The same for a recorded run, at the ends of every committed step and at `times_between` times in
/// it; and that the steps follow each other from 0 to the end without a gap.
RecordingReport check_recording(const Scene& scene, const RecordingReader& recording,
                                int times_between);
#endif

}  // namespace dyop::testing
