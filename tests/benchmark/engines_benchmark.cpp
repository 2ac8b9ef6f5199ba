// SPDX-License-Identifier: BSD-3-Clause

// The World beside Bullet (single precision, its default solver), ODE (double precision, quick step)
// and MuJoCo (double precision, its default solver), one thread, the same scenes in the same run,
// awake throughout:
//   engines_benchmark [SECONDS OF SIMULATED TIME [PART OF THE SCENE'S NAME [parts [THREADS]]]]
// Times are processor time per step: of all steps, of the last fifth of them, and of the worst.
// MuJoCo is left out of scenes of more than 300 bodies, as its matrices take gigabytes, and of those
// with tori, which it takes for their hulls.
// With THREADS, time passed per step, of dyop alone on so many threads.
// `overlap`: the deepest penetration of two bodies at the end of any tenth step, by libccd, and for
// tori by the closed form; `open`: the widest that a joint is open then; `moved`: the farthest that
// a body is from where it began. With `parts` a second line tells what dyop's time went into.
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletDynamicsCommon.h>
#include <mujoco/mujoco.h>
#include <ode/ode.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <numeric>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "dyop/distance/gjk.h"
#include "dyop/dynamics/world.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/world_scenes.h"

namespace dyop::testing {
namespace {

constexpr Scalar kFriction = 0.5;
constexpr Scalar kDensity = 1000;
const Vector3 kFloorHalf(100, 100, 1);

enum class Form { Box, Sphere, Capsule, Hull, Torus };

// Torus: about z; `a` is the radius of its middle, `b` that of its tube, in kAround x kAcross
// quadrilaterals.
constexpr int kAround = 22;
constexpr int kAcross = 12;

struct Solid {
  Form form = Form::Box;
  Vector3 half_extents = Vector3::Constant(0.5);  // Box
  Scalar a = 0.5;                                 // radius
  Scalar b = 0;                                   // Capsule: half length
  std::shared_ptr<const Shape> shape;
  RigidPose start;
  bool is_fixed = false;
};

// Two bodies that share a point; -1: the world.
struct Pin {
  int a = -1;
  int b = -1;
  Vector3 p_W;
};

struct Scene {
  std::string name;
  std::vector<Solid> solids;
  Scalar step = 0.01;
  std::vector<Pin> pins = {};
};

Vector3 held_point(const Scene& scene, int body, const Vector3& p_W) {
  return body < 0 ? p_W : scene.solids[std::size_t(body)].start.inverse() * p_W;
}

const TriangleMesh& mesh_of(const Solid& solid) {
  if (solid.form == Form::Torus) return static_cast<const TriangleMesh&>(*solid.shape);
  return *static_cast<const ConvexHull&>(*solid.shape).core_surface();
}

class Engine {
 public:
  virtual ~Engine() = default;
  virtual std::string name() const = 0;
  virtual void step(Scalar h) = 0;
  virtual std::vector<RigidPose> poses() const = 0;
  virtual void print_parts(int /*steps*/) const {}
};

class DyopEngine : public Engine {
 public:
  DyopEngine(const Scene& scene, bool has_parts, int threads)
      : has_parts_(has_parts), world_(options(has_parts, threads)) {
    BodyDefinition floor = floor_body(kFriction);
    floor.shape = std::make_shared<Box>(kFloorHalf);
    const BodyId ground = world_.add_body(floor);
    for (const Solid& solid : scene.solids) {
      BodyDefinition body = dynamic_body("body", solid.shape, Vector3::Zero());
      if (solid.is_fixed) body.kind = BodyKind::Static;
      body.initial.X_WB = solid.start;
      body.friction = kFriction;
      body.restitution = 0;
      ids_.push_back(world_.add_body(body));
    }
    for (const Pin& pin : scene.pins) {
      JointDefinition joint;
      joint.a = pin.a < 0 ? ground : ids_[std::size_t(pin.a)];
      joint.b = ids_[std::size_t(pin.b)];
      joint.X_AJ = RigidPose(pin.a < 0 ? Vector3(pin.p_W - floor.initial.X_WB.translation())
                                       : held_point(scene, pin.a, pin.p_W));
      joint.X_BJ = RigidPose(held_point(scene, pin.b, pin.p_W));
      world_.add_joint(joint);
    }
  }
  std::string name() const override { return "dyop"; }
  void step(Scalar h) override {
    const AdvanceReport report = world_.advance(h);
    if (report.status != AdvanceStatus::Completed) std::printf("dyop: not completed\n");
    times_.broad_phase += report.times.broad_phase;
    times_.flight += report.times.flight;
    times_.contacts += report.times.contacts;
    times_.solve += report.times.solve;
    times_.ends += report.times.ends;
    times_.proofs += report.times.proofs;
    unconverged_ += report.work.unconverged;
    discarded_ += report.work.discarded_runs;
    rounds_ += report.work.rounds;
    stalls_ += report.work.stalls;
    contacts_ = std::max(contacts_, report.work.contacts);
  }
  std::vector<RigidPose> poses() const override {
    std::vector<RigidPose> result;
    for (const BodyId id : ids_) result.push_back(world_.state(id).X_WB);
    return result;
  }
  void print_parts(int steps) const override {
    if (!has_parts_) return;
    const auto mean = [&](Scalar seconds) { return 1e3 * seconds / steps; };
    std::printf(
        "  pairs %.3f flight %.3f contacts %.3f solve %.3f ends %.3f proofs %.3f ms; at most %ld "
        "contacts, %ld unconverged, %ld runs discarded, %ld rounds, %ld stalls\n",
        mean(times_.broad_phase), mean(times_.flight), mean(times_.contacts), mean(times_.solve),
        mean(times_.ends), mean(times_.proofs), long(contacts_), long(unconverged_),
        long(discarded_), long(rounds_), long(stalls_));
  }

