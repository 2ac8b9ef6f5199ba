// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/check_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "dyop/core/error.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/pose_logs.h"
#include "support/message_of.h"

namespace dyop::testing {
namespace {

const TimeInterval kSpan{-1, 3};
const Vector3 kAxis = Vector3(1, 2, 2) / 3;

// A screw with a swing: p = (sin t, cos 2t, t^2), R = exp(axis * 3 sin t). Bounds from the
// formulas.
UserMotion::Functions sound() {
  UserMotion::Functions f;
  f.pose = [](Scalar t) {
    return RigidPose(rotation_from_vector(3 * std::sin(t) * kAxis),
                     Vector3(std::sin(t), std::cos(2 * t), t * t));
  };
  f.twist = [](Scalar t) {
    return Twist{Vector3(std::cos(t), -2 * std::sin(2 * t), 2 * t), 3 * std::cos(t) * kAxis};
  };
  f.twist_bound = [](const TimeInterval& part) {
    const Scalar latest = std::max(std::abs(part.begin), std::abs(part.end));
    return TwistBound{3 + 2 * latest, 3.001, 7, 3.001};
  };
  return f;
}

MotionCheck check_user(const UserMotion::Functions& functions,
                       const TimeInterval& domain = {-kInfinity, kInfinity}) {
  return check_motion(UserMotion(functions, domain), kSpan);
}

// Expects a fault near a time, with a message that has the words.
void expect_fault(const MotionCheck& found, MotionFault fault, Scalar t, Scalar time_error,
                  const std::string& words) {
  ASSERT_TRUE(found.fault) << "nothing found";
  EXPECT_EQ(*found.fault, fault) << found.message;
  EXPECT_NEAR(found.t, t, time_error) << found.message;
  EXPECT_NE(found.message.find(words), std::string::npos) << found.message;
  EXPECT_FALSE(found.is_sound());
}

constexpr Scalar kBetweenSamples = 4.0 / 500;

TEST(CheckMotion, FindsNothingWrongWithASoundMotion) {
  const MotionCheck found = check_user(sound());
  EXPECT_TRUE(found.is_sound()) << found.message;
  EXPECT_EQ(found.message, "");
  for (std::uint64_t seed = 2; seed < 12; ++seed) {
    const MotionCheck other = check_motion(UserMotion(sound()), kSpan, {.seed = seed});
    EXPECT_TRUE(other.is_sound()) << other.message;
  }
}

TEST(CheckMotion, BlamesNoFineRippleAndNoKink) {
  UserMotion::Functions f = sound();
  f.pose = [](Scalar t) {
    return RigidPose(Vector3(1e-6 * std::sin(1e5 * t), t * std::abs(t), 0));
  };
  f.twist = [](Scalar t) {
    return Twist{Vector3(0.1 * std::cos(1e5 * t), 2 * std::abs(t), 0), Vector3::Zero()};
  };
  f.twist_bound = [](const TimeInterval&) { return TwistBound{7, 0, 1e4 + 3, 0}; };
  const MotionCheck found = check_user(f);
  EXPECT_TRUE(found.is_sound()) << found.message;
}

TEST(CheckMotion, TakesInfiniteBounds) {
  UserMotion::Functions f = sound();
  f.twist_bound = [](const TimeInterval&) {
    return TwistBound{kInfinity, kInfinity, kInfinity, kInfinity};
  };
  EXPECT_TRUE(check_user(f).is_sound()) << check_user(f).message;
  f.twist = [](Scalar t) {
    const Twist twist = sound().twist(t);
    return Twist{-twist.v_WB, twist.w_WB};
  };
  expect_fault(check_user(f), MotionFault::TwistNotDerivative, -1, 0.1, "its sign is reversed");
}

TEST(CheckMotion, NamesReversedTwists) {
  UserMotion::Functions f = sound();
  f.twist = [](Scalar t) {
    const Twist twist = sound().twist(t);
    return Twist{-twist.v_WB, twist.w_WB};
  };
  expect_fault(check_user(f), MotionFault::TwistNotDerivative, -1, 1e-12,
               "the twist is not the derivative of the pose");
  expect_fault(check_user(f), MotionFault::TwistNotDerivative, -1, 1e-12, "twist gives v_WB");
  EXPECT_NE(check_user(f).message.find("its sign is reversed"), std::string::npos);
  f.twist = [](Scalar t) {
    const Twist twist = sound().twist(t);
    return Twist{twist.v_WB, -twist.w_WB};
  };
  expect_fault(check_user(f), MotionFault::TwistNotDerivative, -1, 1e-12, "its sign is reversed");
}

TEST(CheckMotion, NamesTwistsInTheWrongFrame) {
  UserMotion::Functions f = sound();
  f.twist = [](Scalar t) {
    const Twist twist = sound().twist(t);
    const Matrix3 R_BW = sound().pose(t).rotation().transpose();
    return Twist{R_BW * twist.v_WB, twist.w_WB};
  };
  expect_fault(check_user(f), MotionFault::TwistNotDerivative, -1, 1e-12,
               "expressed in the body, not in the world");
}

TEST(CheckMotion, FindsSmallErrorsOfTheTwist) {
  for (const Scalar error : {1e-2, 1e-4, 1e-6}) {
    UserMotion::Functions f = sound();
    f.twist = [=](Scalar t) {
      Twist twist = sound().twist(t);
      if (t > 1) twist.v_WB.x() += error;
      if (t > 1) twist.w_WB *= 1 + error;
      return twist;
    };
    const MotionCheck found = check_user(f);
    ASSERT_TRUE(found.fault) << error;
    EXPECT_NEAR(found.t, 1, 2 * kBetweenSamples) << found.message;
  }
}

TEST(CheckMotion, NamesSpeedsAndAccelerationsAboveTheBound) {
  UserMotion::Functions f = sound();
  f.twist_bound = [](const TimeInterval& part) {
    TwistBound bound = sound().twist_bound(part);
    bound.linear_speed = 4;  // |v| is 2 t and more
    return bound;
  };
  const MotionCheck fast = check_user(f);
  ASSERT_TRUE(fast.fault);
  EXPECT_EQ(*fast.fault, MotionFault::SpeedAboveBound) << fast.message;
  Scalar first = 0;  // when |v| passes 4
  while (sound().twist(first).v_WB.norm() < 4) first += 1e-5;
  EXPECT_NEAR(fast.t, first, kBetweenSamples) << fast.message;
  EXPECT_GT(fast.found, fast.allowed);

  f = sound();
  f.twist_bound = [](const TimeInterval& part) {
    TwistBound bound = sound().twist_bound(part);
    bound.angular_acceleration = 2.9;  // 3 sin t: its size passes 2.9 at asin(2.9 / 3)
    return bound;
  };
  expect_fault(check_user(f), MotionFault::AccelerationAboveBound, std::asin(2.9 / 3),
               kBetweenSamples, "angular acceleration 2.9");
}

TEST(CheckMotion, NamesAJumpWhereItIs) {
  UserMotion::Functions f = sound();
  f.pose = [](Scalar t) {
    const RigidPose X = sound().pose(t);
    return RigidPose(X.rotation(), X.translation() + Vector3(0, 0, t > 1.234 ? 0.5 : 0));
  };
  expect_fault(check_user(f), MotionFault::Jump, 1.234, 1e-9, "the position moves by 0.5");
  f.pose = [](Scalar t) {
    const RigidPose X = sound().pose(t);
    const Matrix3 R = rotation_from_vector(Vector3(t > 0.5 ? 0.25 : 0, 0, 0)) * X.rotation();
    return RigidPose(R, X.translation());
  };
  expect_fault(check_user(f), MotionFault::Jump, 0.5, 1e-9, "the rotation changes by 0.24");
}

TEST(CheckMotion, NamesScaledAndMirroredRotations) {
  UserMotion::Functions f = sound();
  f.pose = [](Scalar t) {
    const RigidPose X = sound().pose(t);
    return RigidPose::from_trusted(X.rotation() * (t > 0.75 ? 1 + 1e-9 : 1), X.translation());
  };
  expect_fault(check_user(f), MotionFault::PoseNotRotation, 0.75, 1e-12, "R^T R is off by 2.0");
  f.pose = [](Scalar t) {
    const RigidPose X = sound().pose(t);
    return RigidPose::from_trusted(-X.rotation(), X.translation());
  };
  expect_fault(check_user(f), MotionFault::PoseNotRotation, -1, 0, "the determinant is -");
}

TEST(CheckMotion, NamesWhatTurnsNaNHalfWay) {
  const Scalar nan = std::nan("");
  UserMotion::Functions f = sound();
  f.pose = [=](Scalar t) {
    const RigidPose X = sound().pose(t);
    return RigidPose::from_trusted(X.rotation(), t > 1 ? Vector3(0, nan, 0) : X.translation());
  };
  expect_fault(check_user(f), MotionFault::PoseNotFinite, 1, 1e-12, "position (0 nan 0)");
  f.pose = [=](Scalar t) { return RigidPose(Vector3(t > 2 ? nan : 0, 0, 0)); };
  f.twist = [](Scalar) { return Twist{}; };
  expect_fault(check_user(f), MotionFault::Refused, 2, 1e-12, "must be finite, not (nan 0 0)");
  f = sound();
  f.twist = [=](Scalar t) {
    Twist twist = sound().twist(t);
    if (t > -0.5) twist.w_WB.z() = kInfinity;
    return twist;
  };
  expect_fault(check_user(f), MotionFault::TwistNotFinite, -0.5, 1e-12, "the twist is not finite");
}

TEST(CheckMotion, ReportsTheFirstOfSeveralFaults) {
  UserMotion::Functions f = sound();
  f.pose = [](Scalar t) {
    const RigidPose X = sound().pose(t);
    const Vector3 jump(0, 0, t > 0.5 ? 0.5 : 0);
    return RigidPose::from_trusted(X.rotation() * (t > 1 ? 2 : 1), X.translation() + jump);
  };
  expect_fault(check_user(f), MotionFault::Jump, 0.5, 1e-9, "the position moves by 0.5");
}

TEST(CheckMotion, NamesWrongDomainsAndPieces) {
  expect_fault(check_user(sound(), {-1, 2}), MotionFault::Domain, 3, 0,
               "defined only on [-1, 2], not on all of [-1, 3]");
  expect_fault(check_user(sound(), {0, 4}), MotionFault::Domain, -1, 0, "not on all of");
  UserMotion::Functions f = sound();
  f.smooth_until = [](Scalar t) { return t < 0 ? 2.0 : 1.0 + std::floor(t); };
  expect_fault(check_user(f), MotionFault::SmoothUntil, 0, kBetweenSamples, "it was 2");
  f.smooth_until = [](Scalar) { return 1.0; };
  expect_fault(check_user(f), MotionFault::Refused, 1, kBetweenSamples,
               "smooth_until of a user motion");
}

// A motion whose other members lie.
class Liar final : public Motion {
 public:
  enum class Lie { State, NegativeBound, EarlySmoothUntil };
  explicit Liar(Lie lie) : lie_(lie) {}
  RigidPose pose(Scalar t) const override { return RigidPose(Vector3(t, 0, 0)); }
  Twist twist(Scalar) const override { return {Vector3::UnitX(), Vector3::Zero()}; }
  MotionState state(Scalar t) const override {
    return {pose(lie_ == Lie::State && t > 2 ? 2 : t), twist(t)};
  }
  TwistBound twist_bound(const TimeInterval&) const override {
    return {1, 0, 0, lie_ == Lie::NegativeBound ? -1.0 : 0.0};
  }
  Scalar smooth_until(Scalar t) const override {
    return lie_ == Lie::EarlySmoothUntil && t > 1 ? t : kInfinity;
  }

