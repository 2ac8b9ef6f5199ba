// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

const TriangleMesh& ball() {
  static const TriangleMesh mesh = icosphere(3).mesh();
  return mesh;
}
const RigidPose kBeside(Vector3(2.1, 0.05, 0.02));

TEST(FindContacts, LimitsThatAreNotReachedChangeNothing) {
  const std::vector<Contact> all = find_contacts(ball(), RigidPose(), ball(), kBeside, 0.3);
  ContactSearchLimits limits;
  limits.max_triangle_pairs = 1'000'000;
  std::stop_source stop;
  limits.stop = stop.get_token();
  const auto limited = find_contacts(ball(), RigidPose(), ball(), kBeside, 0.3, limits);
  ASSERT_TRUE(limited);
  ASSERT_EQ(limited->size(), all.size());
  ASSERT_FALSE(all.empty());
  for (std::size_t k = 0; k < all.size(); ++k) {
    EXPECT_EQ((*limited)[k].lower, all[k].lower);
    EXPECT_EQ((*limited)[k].p_WCa, all[k].p_WCa);
  }
}

TEST(FindContacts, TheLimitIsTheNumberOfTrianglePairsWithinReach) {
  ContactSearchLimits limits;
  const auto is_answered = [&](std::int64_t pairs) {
    limits.max_triangle_pairs = pairs;
    return find_contacts(ball(), RigidPose(), ball(), kBeside, 0.15, limits).has_value();
  };
  EXPECT_FALSE(is_answered(0));
  std::int64_t enough = 1;
  while (!is_answered(enough)) enough *= 2;
  EXPECT_GT(enough, 1);
  EXPECT_LT(enough, std::int64_t{1} << 20);
  // Nothing is in reach, so none is counted.
  limits.max_triangle_pairs = 0;
  EXPECT_TRUE(find_contacts(ball(), RigidPose(), ball(), kBeside, 0.01, limits)->empty());
  EXPECT_THROW(is_answered(-1), InvalidArgument);
}

TEST(FindContacts, AStopEndsTheSearch) {
  std::stop_source stop;
  stop.request_stop();
  ContactSearchLimits limits;
  limits.stop = stop.get_token();
  EXPECT_FALSE(find_contacts(ball(), RigidPose(), ball(), kBeside, 10, limits));
}

// The oracle: the kernel for triangles on every pair of a vertex and a triangle, and of two edges
// that are nearest inside both, whatever is near. Edges inside a flat area are left out.
class EveryPair {
 public:
  EveryPair(const TriangleMesh& a, const RigidPose& X_WA, const TriangleMesh& b,
            const RigidPose& X_WB, Scalar max_distance, Scalar noise)
      : max_distance_(max_distance), noise_(noise) {
    const std::vector<Piece> all_a = pieces(a, X_WA);
    const std::vector<Piece> all_b = pieces(b, X_WB);
    for (const Piece& s : all_a) {
      for (const Piece& t : all_b) {
        for (std::size_t i = 0; i < 3; ++i) {
          add(s.point(i), t.corners, false);
          add(s.corners, t.point(i), false);
          for (std::size_t j = 0; j < 3; ++j) {
            if (!s.is_inner[i] && !t.is_inner[j]) add(s.edge(i), t.edge(j), true);
          }
        }
      }
    }
  }

  std::vector<TriangleDistance> found;

 private:
  struct Piece {
    Triangle corners;
    std::array<bool, 3> is_inner{};
    Triangle point(std::size_t k) const { return {corners[k], corners[k], corners[k]}; }
    Triangle edge(std::size_t k) const {
      return {corners[k], corners[(k + 1) % 3], corners[(k + 1) % 3]};
    }
  };

  static std::vector<Piece> pieces(const TriangleMesh& mesh, const RigidPose& X) {
    std::vector<Piece> result;
    for (std::int32_t k = 0; k < std::int32_t(mesh.triangles().size()); ++k) {
      Piece piece{mesh.triangle(k)};
      for (std::size_t i = 0; i < 3; ++i) {
        piece.corners[i] = X * piece.corners[i];
        const auto edge = mesh.topology().edge_of_side(3 * k + std::int32_t(i));
        piece.is_inner[i] = mesh.contact_features().edge_kind(*edge) == EdgeKind::Flat;
      }
      result.push_back(piece);
    }
    return result;
  }
  void add(const Triangle& a, const Triangle& b, bool is_of_edges) {
    const TriangleDistance d = triangle_distance(a, b);
    // Nearly parallel edges are left to their ends.
    if (is_of_edges &&
        (d.feature_a.kind == FeatureKind::Vertex || d.feature_b.kind == FeatureKind::Vertex ||
         (a[1] - a[0]).normalized().cross((b[1] - b[0]).normalized()).norm() < 1e-4)) {
      return;
    }
    if (d.upper < max_distance_ - noise_) found.push_back(d);
  }

