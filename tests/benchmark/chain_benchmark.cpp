// SPDX-License-Identifier: BSD-3-Clause

// A six-axis arm among 100 obstacles: the proof of a random joint path beside one collision check
// of the same arm in FCL, at one configuration of the same path. Both include self-collision.
// Usage: chain_benchmark [paths]

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>

#include "dyop/chain/certify_chain.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/arms.h"

namespace dyop::testing {
namespace {

using Clock = std::chrono::steady_clock;
using FclObject = fcl::CollisionObject<double>;

constexpr int kPathsPerScene = 50;

double microseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

Eigen::Isometry3d isometry(const RigidPose& X) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = X.rotation();
  result.translation() = X.translation();
  return result;
}

std::shared_ptr<fcl::CollisionGeometry<double>> fcl_mesh(const TriangleMesh& mesh) {
  auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSS<double>>>();
  model->beginModel();
  for (const TriangleIndices& t : mesh.triangles()) {
    const auto vertex = [&](int k) { return mesh.vertices()[std::size_t(t[std::size_t(k)])]; };
    model->addTriangle(vertex(0), vertex(1), vertex(2));
  }
  model->endModel();
  return model;
}

// A shape as FCL's, with where it is in the frame of ours. A compound has one child.
struct FclShape {
  std::shared_ptr<fcl::CollisionGeometry<double>> geometry;
  RigidPose X_SG;
};

FclShape fcl_shape(const Shape& shape) {
  if (const auto* compound = dynamic_cast<const CompoundShape*>(&shape)) {
    return {fcl_shape(*compound->children()[0].shape).geometry, compound->children()[0].X_CS};
  }
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape)) return {fcl_mesh(*mesh), {}};
  if (const auto* box = dynamic_cast<const Box*>(&shape)) {
    return {std::make_shared<fcl::Boxd>(2 * box->half_extents()), {}};
  }
  if (const auto* ball = dynamic_cast<const Sphere*>(&shape)) {
    return {std::make_shared<fcl::Sphered>(ball->radius()), {}};
  }
  const auto& capsule = dynamic_cast<const Capsule&>(shape);
  return {std::make_shared<fcl::Capsuled>(capsule.radius(), 2 * capsule.half_length()), {}};
}

// The arm and its surroundings in FCL: a tree of boxes over the obstacles, one object per link.
class FclArm {
 public:
  FclArm(const KinematicChain& arm, const ObstacleSet& obstacles) : arm_(arm) {
    for (const ObstacleId id : obstacles.ids()) {
      const Obstacle& obstacle = obstacles.obstacle(id);
      const FclShape shape = fcl_shape(*obstacle.shape);
      others_.push_back(std::make_unique<FclObject>(shape.geometry,
                                                    isometry(obstacle.X_WO->pose(0) * shape.X_SG)));
      manager_.registerObject(others_.back().get());
    }
    manager_.setup();
    for (const Link& link : arm.links()) {
      const FclShape shape = fcl_shape(*link.shape);
      links_.push_back(std::make_unique<FclObject>(shape.geometry));
      offsets_.push_back(shape.X_SG);
    }
  }

  bool collides(const JointVector& q) {
    const std::vector<RigidPose> poses = arm_.link_poses(q);
    for (std::size_t i = 0; i < links_.size(); ++i) {
      links_[i]->setTransform(isometry(poses[i] * offsets_[i]));
      links_[i]->computeAABB();
    }
    bool is_hit = false;
    for (std::size_t i = 1; i < links_.size() && !is_hit; ++i) {
      manager_.collide(links_[i].get(), &is_hit, [](FclObject* a, FclObject* b, void* data) {
        return *static_cast<bool*>(data) = overlap(*a, *b);
      });
    }
    for (const KinematicChain::LinkPair& pair : arm_.self_pairs()) {
      if (is_hit) break;
      const FclObject& a = *links_[pair.first];
      const FclObject& b = *links_[pair.second];
      is_hit = a.getAABB().overlap(b.getAABB()) && overlap(a, b);
    }
    return is_hit;
  }

 private:
  static bool overlap(const FclObject& a, const FclObject& b) {
    fcl::CollisionResult<double> result;
    return fcl::collide(&a, &b, fcl::CollisionRequest<double>(), result) > 0;
  }

  const KinematicChain& arm_;
  std::vector<std::unique_ptr<FclObject>> others_;
  std::vector<std::unique_ptr<FclObject>> links_;
  std::vector<RigidPose> offsets_;
  fcl::DynamicAABBTreeCollisionManager<double> manager_;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[values.size() / 2];
}

void run(const char* name, int path_count, Scalar length) {
  std::mt19937_64 random(42);
  const KinematicChain arm = six_axis_arm();
  ChainWorkspace workspace;
  std::vector<double> all, free, checks, free_checks, ratios;
  int counts[3] = {};
  ObstacleSet obstacles;
  std::optional<FclArm> other;
  for (int i = 0; i < path_count; ++i) {
    if (i % kPathsPerScene == 0) {
      obstacles = arm_surroundings(100, random);
      other.emplace(arm, obstacles);
    }
    const JointVector from = random_coordinates(arm, random);
    const JointVector to = from + length * (random_coordinates(arm, random) - from);
    const JointPath path = JointPath::linear(std::vector<Scalar>{0, 1}, std::vector{from, to});
    certify(arm, path, obstacles, {}, workspace);  // warm, as below
    const auto start = Clock::now();
    const ChainResult result = certify(arm, path, obstacles, {}, workspace);
    const double time = microseconds_since(start);
    const bool is_free = result.toi.status == ToiStatus::Separated;
    ++counts[is_free ? 0 : result.toi.status == ToiStatus::Impact ? 1 : 2];
    if (result.toi.status == ToiStatus::InitiallyWithinTarget) continue;
    all.push_back(time);
    if (is_free) free.push_back(time);
    // In the free part, where a check has to examine everything.
    constexpr int kChecks = 20;
    bool is_hit = other->collides(from);
    const auto check_start = Clock::now();
    for (int k = 0; k < kChecks; ++k) {
      is_hit |= other->collides(path.position(k * result.toi.t_safe / kChecks));
    }
    const double check = microseconds_since(check_start) / kChecks;
    checks.push_back(check);
    if (is_free) free_checks.push_back(check);
    ratios.push_back(time / check);
    if (is_hit) std::printf("FCL finds a collision where dyop proves there is none: path %d\n", i);
  }
  std::printf("%s: free %d, impact %d, initially within %d\n", name, counts[0], counts[1],
              counts[2]);
  std::printf(
      "  median certify %.1f us, of free paths %.1f us; one FCL check %.1f us, on free paths "
      "%.1f us; median ratio %.1f\n",
      median(all), median(free), median(checks), median(free_checks), median(ratios));
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const int paths = argc > 1 ? std::atoi(argv[1]) : 1000;
  dyop::testing::run("paths across all limits", paths, 1);
  dyop::testing::run("a tenth of that, as the edges of a planner", paths, 0.1);
}
