// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/page_encoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "dyop/core/error.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/temporary_directory.h"
#include "view/page_block.h"

namespace dyop {
namespace {

using testing::PageBlock;

PageScene scene_with(const std::shared_ptr<const Shape>& shape) {
  PageScene scene;
  scene.title = "A <scene> & more";
  scene.bodies.push_back({"body", BodyKind::Kinematic, shape, "", {}});
  return scene;
}

constexpr int kLevels = 1 << 24;

struct Surface {
  std::vector<Vector3> vertices;
  std::vector<std::size_t> corners;
};

// The steps of docs/player.md, one after another.
Surface surface_in(const PageBlock& block, std::size_t shape) {
  const nlohmann::json& facts = block.header().at("shapes").at(shape);
  const std::string name = "shape" + std::to_string(shape);
  const auto count = facts.at("vertices").get<std::size_t>();
  const std::vector<double> differences = block.numbers(name + ".vertices");
  Surface surface;
  surface.vertices.resize(count);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto low = facts.at("low").at(axis).get<double>();
    const auto high = facts.at("high").at(axis).get<double>();
    int level = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const int coded = int(differences[axis * count + k]);
      level = (level + (coded % 2 == 0 ? coded / 2 : -(coded + 1) / 2) + kLevels) % kLevels;
      surface.vertices[k][Eigen::Index(axis)] = low + (high - low) * level / (kLevels - 1);
    }
  }
  std::size_t next = 0;
  for (const double back : block.numbers(name + ".triangles")) {
    surface.corners.push_back(back == 0 ? next++ : next - std::size_t(back));
  }
  EXPECT_EQ(next, count);
  return surface;
}

TEST(PageEncoder, RoundsVerticesToTheirBox) {
  std::mt19937 random(3);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    std::uniform_real_distribution<Scalar> any(-size, size);
    std::vector<Vector3> vertices;
    std::vector<TriangleIndices> triangles;
    for (std::int32_t k = 0; k < 300; ++k) {
      vertices.push_back(Vector3(any(random), any(random), any(random)) + Vector3(7, 8, 9) * size);
      if (k >= 2) triangles.push_back({k, (k * 7) % k, k - 1});
    }
    const TriangleMesh mesh(vertices, triangles);
    const PageBlock block(PageEncoder(scene_with(std::make_shared<TriangleMesh>(mesh))).head());
    const Surface surface = surface_in(block, 0);
    ASSERT_EQ(surface.corners.size(), 3 * triangles.size());
    for (std::size_t k = 0; k < surface.corners.size(); ++k) {
      const auto vertex = std::size_t(triangles[k / 3][k % 3]);
      const Vector3 off = surface.vertices[surface.corners[k]] - vertices[vertex];
      EXPECT_LE(off.cwiseAbs().maxCoeff(), 2 * size / (kLevels - 1) * 0.51 + 1e-15 * size);
    }
  }
}

// Segments and points have no area: rods are added, whose triangles face outwards. Sides of other
// triangles, as in files with triangles of no area, need none.
TEST(PageEncoder, DrawsWiresAndPoints) {
  const std::vector<Vector3> vertices{{0, 0, 0}, {3, 0, 0}, {3, 4, 0}, {3, 4, 12}, {1, 1, 1}};
  const TriangleMesh mesh(
      vertices, {{0, 1, 2}, {2, 3, 2}, {4, 4, 4}, {2, 1, 1}, {0, 0, 0}, {0, 2, 2}, {3, 2, 2}});
  const PageBlock block(PageEncoder(scene_with(std::make_shared<TriangleMesh>(mesh))).head());
  const Surface surface = surface_in(block, 0);
  const std::size_t own = 3 * 7;
  ASSERT_EQ(surface.corners.size(), own + 2 * 3 * 16);
  const Scalar radius = 0.005 * 13;
  const auto volume_of = [&](std::size_t first) {
    Scalar volume = 0;
    for (std::size_t k = first; k < first + 3 * 16; k += 3) {
      const auto corner = [&](std::size_t i) { return surface.vertices[surface.corners[k + i]]; };
      volume += corner(0).dot(corner(1).cross(corner(2))) / 6;
    }
    return volume;
  };
  // A prism over a square of half diagonals `radius`, and a pyramid at each end.
  const Scalar square = 2 * radius * radius;
  const Scalar tips = 2 * square * radius / 3;
  EXPECT_NEAR(volume_of(own), 12 * square + tips, 1e-5);
  EXPECT_NEAR(volume_of(own + 3 * 16), tips, 1e-5);
}