  Scalar max_distance_;
  Scalar noise_;
};

std::shared_ptr<ConvexShape> random_polytope(Scalar scale, bool is_box, std::mt19937_64& random) {
  if (is_box || random_index(2, random) == 0) {
    return std::make_shared<Box>(scale * Vector3(0.5, 0.4, random_number(0.02, 0.6, random)));
  }
  std::vector<Vector3> points;
  for (int k = 0; k < 5 + random_index(12, random); ++k) {
    points.push_back(0.6 * scale * random_direction(random));
  }
  return std::make_shared<ConvexHull>(points);
}

// B on A at a gap, upright or turned; upright at right angles one time in four.
RigidPose let_down(const ConvexShape& a, const ConvexShape& b, Scalar scale, Scalar gap,
                   std::mt19937_64& random) {
  const Scalar turn = random_index(4, random) == 0 ? std::acos(-1.0) / 2 * random_index(4, random)
                                                   : random_number(0, 6, random);
  const Quaternion q = random_index(2, random) == 0
                           ? Quaternion(Eigen::AngleAxisd(turn, Vector3::UnitZ()))
                           : random_rotation(random);
  const Vector3 aside(random_number(-0.4, 0.4, random), random_number(-0.4, 0.4, random), 0);
  Scalar height = 3 * scale;
  for (int step = 0; step < 50; ++step) {
    const RigidPose X(q, scale * aside + Vector3(0, 0, height));
    height -= 0.99 * (distance(a, RigidPose(), b, X).lower - gap);
  }
  return RigidPose(q, scale * aside + Vector3(0, 0, height));
}

struct CloseShapes {
  std::shared_ptr<ConvexShape> a;
  std::shared_ptr<ConvexShape> b;
  RigidPose X_WA;
  RigidPose X_WB;
  Scalar max_distance;
  Scalar noise;
};

CloseShapes random_close_shapes(std::mt19937_64& random, bool are_boxes = false) {
  const Scalar scale = std::pow(10, random_number(-4, 4, random));
  CloseShapes close;
  close.a = random_polytope(scale, are_boxes, random);
  close.b = random_polytope(scale, are_boxes, random);
  const Scalar gap = scale * std::pow(10, random_number(-6, -2, random));
  const RigidPose X_AB = let_down(*close.a, *close.b, scale, gap, random);
  close.max_distance = gap * random_number(0.5, 5, random);
  const Scalar offset = random_index(3, random) == 0 ? 1e3 * scale : 0;
  close.X_WA = RigidPose(random_rotation(random), offset * random_direction(random));
  close.X_WB = close.X_WA * X_AB;
  close.noise = 1e-13 * (scale + offset);
  return close;
}

bool is_at_place(const Contact& contact, const NearestPoints& pair, Scalar radius) {
  return (contact.p_WCa - pair.p_a).norm() <= radius &&
         (contact.p_WCb - pair.p_b).norm() <= radius && contact.nhat_AB_W.dot(pair.nhat_AB) >= 0.98;
}

