// SPDX-License-Identifier: BSD-3-Clause
#include "bullet_copy.h"

#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"

namespace dyop::testing {
namespace {

btVector3 to_bullet(const Vector3& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

btTransform to_bullet(const RigidPose& X) {
  const Quaternion q(X.rotation());
  const btQuaternion turn(static_cast<btScalar>(q.x()), static_cast<btScalar>(q.y()),
                          static_cast<btScalar>(q.z()), static_cast<btScalar>(q.w()));
  return btTransform(turn, to_bullet(X.translation()));
}

}  // namespace

// Destroyed from the last to the first: the world before what it refers to.
struct BulletCopy::Parts {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broad_phase;
  btSequentialImpulseConstraintSolver solver;
  std::vector<std::unique_ptr<btBoxShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  btDiscreteDynamicsWorld world{&dispatcher, &broad_phase, &solver, &configuration};
};

BulletCopy::BulletCopy(const World& world, const Vector3& gravity_W)
    : parts_(std::make_unique<Parts>()) {
  parts_->world.setGravity(to_bullet(gravity_W));
  for (const BodyId id : world.bodies()) {
    const BodyDefinition& body = world.body(id);
    const auto* box = dynamic_cast<const Box*>(body.shape.get());
    DYOP_REQUIRE(box && body.kind != BodyKind::Kinematic, "BulletCopy: body '", body.name,
                 "' is no box that is static or dynamic");
    parts_->shapes.push_back(std::make_unique<btBoxShape>(to_bullet(box->half_extents())));
    const bool is_dynamic = body.kind == BodyKind::Dynamic;
    const btScalar mass = is_dynamic ? static_cast<btScalar>(body.mass_properties.mass) : 0;
    btVector3 inertia(0, 0, 0);
    if (is_dynamic) parts_->shapes.back()->calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, parts_->shapes.back().get(),
                                                  inertia);
    info.m_startWorldTransform = to_bullet(world.state(id).X_WB);
    info.m_friction = std::sqrt(static_cast<btScalar>(body.friction));  // Bullet multiplies
    parts_->bodies.push_back(std::make_unique<btRigidBody>(info));
    parts_->bodies.back()->setActivationState(DISABLE_DEACTIVATION);
    parts_->world.addRigidBody(parts_->bodies.back().get());
  }
}

BulletCopy::~BulletCopy() {
  for (const auto& body : parts_->bodies) parts_->world.removeRigidBody(body.get());
}

void BulletCopy::step(Scalar h) {
  parts_->world.stepSimulation(static_cast<btScalar>(h), 0);
}

}  // namespace dyop::testing
