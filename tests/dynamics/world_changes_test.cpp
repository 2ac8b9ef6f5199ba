// SPDX-License-Identifier: BSD-3-Clause

// What may be changed between steps: impulses, masses, shapes, filters, materials; and what a World
// tells of contacts and of sensors that move.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "dyop/geometry/compound_shape.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using namespace testing;
using testing::message_of;

std::vector<ContactEvent> run_changes(World& world, Scalar time, Scalar h = 0.01) {
  std::vector<ContactEvent> events;
  const int steps = static_cast<int>(std::lround(time / h));
  for (int k = 0; k < steps; ++k) {
    const AdvanceReport report = world.advance(h);
    EXPECT_EQ(report.status, AdvanceStatus::Completed);
    events.insert(events.end(), report.contact_events.begin(), report.contact_events.end());
  }
  return events;
}

const auto kBrick = std::make_shared<Box>(Vector3(0.3, 0.2, 0.1));

TEST(WorldChanges, AnImpulseGivesMomentumAndSpin) {
  World world;
  BodyDefinition body = dynamic_body("brick", kBrick, {1, 2, 3});
  const Matrix3 R = rotation_from_vector(Vector3(0.4, -0.3, 1));
  body.initial.X_WB = RigidPose(R, {1, 2, 3});
  const BodyId id = world.add_body(body);
  const Vector3 impulse(3, -1, 2);
  const Vector3 arm(0.2, 0.1, -0.3);
  world.apply_impulse(id, impulse, Vector3(1, 2, 3) + arm);
  const Matrix3 I_W = R * body.mass_properties.I_BBcm * R.transpose();
  EXPECT_LT((world.state(id).twist.v_WB - impulse / body.mass_properties.mass).norm(), 1e-12);
  EXPECT_LT((world.state(id).twist.w_WB - I_W.inverse() * arm.cross(impulse)).norm(), 1e-12);
  world.apply_angular_impulse(id, -arm.cross(impulse));
  EXPECT_LT(world.state(id).twist.w_WB.norm(), 1e-12);
  EXPECT_LT((world.momentum() - impulse).norm(), 1e-12);
  world.advance(0.5);
  EXPECT_LT((world.state(id).X_WB.translation() -
             (Vector3(1, 2, 3) + 0.5 * impulse / body.mass_properties.mass))
                .norm(),
            1e-9);
}

TEST(WorldChanges, AnImpulseLeavesLockedAxesAndWakes) {
  World world(earth_options());
  const BodyId floor = world.add_body(floor_body(0.5));
  BodyDefinition body = resting_cube(0, 0, 0);
  body.locked.translation[1] = true;
  body.locked.rotation = {true, true, true};
  const BodyId id = world.add_body(body);
  run_changes(world, 2);
  EXPECT_TRUE(world.is_asleep(id));
  world.apply_impulse(id, {4000, 4000, 0}, world.state(id).X_WB * Vector3(0.1, 0.2, 0.3));
  EXPECT_FALSE(world.is_asleep(id));
  EXPECT_LT((world.state(id).twist.v_WB - Vector3(4, 0, 0)).norm(), 1e-12);
  EXPECT_LT(world.state(id).twist.w_WB.norm(), 1e-12);
  // It slides as far as friction lets it: v^2 / (2 mu g).
  run_changes(world, 2);
  EXPECT_NEAR(world.state(id).X_WB.translation().x(), 16 / (2 * 0.5 * kGravity), 0.01);
  EXPECT_NE(message_of([&] {
              world.apply_impulse(floor, {1, 0, 0});
            }).find("only a dynamic body"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              world.apply_impulse(id, {kInfinity, 0, 0});
            }).find("finite"),
            std::string::npos);
}

