// SPDX-License-Identifier: BSD-3-Clause

// Takes random and degenerate pairs of spheres, capsules and boxes through distance(), in both
// orders, against a slow oracle in long double that shares no code with the library:
//   simple_shapes_soak CASES [SEED [rounded]]
// With `rounded` one of a pair is a rounded box, cylinder or hull or a tapered capsule.
// Sizes 1e-4 to 1e4, ratios of sizes up to 1e6, up to 1e6 sizes from the origin. A case counts as
// wrong if a bound, a witness point, the normal or the status breaks its promise, and as loose if
// the bounds are farther apart than rounding. The exit code is 1 if any case is wrong, or more than
// one in ten thousand loose; curved cores are found step by step, to kCurvedWidth of their size.

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
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

using Real = long double;
using RealVector = Eigen::Matrix<Real, 3, 1>;

// Balls about the points center + x[0] axes[0] + x[1] axes[1] + x[2] axes[2], |x[k]| <= 1, in world:
// an inflated point, segment or box, or a cylinder, where x[0]^2 + x[1]^2 <= 1 too. Each ball has
// the radius radius + x[2] taper.
struct Body {
  RealVector center;
  std::array<RealVector, 3> axes;
  int dimension;  // 0, 1 or 3
  Real radius;
  Real taper = 0;
  bool is_cylinder = false;