TEST(PageEncoder, DrawsRoundShapesOnTheirSurface) {
  const PageBlock block(PageEncoder(scene_with(std::make_shared<Capsule>(0.5, 2))).head());
  const Surface surface = surface_in(block, 0);
  EXPECT_EQ(surface.corners.size(), 3u * 8 * 256);
  for (const Vector3& p : surface.vertices) {
    const Vector3 on_axis(0, 0, std::clamp<Scalar>(p.z(), -2, 2));
    EXPECT_NEAR((p - on_axis).norm(), 0.5, 1e-4);
  }
}

TEST(PageEncoder, StoresASharedShapeOnceAndCompoundsWhole) {
  const auto box = std::make_shared<Box>(Vector3(1, 1, 1));
  PageScene scene = scene_with(box);
  scene.bodies.push_back({"twin", BodyKind::Dynamic, box, "", MassProperties{2, Vector3(1, 2, 3)}});
  const auto pair = std::make_shared<CompoundShape>(
      std::vector<CompoundChild>{{box, RigidPose(Vector3(5, 0, 0))}, {box, RigidPose()}});
  scene.bodies.push_back({"pair", BodyKind::Static, pair, "", {}});
  const PageBlock block(PageEncoder(scene).head());
  ASSERT_EQ(block.header().at("shapes").size(), 2u);
  EXPECT_EQ(block.header().at("bodies").at(1).at("shape"), 0);
  EXPECT_EQ(block.header().at("bodies").at(1).at("center"), nlohmann::json({1.0, 2.0, 3.0}));
  EXPECT_EQ(surface_in(block, 0).corners.size(), 36u);
  EXPECT_EQ(surface_in(block, 1).corners.size(), 72u);
  EXPECT_EQ(block.header().at("shapes").at(1).at("high"), nlohmann::json({6.0, 1.0, 1.0}));
}

TEST(PageEncoder, KeepsParametersOfExactMotions) {
  const PageEncoder encoder(scene_with(std::make_shared<Sphere>(1)));
  const RigidPose X(rotation_from_vector({0.3, -2, 1}), {4, 5, 6});
  const Twist twist{{1, 2, 3}, {0.1, 0.2, 0.3}};
  const ConstantTwistMotion turning(X, twist, 0.25);
  const MotionState begin = turning.state(1);
  const MotionState end = turning.state(2);
  PageSpan span;
  const BodyId body(0);
  span.segments = {
      {body, {0, 0.5}, std::make_shared<RestMotion>(X)},
      {body, {0.5, 1}, std::make_shared<ConstantTwistMotion>(turning)},
      {body, {1, 1.5}, std::make_shared<HermiteMotion>(TimeInterval{1, 2}, begin, end)},
      {body, {2, 3}, nullptr}};
  const PageBlock block(encoder.span(span));
  EXPECT_EQ(block.vector("rest.p", 0), X.translation());
  EXPECT_EQ(block.numbers("twist.t0"), std::vector<double>{0.25});
  EXPECT_EQ(block.vector("twist.v", 0), twist.v_WB);
  EXPECT_EQ(block.vector("twist.w", 0), twist.w_WB);
  EXPECT_EQ(block.numbers("cubic.begin"), std::vector<double>{1});
  EXPECT_EQ(block.numbers("cubic.end"), std::vector<double>{1.5});
  EXPECT_EQ(block.numbers("cubic.domain_end"), std::vector<double>{2});
  EXPECT_EQ(block.vector("cubic.v1", 0), end.twist.v_WB);
  EXPECT_EQ(block.numbers("absent.begin"), std::vector<double>{2});
}

TEST(PageEncoder, TakesSequencesApartWhereTheirVelocityJumps) {
  const RigidPose X;
  const auto out = std::make_shared<ConstantTwistMotion>(X, Twist{{1, 0, 0}, {0, 0, 0}}, 0);
  const auto back = std::make_shared<ConstantTwistMotion>(RigidPose(Vector3(1, 0, 0)),
                                                          Twist{{-1, 0, 0}, {0, 0, 0}}, 1);
  const auto both = std::make_shared<SequenceMotion>(
      std::vector<SequenceMotion::Part>{{{0, 1}, out}, {{1, 2}, back}});
  PageSpan span;
  span.segments = {{BodyId(0), {0.25, 1.5}, both}};
  const PageBlock block(PageEncoder(scene_with(std::make_shared<Sphere>(1))).span(span));
  EXPECT_EQ(block.numbers("twist.begin"), (std::vector<double>{0.25, 1}));
  EXPECT_EQ(block.numbers("twist.end"), (std::vector<double>{1, 1.5}));
}