TEST(WorldChanges, AHeavierBodyGoesOnAsFastAndFeelsLess) {
  World world;
  BodyDefinition body = dynamic_body("brick", kBrick, {0, 0, 0}, {1, 0, 0}, {0, 0, 2});
  body.wrench = [](Scalar, const MotionState&) {
    return Wrench{Vector3(0, 60, 0), Vector3::Zero()};
  };
  const BodyId id = world.add_body(body);
  MassProperties heavy = body.mass_properties;
  heavy.mass *= 3;
  heavy.I_BBcm *= 3;
  heavy.p_BoBcm = Vector3(0.1, 0, 0);
  world.set_mass_properties(id, heavy);
  EXPECT_LT((world.state(id).twist.v_WB - Vector3(1, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR(world.momentum().y(), heavy.mass * 0.2, 1e-9);  // the centre turns with it
  run_changes(world, 1);
  EXPECT_NEAR(world.momentum().y(), heavy.mass * 0.2 + 60, 1e-6);
  EXPECT_NEAR(world.state(id).twist.w_WB.z(), 2, 1e-9);
  heavy.mass = -1;
  EXPECT_NE(message_of([&] { world.set_mass_properties(id, heavy); }).find("mass must be"),
            std::string::npos);
}

TEST(WorldChanges, AnotherShapeRestsWhereItLies) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  BodyDefinition body = dynamic_body("ball", std::make_shared<Sphere>(0.5), {0, 0, 0.51});
  body.restitution = 0;
  const BodyId id = world.add_body(body);
  BodyDefinition rider =
      dynamic_body("rider", std::make_shared<Box>(Vector3(0.4, 0.4, 0.1)), {0, 0, 1.12});
  rider.restitution = 0;
  const BodyId upper = world.add_body(rider);
  run_changes(world, 3);
  EXPECT_TRUE(world.is_asleep(upper));
  world.set_shape(id, std::make_shared<Box>(Vector3(0.5, 0.5, 0.3)));
  EXPECT_FALSE(world.is_asleep(upper));
  run_changes(world, 3);
  EXPECT_NEAR(world.state(id).X_WB.translation().z(), 0.3, 1e-3);
  EXPECT_NEAR(world.state(upper).X_WB.translation().z(), 0.7, 2e-3);
  EXPECT_TRUE(world.is_asleep(upper));
  // One that is too large for its place is told of, and pushed out.
  world.set_shape(id, std::make_shared<Box>(Vector3(0.5, 0.5, 0.32)));
  EXPECT_FALSE(world.advance(0.01).too_near.empty());
  run_changes(world, 3);
  EXPECT_NEAR(world.state(id).X_WB.translation().z(), 0.32, 1e-3);
  EXPECT_NE(message_of([&] { world.set_shape(id, nullptr); }).find("shape is missing"),
            std::string::npos);
}

// Whether a cube comes to lie on the floor, by the filters of both.
bool lies(const CollisionFilter& cube_filter, const CollisionFilter& floor_filter) {
  World world(earth_options());
  BodyDefinition floor = floor_body(0.5);
  floor.filter = floor_filter;
  world.add_body(floor);
  BodyDefinition cube = resting_cube(0, 0, 0);
  cube.filter = cube_filter;
  const BodyId id = world.add_body(cube);
  run_changes(world, 0.5);
  return world.state(id).X_WB.translation().z() > 0.4;
}

TEST(WorldChanges, FiltersSayWhatCollides) {
  EXPECT_TRUE(lies({}, {}));
  EXPECT_TRUE(lies({2, 1, 0}, {1, 2, 0}));
  EXPECT_FALSE(lies({2, 1, 0}, {1, 4, 0}));  // the floor does not see the cube
  EXPECT_FALSE(lies({2, 4, 0}, {1, 2, 0}));  // nor the other way round
  EXPECT_TRUE(lies({2, 4, 3}, {1, 4, 3}));   // one group
  EXPECT_FALSE(lies({1, 1, -3}, {1, 1, -3}));
  EXPECT_TRUE(lies({1, 1, -3}, {1, 1, -4}));  // two groups: bits decide
}

TEST(WorldChanges, AFilterThatChangesLetsFallAndAPairMayOverrideIt) {
  World world(earth_options());
  const BodyId floor = world.add_body(floor_body(0.5));
  const BodyId id = world.add_body(resting_cube(0, 0, 0));
  run_changes(world, 2);
  EXPECT_TRUE(world.is_asleep(id));
  world.set_filter(id, {1, 0, 0});
  run_changes(world, 0.2);
  EXPECT_NEAR(world.state(id).twist.v_WB.z(), -0.2 * kGravity, 1e-6);
  MotionState state = world.state(id);
  state.X_WB = RigidPose(Vector3(0, 0, 0.6));
  state.twist = {};
  world.set_state(id, state);
  world.set_pair_enabled(id, floor, true);
  run_changes(world, 1);
  EXPECT_NEAR(world.state(id).X_WB.translation().z(), 0.5, 1e-2);
}

// How fast a cube is after a second down a slope of 45 degrees.
Scalar slide(CombineRule rule, Scalar cube_friction, Scalar floor_friction,
             std::optional<Scalar> own = {}) {
  WorldOptions options;
  const Scalar g = kGravity / std::sqrt(2.0);
  options.gravity_W = Vector3(g, 0, -g);
  options.combine_friction = rule;
  World world(options);
  const BodyId floor = world.add_body(floor_body(floor_friction));
  const BodyId id = world.add_body(resting_cube(0, 0, 0, cube_friction));
  if (own) {
    Material material;
    material.friction = *own;
    material.restitution = 0;
    world.set_pair_material(floor, id, material);
    EXPECT_EQ(world.pair_material(id, floor).friction, *own);
  }
  run_changes(world, 1);
  const Scalar fast = world.state(id).twist.v_WB.x();
  if (own) {
    world.set_pair_material(id, floor, std::nullopt);
    run_changes(world, 0.5);
    const Scalar usual = std::sqrt(cube_friction * floor_friction);
    EXPECT_NEAR(world.state(id).twist.v_WB.x(), fast + 0.5 * g * (1 - usual), 2e-3);
  }
  return fast / g;
}

TEST(WorldChanges, CoefficientsCombineAsTheOptionsSay) {
  EXPECT_NEAR(slide(CombineRule::GeometricMean, 0.9, 0.4), 1 - 0.6, 1e-3);
  EXPECT_NEAR(slide(CombineRule::Mean, 0.9, 0.4), 1 - 0.65, 1e-3);
  EXPECT_NEAR(slide(CombineRule::Product, 0.9, 0.4), 1 - 0.36, 1e-3);
  EXPECT_NEAR(slide(CombineRule::Minimum, 0.9, 0.4), 1 - 0.4, 1e-3);
  EXPECT_NEAR(slide(CombineRule::Maximum, 0.9, 0.4), 1 - 0.9, 1e-3);
  EXPECT_NEAR(slide(CombineRule::GeometricMean, 0.9, 0.4, 0.2), 1 - 0.2, 1e-3);
}

TEST(WorldChanges, RestitutionCombinesToo) {
  const auto bounce = [](CombineRule rule, std::optional<Scalar> own) {
    WorldOptions options = earth_options();
    options.combine_restitution = rule;
    World world(options);
    const BodyId floor = world.add_body(floor_body(0.5, 0.8));
    BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.1), {0, 0, 1});
    ball.restitution = 0.5;
    const BodyId id = world.add_body(ball);
    if (own) world.set_pair_material(floor, id, Material{*own, 0.5, 0, 0});
    for (int k = 0; k < 100; ++k) {
      const AdvanceReport report = world.advance(0.01);
      if (report.impacts.empty()) continue;
      const WorldContact& contact = report.impacts[0].contacts[0];
      const Scalar mass = ball.mass_properties.mass;
      return contact.impulse_W.norm() / mass / -contact.normal_velocity - 1;
    }
    return Scalar{-1};
  };
  EXPECT_NEAR(bounce(CombineRule::Minimum, {}), 0.5, 1e-6);
  EXPECT_NEAR(bounce(CombineRule::Product, {}), 0.4, 1e-6);
  EXPECT_NEAR(bounce(CombineRule::Maximum, {}), 0.8, 1e-6);
  EXPECT_NEAR(bounce(CombineRule::Minimum, 0.7), 0.7, 1e-6);
}

