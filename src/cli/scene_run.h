// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
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

/// Number of steps of a scene; the last one may be shorter.
inline std::int64_t step_count(const Scene& scene) {
  // literal: a remainder below this part of a step is rounding of end / step, not another step.
  constexpr Scalar kNoStep = 1e-6;
  return std::max<std::int64_t>(1, std::llround(std::ceil(scene.end_time / scene.step - kNoStep)));
}

/// When step k of `count` ends, counted from 1.
inline Scalar step_end(const Scene& scene, std::int64_t k, std::int64_t count) {
  return k == count ? scene.end_time : Scalar(k) * scene.step;
}

}  // namespace dyop::cli