 private:
  static WorldOptions options(bool has_parts, int threads) {
    WorldOptions options = earth_options();
    options.thread_count = threads;
    options.sleep_steps = 0;
    options.records_motions = false;
    options.measures_time = has_parts;
    return options;
  }
  bool has_parts_;
  World world_;
  std::vector<BodyId> ids_;
  StepTimes times_;
  std::int64_t unconverged_ = 0;
  std::int64_t discarded_ = 0;
  std::int64_t rounds_ = 0;
  std::int64_t stalls_ = 0;
  std::int64_t contacts_ = 0;
};

class BulletEngine : public Engine {
 public:
  explicit BulletEngine(const Scene& scene)
      : dispatcher_(&configuration_),
        world_(&dispatcher_, &broad_phase_, &solver_, &configuration_) {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
    world_.setGravity(btVector3(0, 0, btScalar(-kGravity)));
    Solid floor;
    floor.half_extents = kFloorHalf;
    floor.shape = std::make_shared<Box>(kFloorHalf);
    floor.start = RigidPose(Vector3(0, 0, -1));
    floor.is_fixed = true;
    add(floor);
    for (const Solid& solid : scene.solids) add(solid);
    for (const Pin& pin : scene.pins) {
      btRigidBody& b = *bodies_[std::size_t(pin.b + 1)];
      const btVector3 on_b = vector(held_point(scene, pin.b, pin.p_W));
      if (pin.a < 0) {
        pins_.push_back(std::make_unique<btPoint2PointConstraint>(b, on_b));
      } else {
        const btVector3 on_a = vector(held_point(scene, pin.a, pin.p_W));
        pins_.push_back(std::make_unique<btPoint2PointConstraint>(*bodies_[std::size_t(pin.a + 1)],
                                                                  b, on_a, on_b));
      }
      world_.addConstraint(pins_.back().get(), true);
    }
  }
  ~BulletEngine() override {
    for (const auto& pin : pins_) world_.removeConstraint(pin.get());
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
  std::unique_ptr<btCollisionShape> shape_of(const Solid& solid) {
    switch (solid.form) {
      case Form::Box:
        return std::make_unique<btBoxShape>(vector(solid.half_extents));
      case Form::Sphere:
        return std::make_unique<btSphereShape>(btScalar(solid.a));
      case Form::Capsule:
        return std::make_unique<btCapsuleShapeZ>(btScalar(solid.a), btScalar(2 * solid.b));
      case Form::Hull: {
        auto hull = std::make_unique<btConvexHullShape>();
        for (const Vector3& p : mesh_of(solid).vertices()) hull->addPoint(vector(p), false);
        hull->recalcLocalAabb();
        hull->setMargin(0);
        return hull;
      }
      case Form::Torus: {
        meshes_.push_back(std::make_unique<btTriangleMesh>());
        const TriangleMesh& mesh = mesh_of(solid);
        for (std::int32_t i = 0; i < std::int32_t(mesh.triangles().size()); ++i) {
          const auto corners = mesh.triangle(i);
          meshes_.back()->addTriangle(vector(corners[0]), vector(corners[1]), vector(corners[2]));
        }
        auto torus = std::make_unique<btGImpactMeshShape>(meshes_.back().get());
        torus->setMargin(0);
        torus->updateBound();
        return torus;
      }
    }
    return nullptr;
  }
  void add(const Solid& solid) {
    shapes_.push_back(shape_of(solid));
    btVector3 inertia(0, 0, 0);
    const Scalar mass = solid.is_fixed ? 0 : solid.shape->compute_mass_properties(kDensity).mass;
    if (mass > 0) shapes_.back()->calculateLocalInertia(btScalar(mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, shapes_.back().get(),
                                                  inertia);
    const Quaternion q = solid.start.quaternion();
    info.m_startWorldTransform = btTransform(
        btQuaternion(btScalar(q.x()), btScalar(q.y()), btScalar(q.z()), btScalar(q.w())),
        vector(solid.start.translation()));
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
  std::vector<std::unique_ptr<btTriangleMesh>> meshes_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btPoint2PointConstraint>> pins_;
};

// A hull or mesh as arrays of ODE, which keeps pointers to them.
struct OdeArrays {
  std::vector<dReal> points, planes;
  std::vector<float> vertices;
  std::vector<unsigned> polygons;
  std::vector<dTriIndex> triangles;

  explicit OdeArrays(const TriangleMesh& mesh) {
    for (const Vector3& p : mesh.vertices()) {
      for (const Scalar x : p) {
        points.push_back(x);
        vertices.push_back(float(x));
      }
    }
    for (const TriangleIndices& triangle : mesh.triangles()) {
      polygons.push_back(3);
      for (const auto i : triangle) {
        polygons.push_back(unsigned(i));
        triangles.push_back(dTriIndex(i));
      }
    }
    for (std::int32_t i = 0; i < std::int32_t(mesh.triangles().size()); ++i) {
      const auto corners = mesh.triangle(i);
      const Vector3 n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
      for (const Scalar x : {n.x(), n.y(), n.z(), n.dot(corners[0])}) planes.push_back(x);
    }
  }
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
    for (const Solid& solid : scene.solids) add(solid);
    for (const Pin& pin : scene.pins) {
      const dJointID joint = dJointCreateBall(world_, nullptr);
      dJointAttach(joint, pin.a < 0 ? nullptr : bodies_[std::size_t(pin.a)],
                   bodies_[std::size_t(pin.b)]);
      dJointSetBallAnchor(joint, pin.p_W.x(), pin.p_W.y(), pin.p_W.z());
    }
  }
  ~OdeEngine() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
    for (const dTriMeshDataID mesh : meshes_) dGeomTriMeshDataDestroy(mesh);
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
    for (dGeomID geom : geoms_) {
      const dReal* p = dGeomGetPosition(geom);
      dQuaternion q;
      dGeomGetQuaternion(geom, q);
      result.emplace_back(Quaternion(q[0], q[1], q[2], q[3]).normalized(),
                          Vector3(p[0], p[1], p[2]));
    }
    return result;
  }

 private:
  dGeomID geom_of(const Solid& solid) {
    switch (solid.form) {
      case Form::Box: {
        const Vector3 sides = 2 * solid.half_extents;
        return dCreateBox(space_, sides.x(), sides.y(), sides.z());
      }
      case Form::Sphere:
        return dCreateSphere(space_, solid.a);
      case Form::Capsule:
        return dCreateCapsule(space_, solid.a, 2 * solid.b);
      case Form::Hull: {
        arrays_.push_back(std::make_unique<OdeArrays>(mesh_of(solid)));
        OdeArrays& hull = *arrays_.back();
        return dCreateConvex(space_, hull.planes.data(), unsigned(hull.planes.size() / 4),
                             hull.points.data(), unsigned(hull.points.size() / 3),
                             hull.polygons.data());
      }
      case Form::Torus: {
        arrays_.push_back(std::make_unique<OdeArrays>(mesh_of(solid)));
        OdeArrays& torus = *arrays_.back();
        meshes_.push_back(dGeomTriMeshDataCreate());
        dGeomTriMeshDataBuildSingle(meshes_.back(), torus.vertices.data(), 3 * sizeof(float),
                                    int(torus.vertices.size() / 3), torus.triangles.data(),
                                    int(torus.triangles.size()), 3 * sizeof(dTriIndex));
        return dCreateTriMesh(space_, meshes_.back(), nullptr, nullptr, nullptr);
      }
    }
    return nullptr;
  }
  void add(const Solid& solid) {
    dGeomID geom = geom_of(solid);
    geoms_.push_back(geom);
    bodies_.push_back(nullptr);
    const Vector3& p = solid.start.translation();
    const Quaternion q = solid.start.quaternion();
    const dQuaternion turn{q.w(), q.x(), q.y(), q.z()};
    if (!solid.is_fixed) {
      const MassProperties own = solid.shape->compute_mass_properties(kDensity);
      dBodyID body = dBodyCreate(world_);
      dMass mass;
      const Matrix3& I = own.I_BBcm;
      dMassSetParameters(&mass, own.mass, 0, 0, 0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2),
                         I(1, 2));
      dBodySetMass(body, &mass);
      dGeomSetBody(geom, body);
      bodies_.back() = body;
    }
    dGeomSetPosition(geom, p.x(), p.y(), p.z());
    dGeomSetQuaternion(geom, turn);
  }
  static void collide(void* self, dGeomID a, dGeomID b) {
    auto& engine = *static_cast<OdeEngine*>(self);
    dBodyID body_a = dGeomGetBody(a);
    dBodyID body_b = dGeomGetBody(b);
    if (!body_a && !body_b) return;
    if (body_a && body_b && dAreConnected(body_a, body_b)) return;
    constexpr int kMost = 8;
    std::array<dContact, kMost> contacts;
    const int count = dCollide(a, b, kMost, &contacts[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      dContact& contact = contacts[std::size_t(i)];
      contact.surface.mode = dContactApprox1;
      contact.surface.mu = kFriction;
      dJointAttach(dJointCreateContact(engine.world_, engine.contacts_, &contact), body_a, body_b);
    }
  }

  dWorldID world_;
  dSpaceID space_;
  dJointGroupID contacts_;
  std::vector<dBodyID> bodies_;  // null: fixed
  std::vector<dGeomID> geoms_;
  std::vector<dTriMeshDataID> meshes_;
  std::vector<std::unique_ptr<OdeArrays>> arrays_;
};

// A model as MuJoCo reads it.
class MujocoText {
 public:
  explicit MujocoText(const Scene& scene) {
    text_.precision(17);
    text_ << "<mujoco><compiler angle='radian' exactmeshinertia='true'/><size njmax='8000' "
             "nconmax='3000' nstack='30000000'/><option timestep='"
          << scene.step << "' gravity='0 0 " << -kGravity << "'/><default><geom density='"
          << kDensity << "' friction='" << kFriction << " 0 0'/></default><asset>";
    for (std::size_t i = 0; i < scene.solids.size(); ++i) {
      if (scene.solids[i].form == Form::Hull) add_mesh(i, mesh_of(scene.solids[i]));
    }
    text_ << "</asset><worldbody><geom type='box' size='" << kFloorHalf.transpose()
          << "' pos='0 0 -1'/>";
    for (std::size_t i = 0; i < scene.solids.size(); ++i) add_body(i, scene.solids[i]);
    text_ << "</worldbody><equality>";
    for (const Pin& pin : scene.pins) {
      text_ << "<connect body1='b" << pin.b << "' anchor='"
            << held_point(scene, pin.b, pin.p_W).transpose() << "'";
      if (pin.a >= 0) text_ << " body2='b" << pin.a << "'";
      text_ << "/>";
    }
    text_ << "</equality><contact>";
    for (const Pin& pin : scene.pins) {
      if (pin.a < 0) continue;
      text_ << "<exclude body1='b" << pin.a << "' body2='b" << pin.b << "'/>";
    }
    text_ << "</contact></mujoco>";
  }
  std::string str() const { return text_.str(); }