// Cubics through the states at the ends of each row, as the page evaluates them, against the
// motion.
TEST(PageEncoder, FollowsOtherMotionsByCubics) {
  for (const Scalar far : {0.0, 1e4}) {
    std::vector<ControlPoint> points;
    for (int k = 0; k <= 7; ++k) {
      points.push_back({Vector3(std::cos(3 * k) + far, std::exp(k / 5.0), -far),
                        Vector3(std::sin(2 * k), k / 3.0, std::cos(k))});
    }
    const auto motion =
        std::make_shared<BezierMotion>(TimeInterval{0, 1}, Matrix3(Matrix3::Identity()), points);
    PageSpan span;
    span.segments = {{BodyId(0), {0, 1}, motion}};
    const PageBlock block(PageEncoder(scene_with(std::make_shared<Sphere>(1))).span(span));
    const std::vector<double> begins = block.numbers("cubic.begin");
    const std::vector<double> ends = block.numbers("cubic.end");
    const std::vector<double> qw = block.numbers("cubic.qw");
    ASSERT_FALSE(begins.empty());
    for (std::size_t k = 0; k < begins.size(); ++k) {
      const Vector3 q = block.vector("cubic.q", k);
      const HermiteMotion cubic = HermiteMotion::from_chart(
          {begins[k], ends[k]}, Quaternion(qw[k], q.x(), q.y(), q.z()).toRotationMatrix(),
          {block.vector("cubic.p0", k), block.vector("cubic.v0", k),
           block.vector("cubic.theta0", k), block.vector("cubic.theta_rate0", k)},
          {block.vector("cubic.p1", k), block.vector("cubic.v1", k),
           block.vector("cubic.theta1", k), block.vector("cubic.theta_rate1", k)});
      for (const Scalar part : {0.0, 0.21, 0.5, 0.83}) {
        const Scalar t = begins[k] + part * (ends[k] - begins[k]);
        const RigidPose wanted = motion->pose(t);
        const RigidPose found = cubic.pose(t);
        EXPECT_LE((wanted.translation() - found.translation()).norm(),
                  1e-9 * (1 + wanted.translation().norm()));
        EXPECT_LE((wanted.rotation() - found.rotation()).norm(), 1e-9);
      }
    }
  }
}

TEST(PageEncoder, RefusesBodiesWithoutShapeAndUnknownBodies) {
  EXPECT_THROW(PageEncoder(scene_with(nullptr)), InvalidArgument);
  const PageEncoder encoder(scene_with(std::make_shared<Sphere>(1)));
  PageSpan span;
  span.segments = {{BodyId(1), {0, 1}, std::make_shared<RestMotion>()}};
  EXPECT_THROW(encoder.span(span), InvalidArgument);
}

TEST(PageEncoder, AddsBodiesWhileARunGoesOn) {
  PageEncoder encoder(scene_with(std::make_shared<Sphere>(1)));
  PageSpan span;
  span.bodies = {{"late", BodyKind::Static, std::make_shared<Sphere>(2), "", {}}};
  span.segments = {{BodyId(1), {0, 1}, std::make_shared<RestMotion>()}};
  EXPECT_THROW(encoder.span(span), InvalidArgument);
  encoder.add_bodies(span.bodies);
  const nlohmann::json header = PageBlock(encoder.span(span)).header();
  EXPECT_EQ(header["bodies"].at(0)["name"], "late");
  EXPECT_EQ(header["bodies"].at(0)["shape"], 0);
  EXPECT_EQ(header["shapes"].size(), 1u);
  EXPECT_THROW(encoder.add_bodies({{"none", BodyKind::Static, nullptr, "", {}}}), InvalidArgument);
}

// A chunk of random motions of every kind, some of which go on where the one before ended.
class RandomChunk {
 public:
  // Lengths are of this scale, and bodies this far from the origin.
  RandomChunk(unsigned seed, Scalar scale, Scalar far_off)
      : random_(seed), scale_(scale), place_(far_off * any_vector()) {
    for (std::size_t k = 0; k < kBodies; ++k) {
      const auto shape = std::make_shared<Sphere>(scale * (1 + Scalar(k)));
      PageBody& body = scene.bodies.emplace_back();
      body = {"body " + std::to_string(k), BodyKind::Dynamic, shape, "", {}};
      body.mass_properties = MassProperties{1, 0.4 * scale * any_vector(), Matrix3::Identity()};
      add_motions(k);
    }
    for (int k = 0; k < kFrames; ++k) span.frames.push_back({{time(k), time(k + 1)}, {}, 0, 0});
    add_pairs();
  }

