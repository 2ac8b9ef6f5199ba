// SPDX-License-Identifier: BSD-3-Clause

// A World with one tool that a spring drags along a mesh, in steps of a millisecond: the device,
// whose next pose is known one step at a time, moves at a unit of length per second below the
// surface of a lumpy sphere of radius one, and a spring pulls the tool after it:
//   world_drag_benchmark [STEPS [TOOL]]    TOOL: the first letters of one
// Prints the processor time of single steps in microseconds.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "dyop/dynamics/world.h"
#include "dyop/geometry/primitives.h"
#include "mesh_pair.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"

namespace dyop::testing {
namespace {

constexpr Scalar kStep = 1e-3;

TriangleMesh lumpy_sphere(int subdivisions) {
  auto arrays = testing::icosphere(subdivisions);
  for (Vector3& p : arrays.vertices) {
    p *= 1 + 0.005 * std::sin(7 * p.x()) * std::sin(6 * p.y()) * std::sin(5 * p.z());
  }
  return arrays.mesh();
}

// Around the organ beside its equator; at height 1 about on its surface.
Vector3 place(Scalar t, Scalar height) {
  return height * Vector3(std::cos(t), std::sin(t), 0.3 * std::sin(1.7 * t)).normalized();
}

void drag(const std::string& name, const std::shared_ptr<const Shape>& tool_shape, int steps) {
  WorldOptions options;
  options.thread_count = 1;
  options.records_motions = false;
  World world(options);

  BodyDefinition organ;
  organ.name = "organ";
  organ.kind = BodyKind::Static;
  organ.shape = std::make_shared<TriangleMesh>(lumpy_sphere(5));
  organ.friction = 0.2;
  const BodyId organ_id = world.add_body(organ);

  const Scalar radius = tool_shape->bounding_radius();
  BodyDefinition tool = dynamic_body("tool", tool_shape, place(0, 1.03 + radius));
  tool.restitution = 0;
  tool.friction = 0.2;
  const Scalar mass = tool.mass_properties.mass;
  const BodyId tool_id = world.add_body(tool);

  BodyDefinition device;
  device.name = "device";
  device.kind = BodyKind::Kinematic;
  device.shape = std::make_shared<Sphere>(0.01);
  device.motion = std::make_shared<RestMotion>(RigidPose(place(0, 1)));
  const BodyId device_id = world.add_body(device);
  world.set_pair_enabled(device_id, tool_id, false);
  world.set_pair_enabled(device_id, organ_id, false);

  SpringDefinition spring;
  spring.a = device_id;
  spring.b = tool_id;
  spring.rest_length = 0;
  const Scalar frequency = 50;  // radians per second, critically damped
  spring.stiffness = mass * frequency * frequency;
  spring.damping = 2 * mass * frequency;
  world.add_spring(spring);

  std::vector<Scalar> times;
  std::int64_t unconverged = 0, stalls = 0, touching = 0;
  for (int k = 1; k <= steps; ++k) {
    world.set_next_pose(device_id, RigidPose(place(k * kStep, 0.97)), k * kStep);
    AdvanceReport report;
    times.push_back(microseconds([&] { report = world.advance(kStep); }));
    unconverged += report.work.unconverged;
    stalls += report.work.stalls;
    touching += report.work.contacts > 0;
  }
  const Scalar behind =
      (world.state(tool_id).X_WB.translation() - place(steps * kStep, 0.97)).norm();
  std::printf("%-24s", name.c_str());
  for (const Scalar part : {0.5, 0.99, 0.999, 1.0}) std::printf(" %8.1f", quantile(times, part));
  std::printf(" %8.1f %9lld %11lld %7lld %7.3f\n", mean(times), static_cast<long long>(touching),
              static_cast<long long>(unconverged), static_cast<long long>(stalls), behind);
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  using namespace dyop;
  const int steps = argc > 1 ? std::atoi(argv[1]) : 6000;
  const std::string only = argc > 2 ? argv[2] : "";
  if (steps <= 0) {
    std::fprintf(stderr, "usage: world_drag_benchmark [STEPS [TOOL]]\n");
    return 2;
  }
  std::printf("%-24s %8s %8s %8s %8s %8s %9s %11s %7s %7s\n", "us a step", "median", "99 %",
              "99.9 %", "worst", "mean", "touching", "unconverged", "stalls", "behind");
  const auto drag = [&](const std::string& name, const std::shared_ptr<const Shape>& shape) {
    if (name.compare(0, only.size(), only) == 0) testing::drag(name, shape, steps);
  };
  drag("ball", std::make_shared<Sphere>(0.1));
  drag("capsule", std::make_shared<Capsule>(0.05, 0.15));
  drag("box", std::make_shared<Box>(Vector3(0.1, 0.06, 0.04)));
  drag("torus, 800 triangles",
       std::make_shared<TriangleMesh>(testing::torus(0.1, 0.035, 20, 20).mesh()));
  return 0;
}
