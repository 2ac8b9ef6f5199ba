// SPDX-License-Identifier: BSD-3-Clause
#include "cli/scene_run.h"

namespace dyop::cli {

void step_through(const Scene& scene, const std::stop_token& stop, World& world,
                  const std::function<void(const AdvanceReport&)>& after_step) {
  const std::int64_t count = step_count(scene);
  for (std::int64_t k = 1; k <= count; ++k) {
    const Scalar t = step_end(scene, k, count);
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
