// SPDX-License-Identifier: BSD-3-Clause

// Time of impact of convex pairs that move and turn at constant twists: time_of_impact() against
// Bullet's btContinuousConvexCollision and FCL's conservative advancement, the same queries for
// all:
//   convex_time_of_impact_benchmark [QUERIES] [SEED]
// `us` is the processor time of one query, mean over all queries, of the best of nine passes; so
// branch predictors cannot learn one query, and what others do on the machine counts little. The
// other columns count, by the sampling oracle: `hits` reported; `missed`: no hit reported, but the
// shapes touch; `late`: touching before the time reported; `loose`: farther than kLoose apart then.

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/NarrowPhaseCollision/btContinuousConvexCollision.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/motion/interp_motion.h>
#include <fcl/narrowphase/continuous_collision.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/toi_oracle.h"

namespace dyop::testing {
namespace {

constexpr Scalar kTolerance = 1e-3;  // literal: length, of shapes of radius 0.7 and 0.6
constexpr Scalar kTouching = 1e-6;   // literal: of the oracle, far below all tolerances
constexpr Scalar kLate = 1e-4;       // literal: time; FCL's default tolerance of time
constexpr Scalar kLoose = 1e-2;
constexpr int kPasses = 9;

struct Query {
  RigidPose X_WA;
  RigidPose X_WB;
  Twist twist_WA;
  Twist twist_WB;
  ConstantTwistMotion motion_a{X_WA, twist_WA};
  ConstantTwistMotion motion_b{X_WB, twist_WB};
};

std::deque<Query> random_queries(int count, Scalar rate, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::deque<Query> queries;
  for (int k = 0; k < count; ++k) {
    const Vector3 from = 2.5 * random_direction(random);
    const Vector3 aim = random_number(0, 1.2, random) * random_direction(random);
    queries.push_back({RigidPose(random_rotation(random), Vector3::Zero()),
                       RigidPose(random_rotation(random), from),
                       {Vector3::Zero(), rate * random_direction(random)},
                       {1.2 * (aim - from), rate * random_direction(random)}});
  }
  return queries;
}

using Answer = std::optional<Scalar>;  // time of the hit, if one is reported
using Engine = std::function<Answer(const Query&)>;

Engine dyop_engine(const Shape& shape) {
  ToiOptions options;
  options.distance_tolerance = kTolerance;
  return [&shape, options, workspace = std::make_shared<ToiWorkspace>()](const Query& query) {
    const ToiResult result =
        time_of_impact(shape, query.motion_a, shape, query.motion_b, {0, 1}, options, *workspace);
    return result.status == ToiStatus::Separated ? Answer() : Answer(result.t_safe);
  };
}

btVector3 to_bullet(const Vector3& p) {
  return {btScalar(p.x()), btScalar(p.y()), btScalar(p.z())};
}

btTransform to_bullet(const RigidPose& X) {
  const Quaternion q = X.quaternion();
  return btTransform(
      btQuaternion(btScalar(q.x()), btScalar(q.y()), btScalar(q.z()), btScalar(q.w())),
      to_bullet(X.translation()));
}

Engine bullet_engine(const btConvexShape& shape) {
  return [&shape](const Query& query) {
    btVoronoiSimplexSolver simplex;
    btGjkEpaPenetrationDepthSolver penetration;
    btContinuousConvexCollision cast(&shape, &shape, &simplex, &penetration);
    btConvexCast::CastResult result;
    const bool is_hit =
        cast.calcTimeOfImpact(to_bullet(query.X_WA), to_bullet(query.motion_a.pose(1)),
                              to_bullet(query.X_WB), to_bullet(query.motion_b.pose(1)), result);
    return is_hit ? Answer(Scalar(result.m_fraction)) : Answer();
  };
}

fcl::InterpMotion<double> to_fcl(const RigidPose& begin, const ConstantTwistMotion& motion) {
  const RigidPose end = motion.pose(1);
  // About the body's origin, set explicitly: FCL leaves its default uninitialised.
  return {begin.rotation(), begin.translation(), end.rotation(), end.translation(),
          Vector3::Zero()};
}

Engine fcl_engine(const fcl::CollisionGeometryd& shape) {
  fcl::ContinuousCollisionRequestd request;
  request.num_max_iterations = 1000;
  request.ccd_solver_type = fcl::CCDC_CONSERVATIVE_ADVANCEMENT;
  request.gjk_solver_type = fcl::GST_INDEP;
  return [&shape, request](const Query& query) {
    const fcl::InterpMotion<double> motion_a = to_fcl(query.X_WA, query.motion_a);
    const fcl::InterpMotion<double> motion_b = to_fcl(query.X_WB, query.motion_b);
    fcl::ContinuousCollisionResultd result;
    fcl::continuousCollide(&shape, &motion_a, &shape, &motion_b, request, result);
    return result.is_collide ? Answer(result.time_of_contact) : Answer();
  };
}

std::shared_ptr<fcl::Convexd> fcl_hull(const ConvexHull& hull) {
  auto vertices = std::make_shared<std::vector<Vector3>>();
  vertices->assign(hull.vertices().begin(), hull.vertices().end());
  auto faces = std::make_shared<std::vector<int>>();
  for (const TriangleIndices& t : hull.core_surface()->triangles()) {
    faces->push_back(3);
    faces->insert(faces->end(), t.begin(), t.end());
  }
  return std::make_shared<fcl::Convexd>(vertices, int(hull.core_surface()->triangles().size()),
                                        faces);
}

Scalar processor_microseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * Scalar(now.tv_sec) + Scalar(now.tv_nsec) / 1000;
}

// The first time at which the shapes touch, up to kTouching.
std::vector<Answer> truth(const OracleBody& body, const std::deque<Query>& queries) {
  std::vector<Answer> result;
  for (const Query& query : queries) {
    ToiOracle oracle(body, query.motion_a, body, query.motion_b);
    result.push_back(oracle.first_time_within(kTouching, {0, 1}, kTouching).t);
  }
  return result;
}

struct Case {
  std::string name;
  Scalar rate;
  const OracleBody& body;
  const std::deque<Query>& queries;
  const std::vector<Answer>& touching;
};

void run(const Case& subject, const char* engine_name, const Engine& engine) {
  const auto count = Scalar(subject.queries.size());
  Scalar best = kInfinity;
  std::vector<Answer> answers(subject.queries.size());
  for (int pass = 0; pass < kPasses; ++pass) {
    const Scalar begin = processor_microseconds();
    for (std::size_t k = 0; k < answers.size(); ++k) answers[k] = engine(subject.queries[k]);
    best = std::min(best, (processor_microseconds() - begin) / count);
  }
  int hits = 0;
  int missed = 0;
  int late = 0;
  int loose = 0;
  for (std::size_t k = 0; k < answers.size(); ++k) {
    const Answer& touching = subject.touching[k];
    hits += answers[k].has_value();
    missed += touching && !answers[k];
    if (!answers[k]) continue;
    late += touching && *answers[k] > *touching + kLate;
    const Query& query = subject.queries[k];
    ToiOracle oracle(subject.body, query.motion_a, subject.body, query.motion_b);
    loose += oracle.distance_at(*answers[k], kTouching).lower > kLoose;
  }
  std::printf("%-6s %5g %-8s %8.2f %6d %7d %6d %6d\n", subject.name.c_str(), subject.rate,
              engine_name, best, hits, missed, late, loose);
  std::fflush(stdout);
}

// One body as each engine has it.
struct Shapes {
  std::string name;
  const Shape& dyop;
  const btConvexShape& bullet;
  const fcl::CollisionGeometryd& fcl;
};

void run_shape(const Shapes& shapes, int count, std::uint64_t seed) {
  const OracleBody body(shapes.dyop);
  for (const Scalar rate : {0.0, 1.0, 3.0}) {
    const std::deque<Query> queries = random_queries(count, rate, seed);
    const std::vector<Answer> touching = truth(body, queries);
    const Case subject{shapes.name, rate, body, queries, touching};
    run(subject, "dyop", dyop_engine(shapes.dyop));
    run(subject, "Bullet", bullet_engine(shapes.bullet));
    run(subject, "FCL", fcl_engine(shapes.fcl));
    const auto hits = std::count_if(touching.begin(), touching.end(),
                                    [](const Answer& t) { return t.has_value(); });
    std::printf("%-6s %5g %-8s %8s %6d\n", subject.name.c_str(), rate, "oracle", "", int(hits));
  }
}

void run_all(int count, std::uint64_t seed) {
  constexpr Scalar kRadius = 0.5;
  const Vector3 half(0.5, 0.4, 0.3);
  std::mt19937_64 random(seed);
  std::vector<Vector3> points(32);
  for (Vector3& p : points) p = 0.6 * random_direction(random);
  const ConvexHull hull(points);
  btConvexHullShape bullet_hull;
  for (const Vector3& p : points) bullet_hull.addPoint(to_bullet(p));
  bullet_hull.setMargin(0);  // it would be added outside; a box has it inside
  std::printf("%-6s %5s %-8s %8s %6s %7s %6s %6s\n", "shape", "rate", "engine", "us", "hits",
              "missed", "late", "loose");
  run_shape({"sphere", Sphere(kRadius), btSphereShape(kRadius), fcl::Sphered(kRadius)}, count,
            seed);
  run_shape({"box", Box(half), btBoxShape(to_bullet(half)), fcl::Boxd(2 * half)}, count, seed);
  run_shape({"hull", hull, bullet_hull, *fcl_hull(hull)}, count, seed);
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 1000;
  const long seed = argc > 2 ? std::atol(argv[2]) : 1;
  if (count <= 0 || seed < 0) {
    std::fprintf(stderr, "usage: convex_time_of_impact_benchmark [QUERIES] [SEED]\n");
    return 2;
  }
  dyop::testing::run_all(count, static_cast<std::uint64_t>(seed));
  return 0;
}
