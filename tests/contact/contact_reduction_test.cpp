// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_point.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

ContactPoint contact_at(const Vector3& p, const Vector3& n, Scalar gap, int number) {
  ContactPoint contact;
  contact.p_WCa = p;
  contact.p_WCb = p + gap * n;
  contact.nhat_AB_W = n;
  contact.gap = gap;
  contact.key.a = {FeatureKind::Vertex, 0, number};
  return contact;
}

// A square of points, the nearest one in its middle.
std::vector<ContactPoint> patch(const Vector3& n, const Vector3& middle, int first) {
  std::vector<ContactPoint> contacts;
  for (int i = -3; i <= 3; ++i) {
    for (int j = -3; j <= 3; ++j) {
      const bool is_middle = i == 0 && j == 0;
      contacts.push_back(contact_at(middle + Vector3(i, j, 0), n, is_middle ? 0.1 : 0.2,
                                    first + int(contacts.size())));
    }
  }
  return contacts;
}

bool has_place(const std::vector<ContactPoint>& contacts, const Vector3& p) {
  return std::any_of(contacts.begin(), contacts.end(),
                     [&](const ContactPoint& contact) { return contact.p_WCa == p; });
}

TEST(ContactReduction, KeepsTheNearestAndTheCorners) {
  auto contacts = patch(Vector3::UnitZ(), Vector3::Zero(), 0);
  reduce_contacts({}, contacts);
  EXPECT_EQ(contacts.size(), 6u);
  EXPECT_TRUE(has_place(contacts, Vector3::Zero()));
  for (const Scalar x : {-3.0, 3.0}) {
    for (const Scalar y : {-3.0, 3.0}) EXPECT_TRUE(has_place(contacts, Vector3(x, y, 0)));
  }
  EXPECT_TRUE(std::is_sorted(contacts.begin(), contacts.end(),
                             [](const auto& x, const auto& y) { return x.key < y.key; }));
}

TEST(ContactReduction, KeepsAsManyForEveryDirection) {
  auto contacts = patch(Vector3::UnitZ(), Vector3::Zero(), 0);
  // 10 degrees apart is one cluster, 20 degrees are two.
  const auto lean = [](Scalar angle) { return Vector3(std::sin(angle), 0, std::cos(angle)); };
  for (const Scalar angle : {0.35, 1.2}) {
    const auto more = patch(lean(angle), Vector3(20, 0, 0), int(contacts.size()));
    contacts.insert(contacts.end(), more.begin(), more.end());
  }
  auto all = contacts;
  reduce_contacts({}, contacts);
  EXPECT_EQ(contacts.size(), 18u);
  reduce_contacts({.points_per_cluster = 2}, all);
  EXPECT_EQ(all.size(), 6u);
}

TEST(ContactReduction, PrefersWhatCarriedLoad) {
  auto contacts = patch(Vector3::UnitZ(), Vector3::Zero(), 0);
  const auto at = [&](const Vector3& p) -> ContactPoint& {
    return *std::find_if(contacts.begin(), contacts.end(),
                         [&](const ContactPoint& contact) { return contact.p_WCa == p; });
  };
  // A little inside the corner that would be taken.
  at(Vector3(2, 3, 0)).impulse_W = Vector3::UnitZ();
  reduce_contacts({}, contacts);
  EXPECT_TRUE(has_place(contacts, Vector3(2, 3, 0)));
  EXPECT_FALSE(has_place(contacts, Vector3(3, 3, 0)));
}

TEST(ContactReduction, DoesNotDependOnTheOrder) {
  auto contacts = patch(Vector3::UnitZ(), Vector3::Zero(), 0);
  auto backwards = contacts;
  std::reverse(backwards.begin(), backwards.end());
  reduce_contacts({}, contacts);
  reduce_contacts({}, backwards);
  for (const ContactPoint& contact : backwards) EXPECT_TRUE(has_place(contacts, contact.p_WCa));
}

TEST(ContactReduction, LeavesFewAlone) {
  std::vector<ContactPoint> contacts{contact_at(Vector3::Zero(), Vector3::UnitZ(), 0, 0),
                                     contact_at(Vector3::Zero(), Vector3::UnitZ(), 0, 1)};
  reduce_contacts({}, contacts);
  EXPECT_EQ(contacts.size(), 2u);
}

// Vertices of a rim of radius 1 above a floor, 0.01 apart; the lowest is the tenth of 21, `ahead`
// of the lowest place of the rim, which is at x = 0.
std::vector<ContactPoint> rim(Scalar y, int first, Scalar ahead = 0) {
  std::vector<ContactPoint> contacts;
  for (int k = 0; k < 21; ++k) {
    const Scalar x = 0.01 * (k - 10) + ahead;
    contacts.push_back(contact_at({x, y, 0}, Vector3::UnitZ(), 0.001 + x * x / 2, first + k));
  }
  return contacts;
}

