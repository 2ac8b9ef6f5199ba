// SPDX-License-Identifier: BSD-3-Clause

// Motions of user code that lie: every query refuses them where it meets the lie.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::icosphere;
using testing::message_of;
using testing::plate_grid;

const TimeInterval kLieInterval{0, 4};

// Approaches along x at speed 1 from x = 5 and turns about x, until a lie begins at t = 1.
struct Lie {
  const char* name;
  std::function<MotionState(Scalar, const MotionState&)> tell;
  const char* words;  // in the message
};

MotionState with_position(const MotionState& state, const Vector3& p) {
  return {RigidPose::from_trusted(state.X_WB.rotation(), p), state.twist};
}

MotionState with_rotation(const MotionState& state, const Matrix3& R) {
  return {RigidPose::from_trusted(R, state.X_WB.translation()), state.twist};
}

const Scalar kNaN = std::nan("");

const Lie kLies[] = {
    {"NaN position",
     [](Scalar, const MotionState& s) {
       return with_position(s, {kNaN, 0, 0});
     },
     ": the position is not finite: (nan 0 0)"},
    {"infinite position",
     [](Scalar, const MotionState& s) {
       return with_position(s, {0, kInfinity, 0});
     },
     ": the position is not finite: (0 inf 0)"},
    {"NaN rotation",
     [](Scalar, const MotionState& s) { return with_rotation(s, Matrix3::Constant(kNaN)); },
     ": the rotation is not finite: (nan nan"},
    {"scaled",
     [](Scalar, const MotionState& s) { return with_rotation(s, 1.001 * s.X_WB.rotation()); },
     ": the pose is not a rotation: R^T R is off by"},
    {"sheared",
     [](Scalar, const MotionState& s) {
       Matrix3 R = s.X_WB.rotation();
       R.col(0) += 1e-9 * R.col(1);
       return with_rotation(s, R);
     },
     ": the pose is not a rotation: R^T R is off by"},
    {"mirrored", [](Scalar, const MotionState& s) { return with_rotation(s, -s.X_WB.rotation()); },
     ": the rotation mirrors: R = ("},
    {"NaN velocity",
     [](Scalar, const MotionState& s) {
       return MotionState{s.X_WB, {Vector3(0, kNaN, 0), s.twist.w_WB}};
     },
     ": the twist is not finite: v = (0 nan 0)"},
    {"infinite turning",
     [](Scalar, const MotionState& s) {
       return MotionState{s.X_WB, {s.twist.v_WB, Vector3(kInfinity, 0, 0)}};
     },
     ": the twist is not finite: v = ("},
    {"NaN by the pose's own check",
     [](Scalar, const MotionState& s) {
       return MotionState{RigidPose(Vector3(0, 0, kNaN)), s.twist};
     },
     ": pose translation must be finite, not (0 0 nan)"},
    {"teleport",
     [](Scalar, const MotionState& s) {
       return with_position(s, s.X_WB.translation() + Vector3(0, 40, 0));
     },
     " jumps between t = "},
};

MotionState honest(Scalar t) {
  return {RigidPose(rotation_from_vector(Vector3(t, 0, 0)), Vector3(5 - t, 0, 0)),
          {-Vector3::UnitX(), Vector3::UnitX()}};
}

UserMotion liar(const Lie& lie) {
  const auto state = [lie](Scalar t) { return t >= 1 ? lie.tell(t, honest(t)) : honest(t); };
  UserMotion::Functions functions;
  functions.pose = [state](Scalar t) { return state(t).X_WB; };
  functions.twist = [state](Scalar t) { return state(t).twist; };
  functions.twist_bound = [](const TimeInterval&) { return TwistBound{1, 1, 0, 0}; };
  return UserMotion(functions);
}

// Expects these words, and a time at which the lie holds.
void expect_refusal(const std::string& message, const std::string& motion, const Lie& lie) {
  EXPECT_NE(message.find(motion), std::string::npos) << lie.name << ": " << message;
  EXPECT_NE(message.find(lie.words), std::string::npos) << lie.name << ": " << message;
  const std::size_t at = message.find("t = ");
  ASSERT_NE(at, std::string::npos) << message;
  const bool is_jump = message.find("jumps") != std::string::npos;
  const std::size_t later = is_jump ? message.find("t = ", at + 1) : at;
  const Scalar t = std::stod(message.substr(later + 4));
  EXPECT_TRUE((t >= 1 && t <= 4) || is_jump) << message;
}

TEST(MotionRefusal, TimeOfImpactOfEveryKindOfShape) {
  const TriangleMesh mesh = icosphere(2, 1).mesh();
  const Sphere sphere(1);
  const RestMotion at_rest{RigidPose()};
  const std::pair<const Shape*, const Shape*> pairs[] = {
      {&mesh, &mesh}, {&sphere, &sphere}, {&mesh, &sphere}};
  for (const Lie& lie : kLies) {
    const UserMotion motion = liar(lie);
    for (const auto& pair : pairs) {
      const Shape* a = pair.first;
      const Shape* b = pair.second;
      const auto as_b = [&] { time_of_impact(*a, at_rest, *b, motion, kLieInterval); };
      expect_refusal(message_of(as_b), "time_of_impact: the motion of B", lie);
      const auto as_a = [&] { time_of_impact(*b, motion, *a, at_rest, kLieInterval); };
      expect_refusal(message_of(as_a), "time_of_impact: the motion of A", lie);
    }
  }
}