  static constexpr std::size_t kBodies = 6;
  static constexpr int kFrames = 40;
  TimeInterval interval() const { return {time(0), time(kFrames)}; }

  // The library's poses at random times, and every gap and contact.
  nlohmann::json facts() {
    nlohmann::json facts = pair_facts_;
    facts["begin"] = interval().begin;
    for (int k = 0; k < 3000; ++k) {
      const auto body = std::size_t(uniform(0, kBodies));
      const Scalar t = uniform(interval().begin, interval().end);
      const auto segment = std::ranges::find_if(span.segments, [&](const PageSegment& one) {
        return one.body.slot == body && one.interval.begin <= t && t < one.interval.end;
      });
      nlohmann::json json{{"body", body}, {"t", t}};
      if (segment->motion) {
        const MotionState state = segment->motion->state(t);
        const Quaternion q = state.X_WB.quaternion();
        json["p"] = numbers(state.X_WB.translation());
        json["q"] = {q.x(), q.y(), q.z(), q.w()};
        json["v"] = numbers(state.twist.v_WB);
      }
      facts["poses"].push_back(std::move(json));
    }
    return facts;
  }

  PageScene scene;
  PageSpan span;

 private:
  static nlohmann::json numbers(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
  Scalar time(int k) const { return 3 + 0.01 * k; }
  Scalar uniform(Scalar low, Scalar high) {
    return std::uniform_real_distribution<Scalar>(low, high)(random_);
  }
  Vector3 any_vector() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }

  MotionState any_state() {
    return {RigidPose(rotation_from_vector(2 * any_vector()), place_ + scale_ * any_vector()),
            {5 * scale_ * any_vector(), 9 * any_vector()}};
  }

  std::shared_ptr<const Motion> any_motion(const TimeInterval& t, const MotionState& at) {
    const int kind = int(uniform(0, 6));
    if (kind == 0) return std::make_shared<RestMotion>(at.X_WB);
    if (kind == 1) return std::make_shared<ConstantTwistMotion>(at.X_WB, at.twist, t.begin);
    if (kind == 2) {
      return std::make_shared<ScrewMotion>(
          at.X_WB, ScrewMotion::Screw{place_, Vector3(0.6, 0, 0.8), 3, scale_}, t.begin);
    }
    if (kind == 3) return nullptr;
    // Of a longer cubic a part, or all.
    const TimeInterval domain = kind == 4 ? t : TimeInterval{t.begin - 0.005, t.end + 0.01};
    MotionState next = any_state();
    next.X_WB = RigidPose(at.X_WB.rotation() * rotation_from_vector(0.3 * any_vector()),
                          next.X_WB.translation());
    return std::make_shared<HermiteMotion>(domain, at, next);
  }

  void add_motions(std::size_t body) {
    MotionState at = any_state();
    const Vector3 center = scene.bodies[body].mass_properties->p_BoBcm;
    for (int k = 0; k < kFrames; ++k) {
      // Segments of many lengths, down to a millionth of a frame.
      const Scalar cut = k % 5 == 0 ? time(k) + 1e-8 : time(k + 1);
      for (const TimeInterval& t : {TimeInterval{time(k), cut}, TimeInterval{cut, time(k + 1)}}) {
        if (!(t.begin < t.end)) continue;
        std::shared_ptr<const Motion> motion = any_motion(t, at);
        if (motion && uniform(0, 1) < 0.5) {  // about the centre of mass
          motion = std::make_shared<ComposedMotion>(
              motion, std::make_shared<RestMotion>(RigidPose(Matrix3::Identity(), -center)));
        }
        span.segments.push_back({BodyId(body), t, motion});
        at = motion && uniform(0, 1) < 0.7 ? motion->state(t.end) : any_state();
      }
    }
  }

  void add_pairs() {
    for (int k = 0; k < kFrames; ++k) {
      const TimeInterval frame{time(k), time(k + 1)};
      for (std::uint32_t a = 0; a + 1 < kBodies; ++a) {
        if (uniform(0, 1) < 0.3) continue;
        add_gap(frame, BodyId(a), BodyId(a + 1));
        const int count = int(uniform(0, 5));
        for (int number = 0; number < count; ++number) {
          add_contact(frame, BodyId(a), BodyId(a + 1), number);
        }
      }
    }
  }