TEST(WorldChanges, PairsRefuseBadMaterials) {
  World world;
  const BodyId floor = world.add_body(floor_body(0.5));
  const BodyId id = world.add_body(resting_cube(0, 0, 0));
  const std::string message = message_of([&] {
    world.set_pair_material(floor, id, Material{1.5, 0.5, 0, 0});
  });
  EXPECT_NE(message.find("body 'floor' with 'cube': restitution must be in [0, 1], not 1.5"),
            std::string::npos)
      << message;
}

// Begin and end take turns, for each pair.
void expect_turns(const std::vector<ContactEvent>& events) {
  std::map<std::pair<BodyId, BodyId>, bool> touches;
  Scalar last = 0;
  for (const ContactEvent& event : events) {
    bool& touching = touches[{event.a, event.b}];
    EXPECT_NE(touching, event.is_begin);
    touching = event.is_begin;
    EXPECT_GE(event.t, last - 0.01);
    last = event.t;
  }
}

TEST(WorldChanges, ContactsAreToldWhenTheyBeginAndEnd) {
  World world(earth_options());
  const BodyId floor = world.add_body(floor_body(0.5));
  const BodyId id = world.add_body(dynamic_body("brick", kBrick, {0, 0, 0.6}));
  const BodyId far = world.add_body(dynamic_body("far", kBrick, {5, 0, 50}));
  std::vector<ContactEvent> events = run_changes(world, 1);
  expect_turns(events);
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events[0].a, floor);
  EXPECT_EQ(events[0].b, id);
  EXPECT_TRUE(events[0].is_begin);
  EXPECT_NEAR(events[0].t, std::sqrt(2 * 0.5 / kGravity), 1e-3);
  EXPECT_TRUE(events.back().is_begin);  // it lies
  run_changes(world, 1);
  EXPECT_TRUE(world.is_asleep(id));
  EXPECT_TRUE(run_changes(world, 0.5).empty());
  world.apply_impulse(id, world.body(id).mass_properties.mass * Vector3(0, 0, 3));
  events = run_changes(world, 0.3);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_FALSE(events[0].is_begin);
  for (const ContactEvent& event : events) EXPECT_NE(event.b, far);
}