// Every pair of features within reach is at the place of a contact, and every contact is one of
// those pairs; by the bounds of both.
void expect_every_contact(const CloseShapes& close) {
  const std::vector<Contact> contacts =
      find_contacts(*close.a, close.X_WA, *close.b, close.X_WB, close.max_distance);
  const EveryPair within(*close.a->core_surface(), close.X_WA, *close.b->core_surface(), close.X_WB,
                         close.max_distance, close.noise);
  const EveryPair about(*close.a->core_surface(), close.X_WA, *close.b->core_surface(), close.X_WB,
                        close.max_distance + 4 * close.noise, close.noise);
  Scalar least = close.max_distance;
  for (const TriangleDistance& pair : within.found) least = std::min(least, pair.lower);
  const Scalar radius =
      1.001 * std::sqrt(std::max(0.0, close.max_distance * close.max_distance - least * least)) +
      1e3 * close.noise;
  // Below that the normals are rounding.
  if (least < 1e4 * close.noise) return;
  for (const TriangleDistance& pair : within.found) {
    EXPECT_TRUE(
        std::any_of(contacts.begin(), contacts.end(),
                    [&](const Contact& contact) { return is_at_place(contact, pair, radius); }))
        << "a pair at " << pair.lower << " of " << close.max_distance << " has no contact";
  }
  for (const Contact& contact : contacts) {
    EXPECT_LE(contact.lower, contact.upper);
    EXPECT_LE(contact.upper - contact.lower, 10 * close.noise);
    EXPECT_TRUE(std::any_of(about.found.begin(), about.found.end(),
                            [&](const auto& pair) {
                              return std::abs(pair.lower - contact.lower) <= 10 * close.noise &&
                                     is_at_place(contact, pair,
                                                 1e3 * close.noise + 1e-3 * close.max_distance);
                            }))
        << "a contact at " << contact.lower << " is no pair of features";
  }
}

TEST(FindContacts, ConvexPolytopesHaveTheContactsOfAllTheirFeatures) {
  std::mt19937_64 random(28);
  for (int k = 0; k < 150; ++k) {
    SCOPED_TRACE(k);
    expect_every_contact(random_close_shapes(random));
    if (HasFailure()) return;
  }
}

TEST(FindContacts, BoxesHaveTheContactsOfAllTheirFeatures) {
  std::mt19937_64 random(30);
  for (int k = 0; k < 600; ++k) {
    SCOPED_TRACE(k);
    expect_every_contact(random_close_shapes(random, true));
    if (HasFailure()) return;
  }
}

// The trees of the surfaces give the same contacts as the search of near features.
TEST(FindContacts, ConvexPolytopesHaveTheContactsOfTheirSurfacesAsMeshes) {
  std::mt19937_64 random(29);
  for (int k = 0; k < 400; ++k) {
    SCOPED_TRACE(k);
    const CloseShapes close = random_close_shapes(random);
    const auto as_convex =
        find_contacts(*close.a, close.X_WA, *close.b, close.X_WB, close.max_distance);
    const auto as_meshes = find_contacts(*close.a->core_surface(), close.X_WA,
                                         *close.b->core_surface(), close.X_WB, close.max_distance);
    ASSERT_EQ(as_convex.size(), as_meshes.size());
    for (std::size_t i = 0; i < as_convex.size(); ++i) {
      ASSERT_NEAR(as_convex[i].lower, as_meshes[i].lower, 10 * close.noise);
    }
  }
}

TEST(FindContacts, SolidsThatOverlapHaveAContactWithoutAGap) {
  const Box box(Vector3(0.5, 0.4, 0.3));
  const ConvexHull hull(icosphere(1).vertices);
  const RigidPose X_WB(rotation_from_vector(Vector3(0.3, 0.2, 0.1)), Vector3(0.6, 0.1, 0.05));
  const std::array<const ConvexShape*, 2> shapes{&box, &hull};
  for (const ConvexShape* a : shapes) {
    for (const ConvexShape* b : shapes) {
      const auto contacts = find_contacts(*a, RigidPose(), *b, X_WB, 0.02);
      ASSERT_FALSE(contacts.empty());
      EXPECT_EQ(contacts.front().lower, 0);
      EXPECT_LT(contacts.front().upper, 1e-12);
    }
  }
}

TEST(FindContacts, CrossingTrianglesAreAContactWhereTheyCross) {
  // The tip of a pyramid far through the middle of a large plate: no corner or edge is near.
  const TriangleMesh plate({{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}, {{0, 1, 2}});
  const TriangleMesh blade({{0, 0, -2}, {1, 0, 2}, {-1, 0, 2}}, {{0, 1, 2}});
  const auto contacts = find_contacts(plate, RigidPose(), blade, RigidPose(), 0.01);
  ASSERT_FALSE(contacts.empty());
  for (const Contact& contact : contacts) {
    EXPECT_EQ(contact.lower, 0);
    EXPECT_LE(contact.upper, 1e-12);
    EXPECT_NEAR(contact.p_WCa.z(), 0, 1e-12);
    EXPECT_LE((contact.p_WCa - contact.p_WCb).norm(), 1e-12);
    EXPECT_EQ(contact.triangle_a, 0);
    EXPECT_EQ(contact.triangle_b, 0);
  }
}

}  // namespace
}  // namespace dyop::testing