  void add_gap(const TimeInterval& frame, BodyId a, BodyId b) {
    PageGap gap;
    gap.t = frame.end;
    gap.a = a;
    gap.b = b;
    gap.lower = scale_ * std::pow(10, uniform(-9, 0));
    const bool is_known = uniform(0, 1) < 0.8;
    if (is_known) gap.upper = gap.lower * uniform(1, 1.5);
    if (uniform(0, 1) < 0.1) gap.lower = uniform(0, 1) < 0.5 ? 0 : -gap.lower;
    gap.is_resting = uniform(0, 1) < 0.5;
    gap.proof = gap.is_resting ? ProofKind::AtRest : ProofKind::ByBound;
    const Vector3 from = place_ + scale_ * any_vector();
    gap.witness_W = {from, from + (is_known ? gap.upper : 0) * any_vector().normalized()};
    gap.pivot_W = from + 0.1 * scale_ * any_vector();
    span.gaps.push_back(gap);
    pair_facts_["gaps"].push_back({{"t", gap.t},
                                   {"a", a.slot},
                                   {"b", b.slot},
                                   {"lower", gap.lower},
                                   {"upper", gap.upper},
                                   {"resting", gap.is_resting},
                                   {"proof", 1 + int(*gap.proof)},
                                   {"pa", numbers(from)},
                                   {"pb", numbers(gap.witness_W->second)},
                                   {"pivot", numbers(*gap.pivot_W)}});
  }

  void add_contact(const TimeInterval& frame, BodyId a, BodyId b, int number) {
    PageContact contact;
    contact.interval = frame;
    contact.a = a;
    contact.b = b;
    contact.is_resting = uniform(0, 1) < 0.5;
    contact.p_WC = place_ + scale_ * any_vector();
    contact.nhat_AB_W = any_vector().normalized();
    contact.impulse_W = std::pow(10, uniform(-6, 3)) * any_vector();
    span.contacts.push_back(contact);
    pair_facts_["contacts"].push_back({{"begin", frame.begin},
                                       {"end", frame.end},
                                       {"a", a.slot},
                                       {"b", b.slot},
                                       {"number", number},
                                       {"resting", contact.is_resting},
                                       {"p", numbers(contact.p_WC)},
                                       {"normal", numbers(contact.nhat_AB_W)},
                                       {"impulse", numbers(contact.impulse_W)}});
  }

  std::mt19937 random_;
  Scalar scale_;
  Vector3 place_;
  nlohmann::json pair_facts_;
};

TEST(PageEncoder, ChunksAreRoundedByNoMoreThanTheySay) {
  if (std::string(DYOP_NODE).empty() || !std::filesystem::exists(DYOP_NODE)) {
    GTEST_SKIP() << "runs with node: bash .ci/install.sh page";
  }
  const testing::TemporaryDirectory directory;
  unsigned seed = 7;
  using Case = std::pair<Scalar, Scalar>;  // scale, distance from the origin
  for (const auto& [scale, far_off] : {Case{1e-4, 0}, Case{1, 1e7}, Case{1e4, 1e7}}) {
    RandomChunk run(seed++, scale, far_off);
    const PageEncoder encoder(run.scene);
    nlohmann::json facts = run.facts();
    const std::string chunk = encoder.chunk(run.interval(), run.span);
    const nlohmann::json steps = PageBlock(chunk.substr(17)).header().at("steps");
    facts.update(steps);
    EXPECT_LE(steps.at("place").get<Scalar>(), scale * 0x1p-26);
    const auto head_file = directory.write("head", encoder.head());
    const auto chunk_file = directory.write("chunk", chunk);
    const auto facts_file = directory.write("facts.json", facts.dump());
    const auto log = directory.path() / "log";
    const std::string command = std::string("'" DYOP_NODE "' '" DYOP_PAGE_CHECKS
                                            "/check_chunk.mjs' '" DYOP_PAGE_SOURCES "' '") +
                                head_file.string() + "' '" + chunk_file.string() + "' '" +
                                facts_file.string() + "' > '" + log.string() + "' 2>&1";
    const int status = std::system(command.c_str());
    std::ostringstream words;
    words << std::ifstream(log).rdbuf();
    EXPECT_EQ(status, 0) << "scale " << scale << ", " << far_off << " away\n" << words.str();
  }
}

}  // namespace
}  // namespace dyop
