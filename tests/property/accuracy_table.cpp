// SPDX-License-Identifier: BSD-3-Clause

// Measures how accurate dyop's answers are, against oracles and closed forms:
//   accuracy_table [FILE]
// Prints a table in Markdown. With FILE, docs/figures.md, it exits with 1 if a measured figure is
// above what the table in FILE states, or FILE states one more than ten times too large.

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <string>

#include "dyop/distance/distance.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/dynamics/world.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/shape_oracle.h"
#include "support/oracles/triangle_oracle.h"

namespace dyop::testing {
namespace {

long double wide(Scalar x) {
  return static_cast<long double>(x);
}

Scalar largest_coordinate(const TrianglePair& pair) {
  Scalar largest = 0;
  for (const Triangle* triangle : {&pair.a, &pair.b}) {
    for (const Vector3& p : *triangle) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  }
  return largest;
}

struct TriangleErrors {
  Scalar width = 0;  // of the bounds
  Scalar error = 0;  // of their middle
};

// Over all families in which a distance can be relative to the coordinates.
TriangleErrors triangle_errors() {
  TriangleErrors worst;
  std::mt19937_64 random(1);
  for (const TriangleFamily family : kAllTriangleFamilies) {
    for (int i = 0; i < 400; ++i) {
      const TrianglePair pair = random_triangle_pair(family, random);
      const TriangleDistance d = triangle_distance(pair.a, pair.b);
      const OracleDistance exact = oracle_triangle_distance(pair.a, pair.b);
      const Scalar size = largest_coordinate(pair);
      const long double middle = (wide(d.lower) + wide(d.upper)) / 2;
      worst.width = std::max(worst.width, (d.upper - d.lower) / size);
      worst.error = std::max(worst.error, Scalar(std::abs(middle - exact.distance) / wide(size)));
    }
  }
  return worst;
}

// Distance of two shapes at random places, relative to the size of the query.
Scalar shape_width(const Shape& a, const Shape& b, Scalar far) {
  Scalar worst = 0;
  std::mt19937_64 random(2);
  for (int i = 0; i < 60; ++i) {
    const Vector3 place = far * random_direction(random);
    const RigidPose X_WA(random_rotation(random), place);
    const RigidPose X_WB(random_rotation(random), place + 2.2 * random_direction(random));
    const DistanceResult d = distance(a, X_WA, b, X_WB);
    const OracleDistance exact = oracle_distance(a, X_WA, b, X_WB);
    const Scalar error = std::max({d.upper - d.lower, Scalar(wide(d.lower) - exact.upper()),
                                   Scalar(exact.lower() - wide(d.upper))});
    worst = std::max(worst, error / (3 + far));
  }
  return worst;
}

struct ImpactErrors {
  Scalar gap = 0;      // at t_safe, in tolerances
  Scalar bracket = 0;  // from t_safe to t_hit, times the closing speed, in tolerances
};

// A rod turns towards a point at radius 1 and angle phi: the gap is sin(phi - w t).
ImpactErrors impact_errors() {
  ImpactErrors worst;
  const TriangleMesh rod({{0, 0, 0}, {2, 0, 0}}, {{0, 1, 1}});
  const TriangleMesh point({Vector3::Zero()}, {{0, 0, 0}});
  for (const Scalar phi : {0.3, 1.2, 3.0, 6.0}) {
    for (const Scalar rate : {0.1, 1.0, 50.0}) {
      const RestMotion rest(RigidPose(Vector3(std::cos(phi), std::sin(phi), 0)));
      const ConstantTwistMotion turning(RigidPose(), {Vector3::Zero(), Vector3(0, 0, rate)});
      const ToiOptions options{.distance_tolerance = 1e-6};
      const ToiResult r = time_of_impact(rod, turning, point, rest, {0, 100}, options);
      if (r.status != ToiStatus::Impact || !r.t_hit) return {kInfinity, kInfinity};
      const Scalar unit = options.distance_tolerance.value();
      worst.gap = std::max(worst.gap, std::sin(phi - rate * r.t_safe) / unit);
      worst.bracket = std::max(worst.bracket, (*r.t_hit - r.t_safe) * rate / unit);
    }
  }
  return worst;
}

BodyDefinition free_body(std::shared_ptr<const Shape> shape, const Twist& twist) {
  BodyDefinition body;
  body.name = "body";
  body.shape = std::move(shape);
  body.mass_properties = body.shape->compute_mass_properties(1000);
  body.initial = {RigidPose(), twist};
  return body;
}

// Free fall for two units of time, relative to the distance fallen.
Scalar fall_error() {
  WorldOptions options;
  options.gravity_W = Vector3(0, 0, -9.81);
  World world(options);
  const BodyId ball = world.add_body(
      free_body(std::make_shared<Sphere>(0.5), {Vector3(4, -1, 2), Vector3::Zero()}));
  world.advance(2);
  const Vector3 expected = 2 * Vector3(4, -1, 2) + 2 * Vector3(0, 0, -9.81);
  return (world.state(ball).X_WB.translation() - expected).norm() / expected.norm();
}

struct TopErrors {
  Scalar energy = 0;
  Scalar momentum = 0;
};

// A free top that flips about its intermediate axis, 20 units of time at 5 radians per unit.
TopErrors top_errors() {
  WorldOptions options;
  options.gravity_W = Vector3::Zero();
  World world(options);
  world.add_body(free_body(std::make_shared<Box>(Vector3(0.1, 0.3, 0.5)),
                           {Vector3::Zero(), Vector3(0.01, 5, 0.01)}));
  const Scalar energy = world.kinetic_energy();
  const Vector3 momentum = world.angular_momentum();
  world.advance(20);
  return {std::abs(world.kinetic_energy() - energy) / energy,
          (world.angular_momentum() - momentum).norm() / momentum.norm()};
}

std::map<std::string, Scalar> measure() {
  using namespace testing;
  const TriangleErrors triangles = triangle_errors();
  const ImpactErrors impact = impact_errors();
  const TopErrors top = top_errors();
  const TriangleMesh sphere = icosphere(2).mesh();
  const TriangleMesh ring = torus(0.8, 0.25, 24, 10).mesh();
  const Box box(Vector3(0.9, 0.3, 0.02));
  const ConvexHull hull(icosphere(1, 0.7).vertices);
  return {{"triangle bounds", triangles.width},
          {"triangle distance", triangles.error},
          {"convex shapes", shape_width(box, hull, 0)},
          {"convex shapes, far", shape_width(box, hull, 1e4)},
          {"meshes", shape_width(sphere, ring, 0)},
          {"meshes, far", shape_width(sphere, ring, 1e4)},
          {"mesh and convex shape", shape_width(sphere, box, 0)},
          {"gap at the impact", impact.gap},
          {"bracket of the impact", impact.bracket},
          {"free fall", fall_error()},
          {"free top, energy", top.energy},
          {"free top, angular momentum", top.momentum}};
}

// The first two columns of all rows of tables in the file.
std::map<std::string, Scalar> stated(const std::string& file) {
  std::map<std::string, Scalar> rows;
  std::ifstream in(file);
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::string before, name, limit;
    std::getline(cells, before, '|');
    if (!std::getline(cells, name, '|') || !std::getline(cells, limit, '|')) continue;
    const auto first = name.find_first_not_of(' ');
    if (first == std::string::npos) continue;
    name = name.substr(first, name.find_last_not_of(' ') - first + 1);
    char* end = nullptr;
    const Scalar value = std::strtod(limit.c_str(), &end);
    if (end != limit.c_str()) rows[name] = value;
  }
  return rows;
}

int run(const std::string& file) {
  const std::map<std::string, Scalar> limits =
      file.empty() ? std::map<std::string, Scalar>() : stated(file);
  int faults = 0;
  for (const auto& [name, value] : measure()) {
    std::printf("| %s | %.1e |", name.c_str(), value);
    if (!file.empty()) {
      const auto limit = limits.find(name);
      const char* verdict = limit == limits.end()        ? "is not in the file"
                            : !(value <= limit->second)  ? "is above what is stated"
                            : value * 10 < limit->second ? "is far below what is stated"
                                                         : "";
      if (*verdict != 0) ++faults;
      std::printf(" %s", verdict);
    }
    std::printf("\n");
  }
  return faults == 0 ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  return dyop::testing::run(argc > 1 ? argv[1] : "");
}
