// SPDX-License-Identifier: BSD-3-Clause

// Distances, contacts and impacts of simple shapes, in nanoseconds a query:
//   simple_shapes_benchmark [PASSES] [ROW]
// Each row: processor time of one query, mean over many random poses with gaps of 0.001 to 2 sizes,
// best of PASSES (default 9). `cold`: distance(); `warm`: the same poses moved a little from query
// to query, through a DistanceCache; `gjk`: gjk_distance(); `FCL`: its distance() with nearest
// points (kLibccd solver), the same poses. Then spheres and capsules beside a mesh, in
// microseconds: distance(), point_distance() of the centre, time_of_impact(). With ROW only rows
// whose name begins so, or `mesh`.

#include <fcl/fcl.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/point_distance.h"
#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/sphere.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

constexpr int kPoses = 1000;

struct Poses {
  std::vector<RigidPose> a;
  std::vector<RigidPose> b;
};

// Fresh poses, or ones that drift.
Poses random_poses(Scalar radii, bool is_drifting, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Poses poses;
  RigidPose X_WB(random_rotation(random), 1.3 * radii * random_direction(random));
  for (int k = 0; k < kPoses; ++k) {
    poses.a.emplace_back(is_drifting ? Quaternion::Identity() : random_rotation(random),
                         Vector3::Zero());
    if (is_drifting && k % 100 != 0) {
      X_WB = RigidPose(
          Matrix3(rotation_from_vector(0.01 * random_direction(random)) * X_WB.rotation()),
          X_WB.translation() + 0.005 * radii * random_direction(random));
    } else {
      const Scalar away = radii * random_number(0.9, 2, random);
      X_WB = RigidPose(random_rotation(random), away * random_direction(random));
    }
    poses.b.push_back(X_WB);
  }
  return poses;
}

std::shared_ptr<ConvexHull> random_hull(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Vector3> points;
  for (int k = 0; k < count; ++k) points.push_back(random_direction(random));
  return std::make_shared<ConvexHull>(std::move(points));
}

double nanoseconds(int passes, int count, const std::function<void()>& run) {
  double best = 1e300;
  for (int pass = 0; pass < passes; ++pass) {
    const std::clock_t begin = std::clock();
    run();
    best = std::min(best, double(std::clock() - begin) / CLOCKS_PER_SEC / count);
  }
  return best * 1e9;
}

using FclShape = std::shared_ptr<fcl::CollisionGeometryd>;

fcl::Transform3d fcl_pose(const RigidPose& X) {
  fcl::Transform3d result = fcl::Transform3d::Identity();
  result.linear() = X.rotation();
  result.translation() = X.translation();
  return result;
}

double fcl_time(int passes, const Poses& poses, const FclShape& a, const FclShape& b) {
  if (!a || !b) return 0;
  std::vector<fcl::Transform3d> X_WA, X_WB;
  for (int k = 0; k < kPoses; ++k) {
    X_WA.push_back(fcl_pose(poses.a[std::size_t(k)]));
    X_WB.push_back(fcl_pose(poses.b[std::size_t(k)]));
  }
  fcl::DistanceRequestd request(true);
  double sum = 0;
  const double time = nanoseconds(passes, kPoses, [&] {
    for (std::size_t k = 0; k < kPoses; ++k) {
      fcl::DistanceResultd result;
      sum += fcl::distance(a.get(), X_WA[k], b.get(), X_WB[k], request, result);
    }
  });
  if (sum == 12345) std::puts("");
  return time;
}

struct Row {
  std::string name;
  std::shared_ptr<ConvexShape> a;
  std::shared_ptr<ConvexShape> b;
  FclShape fcl_a;
  FclShape fcl_b;
};

std::vector<Row> all_rows() {
  const auto ball = std::make_shared<Sphere>(0.8);
  const auto capsule = std::make_shared<Capsule>(0.3, 0.7);
  const auto box = std::make_shared<Box>(Vector3(0.8, 0.5, 0.3));
  const FclShape fcl_ball = std::make_shared<fcl::Sphered>(0.8);
  const FclShape fcl_capsule = std::make_shared<fcl::Capsuled>(0.3, 1.4);
  const FclShape fcl_box = std::make_shared<fcl::Boxd>(1.6, 1.0, 0.6);
  return {
      {"sphere-sphere", ball, ball, fcl_ball, fcl_ball},
      {"sphere-capsule", ball, capsule, fcl_ball, fcl_capsule},
      {"sphere-box", ball, box, fcl_ball, fcl_box},
      {"capsule-capsule", capsule, capsule, fcl_capsule, fcl_capsule},
      {"capsule-box", capsule, box, fcl_capsule, fcl_box},
      {"box-box", box, box, fcl_box, fcl_box},
      {"hull32-hull32", random_hull(32, 1), random_hull(32, 2), nullptr, nullptr},
      {"hull500-hull500", random_hull(500, 3), random_hull(500, 4), nullptr, nullptr},
  };
}

