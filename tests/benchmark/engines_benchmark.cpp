// SPDX-License-Identifier: BSD-3-Clause

// The World beside Bullet (single precision, its default solver) and ODE (double precision, quick
// step), one thread, the same scenes in the same run, awake throughout:
//   engines_benchmark [SECONDS OF SIMULATED TIME [PART OF THE SCENE'S NAME]]
// Times are processor time per step. `overlap`: the deepest penetration of two boxes at the end of
// any tenth step, by libccd; `moved`: the farthest that a box is from where it began.
#include <btBulletDynamicsCommon.h>
#include <ode/ode.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "dyop/distance/penetration.h"
#include "dyop/dynamics/world.h"
#include "dyop/geometry/box.h"
#include "support/inputs/world_scenes.h"

namespace dyop::testing {
namespace {

constexpr Scalar kFriction = 0.5;
constexpr Scalar kDensity = 1000;
const Vector3 kFloorHalf(100, 100, 1);

struct Cube {
  Vector3 half_extents;
  RigidPose start;
};

struct Scene {
  std::string name;
  std::vector<Cube> cubes;
  Scalar step = 0.01;
};

class Engine {
 public:
  virtual ~Engine() = default;
  virtual std::string name() const = 0;
  virtual void step(Scalar h) = 0;
  virtual std::vector<RigidPose> poses() const = 0;
};

class DyopEngine : public Engine {
 public:
  explicit DyopEngine(const Scene& scene) : world_(options()) {
    BodyDefinition floor = floor_body(kFriction);
    floor.shape = std::make_shared<Box>(kFloorHalf);
    world_.add_body(floor);
    for (const Cube& cube : scene.cubes) {
      BodyDefinition body =
          dynamic_body("cube", std::make_shared<Box>(cube.half_extents), Vector3::Zero());
      body.initial.X_WB = cube.start;
      body.friction = kFriction;
      body.restitution = 0;
      ids_.push_back(world_.add_body(body));
    }
  }
  std::string name() const override { return "dyop"; }
  void step(Scalar h) override {
    const AdvanceReport report = world_.advance(h);
    if (report.status != AdvanceStatus::Completed) std::printf("dyop: not completed\n");
  }
  std::vector<RigidPose> poses() const override {
    std::vector<RigidPose> result;
    for (const BodyId id : ids_) result.push_back(world_.state(id).X_WB);
    return result;
  }

 private:
  static WorldOptions options() {
    WorldOptions options = earth_options();
    options.thread_count = 1;
    options.sleep_steps = 0;
    options.records_motions = false;
    return options;
  }
  World world_;
  std::vector<BodyId> ids_;
};

class BulletEngine : public Engine {
 public:
  explicit BulletEngine(const Scene& scene)
      : dispatcher_(&configuration_),
        world_(&dispatcher_, &broad_phase_, &solver_, &configuration_) {
    world_.setGravity(btVector3(0, 0, btScalar(-kGravity)));
    add(kFloorHalf, RigidPose(Vector3(0, 0, -1)), 0);
    for (const Cube& cube : scene.cubes) {
      add(cube.half_extents, cube.start, kDensity * 8 * cube.half_extents.prod());
    }
  }
  ~BulletEngine() override {
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }
  std::string name() const override { return "Bullet"; }
  void step(Scalar h) override { world_.stepSimulation(btScalar(h), 0); }
  std::vector<RigidPose> poses() const override {
    std::vector<RigidPose> result;
    for (std::size_t i = 1; i < bodies_.size(); ++i) {
      const btTransform& X = bodies_[i]->getWorldTransform();
      const btQuaternion q = X.getRotation();
      const btVector3& p = X.getOrigin();
      const Quaternion turn(double(q.w()), double(q.x()), double(q.y()), double(q.z()));
      result.emplace_back(turn.normalized(), Vector3(double(p.x()), double(p.y()), double(p.z())));
    }
    return result;
  }

