// SPDX-License-Identifier: BSD-3-Clause
#include "view/page_case.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "dyop/view/live_server.h"

namespace dyop::testing {
namespace {

nlohmann::json numbers(const auto& vector) {
  return std::vector<Scalar>(vector.begin(), vector.end());
}

nlohmann::json pose_json(const RigidPose& X) {
  const Quaternion q = X.quaternion();
  return {{"p", numbers(X.translation())}, {"q", {q.x(), q.y(), q.z(), q.w()}}};
}

}  // namespace

RigidPose PageCase::pose(std::size_t slot, Scalar t) const {
  const auto next = std::upper_bound(
      steps.begin(), steps.end(), t,
      [](Scalar value, const CommittedStep& step) { return value < step.interval.begin; });
  return std::prev(next)->motions[slot]->pose(t);
}

nlohmann::json PageCase::facts(int count) const {
  std::mt19937 random(17);
  std::uniform_real_distribution<Scalar> any_time(scene.begin_time, end_time());
  std::uniform_int_distribution<std::size_t> any_body(0, scene.bodies.size() - 1);
  nlohmann::json facts;
  facts["end"] = end_time();
  facts["joints"] = joints;
  facts["poses"] = nlohmann::json::array();
  for (int k = 0; k < count; ++k) {
    const Scalar t = any_time(random);
    const std::size_t slot = any_body(random);
    nlohmann::json json = pose_json(pose(slot, t));
    json["body"] = slot;
    json["t"] = t;
    json["radius"] = scene.bodies[slot].shape->bounding_radius();
    facts["poses"].push_back(std::move(json));
  }
  facts["impacts"] = nlohmann::json::array();
  for (const ImpactEvent& event : impacts) {
    facts["impacts"].push_back({{"t", event.t},
                                {"a", event.a.slot},
                                {"b", event.b.slot},
                                {"X_WA", pose_json(pose(event.a.slot, event.t))},
                                {"X_WB", pose_json(pose(event.b.slot, event.t))}});
  }
  return facts;
}

PageCase run_page_case(const Scene& scene, Scalar end_time) {
  World world = make_world(scene);
  PageCase result;
  result.scene = RunFollower::scene_of(world, scene.title, scene.options.gravity_W, scene.end_time);
  result.scene.scene_file = scene.source;
  for (std::size_t k = 0; k < scene.bodies.size(); ++k) {
    result.scene.bodies[k].shape_name = scene.shape_names[k];
  }
  result.joints = scene.joints.size();
  const PageEncoder encoder(result.scene);
  result.blocks.push_back(encoder.head());
  RunFollower follower(scene.options.gravity_W);
  const auto count = std::llround(std::min(end_time, scene.end_time) / scene.step);
  AdvanceStatus status = AdvanceStatus::NotRun;
  for (long long k = 1; k <= count; ++k) {
    const AdvanceReport report = world.advance(Scalar(k) * scene.step - world.time());
    result.steps.insert(result.steps.end(), report.steps.begin(), report.steps.end());
    result.impacts.insert(result.impacts.end(), report.impacts.begin(), report.impacts.end());
    result.blocks.push_back(encoder.span(follower.follow(report, world)));
    status = report.status;
    if (status != AdvanceStatus::Completed) break;
  }
  result.blocks.push_back(encoder.span(RunFollower::ended(world, status, scene.end_time)));
  return result;
}

}  // namespace dyop::testing
