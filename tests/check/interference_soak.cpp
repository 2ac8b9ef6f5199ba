// SPDX-License-Identifier: BSD-3-Clause

// Worlds in which a caller does all that World lets him between two steps, recorded and checked by
// dyop-check: a run that it does not prove, or whose laws it finds broken, is a fault.
//   interference_soak COUNT [SEED]
// Prints the verdicts of faults, and exits with 1 if there was one. The recording stays.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "check/check.h"
#include "dyop/dynamics/world.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/recording.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/temporary_directory.h"

namespace dyop::testing {
namespace {

class InterferedWorld {
 public:
  InterferedWorld(std::uint64_t seed, const std::filesystem::path& file)
      : random_(seed), world_(options()), writer_(file, {}) {
    add_floor();
    for (int k = 0; k < 6; ++k) add_dynamic();
    add_stirrer();
  }

  void run(int steps) {
    for (int k = 0; k < steps; ++k) {
      if (one_in(3)) interfere();
      writer_.write(world_.advance(one_in(4) ? 0.02 : 0.01), world_);
    }
    writer_.finish();
  }

  const std::string& log() const { return log_; }

 private:
  static WorldOptions options() {
    WorldOptions options;
    options.gravity_W = Vector3(0, 0, -10);
    options.records_impulses = true;
    options.thread_count = 1;
    return options;
  }

  bool one_in(int n) { return random_index(n, random_) == 0; }
  Scalar number(Scalar low, Scalar high) { return random_number(low, high, random_); }
  Vector3 place() { return {number(-2, 2), number(-2, 2), number(0.6, 4)}; }

  std::shared_ptr<const Shape> any_shape() {
    const Scalar r = number(0.1, 0.3);
    switch (random_index(8, random_)) {
      case 0:
        return std::make_shared<Sphere>(r);
      case 1:
        return std::make_shared<Capsule>(r / 2, r);
      case 2:
        return std::make_shared<Cylinder>(r, r / 2);
      case 3:
        return std::make_shared<Ellipsoid>(Vector3(r, r / 2, r * 0.7));
      case 4:
        return std::make_shared<RoundedBox>(Vector3(r, r / 2, r / 2), r / 5);
      case 5:
        return std::make_shared<TaperedCapsule>(r, r / 2, r);
      case 6:
        return std::make_shared<TriangleMesh>(testing::box_mesh(Vector3(r, r, r)).mesh());
      default:
        return std::make_shared<Box>(Vector3(r, r / 2, r));
    }
  }

  void add_floor() {
    BodyDefinition floor;
    floor.name = "floor";
    floor.kind = BodyKind::Static;
    floor.shape = std::make_shared<HalfSpace>();
    if (one_in(2)) floor.shape = std::make_shared<Box>(Vector3(9, 9, 1));
    if (one_in(2)) floor.initial.X_WB = RigidPose(Vector3(0, 0, -1));
    if (dynamic_cast<const Box*>(floor.shape.get()))
      floor.initial.X_WB = RigidPose(-Vector3::UnitZ());
    world_.add_body(floor);
  }

  BodyId add_dynamic() {
    BodyDefinition body;
    body.name = std::to_string(next_name_++);
    body.shape = any_shape();
    body.mass_properties = body.shape->compute_mass_properties(1000);
    body.initial = {RigidPose(rotation_from_vector(random_vector(2, random_)), place()),
                    Twist{random_vector(2, random_), random_vector(4, random_)}};
    body.friction = number(0, 1);
    body.restitution = number(0, 1);
    body.is_sensor = one_in(8);
    if (one_in(8)) body.locked.rotation = {true, true, one_in(2)};
    return world_.add_body(body);
  }

  void add_stirrer() {
    BodyDefinition body;
    body.name = "stirrer";
    body.kind = BodyKind::Kinematic;
    body.shape = std::make_shared<Capsule>(0.1, 1);
    body.motion = std::make_shared<ConstantTwistMotion>(
        RigidPose(rotation_from_vector(Vector3(0, 1.5, 0)), Vector3(0, 0, 0.5)),
        Twist{Vector3::Zero(), Vector3(0, 0, number(-2, 2))});
    world_.add_body(body);
  }

  BodyId any_body(BodyKind kind) {
    std::vector<BodyId> found;
    for (const BodyId id : world_.bodies()) {
      if (world_.body(id).kind == kind) found.push_back(id);
    }
    if (found.empty()) return add_dynamic();  // the stirrer is never removed
    return found[std::size_t(random_index(int(found.size()), random_))];
  }

  void interfere() {
    const int what = random_index(20, random_);
    log_ += std::to_string(what) + " at " + std::to_string(world_.time()) + ", ";
    if (what < 7) return change_body(what);
    if (what < 14) return change_more_of_body(what);
    change_rules(what);
  }