 private:
  void add_mesh(std::size_t number, const TriangleMesh& mesh) {
    text_ << "<mesh name='m" << number << "' vertex='";
    for (const Vector3& p : mesh.vertices()) text_ << p.transpose() << ' ';
    text_ << "' face='";
    for (const TriangleIndices& t : mesh.triangles()) {
      text_ << t[0] << ' ' << t[1] << ' ' << t[2] << ' ';
    }
    text_ << "'/>";
  }
  void add_body(std::size_t number, const Solid& solid) {
    const Quaternion q = solid.start.quaternion();
    text_ << "<body name='b" << number << "' pos='" << solid.start.translation().transpose()
          << "' quat='" << q.w() << ' ' << q.vec().transpose() << "'>";
    if (!solid.is_fixed) text_ << "<freejoint/>";
    text_ << "<geom type=";
    switch (solid.form) {
      case Form::Box:
        text_ << "'box' size='" << solid.half_extents.transpose() << "'";
        break;
      case Form::Sphere:
        text_ << "'sphere' size='" << solid.a << "'";
        break;
      case Form::Capsule:
        text_ << "'capsule' size='" << solid.a << ' ' << solid.b << "'";
        break;
      default:
        text_ << "'mesh' mesh='m" << number << "'";
    }
    text_ << "/></body>";
  }
  std::ostringstream text_;
};

class MujocoEngine : public Engine {
 public:
  static bool can_step(const Scene& scene) {
    constexpr std::size_t kMostSolids = 300;
    return scene.solids.size() <= kMostSolids &&
           std::none_of(scene.solids.begin(), scene.solids.end(),
                        [](const Solid& solid) { return solid.form == Form::Torus; });
  }
  explicit MujocoEngine(const Scene& scene) : scene_(scene) {
    const std::string text = MujocoText(scene).str();
    constexpr const char* kName = "scene.xml";
    const auto files = std::make_unique<mjVFS>();
    mj_defaultVFS(files.get());
    mj_makeEmptyFileVFS(files.get(), kName, int(text.size()));
    std::copy(text.begin(), text.end(), static_cast<char*>(files->filedata[0]));
    std::array<char, 1000> error{};
    model_.reset(mj_loadXML(kName, files.get(), error.data(), int(error.size())));
    mj_deleteVFS(files.get());
    if (!model_) throw std::runtime_error("MuJoCo: " + std::string(error.data()));
    data_.reset(mj_makeData(model_.get()));
  }
  std::string name() const override { return "MuJoCo"; }
  void step(Scalar /*h*/) override {
    mj_step(model_.get(), data_.get());
    for (const int full : {mjWARN_CONTACTFULL, mjWARN_CNSTRFULL}) {
      if (data_->warning[full].number > 0) throw std::runtime_error("MuJoCo: too many contacts");
    }
  }
  std::vector<RigidPose> poses() const override {
    std::vector<RigidPose> result;
    const mjtNum* q = data_->qpos;
    for (const Solid& solid : scene_.solids) {
      if (solid.is_fixed) {
        result.push_back(solid.start);
        continue;
      }
      result.emplace_back(Quaternion(q[3], q[4], q[5], q[6]).normalized(),
                          Vector3(q[0], q[1], q[2]));
      q += 7;
    }
    return result;
  }

