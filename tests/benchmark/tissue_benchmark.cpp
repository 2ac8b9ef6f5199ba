// SPDX-License-Identifier: BSD-3-Clause

// Joint steps of a soft liver with a tool that presses it, then strokes along it: processor time of
// a step, in milliseconds, and that of building the model. The tool is a ball or, with the half
// width of a plate, that.
//   tissue_benchmark [CUBE EDGE in mm [TRIANGLES [STIFFNESS in N/mm [PLATE in mm]]]]

#include <cstdio>
#include <cstdlib>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "dyop/io/haptic_scene_file.h"
#include "dyop/tissue/soft_tissue.h"
#include "mesh_pair.h"

namespace dyop::testing {
namespace {

// Times the model's steps.
class TimedModel final : public TissueModel {
 public:
  explicit TimedModel(std::shared_ptr<TissueModel> model) : model_(std::move(model)) {}
  ContactSearch search() const override { return model_->search(); }
  void step(const TissueNews& news, std::span<Vector3> vertices) override {
    const Scalar start = processor_time();
    model_->step(news, vertices);
    times.push_back(1e-3 * (processor_time() - start));
    contacts = std::max(contacts, news.contacts.size());
  }
  std::vector<Scalar> times;
  std::size_t contacts = 0;

 private:
  std::shared_ptr<TissueModel> model_;
};

int run(Scalar edge, std::size_t triangles, Scalar stiffness, Scalar plate) {
  constexpr Scalar kBall = 6, kTop = 35, kFriction = 0.3;
  constexpr std::int64_t kTicks = 3000;
  const AnatomyMesh liver = make_liver(triangles);
  HapticScene scene;
  std::shared_ptr<const Shape> tool = std::make_shared<Sphere>(kBall);
  if (plate > 0) tool = std::make_shared<Box>(Vector3(plate, plate, kBall));
  scene.tool.push_back({tool, RigidPose(), {}});
  scene.X_WT = RigidPose(Vector3(0, 0, kTop + kBall + 8));
  ToolObstacle obstacle;
  obstacle.name = "liver";
  obstacle.vertices = liver.vertices;
  obstacle.triangles = liver.triangles;
  obstacle.friction = kFriction;
  scene.obstacles.push_back(obstacle);
  HapticOptions options;
  options.coupling.stiffness.setConstant(stiffness);
  options.coupling.rotational_stiffness.setConstant(2000 * stiffness);
  options.rest_offset = 0.05;
  options.recovery_speed = 50;
  SoftTissueOptions tissue;
  tissue.material = {5e-3, 0.45, 1.05e-9, 2, 0.05};
  tissue.cube_edge = edge;
  tissue.period = 0.02;
  tissue.fixed.emplace_back(Vector3(-100, -100, -100), Vector3(100, 100, -20));

  const Scalar start = processor_time();
  const auto soft = std::make_shared<SoftTissueModel>(
      SoftTissue(TriangleMesh(liver.vertices, liver.triangles), tissue),
      ModelledObstacle{options.coupling, {}, options.rest_offset, kFriction});
  std::printf("%zu cubes, %zu nodes, %zu triangles; built in %.0f ms\n",
              soft->tissue().cube_count(), soft->tissue().node_count(), liver.triangles.size(),
              1e-3 * (processor_time() - start));
  const auto model = std::make_shared<TimedModel>(soft);
  TissueFeed feed;
  feed.period = tissue.period;
  feed.model = model;
  RunnerOptions runner;
  runner.is_paced = false;
  runner.ticks = kTicks;
  HapticSession session(scene, options);
  run_session(
      session,
      [&](std::int64_t k) {
        const Scalar t = 1e-3 * Scalar(k);
        const Scalar depth = 15 * std::min(Scalar{1}, t), aside = std::max(Scalar{0}, t - 1.5);
        return DevicePose(RigidPose(Vector3(20 * aside, 0, kTop + kBall + 5 - depth)));
      },
      {feed}, {}, runner);
  std::printf("%zu steps, up to %zu contacts: median %.1f ms, 99 %% %.1f, worst %.1f\n",
              model->times.size(), model->contacts, quantile(model->times, 0.5),
              quantile(model->times, 0.99), quantile(model->times, 1.0));
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace dyop::testing

int main(int count, char** arguments) {
  const double edge = count > 1 ? std::atof(arguments[1]) : 7.4;
  const int triangles = count > 2 ? std::atoi(arguments[2]) : 30000;
  const double stiffness = count > 3 ? std::atof(arguments[3]) : 1;
  const double plate = count > 4 ? std::atof(arguments[4]) : 0;
  return dyop::testing::run(edge, std::size_t(triangles), stiffness, plate);
}
