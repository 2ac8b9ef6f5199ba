// SPDX-License-Identifier: BSD-3-Clause

// Takes random and degenerate pairs of spheres, capsules and boxes through distance(), in both
// orders, against a slow oracle in long double that shares no code with the library:
//   simple_shapes_soak CASES [SEED]
// Sizes 1e-4 to 1e4, ratios of sizes up to 1e6, up to 1e6 sizes from the origin. A case counts as
// wrong if a bound, a witness point, the normal or the status breaks its promise, and as loose if
// the bounds are farther apart than rounding. The exit code is 1 if any case is wrong, or more than
// one in ten thousand loose.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/sphere.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

using Real = long double;
using RealVector = Eigen::Matrix<Real, 3, 1>;

// A ball about the points center + x[0] axes[0] + x[1] axes[1] + x[2] axes[2], |x[k]| <= 1: an
// inflated point, segment or box, in world.
struct Body {
  RealVector center;
  std::array<RealVector, 3> axes;
  int dimension;  // 0, 1 or 3
  Real radius;
};

struct Case {
  std::shared_ptr<ConvexShape> shape;
  RigidPose X;
  Body body() const;
};

Body Case::body() const {
  Body result;
  const Eigen::Matrix<Real, 3, 3> R = X.rotation().cast<Real>();
  result.center = X.translation().cast<Real>();
  result.radius = Real(shape->rounding_radius());
  RealVector half = RealVector::Zero();
  result.dimension = 0;
  if (const auto* box = dynamic_cast<const Box*>(shape.get())) {
    half = box->half_extents().cast<Real>();
    result.dimension = 3;
  } else if (const auto* capsule = dynamic_cast<const Capsule*>(shape.get())) {
    half.z() = Real(capsule->half_length());
    result.dimension = 1;
  }
  for (int k = 0; k < 3; ++k) result.axes[std::size_t(k)] = R.col(k) * half[k];
  return result;
}

// The distance of a point from a core. Axes are orthogonal up to the rounding of doubles, which
// counts as noise.
Real from_core(const RealVector& p, const Body& body) {
  RealVector v = p - body.center;
  for (const RealVector& axis : body.axes) {
    const Real length_sq = axis.squaredNorm();
    if (!(length_sq > 0)) continue;
    v -= std::clamp(axis.dot(v) / length_sq, Real(-1), Real(1)) * axis;
  }
  return v.norm();
}

// The least value of a convex function on [-1, 1], by golden sections.
template <typename Function>
Real least(const Function& f) {
  constexpr Real kRatio = 0.618033988749894848204586834365638L;
  Real low = -1;
  Real high = 1;
  Real x = high - kRatio * (high - low);
  Real y = low + kRatio * (high - low);
  Real fx = f(x);
  Real fy = f(y);
  Real best = std::min({f(Real(-1)), f(Real(1)), fx, fy});
  for (int k = 0; k < 100; ++k) {
    if (fx <= fy) {
      high = y;
      y = x;
      fy = fx;
      x = high - kRatio * (high - low);
      fx = f(x);
    } else {
      low = x;
      x = y;
      fx = fy;
      y = low + kRatio * (high - low);
      fy = f(y);
    }
    best = std::min({best, fx, fy});
  }
  return best;
}

Real reach(const Body& body, const RealVector& n) {
  Real sum = n.dot(body.center) + body.radius * n.norm();
  for (const RealVector& axis : body.axes) sum += std::abs(n.dot(axis));
  return sum;
}

// Whether one of the fifteen axes parts two boxes.
bool are_parted(const Body& a, const Body& b) {
  const auto parts = [&](const RealVector& n) {
    const RealVector towards = n.dot(b.center - a.center) < 0 ? RealVector(-n) : n;
    return -reach(b, -towards) - reach(a, towards) > 0;
  };
  for (const RealVector& axis : a.axes) {
    if (parts(axis)) return true;
    for (const RealVector& other : b.axes) {
      if (parts(axis.normalized().cross(other.normalized()))) return true;
    }
  }
  return std::any_of(b.axes.begin(), b.axes.end(), parts);
}

RealVector corner(const Body& body, int number) {
  RealVector p = body.center;
  for (int k = 0; k < 3; ++k) {
    p += ((number >> k & 1) != 0 ? 1 : -1) * body.axes[std::size_t(k)];
  }
  return p;
}

