// SPDX-License-Identifier: BSD-3-Clause
#include "support/inputs/rolling_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string_view>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/curved_meshes.h"
#include "support/inputs/world_scenes.h"
#include "support/world_energy.h"

namespace dyop::testing {
namespace {

constexpr Scalar kPi = std::numbers::pi;
constexpr Scalar kBallRadius = 0.25;
constexpr std::string_view kCompoundPrefix = "compound-";

Matrix3 turn_about(const Vector3& axis, Scalar angle) {
  return rotation_from_vector(angle * axis);
}

BodyDefinition fixed_body(std::shared_ptr<const Shape> shape, Scalar friction) {
  BodyDefinition body = floor_body(friction);
  body.shape = std::move(shape);
  body.initial.X_WB = RigidPose();
  return body;
}

// A body whose vertices lie at least a rest gap above z = 0.
BodyDefinition on_the_floor(const std::string& name, std::shared_ptr<const Shape> shape,
                            const std::vector<Vector3>& vertices, const Matrix3& R) {
  Scalar lowest = kInfinity;
  for (const Vector3& p : vertices) lowest = std::min(lowest, (R * p).z());
  const Scalar height = rest_gap(shape->bounding_radius()) - lowest;
  BodyDefinition body = dynamic_body(name, std::move(shape), Vector3::Zero());
  body.initial.X_WB = RigidPose(R, Vector3(0, 0, height));
  return body;
}

BodyDefinition round_body(const std::string& scene, int facets) {
  const auto arrays = scene == "disc" ? disc(1, 0.25, facets) : half_disc(1, 0.25, facets);
  const auto shape = std::make_shared<TriangleMesh>(arrays.mesh());
  const Vector3 center(0, 0, 1 + rest_gap(shape->bounding_radius()));
  BodyDefinition body = dynamic_body(scene, shape, center);
  if (scene == "disc") {
    body.initial.twist = {Vector3(1, 0, 0), Vector3(0, 1, 0)};
  } else {
    body.initial.X_WB = RigidPose(turn_about(Vector3::UnitY(), 0.3), center);
  }
  return body;
}

// The coin leans against the floor, its centre nearly at rest: it turns about the diameter through
// the contact, at the rate at which gravity takes that diameter round the vertical in balance.
BodyDefinition spinning_coin(int facets) {
  constexpr Scalar kHalfWidth = 0.02;
  constexpr Scalar kLean = 0.3;
  const MeshArrays arrays = disc(1, kHalfWidth, facets);
  // Its axis y, now upwards, leans towards +x, where the contact is.
  const Matrix3 R = turn_about(Vector3::UnitY(), kLean) * turn_about(Vector3::UnitX(), kPi / 2);
  BodyDefinition coin =
      on_the_floor("coin", std::make_shared<TriangleMesh>(arrays.mesh()), arrays.vertices, R);
  const Scalar precession = std::sqrt(4 * kGravity / std::sin(kLean));
  const Vector3 w = -precession * std::sin(kLean) * R.col(0);
  coin.initial.twist = {-w.cross(R * Vector3(1, -kHalfWidth, 0)), w};
  return coin;
}

// On the line from circle to circle whose plane has the normal (kAlong, y, z); kAlong = 0 is the
// equilibrium. Both circles reach as far along it: sqrt(1 - z^2) = kAlong + sqrt(kAlong^2 + z^2).
BodyDefinition tilted_oloid(int facets) {
  constexpr Scalar kAlong = 0.3;
  Scalar low = 0;
  Scalar high = 1;
  for (int k = 0; k < 60; ++k) {
    const Scalar z = (low + high) / 2;
    const bool is_low = std::sqrt(1 - z * z) > kAlong + std::sqrt(kAlong * kAlong + z * z);
    (is_low ? low : high) = z;
  }
  const Vector3 down(kAlong, std::sqrt(1 - kAlong * kAlong - low * low), low);
  const Matrix3 R = rotation_between(down, -Vector3::UnitZ()).toRotationMatrix();
  const std::vector<Vector3> points = oloid_points(1, facets);
  return on_the_floor("oloid", std::make_shared<ConvexHull>(points), points, R);
}

BodyDefinition ball_in_a_hollow() {
  const Scalar way = 1 - kBallRadius - rest_gap(kBallRadius);
  return dynamic_body("ball", std::make_shared<Sphere>(kBallRadius),
                      way * Vector3(std::sin(0.4), 0, -std::cos(0.4)));
}

// On top of a ball of radius 1, rolling along x and spinning about z.
BodyDefinition on_a_ball(const std::string& name, std::shared_ptr<const Shape> shape, Scalar spin) {
  const Scalar height = 1 + kBallRadius + rest_gap(std::min(Scalar{1}, shape->bounding_radius()));
  BodyDefinition body =
      dynamic_body(name, std::move(shape), {0, 0, height}, {1.5, 0, 0}, {0, 6, spin});
  body.initial.X_WB = RigidPose(turn_about(Vector3::UnitX(), kPi / 2), Vector3(0, 0, height));
  return body;
}

BodyDefinition leaning_rod() {
  const Vector3 half(0.1, 0.1, 1);
  const std::vector<Vector3> lower{{half.x(), half.y(), -half.z()}};
  return on_the_floor("rod", std::make_shared<Box>(half), lower, turn_about(Vector3::UnitY(), 0.4));
}

// The same body as the child of a compound whose frame is elsewhere.
void make_compound(BodyDefinition& body) {
  const RigidPose X_CS(turn_about(Vector3(1, 2, -1).normalized(), 0.7), Vector3(0.1, -0.2, 0.15));
  body.shape = std::make_shared<CompoundShape>(std::vector<CompoundChild>{{body.shape, X_CS}});
  const RigidPose X_WC = body.initial.X_WB * X_CS.inverse();
  const Vector3 p_SC_W = X_WC.translation() - body.initial.X_WB.translation();
  body.initial.twist.v_WB += body.initial.twist.w_WB.cross(p_SC_W);
  body.initial.X_WB = X_WC;
  if (body.kind != BodyKind::Static) {
    body.mass_properties = body.shape->compute_mass_properties(1000);
  }
}

// Default lengths of the scene without compounds, whose bounding radii are larger.
void keep_lengths(WorldOptions& options, const std::string& scene, int facets) {
  World plain;
  add_rolling_scene(plain, scene, facets, 0);
  Scalar radius = kInfinity;
  for (const BodyId id : plain.bodies()) {
    radius = std::min(radius, plain.body(id).shape->bounding_radius());
  }
  options.target_distance = 1e-4 * radius;
  options.rest_offset = 4e-4 * radius;
}

}  // namespace

void add_rolling_scene(World& world, const std::string& name, int facets, Scalar azimuth) {
  const bool is_compound = name.starts_with(kCompoundPrefix);
  const std::string scene = is_compound ? name.substr(kCompoundPrefix.size()) : name;
  BodyDefinition support = floor_body(1);
  BodyDefinition body;
  if (scene == "disc" || scene == "half-disc") {
    body = round_body(scene, facets);
  } else if (scene == "coin") {
    body = spinning_coin(facets);
  } else if (scene == "oloid") {
    body = tilted_oloid(facets);
  } else if (scene == "trough" || scene == "slick-trough" || scene == "bowl") {
    const auto arrays = scene == "bowl" ? bowl(1, 0.5, facets) : trough(1, 0.5, 0.7, facets);
    support = fixed_body(std::make_shared<TriangleMesh>(arrays.mesh()), 1);
    body = ball_in_a_hollow();
  } else if (scene == "ball" || scene == "capsule") {
    support = fixed_body(std::make_shared<Sphere>(1), 1);
    if (scene == "ball") {
      body = on_a_ball(scene, std::make_shared<Sphere>(kBallRadius), 20);
    } else {
      body = on_a_ball(scene, std::make_shared<Capsule>(kBallRadius, 0.5), 1);
    }
  } else if (scene == "rod") {
    body = leaning_rod();
  } else {
    throw std::runtime_error("no scene " + scene);
  }
  support.friction = body.friction = scene == "slick-trough" ? 0 : 1;
  body.restitution = 0;
  if (is_compound) {
    for (BodyDefinition* part : {&support, &body}) make_compound(*part);
  }
  const Matrix3 R = turn_about(Vector3::UnitZ(), azimuth);
  for (BodyDefinition* part : {&support, &body}) {
    part->initial.X_WB = RigidPose(R, Vector3::Zero()) * part->initial.X_WB;
  }
  body.initial.twist = {R * body.initial.twist.v_WB, R * body.initial.twist.w_WB};
  world.add_body(support);
  world.add_body(body);
}

Scalar rolling_energy_error(const std::string& scene, int facets, Scalar azimuth, Scalar h,
                            Scalar end) {
  WorldOptions options = earth_options();
  options.records_motions = false;
  if (scene.starts_with(kCompoundPrefix)) {
    keep_lengths(options, scene.substr(kCompoundPrefix.size()), facets);
  }
  World world(options);
  add_rolling_scene(world, scene, facets, azimuth);
  const Scalar start = energy(world, options.gravity_W);
  Scalar error = 0;
  Scalar kinetic = world.kinetic_energy();
  for (long k = std::lround(end / h); k > 0; --k) {
    if (world.advance(h).status != AdvanceStatus::Completed) return kInfinity;
    error = std::max(error, std::abs(energy(world, options.gravity_W) - start));
    kinetic = std::max(kinetic, world.kinetic_energy());
  }
  return error / kinetic;
}

}  // namespace dyop::testing
