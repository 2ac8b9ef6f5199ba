// SPDX-License-Identifier: BSD-3-Clause
#include "cli/scene_run.h"

#include <algorithm>
#include <cmath>

namespace dyop::cli {

// A remainder shorter than this fraction of a step is not a step of its own.
// literal: only rounding of end / step leaves such a remainder
constexpr Scalar kNoStep = 1e-6;

void step_through(const Scene& scene, const std::stop_token& stop, World& world,
                  const std::function<void(const AdvanceReport&)>& after_step) {
  const auto count =
      std::max<std::int64_t>(1, std::llround(std::ceil(scene.end_time / scene.step - kNoStep)));
  for (std::int64_t k = 1; k <= count; ++k) {
    const Scalar t = k == count ? scene.end_time : Scalar(k) * scene.step;
    const AdvanceReport report = world.advance(t - world.time(), {stop, std::nullopt});
    after_step(report);
    if (report.status != AdvanceStatus::Completed) return;
  }
}

nlohmann::ordered_json bodies_json(const World& world) {
  const auto numbers = [](const auto& v) { return std::vector<Scalar>(v.begin(), v.end()); };
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const BodyId id : world.bodies()) {
    const MotionState state = world.state(id);
    const Quaternion q = state.X_WB.quaternion();
    nlohmann::ordered_json body;
    body["name"] = world.body(id).name;
    body["position"] = numbers(state.X_WB.translation());
    body["quaternion"] = std::vector<Scalar>{q.w(), q.x(), q.y(), q.z()};
    body["linear_velocity"] = numbers(state.twist.v_WB);
    body["angular_velocity"] = numbers(state.twist.w_WB);
    body["asleep"] = world.is_asleep(id);
    list.push_back(std::move(body));
  }
  return list;
}

}  // namespace dyop::cli
