// SPDX-License-Identifier: BSD-3-Clause

// Steps a body that rolls, rocks or slides on fine facets and prints what its energy does:
// curved_soak SCENE FACETS H END [AZIMUTH [ROWS]]. SCENE: disc (rolls on a floor), half-disc (rocks),
// oloid (rolls down a slope), trough and bowl (a ball rolls in them), slick-trough (slides).
// Columns: time, kinetic energy, error of the energy, contacts, unconverged solves, stalls, rounds,
// and the processor time of a step.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <stdexcept>
#include <string>

#include "dyop/geometry/convex_hull.h"
#include "support/inputs/curved_meshes.h"
#include "support/inputs/world_scenes.h"
#include "support/world_energy.h"

namespace dyop::testing {
namespace {

using Arrays = MeshArrays;

Matrix3 turn_of(Scalar azimuth) {
  return rotation_from_vector(Vector3(0, 0, azimuth));
}

BodyDefinition fixed_mesh(const Arrays& arrays, Scalar friction, Scalar azimuth) {
  BodyDefinition body = floor_body(friction);
  body.shape = std::make_shared<TriangleMesh>(arrays.mesh());
  body.initial.X_WB = RigidPose(turn_of(azimuth), Vector3::Zero());
  return body;
}

void build(World& world, const std::string& scene, int facets, Scalar azimuth) {
  const Matrix3 R = turn_of(azimuth);
  BodyDefinition body;
  if (scene == "disc") {
    const auto shape = std::make_shared<TriangleMesh>(disc(1, 0.25, facets).mesh());
    body = dynamic_body("disc", shape, {0, 0, 1 + rest_gap(shape->bounding_radius())},
                        R * Vector3(1, 0, 0), R * Vector3(0, 1, 0));
    world.add_body(floor_body(1));
  } else if (scene == "half-disc") {
    const auto shape = std::make_shared<TriangleMesh>(half_disc(1, 0.25, facets).mesh());
    body = dynamic_body("half disc", shape, {0, 0, 1 + rest_gap(shape->bounding_radius())});
    body.initial.X_WB =
        RigidPose(rotation_from_vector(Vector3(0, 0.3, 0)), body.initial.X_WB.translation());
    world.add_body(floor_body(1));
  } else if (scene == "oloid") {
    const auto shape = std::make_shared<ConvexHull>(oloid_points(1, facets));
    Scalar lowest = 0;
    const Matrix3 lean = rotation_from_vector(Vector3(0.7853981633974483, 0, 0));
    for (const Vector3& p : oloid_points(1, facets)) lowest = std::min(lowest, (lean * p).z());
    body = dynamic_body("oloid", shape, {0, 0, -lowest + rest_gap(shape->bounding_radius())});
    body.initial.X_WB = RigidPose(lean, body.initial.X_WB.translation());
    world.add_body(floor_body(1));
  } else if (scene == "trough" || scene == "slick-trough" || scene == "bowl") {
    const Scalar friction = scene == "slick-trough" ? 0 : 1;
    world.add_body(fixed_mesh(scene == "bowl" ? bowl(1, 0.5, facets) : trough(1, 0.5, 0.7, facets),
                              friction, 0));
    const Scalar radius = 0.25;
    const Scalar way = 1 - radius - rest_gap(radius);
    const Scalar angle = 0.4;
    body = dynamic_body("ball", std::make_shared<Sphere>(radius),
                        way * Vector3(std::sin(angle), 0, -std::cos(angle)));
    body.friction = friction;
  } else {
    throw std::runtime_error("no scene " + scene);
  }
  if (scene != "slick-trough") body.friction = 1;
  body.restitution = 0;
  body.initial.X_WB = RigidPose(R, Vector3::Zero()) * body.initial.X_WB;
  world.add_body(body);
}

int run(const std::string& scene, int facets, Scalar h, Scalar end, Scalar azimuth, int rows) {
  WorldOptions options = earth_options();
  options.records_motions = false;
  options.thread_count = 1;
  World world(options);
  build(world, scene, facets, azimuth);
  const Scalar start = energy(world, options.gravity_W);
  const auto steps = std::lround(end / h);
  const long per_row = std::max(1L, steps / rows);
  StepStatistics work;
  std::clock_t clock = std::clock();
  std::printf("%8s %10s %11s %5s %5s %6s %6s %9s\n", "t", "kinetic", "error", "cont", "unc",
              "stall", "rounds", "ms/step");
  for (long k = 1; k <= steps; ++k) {
    const AdvanceReport report = world.advance(h);
    if (report.status != AdvanceStatus::Completed) {
      std::printf("t = %.4f: not completed\n", world.time());
      return 1;
    }
    work.contacts = std::max(work.contacts, report.work.contacts);
    work.unconverged += report.work.unconverged;
    work.stalls += report.work.stalls;
    work.rounds += report.work.rounds;
    if (k % per_row != 0 && k != steps) continue;
    const double ms = 1e3 * double(std::clock() - clock) / CLOCKS_PER_SEC / double(per_row);
    clock = std::clock();
    std::printf("%8.3f %10.4f %11.3e %5d %5d %6d %6d %9.3f\n", world.time(), world.kinetic_energy(),
                energy(world, options.gravity_W) - start, int(work.contacts), int(work.unconverged),
                int(work.stalls), int(work.rounds), ms);
    std::fflush(stdout);
    work = {};
  }
  return 0;
}

}  // namespace
}  // namespace dyop::testing

int main(int count, char** arguments) {
  try {
    if (count < 5) throw std::runtime_error("expected SCENE FACETS H END [AZIMUTH [ROWS]]");
    const double azimuth = count > 5 ? std::atof(arguments[5]) : 0;
    const int rows = count > 6 ? std::atoi(arguments[6]) : 5;
    return dyop::testing::run(arguments[1], std::atoi(arguments[2]), std::atof(arguments[3]),
                              std::atof(arguments[4]), azimuth, std::max(rows, 1));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "curved_soak: %s\n", error.what());
    return 2;
  }
}
