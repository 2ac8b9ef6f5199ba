// SPDX-License-Identifier: BSD-3-Clause

// The nut of the generated bolt scene against the closed form of a screw.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/io/scene_file.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

// As in the scene: the flanks rise by 0.25 over 0.14 along the axis; both threads overlap from the
// nut's root to the bolt's crest, and the nut's is wider by 0.04.
constexpr Scalar kLead = 0.4 / (2 * std::numbers::pi);  // per radian
constexpr Scalar kSteepness = 0.14 / 0.25;
constexpr Scalar kInner = 0.79;
constexpr Scalar kOuter = 1;
constexpr Scalar kPlay = 0.04 * kSteepness;  // along the axis, from the middle to either side
// Both threads are polygons of 60 sides: ridges on the flanks, as high as the sagitta lets them.
const Scalar kRidge = kOuter * (1 - std::cos(std::numbers::pi / 60)) * kSteepness;

class BoltScene {
 public:
  BoltScene(Scalar friction, Scalar torque, Scalar spin) : scene_(make(friction, torque, spin)) {}

  void run_to(Scalar end) {
    while (world_.time() < end - scene_.step / 2) {
      const Matrix3 before = nut().X_WB.rotation();
      ASSERT_EQ(world_.advance(scene_.step).status, AdvanceStatus::Completed);
      angle_ += rotation_vector(nut().X_WB.rotation() * before.transpose()).z();
    }
  }

  MotionState nut() const { return world_.state(world_.bodies()[1]); }
  Scalar angle() const { return angle_; }
  /// How far the nut is from the middle of its play, along the axis.
  Scalar out_of_middle() const {
    return nut().X_WB.translation().z() - scene_.bodies[1].initial.X_WB.translation().z() -
           kLead * angle_;
  }
  const MassProperties& mass_properties() const { return scene_.bodies[1].mass_properties; }

 private:
  static Scene make(Scalar friction, Scalar torque, Scalar spin) {
    const testing::TemporaryDirectory directory;
    const std::filesystem::path file = directory.path() / "scene.json";
    write_generated_scene(generate_scene("bolt", 2), file);
    Scene scene = load_scene(file);
    scene.options.records_motions = false;
    for (BodyDefinition& body : scene.bodies) body.friction = friction;
    BodyDefinition& nut = scene.bodies[1];
    nut.initial.twist = {Vector3(0, 0, kLead * spin), Vector3(0, 0, spin)};
    nut.wrench = [torque](Scalar, const MotionState&) {
      return Wrench{Vector3::Zero(), Vector3(0, 0, torque)};
    };
    return scene;
  }

  Scene scene_;
  World world_ = make_world(scene_);
  Scalar angle_ = 0;
};

// A screw under its weight m g and a torque T that turns it down, friction acting at the radius r.
// The flank's normal is (s, l / r, 1) / q along (radius, turn, axis) with its steepness s and the
// lead l per radian, the thread's direction (1, l / r) / p along (turn, axis):
//   m l a = m g - N (1 / q + mu l / (r p)),   I a = T + N (l / q - mu r / p).
Scalar screw_acceleration(const MassProperties& nut, Scalar torque, Scalar friction,
                          Scalar radius) {
  const Scalar slope = kLead / radius;
  const Scalar q = std::sqrt(1 + kSteepness * kSteepness + slope * slope);
  const Scalar p = std::sqrt(1 + slope * slope);
  const Scalar lever = (kLead / q - friction * radius / p) / (1 / q + friction * slope / p);
  const Scalar gravity = 9.81;
  return (torque + lever * nut.mass * gravity) / (nut.I_BBcm(2, 2) + lever * nut.mass * kLead);
}

// From when it has come down on the flanks. Its weight adds 0.37 to an acceleration of 6.7, and
// friction 0.1 takes away 0.6; what remains is lost where ridges of the facets land on each other.
TEST(Bolt, ATorqueTurnsTheNutDownAsTheClosedFormSays) {
  constexpr Scalar kTorque = 1e5;
  for (const Scalar friction : {0.0, 0.1}) {
    BoltScene bolt(friction, -kTorque, 0);
    bolt.run_to(0.12);
    const Scalar before = bolt.nut().twist.w_WB.z();
    bolt.run_to(0.24);
    const Scalar found = (before - bolt.nut().twist.w_WB.z()) / 0.12;
    const auto expected = [&](Scalar radius) {
      return screw_acceleration(bolt.mass_properties(), kTorque, friction, radius);
    };
    EXPECT_LT(found, 1.005 * expected(kInner)) << friction;
    EXPECT_GT(found, 0.995 * expected(kOuter)) << friction;
    EXPECT_LT(expected(kOuter), 1.0001 * expected(kInner));
  }
}

// It hops over the ridges of its facets, but stays at the flanks: its way is the lead times its
// turn.
TEST(Bolt, ATurningNutAdvancesByThePitch) {
  BoltScene bolt(0, 0, -3);
  bolt.run_to(0.1);
  const Scalar begin = bolt.out_of_middle();
  const Scalar angle = bolt.angle();
  EXPECT_NEAR(begin, -kPlay, 1.5 * kRidge);
  for (const Scalar t : {0.2, 0.3, 0.4, 0.5}) {
    bolt.run_to(t);
    EXPECT_NEAR(bolt.out_of_middle(), begin, 1.5 * kRidge) << t;
  }
  EXPECT_LT(bolt.angle() - angle, -1.2);  // a fifth of a turn, twelve facets
}

}  // namespace
}  // namespace dyop