// The twelve edges as segments.
std::vector<Body> edges_of(const Body& body) {
  std::vector<Body> edges;
  for (int k = 0; k < 3; ++k) {
    for (int number = 0; number < 8; ++number) {
      if ((number >> k & 1) != 0) continue;
      const RealVector& axis = body.axes[std::size_t(k)];
      edges.push_back(
          {corner(body, number) + axis, {RealVector::Zero(), RealVector::Zero(), axis}, 1, 0});
    }
  }
  return edges;
}

// Boxes apart are nearest at a corner of one or between two edges: the least of all of them.
Real box_distance(const Body& a, const Body& b) {
  if (!are_parted(a, b)) return 0;
  Real best = std::numeric_limits<Real>::infinity();
  for (int number = 0; number < 8; ++number) {
    best = std::min({best, from_core(corner(a, number), b), from_core(corner(b, number), a)});
  }
  const std::vector<Body> edges_b = edges_of(b);
  for (const Body& edge : edges_of(a)) {
    for (const Body& other : edges_b) {
      // Two balls around the edges may prove them farther apart.
      const Real away =
          (edge.center - other.center).norm() - edge.axes[2].norm() - other.axes[2].norm();
      if (away > best) continue;
      best = std::min(
          best, least([&](Real t) { return from_core(edge.center + t * edge.axes[2], other); }));
    }
  }
  return best;
}

Real core_distance(const Body& a, const Body& b) {
  if (a.dimension == 3 && b.dimension == 3) return box_distance(a, b);
  if (a.dimension > b.dimension) return core_distance(b, a);
  if (a.dimension == 0) return from_core(a.center, b);
  const RealVector& axis = a.axes[2];
  return least([&](Real t) { return from_core(a.center + t * axis, b); });
}

struct Tally {
  long cases = 0;
  long wrong = 0;
  long loose = 0;
  long by_gjk = 0;
  Real widest = 0;  // upper - lower, in units of the noise
};

const char* fault_of(const DistanceResult& result, const Body& a, const Body& b, Real noise) {
  const Real d = std::max(Real(0), core_distance(a, b) - a.radius - b.radius);
  const RealVector p_a = result.p_WCa.cast<Real>();
  const RealVector p_b = result.p_WCb.cast<Real>();
  const RealVector n = result.nhat_AB_W.cast<Real>();
  // literal: rounding of the oracle.
  const Real own = noise * 1e-3L;
  if (!(Real(result.lower) <= d + own)) return "lower";
  if (!(Real(result.upper) >= d - own)) return "upper";
  if (!(std::abs(n.norm() - 1) <= 1e-14L)) return "normal";
  if (!(from_core(p_a, a) - a.radius <= noise)) return "witness a";
  if (!(from_core(p_b, b) - b.radius <= noise)) return "witness b";
  if (!((p_b - p_a).norm() <= Real(result.upper) + noise)) return "witness length";
  if (result.lower > 0 && !(-reach(b, -n) - reach(a, n) >= Real(result.lower) - own)) {
    return "slab";
  }
  const bool is_apart = result.status == DistanceStatus::Separated;
  if (is_apart != (result.lower > 0)) return "status";
  if (result.status == DistanceStatus::Overlapping && d > noise) return "overlap";
  return nullptr;
}

void examine(const Case& a, const Case& b, Tally& tally) {
  const DistanceResult result = distance(*a.shape, a.X, *b.shape, b.X);
  const Real noise =
      Real(kPoseNoise) * Real(a.X.translation().norm() + b.X.translation().norm() +
                              2 * a.shape->bounding_radius() + 2 * b.shape->bounding_radius());
  ++tally.cases;
  if (result.statistics.gjk_iterations > 0) ++tally.by_gjk;
  if (const char* fault = fault_of(result, a.body(), b.body(), noise)) {
    ++tally.wrong;
    if (tally.wrong < 20) {
      std::printf("wrong: %s, case %ld, lower %.17g upper %.17g\n", fault, tally.cases,
                  result.lower, result.upper);
    }
  }
  const Real width = Real(result.upper - result.lower) / noise;
  tally.widest = std::max(tally.widest, width);
  const bool is_undecided =
      result.status == DistanceStatus::Inconclusive && result.upper > 3 * noise;
  if (width > 5 || is_undecided) ++tally.loose;
}

