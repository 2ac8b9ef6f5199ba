// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "check/trusted/haptic_recording.h"
#include "check/trusted/prover.h"

/// Which motions of a haptic run are proven. TRUSTED.
namespace dyop_check {

/// Two things, and a motion in which they were not proven apart.
struct HapticFinding {
  std::string a;
  std::string b;
  std::int64_t tick = 0;
  double distance = 0;  ///< refuted: an upper bound of it
  double margin = 0;
};

struct HapticVerdict {
  std::int64_t motions = 0;
  std::int64_t proven = 0;    ///< pairs of bodies, each over a motion, that keep their margin
  std::int64_t leaving = 0;   ///< that do not touch; the run says that they leave a margin
  std::int64_t crossing = 0;  ///< not proven; the run says that the tool crosses something
  std::int64_t placed = 0;    ///< times tools were put elsewhere, the start included
  std::int64_t replaced = 0;  ///< meshes put in the place of others
  std::int64_t node_pairs = 0;
  Findings<HapticFinding> refuted;
  Findings<HapticFinding> undecided;
};

/// Proves that every part of every tool keeps its margin from every tissue, hard region and part of
/// another tool at all times of every motion; from the end of one to the start of the next nothing
/// moves.
HapticVerdict check_haptic_run(const HapticRecording& recording, const CheckOptions& options);

}  // namespace dyop_check
