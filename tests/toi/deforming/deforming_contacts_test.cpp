// SPDX-License-Identifier: BSD-3-Clause

// What a deforming mesh is in contact with: sliding, all contacts, and queries that are resumed.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using testing::MeshArrays;

constexpr Scalar kSheetTolerance = 1e-6;  // literal: of sides of about one
constexpr Scalar kRise = 0.3;             // of everything, per unit of time
constexpr Scalar kWallSpeed = 0.2;        // against the body, which slides at speed one

// A flat sheet about z = 0, 3 by 2, of 12 by 8 cells: its inner vertices wander in its plane, by a
// third of a cell at most, each on a line of its own, and all of it rises.
struct Sheet {
  std::vector<Vector3> begin;
  std::vector<Vector3> end;
  std::vector<TriangleIndices> triangles;
};

Vector3 shaken(const Vector3& p, std::mt19937_64& random) {
  const bool is_inner = std::abs(p.x()) < 1.4 && std::abs(p.y()) < 0.9;
  const Vector3 by = testing::random_vector(0.08, random);
  return is_inner ? Vector3(p + Vector3(by.x(), by.y(), 0)) : p;
}

Sheet wandering_sheet(std::mt19937_64& random) {
  const MeshArrays plate = testing::plate_grid(3, 2, 12, 8);
  Sheet sheet;
  sheet.triangles = plate.triangles;
  for (const Vector3& p : plate.vertices) {
    sheet.begin.push_back(shaken(p, random));
    sheet.end.push_back(shaken(p, random) + Vector3(0, 0, kRise));
  }
  return sheet;
}

// A wall across the sheet at x = 1 that comes nearer.
void add_wall(Sheet& sheet) {
  const auto first = static_cast<std::int32_t>(sheet.begin.size());
  for (const Vector3& p : {Vector3(1, -1, -0.1), Vector3(1, 1, -0.1), Vector3(1, 0, 1)}) {
    sheet.begin.push_back(p);
    sheet.end.push_back(p + Vector3(-kWallSpeed, 0, kRise));
  }
  sheet.triangles.push_back({first, first + 1, first + 2});
}

DeformingMesh turned(const Sheet& sheet, const Matrix3& R) {
  const auto all = [&](std::vector<Vector3> places) {
    for (Vector3& p : places) p = R * p;
    return places;
  };
  return DeformingMesh(all(sheet.begin), all(sheet.end), sheet.triangles);
}

DeformingMesh drifting(const MeshArrays& arrays, const Vector3& by) {
  std::vector<Vector3> end = arrays.vertices;
  for (Vector3& p : end) p += by;
  return DeformingMesh(arrays.vertices, end, arrays.triangles);
}

// A box that slides along the sheet, `gap` tolerances above it, turned as a whole by R.
struct Slide {
  MeshArrays box = testing::box_mesh({0.2, 0.15, 0.1});
  Vector3 from;
  Vector3 velocity;
  Matrix3 R;

  Slide(Scalar gap, const Matrix3& rotation)
      : from(rotation * Vector3(-1, 0.05, 0.1 + gap * kSheetTolerance)),
        velocity(rotation * Vector3(1, 0, kRise)),
        R(rotation) {}

  ConstantTwistMotion motion() const {
    return ConstantTwistMotion(RigidPose(R, from), {velocity, Vector3::Zero()});
  }
  DeformingMesh deforming() const { return drifting(box.moved(R, from), velocity); }
};

ToiOptions with_tolerance() {
  ToiOptions options;
  options.distance_tolerance = kSheetTolerance;
  return options;
}

TEST(DeformingContacts, SlidingAlongASheetIsNoImpact) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 12; ++i) {
    const Matrix3 R =
        i == 0 ? Matrix3(Matrix3::Identity()) : testing::random_rotation(random).toRotationMatrix();
    const DeformingMesh sheet = turned(wandering_sheet(random), R);
    for (const Scalar gap : {0.3, 0.5, 0.6, 0.7, 0.9}) {
      SCOPED_TRACE(::testing::Message() << "turn " << i << ", gap " << gap);
      const Slide slide(gap, R);
      const ToiResult rigid =
          time_of_impact(sheet, slide.box.mesh(), slide.motion(), {0, 1}, with_tolerance());
      EXPECT_EQ(rigid.status, ToiStatus::Separated) << rigid.t_safe;
      const ToiResult deforming =
          time_of_impact(sheet, slide.deforming(), {0, 1}, with_tolerance());
      EXPECT_EQ(deforming.status, ToiStatus::Separated) << deforming.t_safe;
    }
  }
}

