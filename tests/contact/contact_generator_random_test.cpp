// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numbers>
#include <random>

#include "contact/generation/contact_search.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/contact_generation_oracle.h"

namespace dyop {
namespace {

using testing::ContactOracle;
using testing::OraclePoints;
using testing::random_index;
using testing::random_magnitude;
using testing::random_number;
using testing::random_vector;

using testing::MeshArrays;

// Three sheets at one edge, at random angles, some of them flat across it.
MeshArrays fan(std::mt19937_64& random) {
  MeshArrays arrays;
  arrays.vertices = {Vector3(0, 0, -1), Vector3(0, 0, 1)};
  for (std::int32_t k = 0; k < 3 + random_index(2, random); ++k) {
    const Scalar turn = k == 1 ? std::numbers::pi : random_number(0, 2 * std::numbers::pi, random);
    arrays.vertices.emplace_back(std::cos(k == 0 ? 0 : turn), std::sin(k == 0 ? 0 : turn), 0.3);
    arrays.triangles.push_back({0, 1, k + 2});
  }
  return arrays;
}

// An open, bumpy sheet.
MeshArrays sheet(std::mt19937_64& random) {
  MeshArrays arrays = testing::plate_grid(2, 2, 4, 3);
  for (Vector3& p : arrays.vertices) p.z() = random_number(-0.3, 0.3, random);
  return arrays;
}

// Every triangle with vertices of its own, and one in five twice.
MeshArrays shattered(const MeshArrays& whole, std::mt19937_64& random) {
  MeshArrays arrays;
  for (const TriangleIndices& t : whole.triangles) {
    const auto first = std::int32_t(arrays.vertices.size());
    for (const std::int32_t v : t) arrays.vertices.push_back(whole.vertices[std::size_t(v)]);
    arrays.triangles.push_back({first, first + 1, first + 2});
    if (random_index(5, random) == 0) arrays.triangles.push_back({first, first + 2, first + 1});
  }
  return arrays;
}

// Half of the triangles wound the opposite way.
MeshArrays miswound(MeshArrays arrays, std::mt19937_64& random) {
  for (TriangleIndices& t : arrays.triangles) {
    if (random_index(2, random) == 0) std::swap(t[0], t[1]);
  }
  return arrays;
}

MeshArrays random_arrays(int family, std::mt19937_64& random) {
  switch (family) {
    case 0:
      return testing::box_mesh(Vector3(1, 0.7, 0.5));
    case 1:
      return testing::icosphere(1);
    case 2:
      return testing::torus(1, 0.4, 5, 4);
    case 3:
      return testing::gear(3, 0.6, 1, 0.4);
    case 4:
      return sheet(random);
    case 5:
      return fan(random);
    case 6:
      return shattered(testing::box_mesh(Vector3(1, 0.7, 0.5)), random);
    case 7:
      return miswound(testing::icosphere(0), random);
    case 8:
      return testing::needle(2, 3);
    case 9:
      return testing::random_soup(8, 0.6, random());
    default:
      return testing::point_cloud(5, random());
  }
}
constexpr int kMeshFamilies = 11;

std::vector<Vector3> random_points(int count, Scalar scale, std::mt19937_64& random) {
  std::vector<Vector3> points;
  for (int k = 0; k < count; ++k) points.push_back(random_vector(scale, random));
  return points;
}

std::unique_ptr<Shape> random_shape(Scalar scale, bool is_box, std::mt19937_64& random) {
  const int family = is_box ? 0 : random_index(kMeshFamilies + 5, random);
  switch (family) {
    case 0:
      return std::make_unique<Box>(scale * Vector3(1, random_number(0.1, 1, random), 0.6));
    case 1:
      return std::make_unique<Sphere>(scale * random_number(0.2, 1, random));
    case 2:
      return std::make_unique<Capsule>(scale * random_number(0.1, 0.5, random),
                                       scale * random_number(0, 1, random));
    case 3:
      return std::make_unique<ConvexHull>(random_points(12, scale, random));
    case 4:
      return std::make_unique<ConvexHull>(random_points(3, scale, random));
    default:
      break;
  }
  MeshArrays arrays = random_arrays(family - 5, random);
  for (Vector3& p : arrays.vertices) p *= scale;
  return std::make_unique<TriangleMesh>(arrays.mesh());
}

Scalar core_radius(const Shape& shape) {
  return shape.kind() == ShapeKind::Convex
             ? static_cast<const ConvexShape&>(shape).rounding_radius()
             : 0;
}

struct RandomPair {
  std::unique_ptr<Shape> a;
  std::unique_ptr<Shape> b;
  RigidPose X_WA;
  RigidPose X_WB;
  Scalar reach;
  Scalar scale;
};

// How two shapes are placed.
struct Placement {
  Scalar low_exponent = 0;  // of their size
  Scalar high_exponent = 0.01;
  Scalar offset = 0;  // from the world's origin, in their size
  Scalar gap = 0;     // in their size; zero: any
  bool are_boxes = false;
};

RandomPair random_pair(const Placement& placement, std::mt19937_64& random) {
  const Scalar scale = random_magnitude(placement.low_exponent, placement.high_exponent, random);
  RandomPair pair;
  pair.scale = scale;
  pair.a = random_shape(scale, placement.are_boxes, random);
  pair.b = random_shape(scale, placement.are_boxes, random);
  const Vector3 place = scale * placement.offset * testing::random_direction(random);
  pair.X_WA = RigidPose(testing::random_rotation(random), place);
  pair.X_WB =
      RigidPose(testing::random_rotation(random),
                place + scale * (random_number(0.2, 2.2, random) + (placement.are_boxes ? 1 : 0)) *
                            testing::random_direction(random));
  const DistanceResult nearest = distance(*pair.a, pair.X_WA, *pair.b, pair.X_WB);
  pair.reach = nearest.upper + scale * random_number(0, 0.4, random);
  if (placement.gap > 0 && nearest.status == DistanceStatus::Separated) {
    // Nearer along the normal that proves the distance, which is then the gap.
    const Scalar step = nearest.lower - placement.gap * scale;
    pair.X_WB = RigidPose(pair.X_WB.rotation(),
                          Vector3(pair.X_WB.translation() - step * nearest.nhat_AB_W));
    pair.reach = 8 * placement.gap * scale;
  }
  return pair;
}

// Checks the contacts of one pair against the definition. Returns how many minima there are.
int check_pair(const RandomPair& pair) {
  const RigidPose X_AB = pair.X_WA.inverse() * pair.X_WB;
  const ContactOracle oracle(*pair.a, *pair.b, X_AB);
  const Scalar radius_a = core_radius(*pair.a);
  const Scalar radius_b = core_radius(*pair.b);
  const Scalar radii = radius_a + radius_b;
  const RigidPose X_AW = pair.X_WA.inverse();
  const Scalar noise = 1e-13 * (pair.X_WA.translation().norm() + 4 * pair.scale);
  const std::vector<ContactPoint> contacts =
      generate_contacts(*pair.a, pair.X_WA, *pair.b, pair.X_WB, pair.reach);
  std::vector<OraclePoints> points;
  for (const ContactPoint& contact : contacts) {
    const Vector3 n = X_AW.rotation() * contact.nhat_AB_W;
    const Vector3 p_a = X_AW * contact.p_WCa - radius_a * n;
    const Vector3 p_b = X_AW * contact.p_WCb + radius_b * n;
    points.push_back({p_a, p_b});
    if (&contact != contacts.data()) {
      EXPECT_LT((&contact - 1)->key, contact.key);
    }
    // The points are points of the surfaces.
    EXPECT_LE(oracle.distance_to_a(p_a), 16 * noise);
    EXPECT_LE(oracle.distance_to_b(p_b), 16 * noise);
    // Nothing beside them comes nearer by more than the tolerances, in a sector of any width.
    const Scalar d = (p_b - p_a).norm();
    EXPECT_LE(oracle.rise({p_a, p_b}, n, 16 * noise),
              1.5 * ContactGeneratorOptions().cone_tolerance)
        << "between features of kinds " << int(contact.key.a.kind) << " and "
        << int(contact.key.b.kind);
    EXPECT_NEAR(n.norm(), 1, 1e-12);
    EXPECT_LE(contact.lower, d - radii + noise);
    EXPECT_GE(contact.upper, d - radii - noise);
    EXPECT_LE(contact.upper - contact.lower,
              16 * noise + 2 * ContactGeneratorOptions().border_tolerance * std::max(d, Scalar{0}));
    EXPECT_LE(contact.gap, contact.upper + noise);
    EXPECT_LE(contact.lower, pair.reach);
    EXPECT_LE(((pair.X_WA * contact.p_ACa) - contact.p_WCa).norm(), noise);
    EXPECT_LE(((pair.X_WB * contact.p_BCb) - contact.p_WCb).norm(), noise);
  }
  const std::vector<OraclePoints> minima = oracle.minima(pair.reach + radii - 8 * noise, 1e-9);
  for (const OraclePoints& minimum : minima) {
    const Scalar d = (minimum.p_b - minimum.p_a).norm();
    const Scalar apart = 3 * ContactGeneratorOptions().border_tolerance * d + 16 * noise;
    const bool is_found = std::any_of(points.begin(), points.end(), [&](const OraclePoints& p) {
      return (p.p_a - minimum.p_a).norm() <= apart && (p.p_b - minimum.p_b).norm() <= apart;
    });
    EXPECT_TRUE(is_found) << "a minimum at " << d - radii << " of " << pair.reach
                          << " is not found: " << minimum.p_a.transpose() << " to "
                          << minimum.p_b.transpose();
  }
  return int(minima.size());
}

void check_random_pairs(int count, const Placement& placement, std::uint64_t seed) {
  int minima = 0;
  int checked = 0;
  for (int k = 0; k < count && !::testing::Test::HasFailure(); ++k) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed << ", pair " << k);
    std::mt19937_64 random(seed + std::uint64_t(k));
    const RandomPair pair = random_pair(placement, random);
    const ContactOracle oracle(*pair.a, *pair.b, pair.X_WA.inverse() * pair.X_WB);
    const bool is_touching =
        distance(*pair.a, pair.X_WA, *pair.b, pair.X_WB).status != DistanceStatus::Separated;
    if (is_touching || oracle.is_enclosed()) continue;
    minima += check_pair(pair);
    ++checked;
  }
  EXPECT_GT(checked, count / 4);
  EXPECT_GE(minima, checked * 9 / 10);
}

