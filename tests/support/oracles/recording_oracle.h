// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dyop/scene_io/run_recording.h"
#include "dyop/scene_io/scene_file.h"
#ifdef DYOP_HAS_RECORDING
#include "dyop/recording/recording_reader.h"
#endif

namespace dyop::testing {

/// What an independent look at a recording found.
struct RecordingReport {
  std::int64_t steps = 0;
  std::int64_t poses = 0;           ///< times at which all bodies were posed
  std::int64_t pairs = 0;           ///< pairs of bodies looked at, over all times
  std::int64_t examined_pairs = 0;  ///< those whose boxes meet: decided triangle by triangle
  std::vector<std::string> faults;  ///< in words, the first hundred; empty: nothing is wrong
};

/// Checks that no two bodies of a recorded run intersect, at the recorded times and at
/// `times_between` more in every part between two of them, and that the steps follow each other
/// from 0 to the end without a gap.
///
/// Two surfaces of triangles are decided by CGAL (oracle_meshes_intersect), a pair with a rounded
/// body (sphere, capsule) by fast_oracle_distance: no code of the library but the recording's
/// reader and RigidPose takes part. A body wholly inside a solid is looked for at the first and
/// at the last time only: nothing gets inside without surfaces that meet on the way.
///
/// @param scene The scene that was run: its shapes, and the pairs that are not examined.
RecordingReport check_recording(const Scene& scene, const RunRecording& recording,
                                int times_between);

#ifdef DYOP_HAS_RECORDING
/// The same for a recording in HDF5: every committed step at its ends and at `times_between` times
/// in it.
RecordingReport check_recording(const Scene& scene, const RecordingReader& recording,
                                int times_between);
#endif

}  // namespace dyop::testing
