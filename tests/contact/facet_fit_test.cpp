// SPDX-License-Identifier: BSD-3-Clause

// Corners of a polygon over a plane against the circle through them.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "contact/generation/contact_fit.h"

namespace dyop {
namespace {

constexpr Scalar kRimRadius = 2;
constexpr Scalar kRimGap = 1e-3;
constexpr Scalar kRimFacet = 0.02;  // radians

// A corner of the rim at this angle from its lowest place; the plane is A, z points from it to B.
ContactPoint corner_at(Scalar angle) {
  ContactPoint corner;
  corner.nhat_AB_W = corner.nhat_AB_S = Vector3::UnitZ();
  corner.p_WCa = corner.p_ACa = Vector3(kRimRadius * std::sin(angle), 0, 0);
  const Scalar height = kRimGap + kRimRadius * (1 - std::cos(angle));
  corner.p_WCb = corner.p_BCb = corner.p_WCa + height * Vector3::UnitZ();
  corner.gap = height;
  return corner;
}

// The fit of the first of these corners to all.
std::optional<ContactPoint> fit_of(const std::vector<ContactPoint>& corners, Scalar most_sagitta) {
  std::vector<const ContactPoint*> near;
  for (const ContactPoint& corner : corners) near.push_back(&corner);
  return contact_internal::fitted_contact(corners.front(), near, most_sagitta);
}

constexpr Scalar kRimSagitta = kRimRadius * kRimFacet * kRimFacet / 8;

TEST(FacetFit, TouchesWhereTheCircleDoes) {
  for (const Scalar part : {-0.5, -0.31, 0.0, 0.2, 0.5}) {
    SCOPED_TRACE(part);
    const Scalar angle = part * kRimFacet;
    const auto fitted =
        fit_of({corner_at(angle), corner_at(angle - kRimFacet), corner_at(angle + kRimFacet)},
               1.1 * kRimSagitta);
    ASSERT_TRUE(fitted);
    // The corner is off by up to half a facet, and its gap by the sagitta: here two orders less.
    constexpr Scalar kWay = kRimRadius * kRimFacet * kRimFacet * kRimFacet;
    const Vector3 lowest(0, 0, kRimGap);
    EXPECT_LT((fitted->p_WCb - lowest).norm(), kWay);
    EXPECT_LT((fitted->p_BCb - lowest).norm(), kWay);
    EXPECT_LT((fitted->p_WCa - Vector3::Zero()).norm(), kWay);
    EXPECT_LT((fitted->nhat_AB_W - Vector3::UnitZ()).norm(), 1e-15);
    EXPECT_NEAR(fitted->gap, kRimGap, kWay * kRimFacet / 8);
  }
}

TEST(FacetFit, CoarseFacetsCountAsTheyAre) {
  const std::vector<ContactPoint> rim{corner_at(0), corner_at(-kRimFacet), corner_at(kRimFacet)};
  EXPECT_TRUE(fit_of(rim, 1.01 * kRimSagitta));
  EXPECT_FALSE(fit_of(rim, 0.99 * kRimSagitta));
}

TEST(FacetFit, StaysBetweenTheNeighbours) {
  // The lowest place of the circle is two facets away from the first corner.
  const auto fitted =
      fit_of({corner_at(2 * kRimFacet), corner_at(kRimFacet), corner_at(3 * kRimFacet)}, 1);
  ASSERT_TRUE(fitted);
  EXPECT_LT((fitted->p_WCb - corner_at(kRimFacet).p_WCb).norm(), 1e-12);
}

TEST(FacetFit, NeedsARowWithNeighboursOnBothSides) {
  const ContactPoint middle = corner_at(0);
  const ContactPoint next = corner_at(kRimFacet);
  EXPECT_FALSE(fit_of({middle}, 1));
  EXPECT_FALSE(fit_of({middle, next}, 1));
  EXPECT_FALSE(fit_of({middle, next, corner_at(2 * kRimFacet)}, 1));
  EXPECT_TRUE(fit_of({middle, next, corner_at(-2.5 * kRimFacet)}, 1));
  EXPECT_FALSE(fit_of({middle, next, corner_at(-3.5 * kRimFacet)}, 1));
  ContactPoint beside = middle;
  for (Vector3* p : {&beside.p_WCa, &beside.p_WCb}) p->y() += 2 * kRimRadius * kRimFacet;
  EXPECT_TRUE(fit_of({middle, next, corner_at(-kRimFacet)}, 1));
  EXPECT_FALSE(fit_of({middle, next, corner_at(-1.5 * kRimFacet), beside}, 1));
}

}  // namespace
}  // namespace dyop
