// SPDX-License-Identifier: BSD-3-Clause

// Random edges of the thin-wall world: what a proof costs beside OMPL's discrete validator at its
// default step, and at ever smaller ones until it accepts no edge that collides. States are checked
// by FCL (a tree of boxes over the walls), or by dyop where that is faster.
// Usage: ompl_edges_benchmark [edges]

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision.h>
#include <ompl/base/DiscreteMotionValidator.h>
#include <ompl/base/ScopedState.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/spaces/SE3StateSpace.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>

#include "dyop/ompl/ompl_motion_validator.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/thin_wall.h"

namespace dyop::testing {
namespace {

namespace ob = ompl::base;
using Se3 = ob::SE3StateSpace;
using FclObject = fcl::CollisionObject<double>;

class FclWorld {
 public:
  FclWorld(const Shape& body, const ObstacleSet& obstacles) {
    for (const ObstacleId id : obstacles.ids()) {
      const Obstacle& wall = obstacles.obstacle(id);
      walls_.push_back(object_of(*wall.shape));
      place(*walls_.back(), wall.X_WO->pose(0));
      manager_.registerObject(walls_.back().get());
    }
    manager_.setup();
    for (const CompoundChild& child : dynamic_cast<const CompoundShape&>(body).children()) {
      parts_.push_back(object_of(*child.shape));
      offsets_.push_back(child.X_CS);
    }
  }

  bool collides(const RigidPose& X_WB) {
    bool is_hit = false;
    for (std::size_t i = 0; i < parts_.size() && !is_hit; ++i) {
      place(*parts_[i], X_WB * offsets_[i]);
      manager_.collide(parts_[i].get(), &is_hit, [](FclObject* a, FclObject* b, void* hit) {
        fcl::CollisionResult<double> result;
        const auto found = fcl::collide(a, b, fcl::CollisionRequest<double>(), result);
        return *static_cast<bool*>(hit) = found > 0;
      });
    }
    return is_hit;
  }

 private:
  static std::unique_ptr<FclObject> object_of(const Shape& shape) {
    const Vector3 sides = 2 * dynamic_cast<const Box&>(shape).half_extents();
    return std::make_unique<FclObject>(std::make_shared<fcl::Boxd>(sides));
  }
  static void place(FclObject& object, const RigidPose& X) {
    object.setTransform(X.rotation(), X.translation());
    object.computeAABB();
  }

  std::vector<std::unique_ptr<FclObject>> walls_;
  std::vector<std::unique_ptr<FclObject>> parts_;
  std::vector<RigidPose> offsets_;
  fcl::DynamicAABBTreeCollisionManager<double> manager_;
};

RigidPose pose_of(const ob::State* state) {
  const auto& pose = *state->as<Se3::StateType>();
  const auto& q = pose.rotation();
  return RigidPose(Quaternion(q.w, q.x, q.y, q.z).normalized(),
                   Vector3(pose.getX(), pose.getY(), pose.getZ()));
}

void set(ob::ScopedState<Se3>& state, const Matrix3& R, const Vector3& p) {
  state->setXYZ(p.x(), p.y(), p.z());
  const Quaternion q = Quaternion(R).normalized();
  state->rotation().x = q.x();
  state->rotation().y = q.y();
  state->rotation().z = q.z();
  state->rotation().w = q.w();
}

struct Edge {
  ob::ScopedState<Se3> from;
  ob::ScopedState<Se3> to;
};

// As in the test of the validator: half of the edges turn little.
std::vector<Edge> random_edges(const ob::SpaceInformationPtr& si, const OmplMotionValidator& valid,
                               int count) {
  std::mt19937_64 random(2);
  std::vector<Edge> edges;
  while (int(edges.size()) < count) {
    Edge edge{ob::ScopedState<Se3>(si), ob::ScopedState<Se3>(si)};
    const RigidPose from = random_pose(1, random);
    const Scalar turn = edges.size() % 2 == 0 ? 0.1 : 3;
    set(edge.from, from.rotation(), from.translation());
    set(edge.to, from.rotation() * rotation_from_vector(random_vector(turn / 2, random)),
        random_vector(1, random));
    if (valid.is_valid(edge.from.get()) && valid.is_valid(edge.to.get())) edges.push_back(edge);
  }
  return edges;
}

struct Verdicts {
  std::vector<bool> accepted;
  double all = 0;   // microseconds of processor time an edge
  double free = 0;  // of the edges that are free
};

double processor_microseconds() {
  return 1e6 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

// @param free Those edges are timed by themselves; null: those accepted.
Verdicts judge(const ob::MotionValidator& validator, const std::vector<Edge>& edges,
               const std::vector<bool>* free) {
  const auto check = [&](std::size_t i) {
    return validator.checkMotion(edges[i].from.get(), edges[i].to.get());
  };
  Verdicts verdicts;
  const double start = processor_microseconds();
  for (std::size_t i = 0; i < edges.size(); ++i) verdicts.accepted.push_back(check(i));
  const double middle = processor_microseconds();
  const std::vector<bool>& wanted = free != nullptr ? *free : verdicts.accepted;
  double free_count = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (wanted[i]) free_count += check(i);
  }
  verdicts.all = (middle - start) / static_cast<double>(edges.size());
  verdicts.free = (processor_microseconds() - middle) / std::max(free_count, 1.0);
  return verdicts;
}

void run(int edge_count) {
  const auto space = std::make_shared<Se3>();
  ob::RealVectorBounds bounds(3);
  bounds.setLow(-1);
  bounds.setHigh(1);
  space->setBounds(bounds);
  const auto si = std::make_shared<ob::SpaceInformation>(space);
  const auto obstacles = std::make_shared<ObstacleSet>(thin_wall());
  const auto body = piano();
  const OmplMotionValidator validator(si, body, obstacles);
  FclWorld world(*body, *obstacles);
  const std::vector<Edge> edges = random_edges(si, validator, edge_count);
  const Verdicts proof = judge(validator, edges, nullptr);
  const auto count = [](const std::vector<bool>& marks) {
    return int(std::count(marks.begin(), marks.end(), true));
  };
  std::printf("proof: %d of %d edges accepted; %.1f us an edge, %.1f us a free one\n",
              count(proof.accepted), edge_count, proof.all, proof.free);
  const std::pair<const char*, ob::StateValidityCheckerFn> checkers[] = {
      {"FCL", [&](const ob::State* s) { return !world.collides(pose_of(s)); }},
      {"dyop", [&](const ob::State* s) { return validator.is_valid(s); }}};
  for (const auto& [name, checker] : checkers) {
    si->setStateValidityChecker(checker);
    int wrong = 1;
    for (double step = 0.01; wrong > 0 && step > 1e-4;
         step /= 2) {  // literal: a hundred times finer
      si->setStateValidityCheckingResolution(step);
      si->setup();
      const ob::DiscreteMotionValidator discrete(si);
      const Verdicts verdicts = judge(discrete, edges, &proof.accepted);
      wrong = 0;
      for (std::size_t i = 0; i < edges.size(); ++i) {
        wrong += verdicts.accepted[i] && !proof.accepted[i];
      }
      std::printf(
          "states by %s, step %.5f of the space: accepts %d more; %.1f us an edge, %.1f us a free "
          "one; proof %.2f and %.2f of that\n",
          name, step, wrong, verdicts.all, verdicts.free, proof.all / verdicts.all,
          proof.free / verdicts.free);
    }
  }
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  dyop::testing::run(argc > 1 ? std::atoi(argv[1]) : 10'000);
}
