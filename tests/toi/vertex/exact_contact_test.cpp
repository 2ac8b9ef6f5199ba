// SPDX-License-Identifier: BSD-3-Clause
#include "toi/vertex/exact_contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "support/inputs/path_inputs.h"
#include "support/oracles/path_oracle.h"

namespace dyop::toi_internal {
namespace {

using testing::FourPaths;
using testing::PathKind;

VertexPath resting(double x, double y, double z) {
  return {{x, y, z}, {x, y, z}};
}

// Below the first: contact for the oracle. A coordinate moved by 2^-40 makes distances of its
// square and above, 8e-25; between the two limits nothing may lie.
constexpr double kContact = 1e-27;
constexpr double kApart = 1e-26;

struct Counts {
  int contacts = 0;
  int misses = 0;
};

template <typename Paths>
void compare(const Paths& paths, Counts& counts) {
  const double least = static_cast<double>(testing::least_path_distance(paths, 200));
  ASSERT_TRUE(least < kContact || least > kApart) << "the oracle cannot tell: " << least;
  const bool expected = least < kContact;
  EXPECT_EQ(has_contact(paths), expected) << "least distance " << least;
  ++(expected ? counts.contacts : counts.misses);
}

TEST(ExactContact, AgreesWithLeastDistanceIn113Bits) {
  std::mt19937_64 random(1);
  for (const PathKind kind : testing::kAllPathKinds) {
    Counts counts;
    for (int i = 0; i < 60; ++i) {
      const FourPaths paths = testing::make_paths(kind, random);
      SCOPED_TRACE("kind " + std::to_string(static_cast<int>(kind)) + " number " +
                   std::to_string(i));
      compare(testing::vertex_face(paths), counts);
      compare(testing::edge_edge(paths), counts);
    }
    EXPECT_GE(counts.misses, 4) << static_cast<int>(kind);
    EXPECT_GE(counts.contacts, kind == PathKind::Slow ? 0 : 4) << static_cast<int>(kind);
  }
}

TEST(ExactContact, IsUnchangedByPowersOfTwoAndWholeOffsets) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 300; ++i) {
    const FourPaths paths = testing::make_paths(PathKind::SmallWhole, random);
    for (const double scale : {0x1p-200, 0x1p-14, 0x1p14, 0x1p190}) {
      // Exact: small integers, moved by less than 2^50 units.
      const Vector3 offset = scale * 0x1p30 * Vector3(1, -1, 1);
      const FourPaths moved = testing::placed(paths, scale, offset);
      EXPECT_EQ(has_contact(testing::vertex_face(moved)), has_contact(testing::vertex_face(paths)));
      EXPECT_EQ(has_contact(testing::edge_edge(moved)), has_contact(testing::edge_edge(paths)));
    }
  }
}

TEST(ExactContact, DoesNotDependOnTheOrderOfPoints) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 400; ++i) {
    const FourPaths p =
        testing::make_paths(i % 2 == 0 ? PathKind::SmallWhole : PathKind::Coplanar, random);
    const bool face = has_contact(VertexFacePaths{p[0], {p[1], p[2], p[3]}});
    EXPECT_EQ(has_contact(VertexFacePaths{p[0], {p[3], p[2], p[1]}}), face);
    EXPECT_EQ(has_contact(VertexFacePaths{p[0], {p[2], p[3], p[1]}}), face);
    const bool edges = has_contact(EdgeEdgePaths{{p[0], p[1]}, {p[2], p[3]}});
    EXPECT_EQ(has_contact(EdgeEdgePaths{{p[1], p[0]}, {p[2], p[3]}}), edges);
    EXPECT_EQ(has_contact(EdgeEdgePaths{{p[3], p[2]}, {p[0], p[1]}}), edges);
  }
}

TEST(ExactContact, SeesATouchAtOneInstantOnly) {
  // The vertex is at the height 1 - 2 s above a face that rests in the plane z = 0.
  const std::array<VertexPath, 3> face{resting(-1, -1, 0), resting(2, -1, 0), resting(-1, 2, 0)};
  EXPECT_TRUE(has_contact(VertexFacePaths{{{0, 0, 1}, {0, 0, -1}}, face}));
  EXPECT_TRUE(has_contact(VertexFacePaths{{{0, 0, 1}, {0, 0, 0}}, face})) << "at the end";
  EXPECT_TRUE(has_contact(VertexFacePaths{{{0, 0, 0}, {0, 0, 1}}, face})) << "at the start";
  const double above = std::nextafter(0.0, 1.0);
  EXPECT_FALSE(has_contact(VertexFacePaths{{{0, 0, 1}, {0, 0, above}}, face}));
  // Through the border x + y = 1, and by the least number beside it.
  EXPECT_TRUE(has_contact(VertexFacePaths{{{0.5, 0.5, 1}, {0.5, 0.5, -1}}, face}));
  const double beside = std::nextafter(0.5, 1.0);
  EXPECT_FALSE(has_contact(VertexFacePaths{{{0.5, beside, 1}, {0.5, beside, -1}}, face}));
}

