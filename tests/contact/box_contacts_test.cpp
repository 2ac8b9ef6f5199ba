// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "dyop/contact/contact_generator.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using testing::random_direction;
using testing::random_index;
using testing::random_magnitude;
using testing::random_number;

// A box of which nothing is known but that it is convex: it goes the way of all polytopes.
class UnknownBox final : public ConvexShape {
 public:
  UnknownBox(const Vector3& half_extents, Scalar radius, Scalar bounding_radius)
      : box_(half_extents), radius_(radius), bounding_radius_(bounding_radius) {}

  SupportPoint core_support(const Vector3& direction) const override {
    return box_.core_support(direction);
  }
  Scalar rounding_radius() const override { return radius_; }
  Vector3 core_center() const override { return Vector3::Zero(); }
  const TriangleMesh* core_surface() const override { return box_.core_surface(); }
  AlignedBox bounding_box() const override { return box_.bounding_box(); }
  Scalar bounding_radius() const override { return bounding_radius_; }
  MassProperties compute_mass_properties(Scalar density) const override {
    return box_.compute_mass_properties(density);
  }

 private:
  Box box_;
  Scalar radius_;
  Scalar bounding_radius_;
};

// The same box, known as one and not.
struct TwoBoxes {
  std::unique_ptr<ConvexShape> known;
  std::unique_ptr<ConvexShape> unknown;
  Vector3 half_extents;
};

TwoBoxes two_boxes(const Vector3& half_extents, Scalar radius) {
  TwoBoxes result;
  if (radius > 0) {
    result.known = std::make_unique<RoundedBox>(half_extents, radius);
  } else {
    result.known = std::make_unique<Box>(half_extents);
  }
  result.unknown =
      std::make_unique<UnknownBox>(half_extents, radius, result.known->bounding_radius());
  result.half_extents = half_extents;
  return result;
}

// Often with equal sides; one in five flat or thin, up to ten thousand times.
Vector3 random_half_extents(Scalar scale, std::mt19937_64& random) {
  Vector3 half;
  for (Scalar& each : half) {
    each = scale * (random_index(3, random) == 0 ? 0.5 : random_number(0.1, 1, random));
  }
  if (random_index(5, random) == 0)
    half[random_index(3, random)] *= random_magnitude(-4, 0, random);
  return half;
}

// By right angles exactly, by those and a little more, by half of one about an axis, or any.
Matrix3 random_turn(std::mt19937_64& random) {
  const int family = random_index(5, random);
  if (family == 0) return testing::random_rotation(random).toRotationMatrix();
  Matrix3 R = Matrix3::Identity();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (int turns = random_index(4, random); turns > 0; --turns) {
      const Eigen::Index next = (axis + 1) % 3;
      R.row(next).swap(R.row((axis + 2) % 3));
      R.row(next) *= -1;
    }
  }
  if (family == 1) return R;
  const Scalar angle = family == 2   ? random_magnitude(-16, -1, random)
                       : family == 3 ? 1e-12
                                     : std::numbers::pi / 4;
  const Vector3 axis = family == 4 || random_index(2, random) == 0
                           ? Vector3(Vector3::Unit(random_index(3, random)))
                           : random_direction(random);
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix() * R;
}

Scalar random_gap(Scalar scale, std::mt19937_64& random) {
  if (random_index(3, random) == 0) return 0;
  const Scalar gap =
      scale * (random_index(2, random) == 0 ? 0.01 : random_magnitude(-13, -1, random));
  return random_index(6, random) == 0 ? -gap : gap;
}

// Face above face, edge or corner at a gap that may be none or negative, sides flush or not.
Vector3 random_place(const TwoBoxes& a, const TwoBoxes& b, const Matrix3& R_AB, Scalar scale,
                     std::mt19937_64& random) {
  if (random_index(6, random) == 0) {
    return scale * random_number(0, 2.5, random) * random_direction(random);
  }
  const Scalar gap = random_gap(scale, random);
  const Vector3 extents = a.half_extents + R_AB.cwiseAbs() * b.half_extents;
  const Eigen::Index up = random_index(3, random);
  Vector3 p;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Scalar sign = random_index(2, random) == 0 ? 1 : -1;
    const std::array<Scalar, 5> places{sign * (extents[k] + gap), 0,
                                       random_number(-1, 1, random) * extents[k], sign * extents[k],
                                       sign * (extents[k] - 2 * a.half_extents[k])};
    p[k] = places[k == up ? 0 : std::size_t(random_index(5, random))];
  }
  return p;
}