 private:
  Lie lie_;
};

TEST(CheckMotion, ChecksDerivedMotionsToo) {
  expect_fault(check_motion(Liar(Liar::Lie::State), kSpan), MotionFault::StateDiffers, 2, 1e-12,
               "state()");
  expect_fault(check_motion(Liar(Liar::Lie::NegativeBound), kSpan), MotionFault::BoundNotValid, -1,
               0, "angular acceleration -1");
  expect_fault(check_motion(Liar(Liar::Lie::EarlySmoothUntil), kSpan), MotionFault::SmoothUntil, 1,
               kBetweenSamples, "smooth_until()");
}

// Says of a circle in sixteen chords that it strays less from a line than it does.
class Straightened final : public Motion {
 public:
  enum class Lie { Position, Rotation, End };
  explicit Straightened(Lie lie) : lie_(lie) {}
  RigidPose pose(Scalar t) const override { return log_.pose(t); }
  Twist twist(Scalar t) const override { return log_.twist(t); }
  TwistBound twist_bound(const TimeInterval& interval) const override {
    return log_.twist_bound(interval);
  }
  TimeInterval domain() const override { return log_.domain(); }
  Scalar smooth_until(Scalar t) const override { return log_.smooth_until(t); }
  std::optional<MotionStretch> stretch(Scalar t, Scalar after) const override {
    std::optional<MotionStretch> stretch = log_.stretch(t, after);
    if (!stretch) return stretch;
    if (lie_ == Lie::Position) stretch->linear_deviation /= 4;
    if (lie_ == Lie::Rotation) stretch->twist.w_WB *= 1.001;
    if (lie_ == Lie::End) stretch->end = after;
    return stretch;
  }

