// SPDX-License-Identifier: BSD-3-Clause

// Steps a body that rolls, rocks or slides and prints what its energy does:
// curved_soak SCENE FACETS H END [AZIMUTH [ROWS]], with a scene of rolling_scenes.h.
// Columns: time, kinetic energy, error of the energy, contacts, unconverged solves, stalls, rounds,
// and the processor time of a step.
// ROWS = 0: the largest error over the largest kinetic energy at H, H/2, H/4 and H/8, and by what
// factor it fell.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <stdexcept>
#include <string>

#include "support/inputs/rolling_scenes.h"
#include "support/inputs/world_scenes.h"
#include "support/world_energy.h"

namespace dyop::testing {
namespace {

int run(const std::string& scene, int facets, Scalar h, Scalar end, Scalar azimuth, int rows) {
  WorldOptions options = earth_options();
  options.records_motions = false;
  options.thread_count = 1;
  World world(options);
  add_rolling_scene(world, scene, facets, azimuth);
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

int table(const std::string& scene, int facets, Scalar h, Scalar end, Scalar azimuth) {
  Scalar last = 0;
  for (int k = 0; k < 4; ++k, h /= 2) {
    const Scalar error = rolling_energy_error(scene, facets, azimuth, h, end);
    std::printf("%9s %6d %9.6f %10.2e", scene.c_str(), facets, h, error);
    std::printf(k > 0 ? " %6.1f\n" : "\n", last / error);
    std::fflush(stdout);
    last = error;
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
    if (rows == 0) {
      return dyop::testing::table(arguments[1], std::atoi(arguments[2]), std::atof(arguments[3]),
                                  std::atof(arguments[4]), azimuth);
    }
    return dyop::testing::run(arguments[1], std::atoi(arguments[2]), std::atof(arguments[3]),
                              std::atof(arguments[4]), azimuth, std::max(rows, 1));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "curved_soak: %s\n", error.what());
    return 2;
  }
}