// The front of the box is at -0.8 + t, the wall at 1 - 0.2 t.
TEST(DeformingContacts, ABodyThatSlidesAlongASheetHitsTheWallOnItInTime) {
  std::mt19937_64 random(2);
  const Scalar closing = 1 + kWallSpeed;
  // Between a quarter, where the sheet may be the nearer one, and five eighths of the tolerance.
  const Scalar earliest = (1.8 - 0.625 * kSheetTolerance) / closing;
  const Scalar latest = (1.8 - 0.25 * kSheetTolerance) / closing;
  // literal: the interval ends after the impact; paths are twice as long.
  const TimeInterval interval{0, 2};
  for (int i = 0; i < 12; ++i) {
    const Matrix3 R = testing::random_rotation(random).toRotationMatrix();
    Sheet sheet = wandering_sheet(random);
    add_wall(sheet);
    for (std::size_t k = 0; k < sheet.end.size(); ++k) {
      const Vector3 path = sheet.end[k] - sheet.begin[k];
      sheet.end[k] = sheet.begin[k] +
                     Vector3(path.x() * (k + 3 < sheet.end.size() ? 1 : 2), path.y(), 2 * path.z());
    }
    const DeformingMesh a = turned(sheet, R);
    for (const Scalar gap : {0.3, 0.6, 0.9}) {
      SCOPED_TRACE(::testing::Message() << "turn " << i << ", gap " << gap);
      const Slide slide(gap, R);
      const ToiResult result =
          time_of_impact(a, slide.box.mesh(), slide.motion(), interval, with_tolerance());
      ASSERT_EQ(result.status, ToiStatus::Impact);
      EXPECT_GE(result.t_safe, earliest - 2 * result.rounding_allowance);
      EXPECT_LE(result.t_safe, latest + 2 * result.rounding_allowance);
      EXPECT_NEAR((result.contact->nhat_AB_W - R * Vector3(-1, 0, 0)).norm(), 0, 1e-9);
      EXPECT_NEAR(result.contact->closing_speed, closing, 1e-9);
      EXPECT_EQ(result.contact->triangle_a, static_cast<std::int32_t>(a.triangles().size()) - 1);
    }
  }
}

// A cube that lands flat has its four lower corners in contact, at least.
TEST(DeformingContacts, GathersAllContactsOfAnImpact) {
  std::mt19937_64 random(3);
  const DeformingMesh sheet = turned(wandering_sheet(random), Matrix3::Identity());
  ToiOptions options = with_tolerance();
  options.with_contacts = true;
  const MeshArrays cube = testing::box_mesh(Vector3::Constant(0.25));
  const ConstantTwistMotion falling(RigidPose(Vector3(0.1, 0, 1)),
                                    {Vector3(0, 0, -2), Vector3::Zero()});
  const DeformingMesh deforming =
      drifting(cube.moved(Matrix3::Identity(), {0.1, 0, 1}), {0, 0, -2});
  const TriangleMesh rigid = cube.mesh();
  for (const bool is_rigid : {true, false}) {
    const ToiResult result = is_rigid ? time_of_impact(sheet, rigid, falling, {0, 1}, options)
                                      : time_of_impact(sheet, deforming, {0, 1}, options);
    ASSERT_EQ(result.status, ToiStatus::Impact);
    EXPECT_NEAR(result.t_safe, 0.75 / (2 + kRise), 1e-5);
    const Scalar limit = result.contact->upper + kSheetTolerance + 2 * result.rounding_allowance;
    for (const Contact& contact : result.contacts) {
      EXPECT_LE(contact.lower, limit);
      EXPECT_NEAR(contact.p_WCa.z(), kRise * result.t_safe, 1e-9);
    }
    for (const Vector3& corner : cube.vertices) {
      if (corner.z() > 0) continue;
      const Vector3 p = corner + Vector3(0.1, 0, 1 - 2 * result.t_safe);
      const auto is_there = [&](const Contact& contact) {
        return (contact.p_WCb - p).norm() < 1e-5;
      };
      EXPECT_TRUE(std::any_of(result.contacts.begin(), result.contacts.end(), is_there));
    }
    options.with_contacts = false;
    EXPECT_TRUE(time_of_impact(sheet, rigid, falling, {0, 1}, options).contacts.empty());
    options.with_contacts = true;
  }
}

// Steps of a few node pairs, in all phases: also while a nearer pair than one in contact is sought.
TEST(DeformingContacts, AResumedQueryEndsAsAnUnlimitedOne) {
  std::mt19937_64 random(4);
  Sheet sheet = wandering_sheet(random);
  add_wall(sheet);
  const Matrix3 R = testing::random_rotation(random).toRotationMatrix();
  const DeformingMesh a = turned(sheet, R);
  const Slide slide(0.5, R);
  const TriangleMesh rigid = slide.box.mesh();
  const DeformingMesh deforming = slide.deforming();
  const ConstantTwistMotion motion = slide.motion();
  const TimeInterval interval{0, 1};
  const auto check = [&](const auto&... query) {
    const ToiResult whole = time_of_impact(query..., interval, with_tolerance());
    ToiWorkspace workspace;
    ToiOptions few = with_tolerance();
    few.max_node_pairs = 7;
    ToiResult result = time_of_impact(query..., interval, few, workspace);
    int parts = 1;
    for (; workspace.can_resume(); ++parts) {
      ASSERT_EQ(result.status, ToiStatus::BudgetExhausted);
      const Scalar before = result.t_safe;
      result = resume_time_of_impact(query..., interval, few, workspace);
      ASSERT_GE(result.t_safe, before);
    }
    EXPECT_GT(parts, 5);
    EXPECT_TRUE(testing::has_same_bits(result, whole));
    EXPECT_THROW(resume_time_of_impact(query..., interval, few, workspace), InvalidArgument);
  };
  check(a, deforming);
  check(a, rigid, motion);
}

}  // namespace
}  // namespace dyop
