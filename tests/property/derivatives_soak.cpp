// SPDX-License-Identifier: BSD-3-Clause

// Compares derivatives of distances, witness points, normals and times of impact with central
// differences, on random pairs of shapes:
//   derivatives_soak CASES [SEED]
// Prints how many were flagged and the largest differences; the exit code is 1 if one that was not
// flagged differs by more than a millionth (relative to the size of what moves).

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/distance/distance_derivatives.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/impact_derivatives.h"
#include "dyop/toi/time_of_impact.h"
#include "geometry/all_shapes.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

using ShapePointer = std::shared_ptr<const Shape>;

std::vector<ShapePointer> make_shapes() {
  std::vector<ShapePointer> shapes;
  for (const ShapeMaker& maker : all_shapes()) shapes.push_back(maker.make(1));
  shapes.push_back(std::make_shared<TriangleMesh>(torus(1, 0.4, 16, 8).mesh()));
  shapes.push_back(std::make_shared<TriangleMesh>(gear(9, 0.8, 1, 0.2).mesh()));
  shapes.push_back(std::make_shared<TriangleMesh>(random_soup(60, 0.3, 5).mesh()));
  shapes.push_back(std::make_shared<CompoundShape>(std::vector<CompoundChild>{
      {shapes[0], RigidPose(Vector3(2, 0, 0))}, {shapes[1], RigidPose(Vector3(-1, 0, 0))}}));
  return shapes;
}

RigidPose moved(const RigidPose& X, int k, Scalar h) {
  Vector3 v = Vector3::Zero();
  v[k % 3] = h;
  if (k < 3) return RigidPose::from_trusted(X.rotation(), X.translation() + v);
  return RigidPose::from_trusted(rotation_from_vector(v) * X.rotation(), X.translation());
}

Scalar entry(const PoseGradient& gradient, int k) {
  return k < 3 ? gradient.translation[k] : gradient.rotation[k - 3];
}

Vector3 column(const PoseJacobian& jacobian, int k) {
  return (k < 3 ? jacobian.translation : jacobian.rotation).col(k % 3);
}

struct Counts {
  long cases = 0;
  long ties = 0;
  long touching = 0;
  long grazing = 0;
  long unwitnessed = 0;
  long corners = 0;  // beyond what was proven, within the differences
  long rough = 0;    // entries of Jacobians that differ by more than 1e-3
  long wrong = 0;
  Scalar largest = 0;          // error of a gradient
  Scalar largest_coarse = 0;   // of those with a smooth core
  Scalar largest_witness = 0;  // of a Jacobian
};

bool is_smooth(const Shape& shape) {
  return shape.kind() == ShapeKind::Convex &&
         static_cast<const ConvexShape&>(shape).core_surface() == nullptr;
}

void compare_witness(const WitnessJacobians& J, bool moves_a, int k, const DistanceResult& plus,
                     const DistanceResult& minus, Scalar h, Counts& counts) {
  const auto difference = [&](const Vector3& to, const Vector3& from,
                              const PoseJacobian& jacobian) {
    const Vector3 rate = column(jacobian, k);
    return ((to - from) / (2 * h) - rate).norm() / (1 + rate.norm());
  };
  const Scalar error =
      std::max({difference(plus.p_WCa, minus.p_WCa, moves_a ? J.p_WCa_by_a : J.p_WCa_by_b),
                difference(plus.p_WCb, minus.p_WCb, moves_a ? J.p_WCb_by_a : J.p_WCb_by_b),
                difference(plus.nhat_AB_W, minus.nhat_AB_W, moves_a ? J.nhat_by_a : J.nhat_by_b)});
  counts.largest_witness = std::max(counts.largest_witness, error);
  // These are checked, not proven: points slide far where nearly parallel edges meet, and a border
  // may lie just beyond the check.
  counts.rough += error > 1e-3;
  if (error > 0.03 && counts.rough < 6) std::printf("witness: error %.3g of axis %d\n", error, k);
}

