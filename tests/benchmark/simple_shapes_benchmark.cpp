// SPDX-License-Identifier: BSD-3-Clause

// Distances, contacts and impacts of simple shapes, in nanoseconds a query:
//   simple_shapes_benchmark [PASSES] [ROW]
// Each row: processor time of one query, mean over many random poses with gaps of 0.001 to 2 sizes,
// best of PASSES (default 9). `cold`: distance(); `warm`: the same poses moved a little from query
// to query, through a DistanceCache; `gjk`: gjk_distance(); `FCL`: its distance() with nearest
// points (kLibccd solver), the same poses. With ROW only rows whose name begins so, or one of the
// tables that follow, all in microseconds:
//   contacts   pairs that lie on each other: find_contacts(), generate_contacts(); FCL's collide()
//              with contacts and Bullet's box-box and GJK algorithms, which see them touch
//   mesh       spheres and capsules beside a mesh: distance(), point_distance() of the centre,
//              time_of_impact()
//   obstacles  the nearest of many boxes, and moving one before each query; FCL's dynamic tree
//   build      constructing shapes and trees

#include <BulletCollision/CollisionDispatch/btBoxBoxCollisionAlgorithm.h>
#include <BulletCollision/btBulletCollisionCommon.h>
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

#include "dyop/contact/contact_generator.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/point_distance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/occupancy.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/obstacle_set.h"
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

// --- contacts -----------------------------------------------------------------------------------

// Poses of B on A, which is at the origin: turned, shifted, and let down to a gap of 0.002; upright,
// or tilted in any way, so that an edge or a corner is below.
std::vector<RigidPose> resting_poses(const ConvexShape& a, const ConvexShape& b, bool is_tilted) {
  std::mt19937_64 random(21);
  std::vector<RigidPose> poses;
  for (int k = 0; k < kPoses; ++k) {
    const Quaternion turn(Eigen::AngleAxisd(random_number(0, 6, random), Vector3::UnitZ()));
    const Matrix3 R = is_tilted ? random_rotation(random).toRotationMatrix() : turn.matrix();
    const Vector3 aside(random_number(-0.3, 0.3, random), random_number(-0.3, 0.3, random), 0);
    Scalar height = 3;
    for (int step = 0; step < 60; ++step) {
      const RigidPose X(R, aside + Vector3(0, 0, height));
      height -= 0.99 * (distance(a, RigidPose(), b, X).lower - 0.002);
    }
    poses.emplace_back(R, aside + Vector3(0, 0, height));
  }
  return poses;
}

