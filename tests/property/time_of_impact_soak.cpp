// SPDX-License-Identifier: BSD-3-Clause

// Time of impact against an oracle that samples densely with a Lipschitz bound and shares no code
// with the engine, over shapes, motions, turning rates, scales and places:
//   time_of_impact_soak COUNT [SEED [rounded]]
// With `rounded` each query is of a mesh and a ball, a capsule or a rounded hull with a radius of
// 0.01 to 3 sizes of the mesh, some of them inside it. Prints a table and exits with 1 on any
// missed impact, penetration, loose impact, or undecided query. Each query is drawn from SEED and
// its number alone.

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>
#include <string>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/fast_distance_oracle.h"
#include "support/oracles/toi_oracle.h"

namespace dyop {
namespace {

// literal: of the size of the shapes, which is about one times the scale.
constexpr Scalar kTolerance = 1e-6;

constexpr int kMotionKinds = 12;
constexpr Scalar kRates[] = {0, 1, 6, 20};

// A hull inflated by a ball.
class RoundedHull final : public ConvexShape {
 public:
  RoundedHull(std::vector<Vector3> points, Scalar radius) : hull_(std::move(points)), r_(radius) {}

  SupportPoint core_support(const Vector3& direction) const override {
    return hull_.core_support(direction);
  }
  Scalar rounding_radius() const override { return r_; }
  Vector3 core_center() const override { return hull_.core_center(); }
  const TriangleMesh* core_surface() const override { return hull_.core_surface(); }
  AlignedBox bounding_box() const override {
    const Vector3 more = Vector3::Constant(r_);
    return {hull_.bounding_box().min() - more, hull_.bounding_box().max() + more};
  }
  Scalar bounding_radius() const override { return hull_.bounding_radius() + r_; }
  MassProperties compute_mass_properties(Scalar) const override { return {}; }

 private:
  ConvexHull hull_;
  Scalar r_;
};

// The same shapes in every size of a row of scales, so that hierarchies are built once.
struct Zoo {
  explicit Zoo(Scalar s) : scale(s) {
    using namespace testing;
    const auto add_mesh = [&](const MeshArrays& mesh) {
      shapes.push_back(std::make_shared<TriangleMesh>(
          mesh.moved(Matrix3::Identity(), Vector3::Zero(), s).mesh()));
    };
    add_mesh(icosphere(2));
    add_mesh(torus(0.8, 0.25, 24, 10));
    add_mesh(gear(12, 0.7, 1, 0.2));
    add_mesh(plate_grid(1.8, 0.8, 6, 3));
    add_mesh(box_mesh(Vector3(1, 0.04, 0.04)));
    add_mesh(needle(1.5, 5));
    add_mesh(point_cloud(30, 4));
    add_mesh(random_soup(60, 0.3, 5));
    shapes.push_back(std::make_shared<Box>(s * Vector3(0.9, 0.3, 0.02)));
    shapes.push_back(std::make_shared<Capsule>(0.1 * s, 0.8 * s));
    shapes.push_back(std::make_shared<Sphere>(0.5 * s));
    std::mt19937_64 random(6);
    std::vector<Vector3> points(24);
    for (Vector3& p : points) p = s * testing::random_vector(0.7, random);
    shapes.push_back(std::make_shared<ConvexHull>(points));
    first_rounded = shapes.size();
    for (const Scalar r : {0.01, 0.1, 0.5, 1.0, 3.0}) {
      shapes.push_back(std::make_shared<Sphere>(r * s));
      shapes.push_back(std::make_shared<Capsule>(r * s, 0.4 * s));
      std::vector<Vector3> few(6);
      for (Vector3& p : few) p = s * testing::random_vector(0.4, random);
      shapes.push_back(std::make_shared<RoundedHull>(few, r * s));
    }
    for (const auto& shape : shapes) bodies.emplace_back(*shape);
  }