void check_distance(const std::vector<ShapePointer>& shapes, std::mt19937_64& random,
                    Counts& counts) {
  const Shape& a = *shapes[std::size_t(random_index(int(shapes.size()), random))];
  const Shape& b = *shapes[std::size_t(random_index(int(shapes.size()), random))];
  RigidPose X_WA = random_pose(0.5, random);
  RigidPose X_WB = random_pose(3, random);
  if (random_index(4, random) == 0) {  // axes alike: ties
    X_WA = RigidPose(X_WA.translation());
    X_WB = RigidPose(X_WB.translation());
  }
  const DistanceDerivatives found = distance_derivatives(a, X_WA, b, X_WB);
  ++counts.cases;
  counts.ties += found.status == DerivativeStatus::Tie;
  counts.touching += found.status == DerivativeStatus::Touching;
  if (found.status != DerivativeStatus::Proven) return;
  counts.unwitnessed += !found.witness;
  // Differences over a small part of the distance, for which rounding is large near contact.
  const Scalar d = found.distance.lower;
  if (d < 0.01) return;
  // Distances of smooth cores, and so their normals, are known to 1e-10 and 1e-5 only.
  const Scalar noise = found.distance.upper - found.distance.lower;
  const bool is_coarse = is_smooth(a) || is_smooth(b);
  const Scalar h = (is_coarse ? 1e-4 : 1e-6) * std::min(1.0, d);
  const Scalar allowed = is_coarse ? 1e-6 + found.error + noise / h : 1e-6;
  for (const bool moves_a : {true, false}) {
    const Scalar reach = std::max(1.0, (moves_a ? a : b).bounding_radius());
    for (int k = 0; k < 6; ++k) {
      const auto at = [&](Scalar step) {
        return moves_a ? distance(a, moved(X_WA, k, step), b, X_WB)
                       : distance(a, X_WA, b, moved(X_WB, k, step));
      };
      const DistanceResult plus = at(h);
      const DistanceResult minus = at(-h);
      const Scalar middle = (plus.lower + plus.upper - minus.lower - minus.upper) / (4 * h);
      // Behind the pose the distance falls as fast as before it rises, unless there is a corner
      // within the step but beyond that of the proof: then differences mean nothing.
      const Scalar bend = std::abs(plus.upper + minus.upper - 2 * found.distance.upper) / h;
      if (bend > 2 * allowed * reach * (1 + reach / d) + 10 * h * reach * reach / d) {
        ++counts.corners;
        return;
      }
      const Scalar slope = entry(moves_a ? found.by_a : found.by_b, k);
      const Scalar error = std::abs(middle - slope) / (reach * (1 + reach / d));
      // Slopes before and behind the pose enclose the gradient, up to the curvature times the step,
      // and differ by `bend`: of a corner near by.
      const Scalar excess = error - bend / (2 * reach * (1 + reach / d)) - h / 2;
      Scalar& largest = is_coarse ? counts.largest_coarse : counts.largest;
      largest = std::max(largest, error);
      if (!(excess < allowed)) {
        ++counts.wrong;
        if (counts.wrong < 6) {
          std::printf("gradient: %.9g, differences %.9g, distance %.3g, axis %d, proven to %.3g\n",
                      slope, middle, d, k, found.error);
        }
      }
      if (found.witness) compare_witness(*found.witness, moves_a, k, plus, minus, h, counts);
    }
  }
}