TEST(WorldChanges, ABounceWithinAStepBeginsAndEnds) {
  World world(earth_options());
  world.add_body(floor_body(0.5, 1));
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.1), {0, 0, 1.1});
  ball.restitution = 1;
  world.add_body(ball);
  std::size_t impacts = 0;
  std::vector<ContactEvent> events;
  for (int k = 0; k < 50; ++k) {
    const AdvanceReport report = world.advance(0.05);
    impacts += report.impacts.size();
    events.insert(events.end(), report.contact_events.begin(), report.contact_events.end());
  }
  EXPECT_GT(impacts, 2U);
  EXPECT_EQ(events.size(), 2 * impacts);
  expect_turns(events);
}

// A sensor that a body carries: a moving trigger.
TEST(WorldChanges, ASensorIsCarriedAlongAndMovesNothing) {
  for (const bool has_sensor : {false, true}) {
    World world(earth_options());
    world.add_body(floor_body(0.3));
    const BodyId cube = world.add_body(resting_cube(0, 0, 0, 0.3));
    const BodyId post = world.add_body([] {
      BodyDefinition body;
      body.name = "post";
      body.kind = BodyKind::Static;
      body.shape = std::make_shared<Box>(Vector3(0.1, 0.1, 0.5));
      body.initial.X_WB = RigidPose(Vector3(2, 1, 0.5));
      return body;
    }());
    BodyId sensor;
    if (has_sensor) {
      BodyDefinition body = dynamic_body("sensor", std::make_shared<Sphere>(1), {0, 0, 0.5});
      body.initial.X_WB = world.state(cube).X_WB;
      body.is_sensor = true;
      body.mass_properties.mass = 1e-6;
      body.mass_properties.I_BBcm = 1e-6 * Matrix3::Identity();
      sensor = world.add_body(body);
      JointDefinition mount;
      mount.kind = JointKind::Fixed;
      mount.a = cube;
      mount.b = sensor;
      world.add_joint(mount);
    }
    world.apply_impulse(cube, {5000, 0, 0});
    std::vector<SensorEvent> events;
    for (int k = 0; k < 500; ++k) {
      const AdvanceReport report = world.advance(0.01);
      for (const SensorEvent& event : report.sensors) {
        if (event.body == post) events.push_back(event);
      }
    }
    // It slides v^2 / (2 mu g) = 4.2 and sleeps there, sensor and all.
    EXPECT_NEAR(world.state(cube).X_WB.translation().x(), 25 / (0.6 * kGravity), 0.02);
    EXPECT_TRUE(world.is_asleep(cube));
    if (!has_sensor) continue;
    ASSERT_EQ(events.size(), 2U);  // past the post, for a while
    EXPECT_EQ(events[0].sensor, sensor);
    EXPECT_TRUE(events[0].is_overlap);
    EXPECT_FALSE(events[1].is_overlap);
    EXPECT_LT(events[0].t, events[1].t);
  }
}