  Scalar scale;
  std::vector<std::shared_ptr<const Shape>> shapes;
  std::vector<testing::OracleBody> bodies;
  std::size_t first_rounded = 0;
  static constexpr int kMeshes = 8;
};

// Along travel sin(2 k t) and about a fixed axis, with the bounds that follow from its formula.
std::unique_ptr<Motion> swinging(const TimeInterval& interval, const RigidPose& X,
                                 const Vector3& travel, const Vector3& turn) {
  const Scalar k = 2 / interval.length();
  const auto phase = [=](Scalar t) { return k * (t - interval.begin); };
  UserMotion::Functions functions;
  functions.pose = [=](Scalar t) {
    return RigidPose(rotation_from_vector(turn * std::sin(phase(t))) * X.rotation(),
                     X.translation() + travel * std::sin(phase(t)));
  };
  functions.twist = [=](Scalar t) {
    return Twist{travel * k * std::cos(phase(t)), turn * k * std::cos(phase(t))};
  };
  functions.twist_bound = [=](const TimeInterval&) {
    const Scalar v = travel.norm() * k * (1 + kMotionNoise);
    const Scalar w = turn.norm() * k * (1 + kMotionNoise);
    return TwistBound{v, w, v * k, w * k};
  };
  return std::make_unique<UserMotion>(functions, interval);
}

std::unique_ptr<Motion> random_spline(const TimeInterval& interval, const RigidPose& X,
                                      const Vector3& travel, Scalar turn, bool is_bezier,
                                      std::mt19937_64& random) {
  std::vector<ControlPoint> points{{X.translation(), Vector3::Zero()}};
  for (const Scalar part : {0.2, 0.5, 0.8, 1.0}) {
    points.push_back(
        {X.translation() + part * travel + 0.2 * testing::random_vector(travel.norm(), random),
         turn * testing::random_vector(1, random)});
  }
  if (is_bezier) return std::make_unique<BezierMotion>(interval, X.rotation(), points);
  std::vector<Scalar> knots;
  for (const Scalar part : {0.0, 0.0, 0.0, 0.4, 0.7}) {
    knots.push_back(interval.begin + part * interval.length());
  }
  knots.insert(knots.end(), 3, interval.end);
  return std::make_unique<SequenceMotion>(bspline_motion(2, knots, X.rotation(), points));
}

// A motion over `interval` that starts at X and moves by about `travel`, turning by about `turn`.
std::unique_ptr<Motion> random_motion(const TimeInterval& interval, const RigidPose& X,
                                      const Vector3& travel, Scalar turn, std::mt19937_64& random) {
  const Scalar h = interval.length();
  const Twist twist{travel / h, turn / h * testing::random_vector(1, random)};
  const auto pose_after = [&](Scalar part) {
    return RigidPose(
        rotation_from_vector(part * turn * testing::random_vector(1, random)) * X.rotation(),
        X.translation() + part * travel);
  };
  switch (testing::random_index(kMotionKinds, random)) {
    case 0:
      return std::make_unique<ConstantTwistMotion>(X, twist, interval.begin);
    case 1: {
      ScrewMotion::Screw screw;
      screw.p_WA = X.translation() + 0.3 * testing::random_vector(travel.norm(), random);
      screw.axis_W = testing::random_direction(random);
      screw.turn_rate = std::min(turn, 2.0) / h;
      screw.slide_rate = travel.dot(screw.axis_W) / h;
      return std::make_unique<ScrewMotion>(X, screw, interval.begin);
    }
    case 2:
      return std::make_unique<InterpolatedMotion>(interval, X, pose_after(1));
    case 3:
      return std::make_unique<InterpolatedMotion>(interval, X, pose_after(1),
                                                  RotationPath::RotationVector);
    case 4:
      return std::make_unique<SampledMotion>(
          std::vector<SampledMotion::Sample>{{interval.begin, X},
                                             {interval.begin + 0.37 * h, pose_after(0.3)},
                                             {interval.end, pose_after(1)}});
    case 5:
      return std::make_unique<SequenceMotion>(
          smooth_sampled_motion({{interval.begin, X},
                                 {interval.begin + 0.37 * h, pose_after(0.3)},
                                 {interval.begin + 0.6 * h, pose_after(0.7)},
                                 {interval.end, pose_after(1)}}));
    case 6:
      return random_spline(interval, X, travel, turn, true, random);
    case 7:
      return random_spline(interval, X, travel, turn, false, random);
    case 8: {
      const Scalar middle = interval.begin + 0.4 * h;
      const auto first = std::make_shared<ConstantTwistMotion>(X, twist, interval.begin);
      const TimeInterval rest{middle, interval.end};
      const auto second =
          std::make_shared<InterpolatedMotion>(rest, first->pose(middle), pose_after(1));
      return std::make_unique<SequenceMotion>(
          std::vector<SequenceMotion::Part>{{{interval.begin, middle}, first}, {rest, second}});
    }
    case 9: {
      const Twist inner{0.3 * travel / h, 0.5 * turn / h * testing::random_vector(1, random)};
      return std::make_unique<ComposedMotion>(
          std::make_shared<ConstantTwistMotion>(X, Twist{0.7 * twist.v_WB, 0.5 * twist.w_WB},
                                                interval.begin),
          std::make_shared<ConstantTwistMotion>(RigidPose(), inner, interval.begin));
    }
    case 10:
      return swinging(interval, X, travel, turn * testing::random_vector(1, random));
    default:
      return std::make_unique<HermiteMotion>(HermiteMotion::from_chart(
          interval, X.rotation(), {X.translation(), travel / h, Vector3::Zero(), twist.w_WB},
          {X.translation() + travel, 0.5 * travel / h, turn * testing::random_vector(1, random),
           twist.w_WB}));
  }
}

struct Tally {
  int queries = 0;
  int hits = 0;
  int missed = 0;
  int penetrating = 0;
  int loose = 0;
  int undecided = 0;
  int wrong_distances = 0;
  Scalar worst_gap = 0;  // at an impact, in tolerances above the target

