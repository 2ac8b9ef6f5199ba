// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dyop/io/scene_file.h"
#include "dyop/view/page_encoder.h"

namespace dyop::testing {

/// A run of a scene, the blocks of its page, and what the page must show, taken from the World's
/// own motions.
struct PageCase {
  PageScene scene;
  std::vector<std::string> blocks;
  std::vector<CommittedStep> steps;
  std::vector<ImpactEvent> impacts;
  std::size_t joints = 0;

  /// The pose of a body on the committed motion; for the page at an earlier step's end the later
  /// one counts.
  RigidPose pose(std::size_t slot, Scalar t) const;
  Scalar end_time() const { return steps.back().interval.end; }

  /// For check_page.mjs: `count` poses at random times, and all impacts.
  nlohmann::json facts(int count) const;
};

/// Steps the scene to its end, or `end_time` if that is sooner.
PageCase run_page_case(const Scene& scene, Scalar end_time = kInfinity);

}  // namespace dyop::testing