ContactReductionOptions merging_for(const Vector3& shift_W, const Vector3& turn_W) {
  ContactMerging merging{shift_W, turn_W, 1};
  merging.active_gap = 0.0011;
  merging.gap_change = 1e-5;
  return {.merging = merging};
}

TEST(ContactReduction, ARollingRimRestsOnItsLowestPoint) {
  auto contacts = rim(0, 0);
  const auto more = rim(0.5, 21);
  contacts.insert(contacts.end(), more.begin(), more.end());
  contacts[9].impulse_W = Vector3::UnitZ();
  reduce_contacts(merging_for(Vector3(0.06, 0, 0), Vector3(0, 0.06, 0)), contacts);
  ASSERT_EQ(contacts.size(), 2u);
  for (const ContactPoint& contact : contacts) {
    EXPECT_EQ(contact.p_WCa.x(), 0);
    EXPECT_EQ(contact.merged_way, 0.15);
  }
  EXPECT_EQ(contacts[0].impulse_W, Vector3::UnitZ());
}

// Facets of 0.01. A step slides and turns by the same way: three times both reach from one to the
// next or not.
TEST(ContactReduction, ARimOfShortFacetsIsOneContactHoweverFarItReaches) {
  for (const Scalar way : {0.002, 0.0015}) {
    auto contacts = rim(0, 0);
    reduce_contacts(merging_for(Vector3(way, 0, 0), Vector3(0, way, 0)), contacts);
    if (way < 0.0016) {
      EXPECT_GT(contacts.size(), 1u);
    } else {
      ASSERT_EQ(contacts.size(), 1u);
      EXPECT_NEAR(contacts[0].merged_way, 0.1, 1e-3);
    }
  }
}

TEST(ContactReduction, AFineRimRestsWhereItsSmoothCurveIsLowest) {
  constexpr Scalar kSagitta = 0.01 * 0.01 / 8;
  auto options = merging_for(Vector3(0.06, 0, 0), Vector3(0, 0.06, 0));
  for (const Scalar ahead : {-0.005, -0.001, 0.004}) {
    for (const Scalar part : {0.9, 1.1}) {
      options.merging->most_sagitta = part * kSagitta;
      auto contacts = rim(0, 0, ahead);
      reduce_contacts(options, contacts);
      ASSERT_EQ(contacts.size(), 1u);
      const bool is_fine = part > 1;
      EXPECT_NEAR(contacts[0].p_WCa.x(), is_fine ? 0 : ahead, 1e-15) << part;
      EXPECT_NEAR(contacts[0].gap, 0.001 + (is_fine ? 0 : ahead * ahead / 2), 1e-15) << part;
    }
  }
}

// Corners all around the nearest one, or on one side of it only, are no row.
TEST(ContactReduction, OnlyARowIsTakenAsACurve) {
  auto options = merging_for(Vector3(0.06, 0, 0), Vector3(0, 0.06, 0));
  options.merging->most_sagitta = 1;
  auto net = rim(0, 0, 0.004);
  for (const Scalar y : {-0.01, 0.01}) {
    for (ContactPoint& contact : rim(y, int(net.size()), 0.004)) {
      contact.gap += 1e-5;
      net.push_back(contact);
    }
  }
  auto half = rim(0, 0, 0.004);
  half.erase(half.begin(), half.begin() + 10);
  for (auto* contacts : {&net, &half}) {
    reduce_contacts(options, *contacts);
    ASSERT_FALSE(contacts->empty());
    EXPECT_NEAR(contacts->front().p_WCa.x(), 0.004, 1e-15);
  }
}

TEST(ContactReduction, WhatSlidesOrRestsKeepsItsContacts) {
  for (const Vector3& shift_W : {Vector3(0, 0, 0), Vector3(0.1, 0, 0), Vector3(0, 0, -0.1)}) {
    std::vector<ContactPoint> contacts{contact_at(Vector3::Zero(), Vector3::UnitZ(), 0.001, 0),
                                       contact_at({0.01, 0, 0}, Vector3::UnitZ(), 0.001, 1)};
    reduce_contacts(merging_for(shift_W, Vector3::Zero()), contacts);
    EXPECT_EQ(contacts.size(), 2u);
    EXPECT_EQ(contacts[0].merged_way, 0);
  }
}

TEST(ContactReduction, RefusesWhatIsOutOfRange) {
  std::vector<ContactPoint> contacts;
  EXPECT_THROW(reduce_contacts({.points_per_cluster = 0}, contacts), InvalidArgument);
  EXPECT_THROW(reduce_contacts({.same_normal_cosine = 1.5}, contacts), InvalidArgument);
  EXPECT_THROW(reduce_contacts({.same_normal_cosine = std::nan("")}, contacts), InvalidArgument);
}

}  // namespace
}  // namespace dyop