  int faults() const { return missed + penetrating + loose + undecided + wrong_distances; }
};

struct Query {
  std::size_t a;
  std::size_t b;
  TimeInterval interval;
  std::unique_ptr<Motion> X_WA;
  std::unique_ptr<Motion> X_WB;
  ToiOptions options;
};

Query random_query(const Zoo& zoo, Scalar rate, bool is_rounded, std::mt19937_64& random) {
  const Scalar s = zoo.scale;
  const int count = int(zoo.first_rounded);
  Query query;
  query.a = std::size_t(testing::random_index(count, random));
  query.b = std::size_t(testing::random_index(count, random));
  if (is_rounded) {
    query.a = std::size_t(testing::random_index(Zoo::kMeshes, random));
    query.b = zoo.first_rounded + std::size_t(testing::random_index(
                                      int(zoo.shapes.size() - zoo.first_rounded), random));
    if (testing::random_index(2, random) == 0) std::swap(query.a, query.b);
  }
  const Scalar begin = std::array{0.0, -5.0, 100.0}[std::size_t(testing::random_index(3, random))];
  query.interval = {begin,
                    begin + std::array{1.0, 0.01}[std::size_t(testing::random_index(2, random))]};
  // A third far from the world's origin.
  const Vector3 place = testing::random_index(3, random) == 0
                            ? Vector3(1e4 * s * testing::random_direction(random))
                            : Vector3::Zero();
  Vector3 from = s * testing::random_number(2, 4, random) * testing::random_direction(random);
  if (is_rounded) {
    from *= testing::random_index(4, random) == 0 ? 0.1 : 1;
    const auto radius = [&](std::size_t shape) {
      return zoo.bodies[shape].surface().rounding_radius;
    };
    from += (radius(query.a) + radius(query.b)) * from.normalized();
  }
  const Vector3 aim = s * testing::random_vector(1, random);
  query.X_WA = random_motion(query.interval, RigidPose(testing::random_rotation(random), place),
                             0.1 * s * testing::random_vector(1, random), rate, random);
  query.X_WB =
      random_motion(query.interval, RigidPose(testing::random_rotation(random), place + from),
                    1.5 * (aim - from), rate, random);
  query.options.distance_tolerance = kTolerance * s;
  query.options.target_distance = testing::random_index(4, random) == 0 ? 0.05 * s : 0;
  return query;
}

// The bounds of distance() where the search ended.
bool is_distance_right(const Zoo& zoo, const Query& query, const ToiResult& result,
                       const testing::DistanceBracket& oracle) {
  const DistanceResult found =
      distance(*zoo.shapes[query.a], result.X_WA, *zoo.shapes[query.b], result.X_WB);
  return found.lower <= oracle.upper + result.rounding_allowance &&
         found.upper >= oracle.lower - result.rounding_allowance &&
         found.upper - found.lower <= 2 * result.rounding_allowance;
}

void check(const Zoo& zoo, const Query& query, Tally& tally, const std::string& name) {
  const ToiResult result = time_of_impact(*zoo.shapes[query.a], *query.X_WA, *zoo.shapes[query.b],
                                          *query.X_WB, query.interval, query.options);
  ++tally.queries;
  const auto fault = [&](int& counter, const char* what) {
    ++counter;
    std::printf("%s: %s (shapes %zu %zu, t_safe %.17g)\n", name.c_str(), what, query.a, query.b,
                result.t_safe);
  };
  const Scalar delta = query.options.target_distance;
  const Scalar epsilon = query.options.distance_tolerance.value();
  const Scalar resolution = epsilon / 8;
  testing::ToiOracle oracle(zoo.bodies[query.a], *query.X_WA, zoo.bodies[query.b], *query.X_WB);
  if (result.status == ToiStatus::InitiallyWithinTarget) {
    const Scalar lower = oracle.distance_at(query.interval.begin, resolution).lower;
    if (lower > delta + epsilon) fault(tally.undecided, "not within the target at the start");
    return;
  }
  if (!is_distance_right(zoo, query, result, oracle.distance_at(result.t_safe, resolution))) {
    fault(tally.wrong_distances, "wrong distance");
  }
  const bool is_hit = result.status == ToiStatus::Impact;
  // Nobody can tell distances apart that rounding may exceed.
  const bool is_too_fine =
      result.status == ToiStatus::NumericalLimit && result.rounding_allowance > epsilon / 8;
  if (!is_hit && !is_too_fine && result.status != ToiStatus::Separated) {
    fault(tally.undecided, "undecided");
  }
  const Scalar floor = delta + epsilon / 4 - result.rounding_allowance;
  const auto broken = oracle.first_time_within(floor - resolution,
                                               {query.interval.begin, result.t_safe}, resolution);
  if (broken.t && broken.at_t.upper < floor) {
    fault(is_hit ? tally.penetrating : tally.missed, is_hit ? "penetrating" : "missed");
  }
  if (!is_hit) return;
  ++tally.hits;
  const Scalar gap = oracle.distance_at(result.t_safe, resolution).lower - delta;
  tally.worst_gap = std::max(tally.worst_gap, gap / epsilon);
  if (gap > epsilon + result.rounding_allowance) fault(tally.loose, "loose");
}

int run(int count, std::uint64_t seed, bool is_rounded) {
  std::vector<Zoo> zoos;
  for (const Scalar scale : {1e-3, 1.0, 1e3}) zoos.emplace_back(scale);
  std::printf("seed %llu, tolerance %g of the size\n", static_cast<unsigned long long>(seed),
              kTolerance);
  std::printf("%6s %8s %8s %8s %8s %12s %6s %10s %10s\n", "rate", "scale", "queries", "hits",
              "missed", "penetrating", "loose", "undecided", "worst gap");
  int faults = 0;
  for (const Scalar rate : kRates) {
    for (const Zoo& zoo : zoos) {
      Tally tally;
      for (int k = 0; k < count; ++k) {
        std::mt19937_64 random(seed * 1000003 + std::uint64_t(k));
        const Query query = random_query(zoo, rate, is_rounded, random);
        check(zoo, query, tally, "rate " + std::to_string(rate) + " query " + std::to_string(k));
      }
      std::printf("%6g %8g %8d %8d %8d %12d %6d %10d %10.6f\n", rate, zoo.scale, tally.queries,
                  tally.hits, tally.missed, tally.penetrating, tally.loose, tally.undecided,
                  tally.worst_gap);
      std::fflush(stdout);
      faults += tally.faults();
      // Neither all hits nor all misses, or nothing was tested.
      if (tally.hits < tally.queries / 5 || tally.hits > tally.queries * 9 / 10) ++faults;
    }
  }
  return faults == 0 ? 0 : 1;
}

}  // namespace
}  // namespace dyop

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 50;
  const long seed = argc > 2 ? std::atol(argv[2]) : 1;
  if (count <= 0 || seed < 0) {
    std::fprintf(stderr, "usage: time_of_impact_soak COUNT [SEED [rounded]]\n");
    return 2;
  }
  const bool is_rounded = argc > 3 && std::string(argv[3]) == "rounded";
  return dyop::run(count, static_cast<std::uint64_t>(seed), is_rounded);
}
