// SPDX-License-Identifier: BSD-3-Clause

// What dyop-check trusts, against dyop's own motions and shapes, with which it shares no code.

#include "check/trusted/kernel.h"

#include <gtest/gtest.h>

#include <numbers>

#include "check/trusted/motion.h"
#include "check/trusted/segments.h"
#include "check/trusted/shape.h"
#include "check/trusted/shape_reader.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "io/motion_json.h"
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

// The segment that a recorded motion is, from a time on.
Segment segment_of(const Motion& motion, Scalar begin = 1, const Vec& center_of_mass = {}) {
  const std::string text = io_internal::record_motion(motion).dump();
  return dyop_check::prescribed(dyop_check::parse_json(text), begin, center_of_mass).front();
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

// One of each kind of motion, defined from 1 to 1.5 at least.
std::vector<std::shared_ptr<const Motion>> random_motions(std::mt19937_64& random, Scalar size) {
  const auto pose = [&] {
    return RigidPose(rotation_from_vector(testing::random_vector(2, random)),
                     testing::random_vector(size, random));
  };
  const auto cubic = std::make_shared<HermiteMotion>(random_cubic(random, size));
  const auto twist = std::make_shared<ConstantTwistMotion>(
      pose(), Twist{testing::random_vector(size, random), testing::random_vector(9, random)}, 0.25);
  const auto screw = std::make_shared<ScrewMotion>(
      pose(), ScrewMotion::Screw{testing::random_vector(size, random),
                                 testing::random_vector(1, random), 3, size});
  std::vector<ControlPoint> points;
  for (int k = 0; k < 10; ++k)
    points.push_back({testing::random_vector(size, random), testing::random_vector(1, random)});
  const auto curve =
      std::make_shared<BezierMotion>(TimeInterval{1, 1.5}, pose().rotation(), points);
  const auto straight = std::make_shared<InterpolatedMotion>(TimeInterval{1, 1.5}, pose(), pose());
  const auto log = std::make_shared<SampledMotion>(
      std::vector<SampledMotion::Sample>{{0.5, RigidPose()}, {1.5, pose()}});
  const auto fixed = std::make_shared<RestMotion>(pose());
  const auto compose = [](std::shared_ptr<const Motion> outer,
                          std::shared_ptr<const Motion> inner) {
    return std::make_shared<ComposedMotion>(std::move(outer), std::move(inner));
  };
  return {cubic,
          twist,
          screw,
          curve,
          straight,
          log,
          compose(fixed, cubic),
          compose(cubic, fixed),
          compose(cubic, twist),
          compose(screw, curve),
          compose(compose(twist, straight), compose(cubic, log))};
}

TEST(CheckMotion, PosesAreThoseOfTheLibrary) {
  std::mt19937_64 random(1);
  for (int k = 0; k < 300; ++k) {
    const Scalar size = std::pow(10, k % 9 - 4);
    for (const auto& motion : random_motions(random, size)) {
      const Segment segment = segment_of(*motion);
      EXPECT_TRUE(segment.holds(1, 1.5));
      const Scalar noise = dyop_check::pose_noise(segment, 2 * size, 1, 1.5);
      // A polynomial of degree nine is a sum of terms that largely cancel.
      EXPECT_LT(noise, (segment.place.size() > 4 ? 1e-7 : 1e-10) * size);
      for (const Scalar t : {1.0, 1.1, 1.37, 1.5}) {
        const Vector3 corner = testing::random_vector(size, random);
        const Vector3 found = eigen(segment.pose(t) * plain(corner));
        EXPECT_LE((found - motion->pose(t) * corner).norm(), noise);
      }
    }
  }
}

// By second differences of a point's path.
TEST(CheckMotion, NoPointAcceleratesMoreThanItsBound) {
  std::mt19937_64 random(2);
  Scalar tightest = 0;
  for (int k = 0; k < 100; ++k) {
    const Vec center_of_mass = plain(testing::random_vector(1, random));
    for (const auto& shared : random_motions(random, 1)) {
      const Motion& motion = *shared;
      const Segment segment = segment_of(motion, 1, center_of_mass);
      const Scalar begin = 1 + 0.3 * (k % 2);
      const Scalar end = begin + 0.2;
      const auto bound = dyop_check::bounds(segment, begin, end);
      const Vector3 p = testing::random_vector(3, random);
      const Scalar limit = bound.center + bound.turn * (p - eigen(center_of_mass)).norm();
      constexpr Scalar kStep = 1e-4;
      for (Scalar t = begin + kStep; t < end - kStep; t += 0.01) {
        const Vector3 second =
            (motion.pose(t + kStep) * p - 2 * (motion.pose(t) * p) + motion.pose(t - kStep) * p) /
            (kStep * kStep);
        EXPECT_LE(second.norm(), limit * (1 + 1e-6) + 1e-5);
        tightest = std::max(tightest, second.norm() / limit);
        const Matrix3 turn =
            motion.pose(t + kStep).rotation() * motion.pose(t - kStep).rotation().transpose();
        EXPECT_LE(rotation_vector(turn).norm() / (2 * kStep), bound.speed * (1 + 1e-6));
      }
    }
  }
  EXPECT_GT(tightest, 0.8);  // not just any large number
}

// As in the rows of dynamic bodies: the motion is that of the centre of mass.
TEST(CheckMotion, SegmentsMoveTheCentreOfMass) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 300; ++k) {
    for (const auto& motion : random_motions(random, 1)) {
      Segment segment = segment_of(*motion);
      if (norm(segment.p_cm) > 0 || segment.outer) continue;
      segment.p_cm = plain(testing::random_vector(1, random));
      const Vector3 p = testing::random_vector(1, random);
      const Scalar noise = dyop_check::pose_noise(segment, 4, 1, 1.5);
      for (const Scalar t : {1.0, 1.3, 1.5}) {
        const Vector3 expected = motion->pose(t) * (p - eigen(segment.p_cm));
        EXPECT_LE((eigen(segment.pose(t) * plain(p)) - expected).norm(), noise);
      }
    }
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
      const dyop_check::Passage a = dyop_check::passage(*body, p, 1, 1.5);
      const dyop_check::Passage b = dyop_check::passage(*body, q, 1, 1.5);
      dyop_check::PairProver prover(a, b, target, 1'000'000);
      std::vector<dyop_check::NodePair> front(1);
      return prover.prove(front);
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
  const auto compare = [&](const ConvexShape& shape, const std::string& line) {
    Piece piece = dyop_check::ShapeReader({dyop_check::parse_json(line)}, {}, {}).pieces(0).front();
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
  compare(cylinder, R"({"kind":"cylinder","radius":0.7,"half_length":1.3})");
  compare(cone, R"({"kind":"cone","radius":0.7,"half_length":1.3})");
  compare(ellipsoid, R"({"kind":"ellipsoid","semi_axes":[0.5,1,2]})");
  compare(TaperedCapsule(0.6, 0.3, 0.4),
          R"({"kind":"tapered_capsule","bottom_radius":0.6,"top_radius":0.3,"half_length":0.4})");
  compare(TaperedCapsule(0.3, 0.6, 0.4),
          R"({"kind":"tapered_capsule","bottom_radius":0.3,"top_radius":0.6,"half_length":0.4})");
}

// What is smaller than it says would be proven too easily.
TEST(CheckShape, RefusesWhatIsNoShape) {
  for (
      const char* line :
      {R"({"kind":"sphere","radius":-1})", R"({"kind":"sphere","radius":1e999})",
       R"({"kind":"sphere"})", R"({"kind":"capsule","radius":-0.1,"half_length":1})",
       R"({"kind":"cylinder","radius":1,"half_length":-1})",
       R"({"kind":"cone","radius":-1,"half_length":1})",
       R"({"kind":"rounded_box","half_extents":[1,1,1],"radius":-1})",
       R"({"kind":"rounded_cylinder","radius":1,"half_length":1,"edge_radius":-0.5})",
       R"({"kind":"tapered_capsule","bottom_radius":1,"top_radius":-2,"half_length":1})",
       R"({"kind":"half_space","normal":[0,0,0],"offset":0})",
       R"({"kind":"box","half_extents":[1,1]})", R"({"kind":"torus","radius":1})",
       R"({"kind":"hull","first_vertex":0,"vertex_count":1})",
       R"({"kind":"mesh","first_vertex":0,"vertex_count":0,"first_triangle":0,"triangle_count":1})",
       R"({"kind":"compound","children":[{"shape":0,"X_CS":[1,0,0,0,1,0,0,0,1,0,0,0]}]})"}) {
    const dyop_check::ShapeReader reader({dyop_check::parse_json(line)}, {}, {});
    EXPECT_THROW(reader.pieces(0), dyop_check::BadFile) << line;
  }
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

// Seen from a ball that turns by a radian, what flies through it in one motion is far away along n at
// both ends. Whether it flies as a body or as a surface that deforms, n proves nothing.
TEST(CheckKernel, ATurningDirectionDoesNotHideWhatFliesThrough) {
  const auto triangle = [](const Vec& at) {
    return std::vector<Vec>{at, at + Vec{0.01, 0, 0}, at + Vec{0, 0.01, 0}};
  };
  dyop_check::Body ball;
  ball.pieces.resize(1);
  ball.pieces[0].points = {{}};
  ball.pieces[0].radius = 0.1;
  ball.build({});
  const Segment turning = dyop_check::twist({}, {}, {}, {0, 0, -1}, 0);
  const Vec from{-5, 0, 0};
  for (const bool deforms : {false, true}) {
    dyop_check::Body speck;
    speck.pieces.resize(1);
    speck.pieces[0].points = triangle(deforms ? from : Vec{});
    speck.build({});
    Segment flight = dyop_check::twist({}, from, {10, 0, 0}, {}, 0);
    if (deforms) {
      speck.corners = {0, 1, 2};
      speck.deform(triangle(from), triangle(Vec{5, 0, 0}));
      flight = dyop_check::at_rest({});
      flight.part_rate = 1;
    }
    const auto a = dyop_check::passage(ball, turning, 0, 1);
    const auto b = dyop_check::passage(speck, flight, 0, 1);
    dyop_check::PairProver prover(a, b, 0, 10000);
    const Scalar angle = std::numbers::pi / 2 + 0.5;
    std::vector<dyop_check::NodePair> front{
        {0, 0, {{std::cos(angle), std::sin(angle), 0}, dyop_check::Frame::A}}};
    const Vec n_last = dyop_check::rotation({0, 0, -1}) * front[0].direction.n;
    EXPECT_GT(gap(a.at_first(ball.nodes[0]), b.at_first(speck.nodes[0]), front[0].direction.n), 1);
    EXPECT_GT(gap(a.at_last(ball.nodes[0]), b.at_last(speck.nodes[0]), n_last), 1);
    EXPECT_EQ(prover.prove(front), dyop_check::Answer::Refuted) << deforms;
  }
}

}  // namespace
}  // namespace dyop