 private:
  struct Deleter {
    void operator()(mjModel* model) const { mj_deleteModel(model); }
    void operator()(mjData* data) const { mj_deleteData(data); }
  };
  const Scene& scene_;
  std::unique_ptr<mjModel, Deleter> model_;
  std::unique_ptr<mjData, Deleter> data_;
};

Solid box(const Vector3& half_extents, const RigidPose& start) {
  Solid solid;
  solid.half_extents = half_extents;
  solid.shape = std::make_shared<Box>(half_extents);
  solid.start = start;
  return solid;
}

Solid cube_at(const Vector3& p, Scalar gap) {
  return box(Vector3::Constant(0.5), RigidPose(p + Vector3(0, 0, gap)));
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
      scene.solids.push_back(cube_at({1.5 * (k % side), 1.5 * (k / side), level(i)}, 0));
    }
  }
  return scene;
}

// Its ends overhang by half a brick and fall.
Scene falling_wall(int length, int height, Scalar h) {
  Scene scene{"falling wall " + std::to_string(length) + " x " + std::to_string(height), {}, h};
  for (int i = 0; i < height; ++i) {
    for (int k = 0; k < length; ++k) {
      scene.solids.push_back(cube_at({1.01 * (k + 0.5 * (i % 2)), 0, level(i)}, 0));
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
      scene.solids.push_back(
          box(Vector3(is_half ? 0.25 : 0.5, 0.5, 0.5),
              RigidPose(Vector3(kPitch * (k - 0.5 * is_odd) + inward, 0, level(i)))));
    }
  }
  scene.name = "bricks, " + std::to_string(scene.solids.size());
  return scene;
}

Scene pyramid(int rows, Scalar h) {
  Scene scene{"pyramid of " + std::to_string(rows * (rows + 1) / 2), {}, h};
  for (int row = 0; row < rows; ++row) {
    for (int k = 0; k < rows - row; ++k) {
      scene.solids.push_back(cube_at({1.05 * (k + 0.5 * row), 0, level(row)}, 0));
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
    scene.solids.push_back(
        box(Vector3::Constant(0.5),
            RigidPose(rotation_from_vector(turn),
                      Vector3(1.6 * x + 0.13 * z, 1.6 * y - 0.11 * z, 1 + 1.8 * z))));
  }
  return scene;
}

// Bodies on a jittered grid above the floor, `pitch` apart, in layers of side x side; `make` gives
// the i-th of them at a pose.
void pour(Scene& scene, int count, int side, Scalar pitch,
          const std::function<Solid(int, const RigidPose&)>& make) {
  std::minstd_rand random(7);
  const auto jitter = [&random](Scalar size) {
    return size * (2 * Scalar(random()) / Scalar(std::minstd_rand::max()) - 1);
  };
  for (int i = 0; i < count; ++i) {
    const Vector3 p(pitch * (i % side - 0.5 * (side - 1)) + jitter(0.02 * pitch),
                    pitch * (i / side % side - 0.5 * (side - 1)) + jitter(0.02 * pitch),
                    pitch * (0.6 + i / side / side));
    const Vector3 turn(jitter(1.5), jitter(1.5), jitter(1.5));
    scene.solids.push_back(make(i, RigidPose(rotation_from_vector(turn), p)));
  }
}

// Four fixed walls around the middle, `half` away from it.
void add_bin(Scene& scene, Scalar half) {
  constexpr Scalar kHeight = 20;
  for (const Scalar sign : {-1.0, 1.0}) {
    for (const bool is_x : {true, false}) {
      const Vector3 away = is_x ? Vector3(half + 1, 0, 0) : Vector3(0, half + 1, 0);
      const Vector3 size = is_x ? Vector3(1, half + 2, kHeight) : Vector3(half + 2, 1, kHeight);
      scene.solids.push_back(box(size, RigidPose(sign * away + Vector3(0, 0, kHeight))));
      scene.solids.back().is_fixed = true;
    }
  }
}

Solid ball(Scalar radius, const RigidPose& start) {
  Solid solid;
  solid.form = Form::Sphere;
  solid.a = radius;
  solid.shape = std::make_shared<Sphere>(radius);
  solid.start = start;
  return solid;
}

Solid capsule(Scalar radius, Scalar half_length, const RigidPose& start) {
  Solid solid;
  solid.form = Form::Capsule;
  solid.a = radius;
  solid.b = half_length;
  solid.shape = std::make_shared<Capsule>(radius, half_length);
  solid.start = start;
  return solid;
}

// The hull of 20 to 60 points on an ellipsoid, about its centre of mass.
Solid hull(int number, const RigidPose& start) {
  std::minstd_rand random(unsigned(number) + 1);
  const auto signed_fraction = [&random] {
    return 2 * Scalar(random()) / Scalar(std::minstd_rand::max()) - 1;
  };
  std::vector<Vector3> points;
  const int count = 20 + number % 41;
  while (int(points.size()) < count) {
    const Vector3 p(signed_fraction(), signed_fraction(), signed_fraction());
    const Scalar length = p.norm();
    if (!(length > 0.1 && length < 1)) continue;
    points.push_back(Vector3(0.55, 0.5, 0.42).cwiseProduct(p / length));
  }
  const Vector3 center = ConvexHull(points).compute_mass_properties(kDensity).p_BoBcm;
  for (Vector3& p : points) p -= center;
  Solid solid;
  solid.form = Form::Hull;
  solid.shape = std::make_shared<ConvexHull>(std::move(points));
  solid.start = start;
  return solid;
}

Solid torus(Scalar middle, Scalar tube, const RigidPose& start) {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
  const auto at = [](int i, int k) { return std::int32_t((i % kAround) * kAcross + k % kAcross); };
  const Scalar turn = 2 * std::acos(Scalar{-1});
  for (int i = 0; i < kAround; ++i) {
    for (int k = 0; k < kAcross; ++k) {
      const Scalar u = turn * i / kAround;
      const Scalar v = turn * k / kAcross;
      const Scalar out = middle + tube * std::cos(v);
      vertices.emplace_back(out * std::cos(u), out * std::sin(u), tube * std::sin(v));
      triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  Solid solid;
  solid.form = Form::Torus;
  solid.a = middle;
  solid.b = tube;
  solid.shape = std::make_shared<TriangleMesh>(std::move(vertices), std::move(triangles));
  solid.start = start;
  return solid;
}

Scene spheres_in_bin(int count, Scalar h) {
  Scene scene{std::to_string(count) + " spheres in a bin", {}, h};
  add_bin(scene, 2.8);
  pour(scene, count, 5, 1.05,
       [](int, const RigidPose& X) { return ball(0.5, RigidPose(X.translation())); });
  return scene;
}

Scene spheres_fall(int count, Scalar h) {
  Scene scene{std::to_string(count) + " spheres fall", {}, h};
  pour(scene, count, int(std::ceil(std::cbrt(Scalar(count)))), 1.2,
       [](int, const RigidPose& X) { return ball(0.5, RigidPose(X.translation())); });
  return scene;
}

Scene hulls_in_bin(int count, Scalar h) {
  Scene scene{std::to_string(count) + " hulls in a bin", {}, h};
  add_bin(scene, 3);
  pour(scene, count, 5, 1.15, hull);
  return scene;
}

Scene hulls_fall(int count, Scalar h) {
  Scene scene{std::to_string(count) + " hulls fall", {}, h};
  pour(scene, count, int(std::ceil(std::cbrt(Scalar(count)))), 1.3, hull);
  return scene;
}

Scene tori_in_bin(int count, Scalar h) {
  Scene scene{std::to_string(count) + " tori in a bin", {}, h};
  add_bin(scene, 3.4);
  pour(scene, count, 5, 1.3, [](int, const RigidPose& X) { return torus(0.45, 0.15, X); });
  return scene;
}

// A trunk, a head, two arms and two legs of capsules, joined at five places, above the floor.
void add_ragdoll(Scene& scene, const RigidPose& X) {
  const int trunk = int(scene.solids.size());
  const Quaternion across = rotation_between(Vector3::UnitZ(), Vector3::UnitX());
  const auto add = [&](Scalar radius, Scalar half_length, const Quaternion& turn,
                       const Vector3& p) {
    scene.solids.push_back(capsule(radius, half_length, X * RigidPose(turn, p)));
  };
  const auto pin = [&](int limb, const Vector3& p) {
    scene.pins.push_back({trunk, trunk + limb, X * p});
  };
  const Quaternion upright = Quaternion::Identity();
  add(0.15, 0.25, upright, {0, 0, 0});
  add(0.12, 0.05, upright, {0, 0, 0.62});
  pin(1, {0, 0, 0.42});
  for (const Scalar side : {-1.0, 1.0}) {
    add(0.07, 0.25, across, {side * 0.56, 0, 0.25});
    pin(side < 0 ? 2 : 4, {side * 0.2, 0, 0.25});
    add(0.09, 0.35, upright, {side * 0.12, 0, -0.9});
    pin(side < 0 ? 3 : 5, {side * 0.12, 0, -0.42});
  }
}

Scene ragdolls(int count, Scalar h) {
  Scene scene{std::to_string(count) + " ragdolls", {}, h};
  std::minstd_rand random(11);
  const auto jitter = [&random](Scalar size) {
    return size * (2 * Scalar(random()) / Scalar(std::minstd_rand::max()) - 1);
  };
  const int side = int(std::ceil(std::cbrt(Scalar(count))));
  for (int i = 0; i < count; ++i) {
    const Vector3 p(2.2 * (i % side), 1.6 * (i / side % side), 1.8 + 2.6 * (i / side / side));
    const Vector3 turn(jitter(0.5), jitter(0.5), jitter(1.5));
    add_ragdoll(scene, RigidPose(rotation_from_vector(turn), p));
  }
  return scene;
}

// `count` capsules from a fixed point, at first level, and a ball of `load` times the mass of one
// of them at the end; nothing touches.
Scene rope(int count, Scalar load, Scalar h) {
  Scene scene{"rope of " + std::to_string(count) + ", load " + std::to_string(int(load)), {}, h};
  constexpr Scalar kRadius = 0.04;
  constexpr Scalar kHalf = 0.1;
  constexpr Scalar kPitch = 2 * kHalf;
  const Scalar z = kPitch * count + 5;
  const Quaternion across = rotation_between(Vector3::UnitZ(), Vector3::UnitX());
  for (int i = 0; i < count; ++i) {
    const Vector3 middle(kPitch * (i + 0.5), 0, z);
    scene.solids.push_back(capsule(kRadius, kHalf - kRadius, RigidPose(across, middle)));
    scene.pins.push_back({i - 1, i, Vector3(kPitch * i, 0, z)});
  }
  const Scalar link = scene.solids.back().shape->compute_mass_properties(kDensity).mass;
  const Scalar radius = std::cbrt(load * link / kDensity * 3 / 4 / std::acos(Scalar{-1}));
  const Vector3 end(kPitch * count, 0, z);
  scene.solids.push_back(ball(radius, RigidPose(end + Vector3(radius + kRadius, 0, 0))));
  scene.pins.push_back({count - 1, count, end});
  return scene;
}

// Of this thread; with several, the time that passes.
Scalar milliseconds(int threads) {
  timespec now{};
  clock_gettime(threads > 1 ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * Scalar(now.tv_sec) + Scalar(now.tv_nsec) / 1e6;
}

// How deep vertices of B are in a torus inside the mesh of A.
Scalar torus_depth(const Solid& a, const RigidPose& X_WA, const Solid& b, const RigidPose& X_WB) {
  const Scalar half_turn = std::acos(Scalar{-1});
  const Scalar tube =
      a.b * std::cos(half_turn / kAcross) - (a.a + a.b) * (1 - std::cos(half_turn / kAround));
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  Scalar depth = 0;
  for (const Vector3& p_B : mesh_of(b).vertices()) {
    const Vector3 p = X_AB * p_B;
    depth = std::max(depth, tube - std::hypot(std::hypot(p.x(), p.y()) - a.a, p.z()));
  }
  return depth;
}

// How deep the vertices of a torus are in a box.
Scalar box_depth(const Solid& a, const RigidPose& X_WA, const Solid& b, const RigidPose& X_WB) {
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  Scalar depth = 0;
  for (const Vector3& p_B : mesh_of(b).vertices()) {
    const Vector3 inside = a.half_extents - Vector3((X_AB * p_B).cwiseAbs());
    depth = std::max(depth, inside.minCoeff());
  }
  return depth;
}

Scalar depth_of(const Solid& a, const RigidPose& X_WA, const Solid& b, const RigidPose& X_WB) {
  const bool a_is_torus = a.form == Form::Torus;
  const bool b_is_torus = b.form == Form::Torus;
  if (a_is_torus && b_is_torus) {
    return std::max(torus_depth(a, X_WA, b, X_WB), torus_depth(b, X_WB, a, X_WA));
  }
  if (a_is_torus) return box_depth(b, X_WB, a, X_WA);
  if (b_is_torus) return box_depth(a, X_WA, b, X_WB);
  const auto found = find_penetration(static_cast<const ConvexShape&>(*a.shape), X_WA,
                                      static_cast<const ConvexShape&>(*b.shape), X_WB);
  return found ? found->depth : 0;
}

Scalar deepest(const Scene& scene, const std::vector<RigidPose>& poses) {
  Scalar depth = 0;
  const Solid floor = box(kFloorHalf, RigidPose(Vector3(0, 0, -1)));
  std::vector<std::pair<int, int>> joined;
  for (const Pin& pin : scene.pins) joined.emplace_back(pin.a, pin.b);
  std::sort(joined.begin(), joined.end());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Solid& a = scene.solids[i];
    const Scalar radius = a.shape->bounding_radius();
    if (!a.is_fixed && poses[i].translation().z() < radius) {
      depth = std::max(depth, depth_of(floor, floor.start, a, poses[i]));
    }
    for (std::size_t k = 0; k < i; ++k) {
      const Solid& b = scene.solids[k];
      const Scalar reach = radius + b.shape->bounding_radius();
      if (a.is_fixed && b.is_fixed) continue;
      if ((poses[i].translation() - poses[k].translation()).norm() > reach) continue;
      if (std::binary_search(joined.begin(), joined.end(), std::pair(int(k), int(i)))) continue;
      depth = std::max(depth, depth_of(b, poses[k], a, poses[i]));
    }
  }
  return depth;
}

Scalar widest_pin(const Scene& scene, const std::vector<RigidPose>& poses) {
  Scalar widest = 0;
  for (const Pin& pin : scene.pins) {
    const auto at = [&](int body) -> Vector3 {
      const Vector3 p = held_point(scene, body, pin.p_W);
      return body < 0 ? p : poses[std::size_t(body)] * p;
    };
    widest = std::max(widest, (at(pin.a) - at(pin.b)).norm());
  }
  return widest;
}

// What overlaps at the start is pushed apart, each engine in its own way, and nothing can be compared.
void require_apart(const Scene& scene) {
  std::vector<RigidPose> poses;
  for (const Solid& solid : scene.solids) poses.push_back(solid.start);
  if (deepest(scene, poses) > 0) throw std::runtime_error(scene.name + ": overlaps at the start");
}

void measure(const Scene& scene, Engine& engine, Scalar end, int threads) {
  std::vector<Scalar> spent;
  Scalar depth = 0;
  Scalar open = 0;
  const int steps = int(std::lround(end / scene.step));
  for (int k = 1; k <= steps; ++k) {
    const Scalar begin = milliseconds(threads);
    engine.step(scene.step);
    spent.push_back(milliseconds(threads) - begin);
    if (k % 10 != 0) continue;
    const std::vector<RigidPose> poses = engine.poses();
    depth = std::max(depth, deepest(scene, poses));
    open = std::max(open, widest_pin(scene, poses));
  }
  Scalar moved = 0;
  const std::vector<RigidPose> poses = engine.poses();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    moved = std::max(moved, (poses[i].translation() - scene.solids[i].start.translation()).norm());
  }
  const auto mean = [&](std::size_t first) {
    return std::accumulate(spent.begin() + std::ptrdiff_t(first), spent.end(), Scalar{0}) /
           Scalar(spent.size() - first);
  };
  std::printf("%-24s %-7s %9.3f %9.3f %9.3f %9.1e %9.1e %9.1e\n", scene.name.c_str(),
              engine.name().c_str(), mean(0), mean(spent.size() * 4 / 5),
              *std::max_element(spent.begin(), spent.end()), depth, open, moved);
  engine.print_parts(steps);
  std::fflush(stdout);
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  using namespace dyop::testing;
  const double end = argc > 1 ? std::atof(argv[1]) : 2;
  const std::string part = argc > 2 ? argv[2] : "";
  const bool has_parts = argc > 3;
  const int threads = argc > 4 ? std::atoi(argv[4]) : 1;
  std::printf("%-24s %-7s %9s %9s %9s %9s %9s %9s\n", "scene", "engine", "ms/step", "last 1/5",
              "worst", "overlap", "open", "moved");
  for (const Scene& scene :
       {columns(1, 10, 0.01), columns(100, 10, 1.0 / 60), pyramid(20, 1.0 / 60),
        bricks(50, 20, 1.0 / 60), falling_wall(20, 10, 1.0 / 60), pile(5, 0.01), pile(10, 0.01),
        spheres_in_bin(250, 0.01), spheres_in_bin(1000, 0.01), spheres_fall(1000, 0.01),
        hulls_in_bin(250, 0.01), hulls_fall(1000, 0.01), tori_in_bin(100, 0.01), ragdolls(27, 0.01),
        ragdolls(100, 0.01), rope(20, 1, 0.01), rope(20, 1000, 0.01)}) {
    if (scene.name.find(part) == std::string::npos) continue;
    require_apart(scene);
    DyopEngine dyop(scene, has_parts, threads);
    measure(scene, dyop, end, threads);
    if (argc > 4) continue;
    BulletEngine bullet(scene);
    measure(scene, bullet, end, threads);
    OdeEngine ode(scene);
    measure(scene, ode, end, threads);
    if (!MujocoEngine::can_step(scene)) continue;
    MujocoEngine mujoco(scene);
    measure(scene, mujoco, end, threads);
  }
  return 0;
}