TEST(ExactContact, SeesAGrazingDoubleRoot) {
  // With x = 2 s - 1, B runs from (0, x - 1/2, 3/2 x - 1/2 + h) along (0, 1, 1 - x); A rests on the
  // axis of x. The determinant of both directions and the offset is then 2 (x^2 + h): for h = 0 B
  // grazes A at s = 1/2, in its middle, and for h > 0 it never does.
  const std::array<VertexPath, 2> a{resting(-1, 0, 0), resting(1, 0, 0)};
  const auto edge_b = [](double h) {
    return std::array<VertexPath, 2>{VertexPath{{0, -1.5, -2 + h}, {0, 0.5, 1 + h}},
                                     VertexPath{{0, -0.5, h}, {0, 1.5, 1 + h}}};
  };
  EXPECT_TRUE(has_contact(EdgeEdgePaths{a, edge_b(0)}));
  EXPECT_FALSE(has_contact(EdgeEdgePaths{a, edge_b(0x1p-50)}));
  EXPECT_TRUE(has_contact(EdgeEdgePaths{a, edge_b(-0x1p-50)}));
}

TEST(ExactContact, SeesContactOfPairsThatStayInOnePlane) {
  const std::array<VertexPath, 2> a{resting(-1, 0, 0), resting(1, 0, 0)};
  // An end of B passes through A, and then beside it.
  EXPECT_TRUE(has_contact(
      EdgeEdgePaths{a, {VertexPath{{0, -1, 0}, {0, 1, 0}}, VertexPath{{0, -2, 0}, {0, -1, 0}}}}));
  EXPECT_FALSE(has_contact(EdgeEdgePaths{
      a, {VertexPath{{1.5, -1, 0}, {1.5, 1, 0}}, VertexPath{{3, -2, 0}, {3, -1, 0}}}}));
  // On one line: B slides along A's line until it meets the end.
  EXPECT_TRUE(has_contact(
      EdgeEdgePaths{a, {VertexPath{{3, 0, 0}, {1, 0, 0}}, VertexPath{{4, 0, 0}, {5, 0, 0}}}}));
  const double beyond = std::nextafter(1.0, 2.0);
  EXPECT_FALSE(has_contact(
      EdgeEdgePaths{a, {VertexPath{{3, 0, 0}, {beyond, 0, 0}}, VertexPath{{4, 0, 0}, {5, 0, 0}}}}));
}

TEST(ExactContact, SeesAPointThatPassesAPoint) {
  // Both "edges" are points; they meet at s = 1/2 in (0, 0, 0), or miss by the least number.
  const auto point = [](const Vector3& begin, const Vector3& end) {
    return std::array<VertexPath, 2>{VertexPath{begin, end}, VertexPath{begin, end}};
  };
  const std::array<VertexPath, 2> a = point({-1, 0, 0}, {1, 0, 0});
  EXPECT_TRUE(has_contact(EdgeEdgePaths{a, point({0, -3, 0}, {0, 3, 0})}));
  const double beside = std::numeric_limits<double>::denorm_min();
  EXPECT_FALSE(has_contact(EdgeEdgePaths{a, point({0, -3, beside}, {0, 3, 0})}));
}

TEST(ExactContact, TakesTheWidestRangeOfNumbers) {
  const double tiny = std::numeric_limits<double>::denorm_min();
  const std::array<VertexPath, 3> face{resting(-1e60, -1e60, 0), resting(1e60, -1e60, tiny),
                                       resting(0, 1e60, 0)};
  EXPECT_TRUE(has_contact(VertexFacePaths{{{0, 0, 1e60}, {1e-300, tiny, -tiny}}, face}));
  EXPECT_FALSE(has_contact(VertexFacePaths{{{0, 0, 1e60}, {1e-300, tiny, tiny}}, face}));
}

}  // namespace
}  // namespace dyop::toi_internal