// Bullet's contacts of a pair of shapes, in single precision, without its cache of the last pose.
class BulletContacts {
 public:
  BulletContacts(btCollisionShape* a, btCollisionShape* b) : dispatcher_(&configuration_) {
    object_a_.setCollisionShape(a);
    object_b_.setCollisionShape(b);
  }
  int count(const RigidPose& X_WB) {
    const Quaternion q(X_WB.rotation());
    const Vector3& p = X_WB.translation();
    object_b_.setWorldTransform(btTransform(
        btQuaternion(btScalar(q.x()), btScalar(q.y()), btScalar(q.z()), btScalar(q.w())),
        btVector3(btScalar(p.x()), btScalar(p.y()), btScalar(p.z()))));
    const btCollisionObjectWrapper a(nullptr, object_a_.getCollisionShape(), &object_a_,
                                     object_a_.getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper b(nullptr, object_b_.getCollisionShape(), &object_b_,
                                     object_b_.getWorldTransform(), -1, -1);
    if (!algorithm_) {
      algorithm_ = dispatcher_.findAlgorithm(&a, &b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    }
    btManifoldResult result(&a, &b);
    algorithm_->processCollision(&a, &b, info_, &result);
    btPersistentManifold* manifold = result.getPersistentManifold();
    const int count = manifold ? manifold->getNumContacts() : 0;
    if (manifold) manifold->clearManifold();
    return count;
  }

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDispatcherInfo info_;
  btCollisionObject object_a_;
  btCollisionObject object_b_;
  btCollisionAlgorithm* algorithm_ = nullptr;
};

struct ContactRow {
  std::string name;
  std::shared_ptr<ConvexShape> shape;
  FclShape fcl_shape;
  btConvexShape* bullet_shape;
  bool is_tilted;
};

// FCL and Bullet see what overlaps: those get the shapes half a hundredth deep in each other.
std::vector<RigidPose> sunk(const std::vector<RigidPose>& poses) {
  std::vector<RigidPose> result;
  for (const RigidPose& X : poses) {
    result.emplace_back(X.rotation(), Vector3(X.translation() - Vector3(0, 0, 0.007)));
  }
  return result;
}

double fcl_contacts(int passes, const ContactRow& row, const std::vector<RigidPose>& poses) {
  if (!row.fcl_shape) return 0;
  std::vector<fcl::Transform3d> X_WB;
  for (const RigidPose& X : poses) X_WB.push_back(fcl_pose(X));
  const fcl::CollisionRequestd request(8, true);
  std::size_t sum = 0;
  const double time = nanoseconds(passes, kPoses, [&] {
    for (const fcl::Transform3d& X : X_WB) {
      fcl::CollisionResultd result;
      sum += fcl::collide(row.fcl_shape.get(), fcl::Transform3d::Identity(), row.fcl_shape.get(), X,
                          request, result);
    }
  });
  return sum > 0 ? time : 0;
}

void print_contacts(const ContactRow& row, int passes) {
  constexpr Scalar kReach = 0.01;
  const std::vector<RigidPose> poses = resting_poses(*row.shape, *row.shape, row.is_tilted);
  const std::vector<RigidPose> deeper = sunk(poses);
  std::size_t found = 0;
  std::size_t generated = 0;
  const double of_find = nanoseconds(passes, kPoses, [&] {
    for (const RigidPose& X : poses) {
      found += find_contacts(*row.shape, RigidPose(), *row.shape, X, kReach).size();
    }
  });
  ContactWorkspace workspace;
  std::vector<ContactPoint> contacts;
  const double of_generate = nanoseconds(passes, kPoses, [&] {
    for (const RigidPose& X : poses) {
      generate_contacts(*row.shape, RigidPose(), *row.shape, X, kReach, {}, workspace, contacts);
      generated += contacts.size();
    }
  });
  BulletContacts bullet(row.bullet_shape, row.bullet_shape);
  int of_bullet = 0;
  const double bullet_time = nanoseconds(passes, kPoses, [&] {
    for (const RigidPose& X : deeper) of_bullet += bullet.count(X);
  });
  const double calls = double(passes) * kPoses;
  std::printf("%-24s %9.2f %9.2f %9.2f %9.2f   contacts %.1f %.1f, Bullet %.1f\n", row.name.c_str(),
              of_find / 1e3, of_generate / 1e3, fcl_contacts(passes, row, deeper) / 1e3,
              bullet_time / 1e3, double(found) / calls, double(generated) / calls,
              of_bullet / calls);
}

void print_all_contacts(int passes) {
  const auto box = std::make_shared<Box>(Vector3(0.5, 0.5, 0.5));
  const auto hull = random_hull(32, 1);
  const FclShape fcl_box = std::make_shared<fcl::Boxd>(1, 1, 1);
  btBoxShape bullet_box(btVector3(0.5F, 0.5F, 0.5F));
  btConvexHullShape bullet_hull;
  for (const Vector3& p : hull->vertices()) {
    bullet_hull.addPoint(btVector3(btScalar(p.x()), btScalar(p.y()), btScalar(p.z())), false);
  }
  bullet_hull.recalcLocalAabb();
  bullet_hull.initializePolyhedralFeatures();
  std::printf("\n%-24s %9s %9s %9s %9s\n", "contacts, us", "find", "generate", "FCL", "Bullet");
  for (const ContactRow& row : {ContactRow{"boxes, face on face", box, fcl_box, &bullet_box, false},
                                {"boxes, tilted", box, fcl_box, &bullet_box, true},
                                {"hulls of 32", hull, nullptr, &bullet_hull, true}}) {
    print_contacts(row, passes);
  }
}

// --- obstacles ----------------------------------------------------------------------------------

void print_obstacles(int passes, int count) {
  std::mt19937_64 random(7);
  const Scalar half = std::cbrt(Scalar(count));
  const auto box = std::make_shared<Box>(Vector3(0.25, 0.25, 0.25));
  const auto fcl_box = std::make_shared<fcl::Boxd>(0.5, 0.5, 0.5);
  ObstacleSet set;
  fcl::DynamicAABBTreeCollisionManagerd manager;
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects;
  std::vector<fcl::CollisionObjectd*> pointers;
  std::vector<ObstacleId> ids;
  for (int k = 0; k < count; ++k) {
    const RigidPose X = random_pose(half, random);
    ids.push_back(set.add(box, X));
    objects.push_back(std::make_unique<fcl::CollisionObjectd>(fcl_box, fcl_pose(X)));
    pointers.push_back(objects.back().get());
  }
  manager.registerObjects(pointers);
  manager.setup();
  constexpr std::size_t kQueries = 200;
  std::vector<RigidPose> poses;
  std::vector<RigidPose> places;
  for (std::size_t k = 0; k < kQueries; ++k) {
    poses.push_back(random_pose(half, random));
    places.push_back(random_pose(half, random));
  }
  double sum = 0;
  const double of_nearest = nanoseconds(passes, kQueries, [&] {
    for (const RigidPose& X : poses) sum += set.nearest(*box, X).distance.lower;
  });
  const double of_move = nanoseconds(passes, kQueries, [&] {
    for (std::size_t k = 0; k < kQueries; ++k) {
      set.move(ids[k * 31 % ids.size()], places[k]);
      sum += set.nearest(*box, poses[k]).distance.lower;
    }
  });
  fcl::CollisionObjectd query(fcl_box);
  const auto nearest_by_fcl = [&](const RigidPose& X) {
    query.setTransform(fcl_pose(X));
    query.computeAABB();
    fcl::DefaultDistanceData<double> data;
    manager.distance(&query, &data, fcl::DefaultDistanceFunction<double>);
    return data.result.min_distance;
  };
  const double fcl_nearest = nanoseconds(passes, kQueries, [&] {
    for (const RigidPose& X : poses) sum += nearest_by_fcl(X);
  });
  const double fcl_move = nanoseconds(passes, kQueries, [&] {
    for (std::size_t k = 0; k < kQueries; ++k) {
      fcl::CollisionObjectd& object = *objects[k * 31 % objects.size()];
      object.setTransform(fcl_pose(places[k]));
      object.computeAABB();
      manager.update(&object);
      sum += nearest_by_fcl(poses[k]);
    }
  });
  std::printf("%-24d %9.2f %9.2f %9.2f %9.2f  %s\n", count, of_nearest / 1e3, of_move / 1e3,
              fcl_nearest / 1e3, fcl_move / 1e3, sum == 12345 ? "!" : "");
}

// --- construction -------------------------------------------------------------------------------

void print_builds(int passes) {
  std::printf("\n%-24s %9s\n", "construct", "us");
  std::size_t sum = 0;
  const auto print = [&](const char* name, int count, const std::function<void()>& run) {
    std::printf("%-24s %9.2f\n", name, nanoseconds(passes, count, run) / 1e3);
  };
  constexpr int kShapes = 200;
  print("box", kShapes, [&] {
    for (int k = 0; k < kShapes; ++k) sum += std::size_t(Box(Vector3(1, 2, 3)).bounding_radius());
  });
  print("box with its surface", kShapes, [&] {
    for (int k = 0; k < kShapes; ++k)
      sum += std::size_t(Box(Vector3(1, 2, 3)).core_surface() != nullptr);
  });
  std::mt19937_64 random(3);
  std::vector<OccupiedCube> cubes(10000);
  for (OccupiedCube& cube : cubes) cube.center = 30 * random_direction(random);
  print("occupancy, a cube", int(cubes.size()), [&] { sum += occupancy(cubes).children().size(); });
  const std::shared_ptr<ConvexHull> hull = random_hull(32, 1);
  const std::vector<Vector3> points(hull->vertices().begin(), hull->vertices().end());
  print("hull of 32", kShapes, [&] {
    for (int k = 0; k < kShapes; ++k) sum += ConvexHull(points).vertices().size();
  });
  for (const int level : {3, 5, 7}) {
    const MeshArrays mesh = icosphere(level);
    const int count = int(mesh.triangles.size());
    const std::string name = "mesh of " + std::to_string(count) + ", a triangle";
    print(name.c_str(), count, [&] { sum += mesh.mesh().hierarchy().nodes().size(); });
  }
  if (sum == 12345) std::puts("!");
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const int passes = argc > 1 ? std::atoi(argv[1]) : 9;
  const std::string wanted = argc > 2 ? argv[2] : "";
  const auto is_wanted = [&](const std::string& name) { return name.rfind(wanted, 0) == 0; };
  std::printf("%-18s %8s %8s %8s %8s %8s\n", "distance, ns", "cold", "drifting", "warm", "gjk",
              "FCL");
  for (const auto& row : dyop::testing::all_rows()) {
    if (is_wanted(row.name)) dyop::testing::print_distances(row, passes);
  }
  if (is_wanted("contacts")) dyop::testing::print_all_contacts(passes);
  if (is_wanted("mesh")) {
    std::printf("\n%-24s %9s %9s %9s %9s\n", "against a mesh, us", "triangles", "distance",
                "centre", "impact");
    for (const int level : {4, 5, 6}) dyop::testing::print_meshes(std::min(passes, 3), level);
  }
  if (is_wanted("obstacles")) {
    std::printf("\n%-24s %9s %9s %9s %9s\n", "nearest of so many, us", "nearest", "and move", "FCL",
                "and move");
    for (const int count : {1000, 10000, 100000}) dyop::testing::print_obstacles(passes, count);
  }
  if (is_wanted("build")) dyop::testing::print_builds(passes);
  return 0;
}