// --- inputs -------------------------------------------------------------------------------------

std::shared_ptr<ConvexShape> random_shape(int kind, Scalar size, std::mt19937_64& random) {
  const auto part = [&] { return size * random_magnitude(-2, 0, random); };
  if (kind == 0) return std::make_shared<Sphere>(part());
  if (kind == 2) {
    Vector3 half(part(), part(), part());
    if (random_index(4, random) == 0)
      half[random_index(3, random)] *= random_magnitude(-9, 0, random);
    return std::make_shared<Box>(half);
  }
  const Scalar half_length = random_index(8, random) == 0 ? 0 : part();
  const Scalar radius =
      random_index(4, random) == 0 ? size * random_magnitude(-9, 0, random) : part();
  return std::make_shared<Capsule>(radius, half_length);
}

// The same axes, axes exchanged, or a tilt of 1e-17 to 1: parallel and nearly parallel edges.
Matrix3 random_turn(const Matrix3& R, std::mt19937_64& random) {
  const int choice = random_index(4, random);
  if (choice == 0) return RigidPose(random_rotation(random), Vector3::Zero()).rotation();
  if (choice == 1) return R;
  Matrix3 turn = R;
  if (choice == 2) {
    turn.col(0) = R.col(1);
    turn.col(1) = R.col(2);
    turn.col(2) = R.col(0);
    return turn;
  }
  return rotation_from_vector(random_magnitude(-17, 0, random) * random_direction(random)) * R;
}

Scalar random_gap(Scalar size, std::mt19937_64& random) {
  switch (random_index(5, random)) {
    case 0:
      return 0;
    case 1:
      return -size * random_number(0, 1, random);
    case 2:
      return size * random_magnitude(-15, -4, random);
    default:
      return size * random_magnitude(-4, 2, random);
  }
}

// Two bodies whose supporting planes along a direction are a chosen gap apart, then shifted along
// the planes.
std::pair<Case, Case> random_pair(std::mt19937_64& random) {
  const Scalar size = random_magnitude(-4, 4, random);
  const Scalar ratio = random_index(4, random) == 0 ? random_magnitude(-6, 6, random) : 1;
  const int kind_a = random_index(3, random);
  const int kind_b = random_index(3, random);
  const auto a = random_shape(kind_a, size, random);
  const auto b = random_shape(kind_b, size * ratio, random);
  const Matrix3 R_WA = random_index(3, random) == 0
                           ? Matrix3::Identity()
                           : RigidPose(random_rotation(random), Vector3::Zero()).rotation();
  const Matrix3 R_WB = random_turn(R_WA, random);
  const Vector3 n = random_index(3, random) == 0 ? Vector3(R_WA.col(random_index(3, random)))
                                                 : random_direction(random);
  Vector3 p_AB = R_WA * a->support(R_WA.transpose() * n) -
                 R_WB * b->support(-(R_WB.transpose() * n)) + random_gap(size, random) * n;
  if (random_index(2, random) == 0) {
    const Vector3 shift =
        random_number(0, 2, random) * a->bounding_radius() * random_direction(random);
    p_AB += shift - n * n.dot(shift);
  }
  if (random_index(20, random) == 0) p_AB.setZero();
  Vector3 p_WA = Vector3::Zero();
  if (random_index(3, random) == 0)
    p_WA = size * random_magnitude(0, 6, random) * random_direction(random);
  return {{a, RigidPose::from_trusted(R_WA, p_WA)},
          {b, RigidPose::from_trusted(R_WB, p_WA + p_AB)}};
}

int soak(long cases, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Tally tally;
  for (long k = 0; k < cases; ++k) {
    const auto [a, b] = random_pair(random);
    examine(a, b, tally);
    examine(b, a, tally);
  }
  std::printf("%ld queries, %ld wrong, %ld loose, %ld by GJK, bounds at most %.2Lf noises apart\n",
              tally.cases, tally.wrong, tally.loose, tally.by_gjk, tally.widest);
  // literal: edges that nearly meet and are nearly parallel leave GJK short of full accuracy.
  return tally.wrong > 0 || Scalar(tally.loose) > 1e-4 * Scalar(tally.cases) ? 1 : 0;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: simple_shapes_soak CASES [SEED]\n");
    return 2;
  }
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 1);
  return dyop::testing::soak(std::atol(argv[1]), seed);
}
