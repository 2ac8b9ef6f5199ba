// SPDX-License-Identifier: BSD-3-Clause

// half_space_soak COUNT SEED: random and degenerate queries of half-spaces, near and up to a
// million sizes from the origin, against vertices in extended precision: bounds of distances, rays,
// and what a time of impact promises at random times. Prints what is wrong; exit code 1 if anything
// is.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

using Wide = long double;
using WideVector = Eigen::Matrix<Wide, 3, 1>;
using WideMatrix = Eigen::Matrix<Wide, 3, 3>;

struct Body {
  std::shared_ptr<const Shape> shape;
  std::vector<Vector3> vertices;
  std::vector<Scalar> radii;  // of balls about the vertices, if not zero
};

std::vector<Body> bodies() {
  const Vector3 half(1, 0.5, 0.2);
  const MeshArrays box = box_mesh(half);
  const std::vector<Scalar> radii(box.vertices.size(), 0.1);
  const std::vector<Vector3> ends{Vector3(0, 0, -0.6), Vector3(0, 0, 0.6)};
  std::vector<Body> result{{std::make_shared<Box>(half), box.vertices, {}},
                           {std::make_shared<RoundedBox>(half, 0.1), box.vertices, radii},
                           {std::make_shared<ConvexHull>(box.vertices, 0.1), box.vertices, radii},
                           {std::make_shared<TaperedCapsule>(0.4, 0.01, 0.6), ends, {0.4, 0.01}},
                           {std::make_shared<Capsule>(0.3, 0.6), ends, {0.3, 0.3}}};
  for (const MeshArrays& mesh :
       {gear(9, 0.8, 1, 0.3), plate_grid(1, 1, 4, 4), needle(1, 4), point_cloud(30, 1)}) {
    result.push_back(
        {std::make_shared<TriangleMesh>(mesh.vertices, mesh.triangles), mesh.vertices, {}});
    result.push_back({std::make_shared<ConvexHull>(mesh.vertices), mesh.vertices, {}});
  }
  return result;
}

// One query: a half-space and a body of size one, in units of `size`.
struct Case {
  HalfSpace plane;
  RigidPose X_WA;
  RigidPose X_WB;
  const Body* body;

  Wide height(const RigidPose& X_WC) const { return height(X_WA, X_WC); }

  Wide height(const RigidPose& X_WP, const RigidPose& X_WC) const {
    const WideMatrix R = X_WP.rotation().cast<Wide>();
    const WideVector n = R * plane.normal().cast<Wide>();
    Wide least = Wide(kInfinity);
    for (std::size_t k = 0; k < body->vertices.size(); ++k) {
      const WideVector p = X_WC.rotation().cast<Wide>() * body->vertices[k].cast<Wide>() +
                           X_WC.translation().cast<Wide>() - X_WP.translation().cast<Wide>();
      least = std::min(least, n.dot(p) - Wide(body->radii.empty() ? 0 : body->radii[k]));
    }
    return least - Wide(plane.offset());
  }
};

// Axes, multiples of a quarter turn, and anything.
RigidPose any_pose(Scalar away, std::mt19937_64& random) {
  const Vector3 p = random_vector(away, random);
  if (random_index(3, random) > 0) return {random_rotation(random), p};
  Matrix3 R = Matrix3::Zero();
  const int k = random_index(3, random);
  R(0, k) = R(1, (k + 1) % 3) = R(2, (k + 2) % 3) = 1;
  return RigidPose(R, p);
}

Case any_case(const std::vector<Body>& all, std::mt19937_64& random) {
  const Scalar away = random_magnitude(0, random_index(4, random) == 0 ? 6 : 1, random);
  const Vector3 normal = random_index(3, random) == 0
                             ? Vector3(Vector3::Unit(random_index(3, random)))
                             : random_direction(random);
  Case result{HalfSpace(normal, random_number(-1, 1, random)), any_pose(away, random),
              any_pose(away, random), &all[std::size_t(random_index(int(all.size()), random))]};
  // A third of them touch, or nearly.
  if (random_index(3, random) == 0) {
    const auto height = Scalar(result.height(result.X_WB));
    const Scalar gap = random_index(2, random) == 0 ? 0 : random_magnitude(-12, 0, random);
    const Vector3 n_W = result.X_WA.rotation() * normal.normalized();
    result.X_WB =
        RigidPose(result.X_WB.rotation(), result.X_WB.translation() - (height - gap) * n_W);
  }
  return result;
}

class Soak {
 public:
  explicit Soak(unsigned long seed) : random_(seed) {}

