// SPDX-License-Identifier: BSD-3-Clause

// What dyop-check trusts, against dyop's own motions and shapes, with which it shares no code.

#include "check/kernel.h"

#include <gtest/gtest.h>

#include <numbers>

#include "check/motion.h"
#include "check/shape.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/box.h"
#include "dyop/geometry/cone.h"
#include "dyop/geometry/cylinder.h"
#include "dyop/geometry/ellipsoid.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using dyop_check::Piece;
using dyop_check::Segment;
using dyop_check::Vec;

Vec plain(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

Vector3 eigen(const Vec& v) {
  return {v.x, v.y, v.z};
}

dyop_check::Mat plain(const Matrix3& R) {
  dyop_check::Mat m;
  for (Eigen::Index i = 0; i < 9; ++i) m.m[std::size_t(i)] = R(i / 3, i % 3);
  return m;
}

dyop_check::CubicNode plain(Scalar t, const HermiteNode& node) {
  return {t, plain(node.p_WB), plain(node.v_WB), plain(node.theta), plain(node.theta_rate)};
}

Segment segment_of(const HermiteMotion& motion) {
  Segment segment;
  segment.kind = Segment::Kind::Cubic;
  segment.R = plain(motion.X_WC().rotation());
  segment.first = plain(motion.domain().begin, motion.begin());
  segment.last = plain(motion.domain().end, motion.end());
  return segment;
}

HermiteMotion random_cubic(std::mt19937_64& random, Scalar size) {
  const auto node = [&](bool first) {
    HermiteNode result;
    result.p_WB = testing::random_vector(size, random);
    result.v_WB = testing::random_vector(3 * size, random);
    result.theta = first ? Vector3::Zero() : testing::random_vector(2, random);
    result.theta_rate = testing::random_vector(5, random);
    return result;
  };
  const Matrix3 R = rotation_from_vector(testing::random_vector(2, random));
  const HermiteNode begin = node(true);
  return HermiteMotion::from_chart({1, 1.5}, R, begin, node(false));
}

TEST(CheckMotion, PosesAreThoseOfTheLibrary) {
  std::mt19937_64 random(1);
  for (int k = 0; k < 2000; ++k) {
    const Scalar size = std::pow(10, k % 9 - 4);
    const HermiteMotion motion = random_cubic(random, size);
    Segment segment = segment_of(motion);
    const Vec p_cm = plain(testing::random_vector(size, random));
    segment.p_cm = p_cm;
    const Scalar noise = dyop_check::pose_noise(segment, 2 * size, 1, 1.5);
    EXPECT_LT(noise, 1e-11 * size);
    for (const Scalar t : {1.0, 1.1, 1.37, 1.5}) {
      const RigidPose X_WM = motion.pose(t);
      const dyop_check::Pose X = segment.pose(t);
      const Vector3 corner = testing::random_vector(size, random);
      const Vector3 expected = X_WM * (corner - eigen(p_cm));
      EXPECT_LE((eigen(X * plain(corner)) - expected).norm(), noise);
    }
  }
}

// By second differences of a point's path.
TEST(CheckMotion, NoPointAcceleratesMoreThanItsBound) {
  std::mt19937_64 random(2);
  Scalar tightest = 0;
  for (int k = 0; k < 500; ++k) {
    const HermiteMotion motion = random_cubic(random, 1);
    const Segment segment = segment_of(motion);
    const Scalar begin = 1 + 0.3 * (k % 2);
    const Scalar end = begin + 0.2;
    const auto bound = dyop_check::acceleration(segment, begin, end);
    const Vector3 p = testing::random_vector(3, random);
    const Scalar limit = bound.center + bound.turn * p.norm();
    constexpr Scalar kStep = 1e-4;
    for (Scalar t = begin + kStep; t < end - kStep; t += 0.01) {
      const Vector3 second =
          (motion.pose(t + kStep) * p - 2 * (motion.pose(t) * p) + motion.pose(t - kStep) * p) /
          (kStep * kStep);
      EXPECT_LE(second.norm(), limit * (1 + 1e-6) + 1e-5);
      tightest = std::max(tightest, second.norm() / limit);
    }
  }
  EXPECT_GT(tightest, 0.5);  // not just any large number
}

TEST(CheckMotion, TwistsTurnAboutTheCentreOfMass) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 500; ++k) {
    const RigidPose X_WM(rotation_from_vector(testing::random_vector(2, random)),
                         testing::random_vector(5, random));
    const Twist twist{testing::random_vector(3, random), testing::random_vector(20, random)};
    const ConstantTwistMotion motion(X_WM, twist, 0.25);
    Segment segment;
    segment.kind = Segment::Kind::Twist;
    segment.R = plain(X_WM.rotation());
    segment.p = plain(X_WM.translation());
    segment.v = plain(twist.v_WB);
    segment.w = plain(twist.w_WB);
    segment.t0 = 0.25;
    segment.p_cm = plain(testing::random_vector(1, random));
    const Vector3 p = testing::random_vector(1, random);
    for (const Scalar t : {0.25, 0.3, 2.0}) {
      const Vector3 expected = motion.pose(t) * (p - eigen(segment.p_cm));
      const Scalar noise = dyop_check::pose_noise(segment, 4, 0.25, 2);
      EXPECT_LE((eigen(segment.pose(t) * plain(p)) - expected).norm(), noise);
    }
    EXPECT_NEAR(dyop_check::acceleration(segment, 0, 1).turn, twist.w_WB.squaredNorm(),
                1e-9 * twist.w_WB.squaredNorm());
  }
}