 private:
  Lie lie_;
  SampledMotion log_{smooth_log(17, 1, 2, 0, 4)};
};

TEST(CheckMotion, ChecksStretches) {
  const TimeInterval span{0, 4};
  EXPECT_TRUE(check_motion(SampledMotion(smooth_log(17, 1, 2, 0, 4)), span).is_sound());
  expect_fault(check_motion(Straightened(Straightened::Lie::Position), span),
               MotionFault::StretchExceeded, 0, kBetweenSamples, "the position differs");
  expect_fault(check_motion(Straightened(Straightened::Lie::Rotation), span),
               MotionFault::StretchExceeded, 0, kBetweenSamples, "the rotation differs");
  expect_fault(check_motion(Straightened(Straightened::Lie::End), span),
               MotionFault::StretchExceeded, 0, kBetweenSamples, "must end after");
}

TEST(CheckMotion, RefusesWhatItCannotSample) {
  const ConstantTwistMotion motion(RigidPose(), {});
  EXPECT_EQ(message_of([&] {
              check_motion(motion, {1, 1});
            }),
            "check_motion: the interval [1, 1] has no length");
  EXPECT_EQ(message_of([&] {
              check_motion(motion, {2, 1});
            }),
            "check_motion: interval must not be reversed: begin 2 > end 1");
  EXPECT_EQ(message_of([&] {
              check_motion(motion, {0, 1}, {.sample_count = 1});
            }),
            "check_motion: sample_count must be >= 2, not 1");
}

}  // namespace
}  // namespace dyop::testing