 private:
  void add(const Vector3& half, const RigidPose& X, Scalar mass) {
    shapes_.push_back(std::make_unique<btBoxShape>(vector(half)));
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shapes_.back()->calculateLocalInertia(btScalar(mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, shapes_.back().get(),
                                                  inertia);
    const Quaternion q = X.quaternion();
    info.m_startWorldTransform = btTransform(
        btQuaternion(btScalar(q.x()), btScalar(q.y()), btScalar(q.z()), btScalar(q.w())),
        vector(X.translation()));
    info.m_friction = btScalar(std::sqrt(kFriction));  // Bullet multiplies
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    world_.addRigidBody(bodies_.back().get());
  }
  static btVector3 vector(const Vector3& v) {
    return btVector3(btScalar(v.x()), btScalar(v.y()), btScalar(v.z()));
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broad_phase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  std::vector<std::unique_ptr<btBoxShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

class OdeEngine : public Engine {
 public:
  explicit OdeEngine(const Scene& scene) {
    dInitODE();
    world_ = dWorldCreate();
    space_ = dHashSpaceCreate(nullptr);
    contacts_ = dJointGroupCreate(0);
    dWorldSetGravity(world_, 0, 0, -kGravity);
    dGeomSetPosition(dCreateBox(space_, 2 * kFloorHalf.x(), 2 * kFloorHalf.y(), 2), 0, 0, -1);
    for (const Cube& cube : scene.cubes) {
      const Vector3 sides = 2 * cube.half_extents;
      dBodyID body = dBodyCreate(world_);
      dMass mass;
      dMassSetBox(&mass, kDensity, sides.x(), sides.y(), sides.z());
      dBodySetMass(body, &mass);
      const Vector3& p = cube.start.translation();
      dBodySetPosition(body, p.x(), p.y(), p.z());
      const Quaternion q = cube.start.quaternion();
      const dQuaternion turn{q.w(), q.x(), q.y(), q.z()};
      dBodySetQuaternion(body, turn);
      dGeomSetBody(dCreateBox(space_, sides.x(), sides.y(), sides.z()), body);
      bodies_.push_back(body);
    }
  }
  ~OdeEngine() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
    dCloseODE();
  }
  std::string name() const override { return "ODE"; }
  void step(Scalar h) override {
    dSpaceCollide(space_, this, &OdeEngine::collide);
    dWorldQuickStep(world_, h);
    dJointGroupEmpty(contacts_);
  }
  std::vector<RigidPose> poses() const override {
    std::vector<RigidPose> result;
    for (dBodyID body : bodies_) {
      const dReal* p = dBodyGetPosition(body);
      const dReal* q = dBodyGetQuaternion(body);
      result.emplace_back(Quaternion(q[0], q[1], q[2], q[3]).normalized(),
                          Vector3(p[0], p[1], p[2]));
    }
    return result;
  }

 private:
  static void collide(void* self, dGeomID a, dGeomID b) {
    auto& engine = *static_cast<OdeEngine*>(self);
    constexpr int kMost = 8;
    std::array<dContact, kMost> contacts;
    const int count = dCollide(a, b, kMost, &contacts[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      dContact& contact = contacts[std::size_t(i)];
      contact.surface.mode = dContactApprox1;
      contact.surface.mu = kFriction;
      dJointAttach(dJointCreateContact(engine.world_, engine.contacts_, &contact), dGeomGetBody(a),
                   dGeomGetBody(b));
    }
  }

  dWorldID world_;
  dSpaceID space_;
  dJointGroupID contacts_;
  std::vector<dBodyID> bodies_;
};

Cube cube_at(const Vector3& p, Scalar gap) {
  return {Vector3(0.5, 0.5, 0.5), RigidPose(p + Vector3(0, 0, gap))};
}

// Each level a rest gap of dyop's above the one below.
Scalar level(int i) {
  const Scalar gap = rest_gap(std::sqrt(0.75));
  return 0.5 + gap + i * (1 + gap);
}

Scene columns(int count, int height, Scalar h) {
  Scene scene{std::to_string(count) + " columns of " + std::to_string(height), {}, h};
  const int side = int(std::ceil(std::sqrt(Scalar(count))));
  for (int k = 0; k < count; ++k) {
    for (int i = 0; i < height; ++i) {
      scene.cubes.push_back(cube_at({1.5 * (k % side), 1.5 * (k / side), level(i)}, 0));
    }
  }
  return scene;
}

// Its ends overhang by half a brick and fall.
Scene falling_wall(int length, int height, Scalar h) {
  Scene scene{"falling wall " + std::to_string(length) + " x " + std::to_string(height), {}, h};
  for (int i = 0; i < height; ++i) {
    for (int k = 0; k < length; ++k) {
      scene.cubes.push_back(cube_at({1.01 * (k + 0.5 * (i % 2)), 0, level(i)}, 0));
    }
  }
  return scene;
}

// Every second course ends in half bricks, so that it stands; all in one island.
Scene bricks(int length, int height, Scalar h) {
  Scene scene{"", {}, h};
  constexpr Scalar kPitch = 1.01;
  for (int i = 0; i < height; ++i) {
    const bool is_odd = i % 2 == 1;
    for (int k = 0; k < length + is_odd; ++k) {
      const bool is_half = is_odd && (k == 0 || k == length);
      const Scalar inward = is_half ? (k == 0 ? 0.25 : -0.25) : 0;
      scene.cubes.push_back(
          {Vector3(is_half ? 0.25 : 0.5, 0.5, 0.5),
           RigidPose(Vector3(kPitch * (k - 0.5 * is_odd) + inward, 0, level(i)))});
    }
  }
  scene.name = "bricks, " + std::to_string(scene.cubes.size());
  return scene;
}

Scene pyramid(int rows, Scalar h) {
  Scene scene{"pyramid of " + std::to_string(rows * (rows + 1) / 2), {}, h};
  for (int row = 0; row < rows; ++row) {
    for (int k = 0; k < rows - row; ++k) {
      scene.cubes.push_back(cube_at({1.05 * (k + 0.5 * row), 0, level(row)}, 0));
    }
  }
  return scene;
}

Scene pile(int side, Scalar h) {
  Scene scene{"pile of " + std::to_string(side * side * side), {}, h};
  for (int i = 0; i < side * side * side; ++i) {
    const int x = i % side;
    const int y = i / side % side;
    const int z = i / side / side;
    const Vector3 turn(0.05 * ((i * 7) % 5 - 2), 0.04 * ((i * 3) % 5 - 2), 0.3 * ((i * 11) % 7));
    scene.cubes.push_back(
        {Vector3(0.5, 0.5, 0.5),
         RigidPose(rotation_from_vector(turn),
                   Vector3(1.6 * x + 0.13 * z, 1.6 * y - 0.11 * z, 1 + 1.8 * z))});
  }
  return scene;
}

Scalar processor_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * Scalar(now.tv_sec) + Scalar(now.tv_nsec) / 1e6;
}

Scalar deepest(const Scene& scene, const std::vector<RigidPose>& poses) {
  Scalar depth = 0;
  const auto overlap = [&](const Box& a, const RigidPose& X_WA, const Box& b,
                           const RigidPose& X_WB) {
    const auto found = find_penetration(a, X_WA, b, X_WB);
    if (found) depth = std::max(depth, found->depth);
  };
  const Box floor(kFloorHalf);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Box a(scene.cubes[i].half_extents);
    if (poses[i].translation().z() < 1) overlap(floor, RigidPose(Vector3(0, 0, -1)), a, poses[i]);
    for (std::size_t k = 0; k < i; ++k) {
      if ((poses[i].translation() - poses[k].translation()).norm() > 1.8) continue;
      overlap(Box(scene.cubes[k].half_extents), poses[k], a, poses[i]);
    }
  }
  return depth;
}

void measure(const Scene& scene, Engine& engine, Scalar end) {
  Scalar sum = 0;
  Scalar worst = 0;
  Scalar depth = 0;
  const int steps = int(std::lround(end / scene.step));
  for (int k = 1; k <= steps; ++k) {
    const Scalar begin = processor_milliseconds();
    engine.step(scene.step);
    const Scalar spent = processor_milliseconds() - begin;
    sum += spent;
    worst = std::max(worst, spent);
    if (k % 10 == 0) depth = std::max(depth, deepest(scene, engine.poses()));
  }
  Scalar moved = 0;
  const std::vector<RigidPose> poses = engine.poses();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    moved = std::max(moved, (poses[i].translation() - scene.cubes[i].start.translation()).norm());
  }
  std::printf("%-22s %-7s %9.3f %9.3f %11.2e %11.2e\n", scene.name.c_str(), engine.name().c_str(),
              sum / steps, worst, depth, moved);
  std::fflush(stdout);
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  using namespace dyop::testing;
  const double end = argc > 1 ? std::atof(argv[1]) : 2;
  const std::string part = argc > 2 ? argv[2] : "";
  std::printf("%-22s %-7s %9s %9s %11s %11s\n", "scene", "engine", "ms/step", "worst", "overlap",
              "moved");
  for (const Scene& scene :
       {columns(1, 10, 0.01), columns(100, 10, 1.0 / 60), pyramid(20, 1.0 / 60),
        bricks(50, 20, 1.0 / 60), falling_wall(20, 10, 1.0 / 60), pile(5, 0.01), pile(10, 0.01)}) {
    if (scene.name.find(part) == std::string::npos) continue;
    DyopEngine dyop(scene);
    measure(scene, dyop, end);
    BulletEngine bullet(scene);
    measure(scene, bullet, end);
    OdeEngine ode(scene);
    measure(scene, ode, end);
  }
  return 0;
}