TEST(ContactGenerator, FindsEveryLocalMinimumAndNothingElse) {
  check_random_pairs(6000, {}, 1);
}

// What an approach leaves out does not come as near as it asks for: the material points of each
// contact that is missing, moved as expected. All that is kept is what a search without it finds.
TEST(ContactGenerator, LeavesOutOnlyWhatDoesNotMatterForAnApproach) {
  using contact_internal::ExpectedApproach;
  ContactWorkspace workspace;
  std::vector<ContactPoint> kept;
  int missing = 0, shared = 0;
  for (std::uint64_t seed = 500000; seed < 503000 && !HasFailure(); ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const RandomPair pair = random_pair({}, random);
    const Scalar length = 0.3 * pair.scale;
    ExpectedApproach approach{.least = random_number(0, 0.5, random) * pair.reach,
                              .reach = pair.reach,
                              .slack = random_number(0, 0.1, random) * pair.reach,
                              .v_W = random_vector(length, random),
                              .w_W = random_vector(0.3, random),
                              .origin_W = pair.X_WB.translation() + random_vector(length, random)};
    const std::vector<ContactPoint> all =
        generate_contacts(*pair.a, pair.X_WA, *pair.b, pair.X_WB, pair.reach);
    {
      const contact_internal::ScopedUse use(workspace.impl().approach, approach);
      generate_contacts(*pair.a, pair.X_WA, *pair.b, pair.X_WB, pair.reach, {}, workspace, kept);
    }
    const auto place = [](const ContactPoint& x, const ContactPoint& y) {
      return (x.p_WCa - y.p_WCa).norm() + (x.p_WCb - y.p_WCb).norm();
    };
    const Scalar same = 0.01 * pair.reach;
    for (const ContactPoint& contact : kept) {
      EXPECT_TRUE(std::any_of(all.begin(), all.end(),
                              [&](const auto& other) { return place(contact, other) <= same; }));
    }
    const Scalar least = approach.least + approach.slack - 1e-9 * pair.scale;
    for (const ContactPoint& contact : all) {
      const bool is_kept = std::any_of(kept.begin(), kept.end(), [&](const auto& other) {
        return other.key == contact.key || place(contact, other) <= same;
      });
      ++(is_kept ? shared : missing);
      if (is_kept) continue;
      const Vector3 step = approach.v_W + approach.w_W.cross(contact.p_WCb - approach.origin_W);
      for (const Scalar part : {0.0, 0.25, 0.5, 0.75, 1.0}) {
        EXPECT_GT((contact.p_WCb + part * step - contact.p_WCa).norm(), least) << part;
      }
    }
  }
  EXPECT_GT(missing, 500);
  EXPECT_GT(shared, 500);
}