// The sensor moves, and the body rests: gone by motion at any speed, or put elsewhere.
TEST(WorldChanges, ASensorThatMovesLeavesWhatRests) {
  for (const bool is_put : {false, true}) {
    for (const Scalar speed : {1.0, 300.0}) {
      World world;
      BodyDefinition gate = dynamic_body("gate", std::make_shared<Sphere>(1), {0, 0, 0});
      gate.is_sensor = true;
      const BodyId sensor = world.add_body(gate);
      BodyDefinition post;
      post.kind = BodyKind::Static;
      post.shape = std::make_shared<Sphere>(0.1);
      const BodyId body = world.add_body(post);
      std::vector<bool> events;
      const auto run = [&] {
        for (int k = 0; k < 200; ++k) {
          for (const SensorEvent& event : world.advance(0.01).sensors) {
            EXPECT_EQ(event.sensor, sensor);
            EXPECT_EQ(event.body, body);
            events.push_back(event.is_overlap);
          }
        }
      };
      const auto set = [&](Scalar x, Scalar v) {
        world.set_state(sensor, {RigidPose(Vector3(x, 0, 0)), Twist{{v, 0, 0}, Vector3::Zero()}});
        run();
      };
      run();
      if (is_put) {
        set(5 * speed, 0);
        set(0, 0);
      } else {
        set(0, speed);
        set(world.state(sensor).X_WB.translation().x(), -speed);
      }
      EXPECT_EQ(events, (std::vector<bool>{true, false, true})) << is_put << ' ' << speed;
    }
  }
}

// However a body leaves a sensor, the overlap ends once, and begins anew when it is back.
TEST(WorldChanges, ASensorNoticesWhatIsTakenAwayAndPutBack) {
  using Change = std::function<void(World&, BodyId)>;
  const auto move_to = [](Scalar x) -> Change {
    return [x](World& world, BodyId id) {
      auto state = world.state(id);
      state.X_WB = RigidPose(Vector3(x, 0, 0));
      world.set_state(id, state);
    };
  };
  const auto enable = [](bool is_enabled) -> Change {
    return [is_enabled](World& world, BodyId id) { world.set_enabled(id, is_enabled); };
  };
  const auto filter_by = [](std::uint64_t mask) -> Change {
    return [mask](World& world, BodyId id) {
      CollisionFilter filter;
      filter.mask = mask;
      world.set_filter(id, filter);
    };
  };
  const auto take_shape = [](Scalar x) -> Change {
    return [x](World& world, BodyId id) {
      const auto ball = std::make_shared<Sphere>(0.1);
      world.set_shape(id, std::make_shared<CompoundShape>(
                              std::vector<CompoundChild>{{ball, RigidPose(Vector3(x, 0, 0))}}));
    };
  };
  const std::pair<Change, Change> changes[] = {{move_to(5), move_to(0)},
                                               {take_shape(5), take_shape(0)},
                                               {enable(false), enable(true)},
                                               {filter_by(0), filter_by(CollisionFilter{}.mask)}};
  for (const auto& [leave, come_back] : changes) {
    World world;
    BodyDefinition gate;
    gate.kind = BodyKind::Static;
    gate.shape = std::make_shared<Sphere>(1);
    gate.is_sensor = true;
    world.add_body(gate);
    const BodyId ball =
        world.add_body(dynamic_body("ball", std::make_shared<Sphere>(0.1), {0, 0, 0}));
    std::vector<bool> events;
    const auto run = [&] {
      for (int k = 0; k < 5; ++k) {
        for (const SensorEvent& event : world.advance(0.01).sensors) {
          EXPECT_EQ(event.body, ball);
          events.push_back(event.is_overlap);
        }
      }
    };
    run();
    leave(world, ball);
    run();
    come_back(world, ball);
    run();
    EXPECT_EQ(events, (std::vector<bool>{true, false, true}));
    world.remove_body(ball);
    run();
    EXPECT_EQ(events.size(), 3U);
  }
}

// Nothing bounds where its box ends, and the boxes of absent bodies are empty.
TEST(WorldChanges, AMotionWithoutBoundsMeetsNoAbsentBody) {
  World world;
  BodyDefinition body;
  body.kind = BodyKind::Kinematic;
  body.shape = kBrick;
  body.motion = std::make_shared<UserMotion>(
      UserMotion::Functions{[](Scalar) { return RigidPose(); },
                            [](Scalar) { return Twist(); },
                            [](const TimeInterval&) {
                              return TwistBound{kInfinity, kInfinity, kInfinity, kInfinity};
                            },
                            {}});
  world.add_body(body);
  body.motion =
      std::make_shared<ConstantTwistMotion>(RigidPose(), Twist{{1, 0, 0}, Vector3::Zero()});
  const BodyId disabled = world.add_body(body);
  const BodyId removed = world.add_body(body);
  world.set_enabled(disabled, false);
  world.remove_body(removed);
  const AdvanceReport report = world.advance(0.1);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  EXPECT_TRUE(report.crossed.empty());
}

}  // namespace
}  // namespace dyop