std::shared_ptr<dyop_check::Body> body_of(const Box& box) {
  auto body = std::make_shared<dyop_check::Body>();
  Piece& piece = body->pieces.emplace_back();
  for (int k = 0; k < 8; ++k) {
    const Vector3 sign(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    piece.points.push_back(plain(Vector3(sign.cwiseProduct(box.half_extents()))));
  }
  body->build({});
  return body;
}

// Boxes that tumble past each other, together with or against each other: the least of many sampled
// distances can be proven up to a thousandth, and not what is larger.
TEST(CheckKernel, ProvesWhatHoldsAndNothingElse) {
  std::mt19937_64 random(6);
  int proven = 0;
  for (int k = 0; k < 400; ++k) {
    const Scalar size = std::pow(10, k % 5 - 2);
    const Box box(Vector3(0.5, 0.3, 0.2) * size);
    const auto body = body_of(box);
    const HermiteMotion first = random_cubic(random, size);
    HermiteMotion second = random_cubic(random, size);
    if (k % 2 == 0) {  // the second follows the first, like one that lies on it
      const Vector3 offset = first.pose(1) * Vector3(0, 0, 0.45 * size);
      HermiteNode begin = first.begin();
      HermiteNode end = first.end();
      begin.p_WB = offset;
      end.p_WB = first.pose(1.5) * Vector3(0, 0, 0.45 * size);
      begin.v_WB += first.twist(1).w_WB.cross(offset - first.pose(1).translation());
      end.v_WB += first.twist(1.5).w_WB.cross(end.p_WB - first.pose(1.5).translation());
      second = HermiteMotion::from_chart({1, 1.5}, first.X_WC().rotation(), begin, end);
    }
    Scalar least = kInfinity;
    for (int i = 0; i <= 200; ++i) {
      const Scalar t = 1 + i / 400.0;
      least = std::min(least, distance(box, first.pose(t), box, second.pose(t)).upper);
    }
    const Segment p = segment_of(first);
    const Segment q = segment_of(second);
    const auto prove = [&](Scalar target) {
      dyop_check::PairProver prover({body.get(), &p}, {body.get(), &q}, target, 1'000'000);
      std::vector<dyop_check::NodePair> front(1);
      return prover.prove(1, 1.5, front);
    };
    EXPECT_NE(prove(least * (1 + 1e-6)), dyop_check::Answer::Proven) << k;
    if (least < 0.01 * size) continue;
    // Between two samples it may be a little less.
    EXPECT_EQ(prove(least - 0.01 * size), dyop_check::Answer::Proven) << k;
    ++proven;
  }
  EXPECT_GT(proven, 100);
}

TEST(CheckShape, SupportsOfRoundShapesAreThoseOfTheLibrary) {
  std::mt19937_64 random(4);
  const Cylinder cylinder(0.7, 1.3);
  const Cone cone(0.7, 1.3);
  const Ellipsoid ellipsoid({0.5, 1, 2});
  const auto compare = [&](const ConvexShape& shape, Piece::Kind kind, const Vec& size) {
    Piece piece;
    piece.kind = kind;
    piece.size = size;
    const RigidPose X(rotation_from_vector(testing::random_vector(2, random)),
                      testing::random_vector(3, random));
    piece.X = {plain(X.rotation()), plain(X.translation())};
    for (int k = 0; k < 2000; ++k) {
      const Vector3 n = testing::random_vector(1, random).normalized();
      const Vector3 in = X.rotation().transpose() * n;
      const Scalar expected = in.dot(shape.core_support(in).point) + n.dot(X.translation());
      EXPECT_NEAR(piece.support(plain(n)), expected, 1e-13);
    }
  };
  compare(cylinder, Piece::Kind::Cylinder, {0.7, 0, 1.3});
  compare(cone, Piece::Kind::Cone, {0.7, 0, 1.3});
  compare(ellipsoid, Piece::Kind::Ellipsoid, {0.5, 1, 2});
}

TEST(CheckShape, BoxesHoldAllPiecesBelowThem) {
  std::mt19937_64 random(5);
  dyop_check::Body body;
  for (int k = 0; k < 300; ++k) {
    Piece& piece = body.pieces.emplace_back();
    for (int corner = 0; corner < 3; ++corner)
      piece.points.push_back(plain(testing::random_vector(2, random)));
    if (k % 3 == 0) piece.radius = 0.1;
  }
  const Vec com{0.3, -0.2, 0.1};
  body.build(com);
  std::size_t leaves = 0;
  for (const dyop_check::Node& node : body.nodes) {
    if (!node.is_leaf()) continue;
    ++leaves;
    const Piece& piece = body.pieces[std::size_t(node.piece)];
    for (const Vec& point : piece.points) EXPECT_LE(norm(point - com), node.reach);
  }
  EXPECT_EQ(leaves, body.pieces.size());
  for (const Piece& piece : body.pieces) {
    for (const Vec& n : {Vec{1, 0, 0}, Vec{0, -1, 0}, Vec{0.6, 0, 0.8}}) {
      const dyop_check::Node& top = body.nodes.front();
      const double reach = dot(n, top.center) + std::abs(n.x) * top.half.x +
                           std::abs(n.y) * top.half.y + std::abs(n.z) * top.half.z;
      EXPECT_LE(piece.support(n), reach);
    }
  }
}

}  // namespace
}  // namespace dyop