TEST(ContactGenerator, DoesSoAtAnyScale) {
  check_random_pairs(2000, {.low_exponent = -4, .high_exponent = 4}, 100000);
}

TEST(ContactGenerator, DoesSoFarFromTheOrigin) {
  check_random_pairs(2000, {.offset = 1e4}, 200000);
}

TEST(ContactGenerator, DoesSoCloseToContact) {
  check_random_pairs(2000, {.gap = 1e-3}, 300000);
  check_random_pairs(2000, {.gap = 1e-6}, 400000);
}

TEST(ContactGenerator, DoesSoForBoxes) {
  check_random_pairs(1600, {.low_exponent = -4, .high_exponent = 4, .are_boxes = true}, 600000);
  check_random_pairs(800, {.offset = 1e4, .gap = 1e-3, .are_boxes = true}, 700000);
  check_random_pairs(800, {.gap = 1e-6, .are_boxes = true}, 800000);
}

// In a ball: those of all contacts whose point of A is in it. Of duplicates at its edge another may
// be kept.
TEST(ContactGenerator, FindsTheSameInARegion) {
  int left_out = 0;
  int kept = 0;
  for (int k = 0; k < 2000 && !::testing::Test::HasFailure(); ++k) {
    SCOPED_TRACE(k);
    std::mt19937_64 random(500000 + std::uint64_t(k));
    const RandomPair pair = random_pair({.low_exponent = -2, .high_exponent = 2}, random);
    const std::vector<ContactPoint> all =
        generate_contacts(*pair.a, pair.X_WA, *pair.b, pair.X_WB, pair.reach);
    if (all.empty()) continue;
    const auto chosen = static_cast<std::size_t>(random_index(int(all.size()), random));
    const ContactRegion region{all[chosen].p_WCa + random_vector(0.1 * pair.scale, random),
                               pair.scale * random_number(0, 1, random)};
    ContactGeneratorOptions options;
    options.region = region;
    const std::vector<ContactPoint> found =
        generate_contacts(*pair.a, pair.X_WA, *pair.b, pair.X_WB, pair.reach, options);
    const auto depth = [&](const ContactPoint& contact) {
      return region.radius - (contact.p_WCa - region.center_W).norm();
    };
    const auto holds = [](const std::vector<ContactPoint>& list, const ContactPoint& contact) {
      return std::any_of(list.begin(), list.end(), [&](const ContactPoint& other) {
        return other.key == contact.key && other.p_WCa == contact.p_WCa;
      });
    };
    const Scalar edge = 4 * options.border_tolerance * pair.reach;
    for (const ContactPoint& contact : found) {
      EXPECT_GE(depth(contact), 0);
      EXPECT_TRUE(depth(contact) < edge || holds(all, contact));
    }
    for (const ContactPoint& contact : all) {
      const bool is_inside = depth(contact) > edge;
      ++(is_inside ? kept : left_out);
      EXPECT_TRUE(!is_inside || holds(found, contact));
    }
  }
  EXPECT_GT(kept, 500);
  EXPECT_GT(left_out, 500);
}

TEST(ContactGenerator, RejectsARegionThatIsNone) {
  const Sphere ball(1);
  ContactGeneratorOptions options;
  options.region = ContactRegion{Vector3::Zero(), -1};
  const RigidPose X_WB(Vector3(3, 0, 0));
  EXPECT_THROW(generate_contacts(ball, RigidPose(), ball, X_WB, 1, options), InvalidArgument);
  options.region->radius = kInfinity;
  EXPECT_THROW(generate_contacts(ball, RigidPose(), ball, X_WB, 1, options), InvalidArgument);
}

}  // namespace
}  // namespace dyop