TEST(MotionRefusal, AtTheStartToo) {
  const Sphere sphere(1);
  const RestMotion at_rest{RigidPose()};
  for (const Lie& lie : kLies) {
    if (std::string(lie.name) == "teleport") continue;
    const UserMotion motion = liar(lie);
    ToiOptions solid;
    solid.solid_a = true;
    const TriangleMesh mesh = icosphere(1, 1).mesh();
    expect_refusal(message_of([&] {
                     time_of_impact(mesh, at_rest, sphere, motion, {1, 2}, solid);
                   }),
                   "at t = 1", lie);
  }
}

// Motions of the library are trusted, but not for what users put into them.
TEST(MotionRefusal, OfLiesInsideOtherMotions) {
  const Sphere sphere(1);
  const auto at_rest = std::make_shared<RestMotion>(RigidPose());
  EXPECT_TRUE(ComposedMotion(at_rest, at_rest).is_trusted());
  EXPECT_TRUE(SequenceMotion({{kLieInterval, at_rest}}).is_trusted());
  for (const Lie& lie : kLies) {
    const auto motion = std::make_shared<UserMotion>(liar(lie));
    EXPECT_FALSE(motion->is_trusted());
    const ComposedMotion inner(at_rest, motion);
    const ComposedMotion outer(motion, at_rest);
    const SequenceMotion parts({{{0, 0.5}, motion}, {{0.5, 4}, motion}});
    for (const Motion* whole : std::initializer_list<const Motion*>{&inner, &outer, &parts}) {
      EXPECT_FALSE(whole->is_trusted());
      EXPECT_THROW(time_of_impact(sphere, *at_rest, sphere, *whole, kLieInterval), InvalidArgument)
          << lie.name;
    }
  }
}

TEST(MotionRefusal, ResumedQueries) {
  const TriangleMesh mesh = icosphere(2, 1.8).mesh();  // its first steps end before t = 1
  const RestMotion at_rest{RigidPose()};
  const UserMotion motion = liar(kLies[0]);
  ToiWorkspace workspace;
  ToiOptions options;
  options.max_node_pairs = 1;
  int resumed = 0;
  const auto ask = [&] {
    time_of_impact(mesh, at_rest, mesh, motion, {0, 4}, options, workspace);
    for (; workspace.can_resume(); ++resumed) {
      resume_time_of_impact(mesh, at_rest, mesh, motion, {0, 4}, options, workspace);
    }
  };
  expect_refusal(message_of(ask), "time_of_impact: the motion of B", kLies[0]);
  EXPECT_GT(resumed, 0);
  // The workspace is free again.
  const ConstantTwistMotion honest_motion(RigidPose(Vector3(5, 0, 0)),
                                          {Vector3(-1, 0, 0), Vector3::Zero()});
  EXPECT_EQ(time_of_impact(mesh, at_rest, mesh, honest_motion, kLieInterval, {}, workspace).status,
            ToiStatus::Impact);
}

TEST(MotionRefusal, BatchesNameTheQuery) {
  const TriangleMesh mesh = icosphere(2, 1).mesh();
  const RestMotion at_rest{RigidPose()};
  for (const Lie& lie : kLies) {
    const UserMotion motion = liar(lie);
    std::vector<ToiQuery> queries(4, ToiQuery{&mesh, &at_rest, &mesh, &at_rest, kLieInterval, {}});
    queries[2].X_WB = &motion;
    for (ToiQuery& query : queries) query.options.max_node_pairs = 10'000;
    std::vector<ToiResult> results(4);
    const std::string message = message_of([&] { time_of_impact_batch(queries, results); });
    expect_refusal(message, "query 2: time_of_impact: the motion of B", lie);
  }
}

TEST(MotionRefusal, DeformingMeshes) {
  auto sheet = plate_grid(4, 4, 6, 6).moved(rotation_from_vector(Vector3(0, 1.5, 0)), {0, 0, 0});
  auto moved = sheet.vertices;
  for (Vector3& v : moved) v.x() -= 0.1;
  const DeformingMesh cloth(sheet.vertices, moved, sheet.triangles);
  const TriangleMesh ball = icosphere(2, 1).mesh();
  for (const Lie& lie : kLies) {
    const UserMotion motion = liar(lie);
    expect_refusal(message_of([&] { time_of_impact(cloth, ball, motion, kLieInterval); }),
                   "time_of_impact: the motion of B", lie);
  }
}

// Jumps that a bound allows are no lies: a motion may be fast.
TEST(MotionRefusal, LetsFastMotionsPass) {
  const Sphere sphere(1);
  const RestMotion at_rest{RigidPose()};
  for (const Scalar speed : {1.0, 1e6, 1e12}) {
    for (const Scalar turn : {0.0, 1.0, 1e3}) {
      for (const Scalar start : {0.0, 1e6}) {
        const ConstantTwistMotion fast(RigidPose(Vector3(5 * speed, 3, 0)),
                                       {Vector3(-speed, 0, 0), Vector3(0, turn, turn)}, start);
        EXPECT_NO_THROW(time_of_impact(sphere, at_rest, sphere, fast, {start, start + 9}));
      }
    }
  }
}

}  // namespace
}  // namespace dyop