  void change_body(int what) {
    const BodyId id = any_body(BodyKind::Dynamic);
    switch (what) {
      case 0:
        add_dynamic();
        return;
      case 1:
        return world_.remove_body(id);
      case 2:
        return world_.set_enabled(id, !world_.is_enabled(id));
      case 3: {
        MotionState state = world_.state(id);
        state.X_WB = RigidPose(state.X_WB.rotation(), place());
        return world_.set_state(id, state);
      }
      case 4:
        return world_.set_shape(id, any_shape());
      case 5: {
        MassProperties mass =
            with_mass(world_.body(id).shape->compute_mass_properties(1), number(1, 100));
        if (one_in(2)) mass.p_BoBcm += random_vector(0.02, random_);
        return world_.set_mass_properties(id, mass);
      }
      default:
        return world_.set_wrench(
            id, one_in(2) ? WrenchCallback() : [](Scalar t, const MotionState&) {
              return Wrench{Vector3(std::sin(t), 1, 0), Vector3(0, 0.1, 0)};
            });
    }
  }

  void change_more_of_body(int what) {
    const BodyId id = any_body(BodyKind::Dynamic);
    switch (what) {
      case 7:
        return world_.apply_impulse(id, random_vector(10, random_));
      case 8:
        return world_.apply_angular_impulse(id, random_vector(1, random_));
      case 9:
        return world_.set_material(id, {number(0, 1), number(0, 1), 0, 0});
      case 10:
        return world_.set_pair_material(id, world_.bodies().front(),
                                        Material{number(0, 1), number(0, 1), 0, 0});
      case 11:
        return world_.set_filter(id, one_in(2) ? CollisionFilter{} : CollisionFilter{1, 0, 0});
      case 12: {
        const BodyId stirrer = any_body(BodyKind::Kinematic);
        RigidPose X = world_.state(stirrer).X_WB;
        X = RigidPose(X.rotation(), X.translation() + random_vector(0.02, random_));
        return world_.set_next_pose(stirrer, X, world_.time() + 0.1);
      }
      default: {
        const BodyId stirrer = any_body(BodyKind::Kinematic);
        return world_.set_motion(
            stirrer,
            std::make_shared<ConstantTwistMotion>(
                world_.state(stirrer).X_WB,
                Twist{random_vector(0.2, random_), random_vector(2, random_)}, world_.time()));
      }
    }
  }

  void change_rules(int what) {
    const BodyId a = any_body(BodyKind::Dynamic);
    const BodyId b = world_.bodies()[std::size_t(random_index(int(world_.body_count()), random_))];
    if (a == b) return;
    switch (what) {
      case 14:
        return world_.set_gravity({number(-3, 3), 0, number(-12, -5)});
      case 15:
        return world_.set_pair_enabled(a, b, one_in(2));
      case 16:
        return world_.set_target_distance(a, b, number(0, 2e-3));
      case 17:
        return add_joint(a, b);
      case 18:
        if (!world_.joints().empty()) world_.remove_joint(world_.joints().front());
        return;
      default:
        if (!world_.springs().empty() && one_in(2)) {
          return world_.remove_spring(world_.springs().front());
        }
        SpringDefinition spring;
        spring.a = a;
        spring.b = b;
        spring.stiffness = number(10, 200);
        spring.damping = number(0, 2);
        world_.add_spring(spring);
    }
  }

  void add_joint(BodyId a, BodyId b) {
    if (dynamic_cast<const HalfSpace*>(world_.body(b).shape.get())) return;
    JointDefinition joint;
    joint.a = a;
    joint.b = b;
    joint.kind = one_in(2) ? JointKind::Ball : JointKind::Fixed;
    joint.X_AJ = RigidPose();
    joint.X_BJ = world_.state(b).X_WB.inverse() * world_.state(a).X_WB;
    joint.bodies_collide = one_in(4);
    if (one_in(3)) joint.break_force = 500;
    world_.add_joint(joint);
  }

  std::mt19937_64 random_;
  World world_;
  RecordingWriter writer_;
  int next_name_ = 0;
  std::string log_;
};

int run(int count, std::uint64_t seed) {
  const TemporaryDirectory directory;
  std::map<int, int> codes;
  for (int k = 0; k < count; ++k) {
    const std::filesystem::path file = directory.path() / "run.h5";
    InterferedWorld world(seed + std::uint64_t(k), file);
    world.run(60);
    std::ostringstream words;
    const int code = dyop_check::check_file(file.string(), 1, words, words);
    if (++codes[code] <= 5 && code != 0) {
      const std::filesystem::path kept =
          std::filesystem::temp_directory_path() /
          (std::to_string(seed + std::uint64_t(k)) + ".interference.h5");
      std::filesystem::copy_file(file, kept, std::filesystem::copy_options::overwrite_existing);
      std::printf("seed %llu, kept as %s, after %s\n%s\n",
                  static_cast<unsigned long long>(seed + std::uint64_t(k)), kept.c_str(),
                  world.log().c_str(), words.str().c_str());
    }
  }
  for (const auto& [code, times] : codes) std::printf("code %d: %d runs\n", code, times);
  return codes[0] == count ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  if (argc < 2) {
    std::puts("Usage: interference_soak COUNT [SEED]");
    return 2;
  }
  return dyop::testing::run(std::atoi(argv[1]), argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
}