void check_impact(const std::vector<ShapePointer>& shapes, std::mt19937_64& random,
                  Counts& counts) {
  const Shape& a = *shapes[std::size_t(random_index(int(shapes.size()), random))];
  const Shape& b = *shapes[std::size_t(random_index(int(shapes.size()), random))];
  const RigidPose X_WA = random_pose(0.2, random);
  const RigidPose X_WB(random_rotation(random), 5 * random_direction(random));
  const Twist twist_a = random_twist(0.5, 1, random);
  const Twist twist_b{-X_WB.translation() + random_vector(1, random), random_vector(1, random)};
  // A target, so that something is left of the gap.
  ToiOptions options;
  options.target_distance = 0.1;
  options.distance_tolerance = 1e-9;
  const ConstantTwistMotion motion_a(X_WA, twist_a);
  const ConstantTwistMotion motion_b(X_WB, twist_b);
  const ToiResult hit = time_of_impact(a, motion_a, b, motion_b, {0, 2}, options);
  if (hit.status != ToiStatus::Impact) return;
  const ImpactDerivatives found = impact_derivatives(a, motion_a, b, motion_b, hit);
  ++counts.cases;
  counts.ties += found.status == DerivativeStatus::Tie;
  counts.touching += found.status == DerivativeStatus::Touching;
  counts.grazing += found.status == DerivativeStatus::Grazing;
  if (found.status != DerivativeStatus::Proven) return;
  const Scalar gap = found.distance.distance.upper;
  // When the gap falls to what it is there, from one end, by bisection of the distance near there.
  const auto time_of_gap = [&](const Motion& moving_a, const Motion& moving_b) {
    Scalar low = hit.t_safe - 1e-3;
    Scalar high = hit.t_safe + 1e-3;
    for (int i = 0; i < 50; ++i) {
      const Scalar t = (low + high) / 2;
      const DistanceResult d = distance(a, moving_a.pose(t), b, moving_b.pose(t));
      ((d.lower + d.upper) / 2 > gap ? low : high) = t;
    }
    return (low + high) / 2;
  };
  const Scalar h = 1e-6;
  for (int k = 0; k < 12; ++k) {
    Twist unit;
    (k % 6 < 3 ? unit.v_WB : unit.w_WB)[k % 3] = 1;
    const Twist change = k < 6 ? motion_b.pose_change(hit.t_safe, unit, {})
                               : motion_b.pose_change(hit.t_safe, {}, unit);
    const auto varied = [&](Scalar step) {
      if (k < 6) return ConstantTwistMotion(moved(X_WB, k, step), twist_b);
      return ConstantTwistMotion(
          X_WB, {twist_b.v_WB + step * unit.v_WB, twist_b.w_WB + step * unit.w_WB});
    };
    const Scalar middle =
        (time_of_gap(motion_a, varied(h)) - time_of_gap(motion_a, varied(-h))) / (2 * h);
    const Scalar exact = found.by_b.along(change);
    const Scalar scale = (1 + change.v_WB.norm() + 2 * change.w_WB.norm()) / found.closing_speed;
    // The second derivative times the step: the slower they meet, the more.
    const Scalar bend = 1 + 10 / found.closing_speed;
    const Scalar error = std::abs(middle - exact) / (scale * bend * 10);
    counts.largest = std::max(counts.largest, error);
    if (!(error < 1e-6)) {
      ++counts.wrong;
      if (counts.wrong < 6) {
        std::printf("impact: %.9g, differences %.9g, parameter %d, closing %.3g\n", exact, middle,
                    k, found.closing_speed);
      }
    }
  }
}

int run(long cases, unsigned seed) {
  const std::vector<ShapePointer> shapes = make_shapes();
  std::mt19937_64 random(seed);
  Counts distances;
  Counts impacts;
  for (long k = 0; k < cases; ++k) {
    if (k % 10 == 9) {
      check_impact(shapes, random, impacts);
    } else {
      check_distance(shapes, random, distances);
    }
  }
  for (const Counts* c : {&distances, &impacts}) {
    std::printf(
        "%s: %ld cases; flagged: %.2f %% ties, %.2f %% touching, %.2f %% grazing; %.1f %% "
        "without witness Jacobians; %ld with a corner near by; %ld wrong, %ld rough; largest error "
        "%.2g, of smooth cores "
        "%.2g, of a "
        "witness %.2g\n",
        c == &distances ? "distances" : "impacts", c->cases,
        100.0 * double(c->ties) / double(c->cases), 100.0 * double(c->touching) / double(c->cases),
        100.0 * double(c->grazing) / double(c->cases),
        100.0 * double(c->unwitnessed) / double(c->cases), c->corners, c->wrong, c->rough,
        c->largest, c->largest_coarse, c->largest_witness);
  }
  const bool has_many_corners = distances.corners > 2 + distances.cases / 200;
  const bool is_rough = distances.rough > 2 + distances.cases / 10000;
  return distances.wrong + impacts.wrong > 0 || has_many_corners || is_rough ? 1 : 0;
}

}  // namespace
}  // namespace dyop::testing

int main(int count, char** arguments) {
  const long cases = count > 1 ? std::atol(arguments[1]) : 1000;
  const unsigned seed = count > 2 ? unsigned(std::atol(arguments[2])) : 1;
  return dyop::testing::run(cases, seed);
}
