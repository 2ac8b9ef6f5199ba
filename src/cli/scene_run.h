// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <stop_token>

#include "dyop/io/scene_file.h"

namespace dyop::cli {

/// Advances the world of a scene step by step to the end of the scene, or to where a step ends it.
void step_through(const Scene& scene, const std::stop_token& stop, World& world,
                  const std::function<void(const AdvanceReport&)>& after_step);

/// Names and states of all bodies.
nlohmann::ordered_json bodies_json(const World& world);

}  // namespace dyop::cli
