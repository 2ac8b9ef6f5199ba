// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/placed_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "contact/generation/contact_search.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using namespace testing;
using contact_internal::ContactPlace;

// What counts at a place: faces the same way, and is not nearer to another point.
std::vector<ContactPoint> own_contacts(const std::vector<ContactPoint>& found,
                                       const ContactPlace& place,
                                       const std::vector<Vector3>& points_W) {
  std::vector<ContactPoint> own;
  for (const ContactPoint& contact : found) {
    const Vector3& p = contact.p_WCa;
    const Scalar apart = std::min((p - place.p_WCa).squaredNorm(), (p - place.p_WCb).squaredNorm());
    const bool is_of_another = std::any_of(points_W.begin(), points_W.end(), [&](const Vector3& q) {
      return (p - q).squaredNorm() < apart;
    });
    if (contact.nhat_AB_W.dot(place.nhat_AB_W) >= 0.9 && !is_of_another) own.push_back(contact);
  }
  return own;
}

// Searches at the places of contacts, after a small move that may bring the surfaces across each
// other, with any lift, reach and region.
class PlacedContacts : public ::testing::Test {
 protected:
  void compare(const TriangleMesh& a, const TriangleMesh& b);

  std::mt19937_64 random{17};
  ContactWorkspace workspace;
  int places_seen = 0, contacts_seen = 0;
};

void PlacedContacts::compare(const TriangleMesh& a, const TriangleMesh& b) {
  const RigidPose X_WA = random_pose(1, random);
  const Scalar reach = 0.25;
  RigidPose X_WB(random_rotation(random).toRotationMatrix(),
                 X_WA.translation() + random_number(0, 1.2, random) * random_direction(random));
  const DistanceResult apart = distance(a, X_WA, b, X_WB);
  if (!(apart.lower > 0)) return;
  const Scalar part = 1 - 0.02 / apart.upper;
  X_WB = RigidPose(X_WB.rotation(), X_WB.translation() - part * (apart.p_WCb - apart.p_WCa));
  std::vector<ContactPoint> known;
  generate_contacts(a, X_WA, b, X_WB, reach, {}, workspace, known);
  if (known.size() < 2) return;
  X_WB = RigidPose(rotation_from_vector(random_vector(0.02, random)) * X_WB.rotation(),
                   X_WB.translation() + random_vector(0.02, random));
  std::vector<ContactPlace> places;
  std::vector<Vector3> points_W;
  for (const ContactPoint& contact : known) {
    points_W.push_back(contact.p_WCa);
    if (random_number(0, 1, random) < 0.3) continue;
    const Scalar lift = random_number(-0.1, 0.2, random);
    places.push_back({contact.nhat_AB_W,
                      std::max(lift, Scalar{0}),
                      random_number(0.01, reach, random),
                      {contact.p_WCa, random_number(0.02, 0.5, random)},
                      contact.p_WCa,
                      X_WB * contact.p_BCb});
  }
  std::size_t next = 0;
  contact_internal::generate_placed_contacts(
      {a, X_WA, b, X_WB, places, points_W}, workspace,
      [&](std::size_t number, const std::vector<ContactPoint>& found) {
        ASSERT_EQ(number, next++);
        const ContactPlace& place = places[number];
        ContactGeneratorOptions options;
        options.region = place.region;
        const auto alone = generate_contacts(a, X_WA, b, contact_internal::lifted(place, X_WB),
                                             place.reach, options);
        const auto expected = own_contacts(alone, place, points_W);
        const auto actual = own_contacts(found, place, points_W);
        ASSERT_EQ(actual.size(), expected.size());
        ++places_seen;
        contacts_seen += int(actual.size());
        for (std::size_t k = 0; k < actual.size(); ++k) {
          EXPECT_EQ(actual[k].key, expected[k].key);
          EXPECT_EQ(actual[k].gap, expected[k].gap);
          EXPECT_EQ(actual[k].p_WCa, expected[k].p_WCa);
          EXPECT_EQ(actual[k].nhat_AB_W, expected[k].nhat_AB_W);
        }
      });
  EXPECT_EQ(next, places.size());
}

// The same bits as one search for each place.
TEST_F(PlacedContacts, AreThoseOfASearchAtEachPlace) {
  const std::vector<TriangleMesh> meshes{
      icosphere(2, 0.5).mesh(), torus(0.5, 0.2, 20, 12).mesh(), box_mesh({0.5, 0.4, 0.3}).mesh(),
      plate_grid(1, 1, 6, 6).mesh(), gear(12, 0.4, 0.5, 0.2).mesh()};
  for (const TriangleMesh& a : meshes) {
    for (const TriangleMesh& b : meshes) {
      for (int k = 0; k < 400; ++k) compare(a, b);
    }
  }
  EXPECT_GT(places_seen, 1000);
  EXPECT_GT(contacts_seen, 1000);
}

}  // namespace
}  // namespace dyop