  void distances() {
    const Case c = any_case(all_, random_);
    const Wide exact = c.height(c.X_WB);
    const bool is_first = random_index(2, random_) == 0;
    const DistanceResult found = is_first ? distance(c.plane, c.X_WA, *c.body->shape, c.X_WB)
                                          : distance(*c.body->shape, c.X_WB, c.plane, c.X_WA);
    const Wide noise = noise_of(c);
    expect(Wide(found.lower) <= std::max(Wide(0), exact), "the lower bound is too large");
    expect(Wide(found.upper) >= exact, "the upper bound is too small");
    expect(Wide(found.lower) >= exact - noise, "the lower bound is loose");
    expect(Wide(found.upper) <= std::max(Wide(0), exact) + noise, "the upper bound is loose");
  }

  void rays() {
    const Case c = any_case(all_, random_);
    Ray ray;
    ray.p_W = c.X_WB.translation();
    ray.direction_W = random_direction(random_);
    ray.radius = random_index(2, random_) == 0 ? 0 : random_number(0, 2, random_);
    const WideVector n = c.X_WA.rotation().cast<Wide>() * c.plane.normal().cast<Wide>();
    const WideVector along = ray.direction_W.cast<Wide>().normalized();
    const Wide height = n.dot(ray.p_W.cast<Wide>() - c.X_WA.translation().cast<Wide>()) -
                        Wide(c.plane.offset()) - Wide(ray.radius);
    const Wide rate = -n.dot(along);
    const RayHit hit = ray_cast(c.plane, c.X_WA, ray);
    if (hit.status == RayStatus::Miss) {
      expect(height > 0 && rate <= Wide(1e-14), "a ray misses the plane");
    } else if (hit.status == RayStatus::Hit || hit.status == RayStatus::NumericalLimit) {
      expect(Wide(hit.distance) * rate <= height + noise_of(c) / 64, "a ray passes the plane");
    }
    expect(hit.status != RayStatus::NumericalLimit || rate < Wide(1e-3), "a ray is undecided");
  }

  void impacts() {
    Case c = any_case(all_, random_);
    Twist twist = random_twist(3, 6, random_);
    const ConstantTwistMotion moving(c.X_WB, twist);
    // A plane that rests, or moves and turns: its far parts then move as fast as they like.
    const bool is_turning = random_index(3, random_) == 0;
    const ConstantTwistMotion base(c.X_WA, is_turning ? random_twist(3, 6, random_) : Twist());
    ToiOptions options;
    options.target_distance = random_index(2, random_) == 0 ? 0 : 1e-3;
    options.distance_tolerance = 1e-6;
    const TimeInterval interval{0, 2};
    const bool is_first = random_index(2, random_) == 0;
    const ToiResult found =
        is_first ? time_of_impact(c.plane, base, *c.body->shape, moving, interval, options)
                 : time_of_impact(*c.body->shape, moving, c.plane, base, interval, options);
    const Wide noise = 10 * Wide(found.rounding_allowance) + noise_of(c);
    const Wide least = std::min(Wide(options.target_distance), c.height(c.X_WB)) - noise;
    const bool is_far = noise > Wide(1e-7);
    expect(is_far || found.status != ToiStatus::NumericalLimit, "an impact is undecided");
    if (found.status == ToiStatus::InitiallyWithinTarget) {
      expect(c.height(c.X_WB) <= Wide(options.target_distance) + Wide(1.01e-6) + noise,
             "it is not within target");
      return;
    }
    for (int k = 0; k < 20; ++k) {
      const Scalar t = found.t_safe * (k == 0 ? 1 : random_number(0, 1, random_));
      expect(c.height(base.pose(t), moving.pose(t)) >= least, "a motion is not as free as proven");
    }
    if (found.status != ToiStatus::Impact) return;
    ++impacts_;
    expect(c.height(base.pose(found.t_safe), moving.pose(found.t_safe)) <=
               Wide(options.target_distance) + Wide(1.01e-6) + noise,
           "an impact is too far away");
  }

  int wrong() const { return wrong_; }
  int impact_count() const { return impacts_; }

 private:
  static Wide noise_of(const Case& c) {
    const Scalar size = c.X_WA.translation().norm() + c.X_WB.translation().norm() + 4;
    return Wide(4 * kPoseNoise * size);
  }
  void expect(bool is_right, const char* what) {
    if (is_right) return;
    if (++wrong_ <= 20) std::printf("%s\n", what);
  }

  const std::vector<Body> all_ = bodies();
  std::mt19937_64 random_;
  int wrong_ = 0;
  int impacts_ = 0;
};

int run(long count, unsigned long seed) {
  Soak soak(seed);
  for (long k = 0; k < count; ++k) {
    soak.distances();
    soak.rays();
    if (k % 4 == 0) soak.impacts();
  }
  std::printf("%ld distances and rays, %d impacts: %d wrong\n", count, soak.impact_count(),
              soak.wrong());
  return soak.wrong() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  if (argc != 3) {
    std::printf("half_space_soak COUNT SEED\n");
    return 2;
  }
  return dyop::testing::run(std::atol(argv[1]), std::strtoul(argv[2], nullptr, 10));
}