void print_distances(const Row& row, int passes) {
  const Scalar radii = row.a->bounding_radius() + row.b->bounding_radius();
  const Poses fresh = random_poses(radii, false, 11);
  const Poses drifting = random_poses(radii, true, 12);
  double sum = 0;
  const auto cold = [&](const Poses& poses) {
    return nanoseconds(passes, kPoses, [&] {
      for (std::size_t k = 0; k < kPoses; ++k) {
        sum += distance(*row.a, poses.a[k], *row.b, poses.b[k]).lower;
      }
    });
  };
  const double warm = nanoseconds(passes, kPoses, [&] {
    DistanceCache cache;
    for (std::size_t k = 0; k < kPoses; ++k) {
      sum += distance(*row.a, drifting.a[k], *row.b, drifting.b[k], {}, cache).lower;
    }
  });
  const double gjk = nanoseconds(passes, kPoses, [&] {
    for (std::size_t k = 0; k < kPoses; ++k) {
      sum += gjk_distance(*row.a, *row.b, fresh.a[k].inverse() * fresh.b[k]).lower;
    }
  });
  const double of_fresh = cold(fresh);
  const double of_drifting = cold(drifting);
  std::printf("%-18s %8.0f %8.0f %8.0f %8.0f %8.0f   %s\n", row.name.c_str(), of_fresh, of_drifting,
              warm, gjk, fcl_time(passes, fresh, row.fcl_a, row.fcl_b), sum == 12345 ? "!" : "");
}

// A mesh of about so many triangles, bumpy like a scan: no symmetry, no flat parts.
TriangleMesh bumpy_ball(int level) {
  MeshArrays mesh = icosphere(level);
  for (Vector3& p : mesh.vertices) {
    p *= 0.8 + 0.15 * std::sin(5 * p.x() + 1) * std::sin(7 * p.y() + 2) * std::cos(6 * p.z());
  }
  return mesh.mesh();
}

// Balls and rounded boxes of growing radius beside a mesh of radius 1, at gaps of 0.01 to 0.3.
void print_meshes(int passes, int level) {
  const TriangleMesh mesh = bumpy_ball(level);
  constexpr int kQueries = 60;
  double sum = 0;
  const auto row = [&](const std::string& name, const ConvexShape& shape) {
    std::mt19937_64 random(5);
    std::vector<RigidPose> poses;
    std::vector<ConstantTwistMotion> motions;
    for (int k = 0; k < kQueries; ++k) {
      const Vector3 from = random_direction(random);
      const Scalar away = 1 + shape.bounding_radius() + random_number(0.01, 0.3, random);
      const RigidPose X(random_rotation(random), away * from);
      poses.push_back(X);
      const Vector3 aim = 0.3 * random_direction(random);
      motions.emplace_back(RigidPose(X.rotation(), 2 * X.translation()),
                           Twist{aim - 2 * X.translation(), random_direction(random)});
    }
    const RestMotion rest{RigidPose()};
    const double of_distance = nanoseconds(passes, kQueries, [&] {
      for (const RigidPose& X : poses) sum += distance(mesh, RigidPose(), shape, X).lower;
    });
    const double of_center = nanoseconds(passes, kQueries, [&] {
      for (const RigidPose& X : poses) {
        sum += point_distance(mesh, RigidPose(), X.translation()).lower;
      }
    });
    ToiWorkspace workspace;
    const double of_impact = nanoseconds(passes, kQueries, [&] {
      for (const ConstantTwistMotion& motion : motions) {
        sum += time_of_impact(mesh, rest, shape, motion, {0, 1}, {}, workspace).t_safe;
      }
    });
    std::printf("%-24s %9zu %9.1f %9.1f %9.1f  %s\n", name.c_str(), mesh.triangles().size(),
                of_distance / 1e3, of_center / 1e3, of_impact / 1e3, sum == 12345 ? "!" : "");
  };
  for (const Scalar r : {0.03, 0.3, 1.0}) {
    const std::string radius = std::to_string(r).substr(0, 4);
    row("ball " + radius, Sphere(r));
    row("capsule " + radius, Capsule(r, 0.3));
  }
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const int passes = argc > 1 ? std::atoi(argv[1]) : 9;
  const std::string wanted = argc > 2 ? argv[2] : "";
  std::printf("%-18s %8s %8s %8s %8s %8s\n", "distance, ns", "cold", "drifting", "warm", "gjk",
              "FCL");
  for (const auto& row : dyop::testing::all_rows()) {
    if (row.name.rfind(wanted, 0) == 0) dyop::testing::print_distances(row, passes);
  }
  if (std::string("mesh").rfind(wanted, 0) != 0) return 0;
  std::printf("\n%-24s %9s %9s %9s %9s\n", "against a mesh, us", "triangles", "distance", "centre",
              "impact");
  for (const int level : {4, 5, 6}) dyop::testing::print_meshes(std::min(passes, 3), level);
  return 0;
}