  bool is_line() const { return dimension < 3; }
  bool is_curved() const { return is_cylinder || taper != 0; }
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
  } else if (const auto* rounded = dynamic_cast<const RoundedBox*>(shape.get())) {
    half = rounded->half_extents().cast<Real>();
    result.dimension = 3;
  } else if (const auto* hull = dynamic_cast<const ConvexHull*>(shape.get())) {
    half = hull->vertices()[0].cwiseAbs().cast<Real>();
    result.dimension = 3;
  } else if (const auto* cylinder = dynamic_cast<const RoundedCylinder*>(shape.get())) {
    half = Vector3(cylinder->radius(), cylinder->radius(), cylinder->half_length()).cast<Real>();
    result.dimension = 3;
    result.is_cylinder = true;
  } else if (const auto* tapered = dynamic_cast<const TaperedCapsule*>(shape.get())) {
    half.z() = Real(tapered->half_length());
    result.dimension = 1;
    result.radius = (Real(tapered->bottom_radius()) + Real(tapered->top_radius())) / 2;
    result.taper = (Real(tapered->top_radius()) - Real(tapered->bottom_radius())) / 2;
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

Real from_cylinder(const RealVector& p, const Body& body) {
  const RealVector v = p - body.center;
  const Real half_length = body.axes[2].norm();
  const RealVector axis = body.axes[2] / half_length;
  const Real along = std::max(Real(0), std::abs(axis.dot(v)) - half_length);
  const Real across = (v - axis.dot(v) * axis).norm() - body.axes[0].norm();
  return std::hypot(along, std::max(Real(0), across));
}

// The distance of a point from a body, negative within its balls.
Real from_body(const RealVector& p, const Body& body) {
  if (body.is_cylinder) return from_cylinder(p, body) - body.radius;
  if (body.taper == 0) return from_core(p, body) - body.radius;
  return least([&](Real t) {
    return (p - body.center - t * body.axes[2]).norm() - body.radius - t * body.taper;
  });
}

Real reach(const Body& body, const RealVector& n) {
  Real sum = n.dot(body.center) + body.radius * n.norm();
  if (body.is_cylinder) {
    const RealVector axis = body.axes[2].normalized();
    return sum + std::abs(n.dot(body.axes[2])) +
           body.axes[0].norm() * (n - n.dot(axis) * axis).norm();
  }
  if (body.taper != 0) return sum + std::abs(n.dot(body.axes[2]) + body.taper * n.norm());
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

// Boxes apart are nearest at a corner of one or between two edges: the least of all of them. Their
// cores: radii are left out.
Real box_distance(Body a, Body b) {
  a.radius = b.radius = 0;
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

// The distance of two bodies, negative within their balls. Not for a cylinder and a box or another.
Real body_distance(const Body& a, const Body& b) {
  if (!a.is_line() && !b.is_line()) return box_distance(a, b) - a.radius - b.radius;
  if (a.dimension > b.dimension) return body_distance(b, a);
  if (a.dimension == 0) return from_body(a.center, b) - a.radius;
  return least(
      [&](Real t) { return from_body(a.center + t * a.axes[2], b) - a.radius - t * a.taper; });
}

struct Tally {
  long cases = 0;
  long wrong = 0;
  long loose = 0;
  long by_gjk = 0;
  Real widest = 0;         // upper - lower, in units of the noise
  Real widest_curved = 0;  // in units of the size
};

constexpr Real kCurvedWidth = 1e-6L;  // literal: steps towards curved cores end there

const char* fault_of(const DistanceResult& result, const Body& a, const Body& b, Real noise) {
  const Real d = std::max(Real(0), body_distance(a, b));
  const RealVector p_a = result.p_WCa.cast<Real>();
  const RealVector p_b = result.p_WCb.cast<Real>();
  const RealVector n = result.nhat_AB_W.cast<Real>();
  // literal: rounding of the oracle.
  const Real own = noise * 1e-3L;
  if (!(Real(result.lower) <= d + own)) return "lower";
  if (!(Real(result.upper) >= d - own)) return "upper";
  if (!(std::abs(n.norm() - 1) <= 1e-14L)) return "normal";
  if (!(from_body(p_a, a) <= noise)) return "witness a";
  if (!(from_body(p_b, b) <= noise)) return "witness b";
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
  const Body body_a = a.body();
  const Body body_b = b.body();
  if (const char* fault = fault_of(result, body_a, body_b, noise)) {
    ++tally.wrong;
    if (tally.wrong < 20) {
      std::printf("wrong: %s, case %ld, lower %.17g upper %.17g\n", fault, tally.cases,
                  result.lower, result.upper);
    }
  }
  if (body_a.is_curved() || body_b.is_curved()) {
    const Real size = Real(a.shape->bounding_radius() + b.shape->bounding_radius()) + noise;
    const Real part = Real(result.upper - result.lower) / size;
    tally.widest_curved = std::max(tally.widest_curved, part);
    if (part > kCurvedWidth) ++tally.loose;
    return;
  }
  const Real width = Real(result.upper - result.lower) / noise;
  tally.widest = std::max(tally.widest, width);
  const bool is_undecided =
      result.status == DistanceStatus::Inconclusive && Real(result.upper) > 3 * noise;
  if (width > 5 || is_undecided) ++tally.loose;
}

// --- inputs -------------------------------------------------------------------------------------

constexpr int kSimpleKinds = 3;
constexpr int kKinds = 7;

std::shared_ptr<ConvexShape> random_rounded(int kind, Scalar size, std::mt19937_64& random) {
  const auto part = [&] { return size * random_magnitude(-2, 0, random); };
  const Scalar thin = random_index(4, random) == 0 ? random_magnitude(-6, 0, random) : 1;
  const Scalar radius = thin * part();
  if (kind == 3) return std::make_shared<RoundedCylinder>(part(), part(), radius);
  if (kind == 4) {
    const Scalar half_length = part();
    const Scalar change = 2 * half_length * random_number(-1, 1, random) * 0.999;
    return std::make_shared<TaperedCapsule>(radius + std::max(Scalar(0), -change),
                                            radius + std::max(Scalar(0), change), half_length);
  }
  const Vector3 half(part(), part(), part());
  if (kind == 5) return std::make_shared<RoundedBox>(half, radius);
  std::vector<Vector3> corners;
  for (int k = 0; k < 8; ++k) {
    corners.push_back(half.cwiseProduct(Vector3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  }
  return std::make_shared<ConvexHull>(corners, radius);
}

std::shared_ptr<ConvexShape> random_shape(int kind, Scalar size, std::mt19937_64& random) {
  if (kind >= kSimpleKinds) return random_rounded(kind, size, random);
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

// A kind for the second of a pair: the oracle knows no distance of a cylinder from a box.
int other_kind(int kind, bool is_rounded, std::mt19937_64& random) {
  if (!is_rounded) return random_index(kSimpleKinds, random);
  constexpr std::array by_cylinder{0, 1, 4};
  constexpr std::array by_box{0, 1, 2, 4, 5, 6};
  if (kind == 3) return by_cylinder[std::size_t(random_index(int(by_cylinder.size()), random))];
  if (kind > 4) return by_box[std::size_t(random_index(int(by_box.size()), random))];
  return random_index(kKinds, random);
}

// Two bodies whose supporting planes along a direction are a chosen gap apart, then shifted along
// the planes.
std::pair<Case, Case> random_pair(std::mt19937_64& random, bool is_rounded) {
  const Scalar size = random_magnitude(-4, 4, random);
  const Scalar ratio = random_index(4, random) == 0 ? random_magnitude(-6, 6, random) : 1;
  const int kind_a = is_rounded ? kSimpleKinds + random_index(kKinds - kSimpleKinds, random)
                                : random_index(kSimpleKinds, random);
  const int kind_b = other_kind(kind_a, is_rounded, random);
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

int soak(long cases, std::uint64_t seed, bool is_rounded) {
  std::mt19937_64 random(seed);
  Tally tally;
  for (long k = 0; k < cases; ++k) {
    const auto [a, b] = random_pair(random, is_rounded);
    examine(a, b, tally);
    examine(b, a, tally);
  }
  std::printf(
      "%ld queries, %ld wrong, %ld loose, %ld by GJK, bounds at most %.2Lf noises apart, those of "
      "curved cores %.1Le of their size\n",
      tally.cases, tally.wrong, tally.loose, tally.by_gjk, tally.widest, tally.widest_curved);
  // literal: edges that nearly meet and are nearly parallel leave GJK short of full accuracy.
  return tally.wrong > 0 || Scalar(tally.loose) > 1e-4 * Scalar(tally.cases) ? 1 : 0;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: simple_shapes_soak CASES [SEED [rounded]]\n");
    return 2;
  }
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 1);
  return dyop::testing::soak(std::atol(argv[1]), seed, argc > 3);
}
