// SPDX-License-Identifier: BSD-3-Clause
// Writes pages of large runs, for time_page.mjs to open.
// Usage: big_page OUT.html BODIES STEPS      cubes that tumble, a twist for each body and step
//        big_page OUT.html meshes            two meshes of 69,632 triangles, 1,000 steps
#include <cmath>
#include <fstream>
#include <iostream>
#include <memory>
#include <random>
#include <string>

#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/view/page_encoder.h"
#include "dyop/view/run_files.h"

namespace dyop {
namespace {

// A bumpy torus of 2 * rows * columns triangles.
std::shared_ptr<const Shape> bumpy_torus(std::int32_t rows, std::int32_t columns) {
  constexpr Scalar kTurn = 2 * 3.14159265358979323846;
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
  const auto at = [&](std::int32_t i, std::int32_t j) {
    return (i % rows) * columns + j % columns;
  };
  for (std::int32_t i = 0; i < rows; ++i) {
    for (std::int32_t j = 0; j < columns; ++j) {
      const Scalar u = kTurn * i / rows;
      const Scalar v = kTurn * j / columns;
      const Scalar r = 0.3 + 0.02 * std::sin(9 * u) * std::sin(7 * v);
      vertices.emplace_back((1 + r * std::cos(v)) * std::cos(u),
                            (1 + r * std::cos(v)) * std::sin(u), r * std::sin(v));
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return std::make_shared<TriangleMesh>(std::move(vertices), std::move(triangles));
}

std::size_t write_page(const std::string& file, std::size_t bodies, int steps,
                       const std::vector<std::shared_ptr<const Shape>>& shapes) {
  PageScene scene;
  scene.title = std::to_string(bodies) + " bodies, " + std::to_string(steps) + " steps";
  scene.gravity_W = Vector3(0, 0, -9.81);
  const Scalar h = 0.01;
  scene.end_time = h * steps;
  std::vector<RigidPose> poses;
  const auto side = std::size_t(std::ceil(std::cbrt(double(bodies))));
  for (std::size_t k = 0; k < bodies; ++k) {
    scene.bodies.push_back(
        {"body " + std::to_string(k), BodyKind::Dynamic, shapes[k % shapes.size()], "", {}});
    poses.emplace_back(Vector3(Scalar(k % side), Scalar(k / side % side), Scalar(k / side / side)) *
                       2.7);
  }
  const PageEncoder encoder(scene);
  std::vector<std::string> blocks{encoder.head()};
  std::mt19937 random(1);
  std::normal_distribution<Scalar> any;
  const auto any_vector = [&] { return Vector3(any(random), any(random), any(random)); };
  std::vector<Twist> twists(bodies);
  for (Twist& twist : twists) twist = {0.3 * any_vector(), any_vector()};
  PageSpan span;
  for (int step = 0; step < steps; ++step) {
    const TimeInterval interval{h * step, h * (step + 1)};
    for (std::size_t k = 0; k < bodies; ++k) {
      // As in a contact island, velocities change with each step.
      twists[k].v_WB += 0.01 * any_vector();
      twists[k].w_WB += 0.02 * any_vector();
      const auto motion =
          std::make_shared<ConstantTwistMotion>(poses[k], twists[k], interval.begin);
      poses[k] = motion->pose(interval.end);
      span.segments.push_back({BodyId(k), interval, motion});
    }
    span.steps.push_back(interval);
    const std::size_t limit = blocks.size() == 1 ? 3000 : 20000;
    if (span.segments.size() < limit && step + 1 < steps) continue;
    blocks.push_back(encoder.span(span));
    span = {};
  }
  std::size_t bytes = 0;
  for (const std::string& block : blocks) bytes += block.size();
  std::ofstream(file, std::ios::binary) << page_html(scene.title, blocks);
  return bytes;
}

}  // namespace
}  // namespace dyop

int main(int argc, char** argv) {
  using namespace dyop;
  if (argc < 3) {
    std::cerr << "usage: big_page OUT.html BODIES STEPS | meshes\n";
    return 2;
  }
  const bool has_meshes = std::string(argv[2]) == "meshes";
  const std::size_t bytes = has_meshes
                                ? write_page(argv[1], 2, 1000, {bumpy_torus(256, 136)})
                                : write_page(argv[1], std::stoul(argv[2]), std::stoi(argv[3]),
                                             {std::make_shared<Box>(Vector3(0.5, 0.5, 0.5))});
  std::cout << "blocks: " << bytes << " bytes\n";
}