struct BoxCase {
  TwoBoxes a;
  TwoBoxes b;
  RigidPose X_WA;
  RigidPose X_WB;
  Scalar reach = 0;
  ContactGeneratorOptions options;
};

BoxCase random_case(std::mt19937_64& random) {
  const Scalar scale = random_index(2, random) == 0 ? 1 : random_magnitude(-4, 4, random);
  const auto radius = [&] { return random_index(5, random) == 0 ? 0.1 * scale : 0; };
  BoxCase c;
  const Vector3 half = random_half_extents(scale, random);
  c.a = two_boxes(half, radius());
  c.b =
      two_boxes(random_index(3, random) == 0 ? half : random_half_extents(scale, random), radius());
  const Scalar away =
      random_index(4, random) == 0 ? scale * random_magnitude(0, 6, random) : Scalar{0};
  const Matrix3 R_WA = random_index(2, random) == 0
                           ? Matrix3(Matrix3::Identity())
                           : testing::random_rotation(random).toRotationMatrix();
  c.X_WA = RigidPose(R_WA, away * random_direction(random));
  const Matrix3 R_AB = random_turn(random);
  c.X_WB = c.X_WA * RigidPose(R_AB, random_place(c.a, c.b, R_AB, scale, random));
  if (random_index(3, random) == 0) {
    const DistanceResult d = distance(*c.a.known, c.X_WA, *c.b.known, c.X_WB);
    const Scalar step = std::max(Scalar{0}, d.lower - std::abs(random_gap(scale, random)));
    c.X_WB = RigidPose(c.X_WB.rotation(), Vector3(c.X_WB.translation() - step * d.nhat_AB_W));
  }
  const std::array<Scalar, 4> reaches{0, 0.01 * scale, scale * random_magnitude(-12, 0.3, random),
                                      0.1 * scale};
  c.reach = reaches[std::size_t(random_index(4, random))];
  if (random_index(3, random) == 0) {
    c.options.cone_tolerance = random_index(3, random) == 0 ? 0 : random_number(0, 0.5, random);
    c.options.border_tolerance = random_index(3, random) == 0 ? 0 : random_number(0, 0.5, random);
  }
  return c;
}

// Two corners may give their common contact either normal's owner: both sides found it alike.
bool is_same(const ContactPoint& x, const ContactPoint& y) {
  const bool are_corners =
      x.key.a.kind == FeatureKind::Vertex && x.key.b.kind == FeatureKind::Vertex;
  const bool is_same_owner = x.normal_is_of_b == y.normal_is_of_b && x.nhat_AB_S == y.nhat_AB_S;
  return x.key == y.key && x.feature_a == y.feature_a && x.feature_b == y.feature_b &&
         x.gap == y.gap && x.lower == y.lower && x.upper == y.upper && x.p_WCa == y.p_WCa &&
         x.p_WCb == y.p_WCb && x.p_ACa == y.p_ACa && x.p_BCb == y.p_BCb &&
         x.nhat_AB_W == y.nhat_AB_W && (are_corners || is_same_owner);
}

bool is_same(const Contact& x, const Contact& y) {
  return x.lower == y.lower && x.upper == y.upper && x.p_WCa == y.p_WCa && x.p_WCb == y.p_WCb &&
         x.nhat_AB_W == y.nhat_AB_W && x.feature_a == y.feature_a && x.feature_b == y.feature_b;
}

template <typename List>
void expect_same(const List& known, const List& unknown) {
  ASSERT_EQ(known.size(), unknown.size());
  for (std::size_t k = 0; k < known.size(); ++k) {
    EXPECT_TRUE(is_same(known[k], unknown[k])) << "contact " << k;
  }
}

// Bit for bit those that the search of all polytopes finds, which has oracles of its own.
TEST(BoxContacts, AreThoseOfTheSamePolytopes) {
  std::size_t generated = 0;
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 40000 && !HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const BoxCase c = random_case(random);
    const auto points =
        generate_contacts(*c.a.known, c.X_WA, *c.b.known, c.X_WB, c.reach, c.options);
    expect_same(points,
                generate_contacts(*c.a.unknown, c.X_WA, *c.b.unknown, c.X_WB, c.reach, c.options));
    const auto contacts = find_contacts(*c.a.known, c.X_WA, *c.b.known, c.X_WB, c.reach);
    expect_same(contacts, find_contacts(*c.a.unknown, c.X_WA, *c.b.unknown, c.X_WB, c.reach));
    generated += points.size();
    found += contacts.size();
  }
  EXPECT_GT(generated, 40000);
  EXPECT_GT(found, 80000);
}

}  // namespace
}  // namespace dyop
