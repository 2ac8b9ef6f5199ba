// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "dyop/core/error.h"
#include "dyop/tissue/soft_tissue.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/tissue_bars.h"
#include "support/message_of.h"
#include "support/oracles/difference_oracle.h"

namespace dyop {
namespace {

using testing::message_of;

constexpr Scalar kDensity = 2;

SoftTissueOptions options_to_cut(Scalar cube_edge) {
  SoftTissueOptions options;
  options.material = {3, 0.3, kDensity, 0, 0};
  options.cube_edge = cube_edge;
  options.period = 0.01;
  options.tolerance = 1e-8;
  options.most_iterations = 300;
  return options;
}

// 8 long, with a square section of 1, from the origin along the axes.
TriangleMesh bar() {
  const auto arrays = testing::divided_box({8, 1, 1}, {32, 4, 4});
  return TriangleMesh(arrays.vertices, arrays.triangles);
}

TriangleMesh surface_of(const SoftTissue& tissue) {
  return TriangleMesh({tissue.vertices().begin(), tissue.vertices().end()},
                      {tissue.triangles().begin(), tissue.triangles().end()});
}

TissueKerf kerf_at(const Vector3& middle, const Vector3& half_extents) {
  return {RigidPose(Quaternion::Identity(), middle), half_extents};
}

// Across the bar.
TissueKerf slice(Scalar x, Scalar width = 0.02) {
  return kerf_at({x, 0.5, 0.5}, {width / 2, 1, 1});
}

TissueKerf random_kerf(std::mt19937_64& random, Scalar size) {
  std::uniform_real_distribution<Scalar> share(0, 1);
  const Vector3 half(size * 0.01 * (0.2 + share(random)), size * (0.2 + share(random)),
                     size * (0.2 + share(random)));
  return {testing::random_pose(0.5 * size, random), half};
}

TEST(TissueCut, RefusesKerfsByName) {
  SoftTissue tissue(bar(), options_to_cut(0.25));
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  const auto message = [&](const TissueKerf& kerf) {
    return message_of<InvalidArgument>([&] { tissue.cut(kerf); });
  };
  const RigidPose X;
  EXPECT_NE(message({X, {1, 0, 1}}).find("TissueKerf: half_extents must be finite and > 0"),
            std::string::npos);
  EXPECT_NE(message({X, {1, nan, 1}}).find("half_extents"), std::string::npos);
  EXPECT_NE(message({X, {1, -1, 1}}).find("half_extents"), std::string::npos);
  EXPECT_NE(message({X, {1, kInfinity, 1}}).find("half_extents"), std::string::npos);
  EXPECT_EQ(tissue.triangles().size(), bar().triangles().size());
}

TEST(TissueCut, LeavesWhatItMissesOrHoldsAsItIs) {
  SoftTissue tissue(bar(), options_to_cut(0.25));
  const std::vector<Vector3> before(tissue.vertices().begin(), tissue.vertices().end());
  EXPECT_EQ(tissue.cut(kerf_at({4, 0.5, 3}, {1, 1, 1})).status, CutStatus::Missed);
  EXPECT_EQ(tissue.cut(kerf_at({4, 0.5, 0.5}, {9, 9, 9})).status, CutStatus::NothingLeft);
  EXPECT_TRUE(std::equal(before.begin(), before.end(), tissue.vertices().begin()));
}

// Kerfs in and between the planes of the lattice, and through vertices of the surface.
TEST(TissueCut, PartsABarInTwo) {
  for (const Scalar x : {4.0, 4.1, 4.125, 3.93}) {
    SoftTissue tissue(bar(), options_to_cut(0.25));
    const CutReport report = tissue.cut(slice(x));
    ASSERT_EQ(report.status, CutStatus::Cut);
    EXPECT_EQ(report.parts, 2u);
    const TriangleMesh surface = surface_of(tissue);
    EXPECT_TRUE(surface.is_closed());
    EXPECT_NEAR(surface.compute_mass_properties(1).mass, 8 - 0.02, 1e-6);
    EXPECT_NEAR(tissue.balance().mass, kDensity * (8 - 0.02), kDensity * 0.02);
  }
}

TEST(TissueCut, LetsTheHalvesOfABarFallAlike) {
  SoftTissueOptions options = options_to_cut(0.25);
  options.gravity_W = {0, 0, -9};
  SoftTissue tissue(bar(), options);
  ASSERT_EQ(tissue.cut(slice(4.1)).parts, 2u);
  const std::vector<Vector3> start(tissue.vertices().begin(), tissue.vertices().end());
  constexpr int kSteps = 20;
  for (int k = 0; k < kSteps; ++k) tissue.step();
  const Scalar way = 9 * 1e-4 * kSteps * (kSteps + 1) / 2;
  for (std::size_t k = 0; k < start.size(); ++k) {
    EXPECT_LE((tissue.vertices()[k] - start[k] + Vector3(0, 0, way)).norm(), 1e-7 * way);
  }
}

// What pulls at one half does not move the other at all.
TEST(TissueCut, JoinsNothingAcrossAThinKerf) {
  for (const Scalar x : {4.0, 4.1}) {
    SoftTissue tissue(bar(), options_to_cut(0.25));
    ASSERT_EQ(tissue.cut(slice(x, 1e-4)).parts, 2u);
    const std::vector<Vector3> start(tissue.vertices().begin(), tissue.vertices().end());
    std::int32_t at_left = -1;
    for (std::size_t t = 0; t < tissue.triangles().size(); ++t) {
      if (start[std::size_t(tissue.triangles()[t][0])].x() < 1) at_left = std::int32_t(t);
    }
    for (int k = 0; k < 20; ++k) {
      tissue.step(std::vector<SurfaceForce>{{at_left, {1, 0, 0}, {0.1, 0.2, 0.3}}});
    }
    Scalar left = 0, right = 0;
    for (std::size_t k = 0; k < start.size(); ++k) {
      Scalar& most = start[k].x() < x ? left : right;
      most = std::max(most, (tissue.vertices()[k] - start[k]).norm());
    }
    EXPECT_GT(left, 1e-3);
    EXPECT_LE(right, 1e-12);
  }
}

TEST(TissueCut, KeepsVelocitiesAndMomentum) {
  const Vector3 v(0.3, -0.2, 0.1), w(0.1, 0.5, -0.3);
  SoftTissue tissue(bar(), options_to_cut(0.25));
  tissue.set_velocity(v, Vector3::Zero());
  ASSERT_EQ(tissue.cut(slice(4.1)).parts, 2u);
  EXPECT_LE((tissue.balance().momentum_W - tissue.balance().mass * v).norm(), 1e-12);
  tissue.set_velocity(v, w);
  const TissueBalance before = tissue.balance();
  for (int k = 0; k < 50; ++k) tissue.step();
  EXPECT_LE((tissue.balance().momentum_W - before.momentum_W).norm(),
            1e-11 * before.momentum_W.norm());
  EXPECT_LE(tissue.balance().energy(), before.energy() * (1 + 1e-12));
}

// The same of three, of which the blade takes two.
TEST(TissueCut, KeepsTheMomentumOfWhatIsLeft) {
  std::mt19937_64 random(3);
  SoftTissue tissue(bar(), options_to_cut(0.25));
  for (int k = 0; k < 6; ++k) {
    tissue.cut({testing::random_pose(1, random) * RigidPose(Quaternion::Identity(), {1, 0, 0}),
                {0.05, 1, 1}});
    const Vector3 v = testing::random_vector(1, random);
    tissue.set_velocity(v, Vector3::Zero());
    tissue.cut(
        {RigidPose(testing::random_rotation(random), {4 + 0.5 * k, 0.5, 0.5}), {0.05, 0.3, 0.4}});
    EXPECT_LE((tissue.balance().momentum_W - tissue.balance().mass * v).norm(), 1e-12);
  }
}

// Of a bar that is held at x = 0 and pulled down at its other end.
Scalar tip_deflection(const std::vector<TissueKerf>& kerfs, const TriangleMesh& mesh = bar()) {
  SoftTissueOptions options = options_to_cut(0.125);
  options.fixed = {AlignedBox(Vector3(-1, -1, -1), Vector3(0.01, 2, 2))};
  options.period = 300;  // inertia counts nothing
  SoftTissue tissue(mesh, options);
  for (const TissueKerf& kerf : kerfs) EXPECT_EQ(tissue.cut(kerf).status, CutStatus::Cut);
  // Evenly over the end, by area.
  std::vector<SurfaceForce> forces;
  Scalar area = 0;
  const auto at = [&](const TriangleIndices& t, std::size_t k) {
    return tissue.vertices()[std::size_t(t[k])];
  };
  for (std::size_t k = 0; k < tissue.triangles().size(); ++k) {
    const TriangleIndices& t = tissue.triangles()[k];
    if (std::min({at(t, 0).x(), at(t, 1).x(), at(t, 2).x()}) < 8 - 1e-9) continue;
    const Scalar part = (at(t, 1) - at(t, 0)).cross(at(t, 2) - at(t, 0)).norm() / 2;
    forces.push_back({std::int32_t(k), Vector3::Constant(1.0 / 3), {0, 0, -1e-7 * part}});
    area += part;
  }
  for (SurfaceForce& force : forces) force.force_W /= area;
  for (int k = 0; k < 6; ++k) {
    tissue.step(forces);
    tissue.set_velocity(Vector3::Zero(), Vector3::Zero());
  }
  Scalar lowest = 0;
  for (const Vector3& p : tissue.vertices()) lowest = std::min(lowest, p.z());
  return -lowest;
}

// Split along its length by a slit a cantilever is two beams, each with its part of the load. The
// lower one, of height z, sinks by 1 / z^2 of what the whole did; shear, 1 % here, stays.
TEST(TissueCut, MakesTwoBeamsOfOne) {
  const Scalar whole = tip_deflection({});
  EXPECT_NEAR(whole, 1e-7 * 512 / (3 * 3.0 / 12), 0.04 * whole);
  for (const Scalar z : {0.5, 0.55}) {
    const TissueKerf slit = kerf_at({4, 0.5, z}, {5, 1, 0.001});
    EXPECT_NEAR(tip_deflection({slit}) / whole, 1 / (z * z), 0.02 / (z * z)) << z;
  }
}

// A crack of half the height h turns a beam there by 3.42 (1 - nu^2) h M / (E I) [Tada2000]. At 3.97
// from the load that lets the end sink by 49 F / (E I) more than the beam itself: 512 / 3.
TEST(TissueCut, MakesABarAsSoftAsACrackDoes) {
  const TissueKerf kerf = kerf_at({4.03, 0.5, 1}, {0.001, 1, 0.5});
  EXPECT_NEAR(tip_deflection({kerf}) / tip_deflection({}), 1.287, 0.03);
}

// A slot that takes whole cubes is like one that was there from the start.
TEST(TissueCut, MakesTheSameLatticeAsAMeshWithTheSlot) {
  const TissueKerf kerf = kerf_at({4, 0.5, 1}, {0.125, 1, 0.5});
  SoftTissue tissue(bar(), options_to_cut(0.125));
  ASSERT_EQ(tissue.cut(kerf).status, CutStatus::Cut);
  const Scalar cut = tip_deflection({kerf});
  EXPECT_NEAR(tip_deflection({}, surface_of(tissue)), cut, 1e-3 * cut);
}

SoftTissue sagging_ball(Scalar cube) {
  SoftTissueOptions options = options_to_cut(cube);
  options.gravity_W = {0, 0, -0.5};
  options.fixed = {AlignedBox(Vector3(-1, -1, -1.2), Vector3(1, 1, -0.7))};
  const testing::MeshArrays arrays = testing::icosphere(3);
  SoftTissue tissue(TriangleMesh(arrays.vertices, arrays.triangles), options);
  for (int k = 0; k < 30; ++k) tissue.step();
  return tissue;
}

// In the present shape the surface is the old one less the kerf.
TEST(TissueCut, IsWhereTheBladeIs) {
  std::mt19937_64 random(5);
  for (int k = 0; k < 10; ++k) {
    SoftTissue tissue = sagging_ball(0.3);
    const TriangleMesh before = surface_of(tissue);
    const TissueKerf kerf = random_kerf(random, 1);
    const CutStatus status = tissue.cut(kerf).status;
    ASSERT_NE(status, CutStatus::Unclear);
    const TriangleMesh after = surface_of(tissue);
    EXPECT_TRUE(after.is_closed());
    EXPECT_NEAR(after.compute_mass_properties(1).mass,
                testing::oracle_volume_less_box(before, kerf.X_WK, kerf.half_extents), 1e-3);
    for (const Vector3& p : tissue.vertices()) EXPECT_FALSE((p - p).hasNaN());
  }
}

// One after the other, through each other, while the body moves.
// A ball of radius 20 on its lowest part.
SoftTissue soft_ball(const Vector3& gravity_W) {
  SoftTissueOptions options = options_to_cut(4);
  options.material = {3, 0.45, 1e-6, 2, 0};
  options.tolerance = 1e-2;
  options.gravity_W = gravity_W;
  options.fixed = {AlignedBox(Vector3(-30, -30, -30), Vector3(30, 30, -14))};
  auto arrays = testing::icosphere(2);
  for (Vector3& p : arrays.vertices) p *= 20;
  return SoftTissue(arrays.mesh(), options);
}

TissueKerf blade_in_ball(std::mt19937_64& random) {
  std::uniform_real_distribution<Scalar> share(0, 1);
  const Vector3 half(0.05 + 0.1 * share(random), 4 + 16 * share(random), 4 + 16 * share(random));
  return {testing::random_pose(8, random), half};
}

Scalar longest_edge(const SoftTissue& tissue) {
  Scalar longest = 0;
  for (const TriangleIndices& t : tissue.triangles()) {
    const auto at = [&](std::size_t k) { return tissue.vertices()[std::size_t(t[k])]; };
    longest = std::max({longest, (at(0) - at(1)).norm(), (at(1) - at(2)).norm()});
  }
  return longest;
}

TEST(TissueCut, CrossesEarlierCuts) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 25; ++k) {
    SoftTissue tissue = soft_ball(Vector3::Zero());
    ASSERT_EQ(tissue.cut(blade_in_ball(random)).status, CutStatus::Cut) << k;
    ASSERT_EQ(tissue.cut(blade_in_ball(random)).status, CutStatus::Cut) << k;
    EXPECT_TRUE(surface_of(tissue).is_closed()) << k;
  }
}

// Cut to pieces that hang over each other: tissue does not meet itself.
TEST(TissueCut, CutsWhatLiesOverItself) {
  std::mt19937_64 random(4);
  int refused = 0;
  constexpr int kBalls = 10;
  constexpr int kCuts = 4;
  for (int k = 0; k < kBalls; ++k) {
    SoftTissue tissue = soft_ball({0, 0, -9810});
    for (int cut = 0; cut < kCuts; ++cut) {
      for (int step = 0; step < 10; ++step) tissue.step();
      refused += tissue.cut(blade_in_ball(random)).status == CutStatus::Unclear;
      ASSERT_TRUE(surface_of(tissue).is_closed()) << k;
    }
    for (int step = 0; step < 20; ++step) tissue.step();
    EXPECT_LT(longest_edge(tissue), 20) << k;
  }
  EXPECT_LE(refused, kBalls * kCuts / 20);
}

TEST(TissueCut, CreatesNoEnergyAndKeepsItsMass) {
  std::mt19937_64 random(7);
  int cuts = 0;
  for (int run = 0; run < 5; ++run) {
    SoftTissue tissue = sagging_ball(0.25);
    for (int k = 0; k < 8; ++k) {
      const TissueBalance before = tissue.balance();
      const CutReport report = tissue.cut(random_kerf(random, 1));
      const TissueBalance after = tissue.balance();
      EXPECT_LE(after.elastic_energy, before.elastic_energy * (1 + 1e-12));
      EXPECT_LE(after.kinetic_energy, before.kinetic_energy * (1 + 1e-12));
      EXPECT_LE(after.mass, before.mass);
      cuts += report.status == CutStatus::Cut;
      const TriangleMesh surface = surface_of(tissue);
      EXPECT_TRUE(surface.is_closed());
      Scalar energy = after.energy();
      for (int step = 0; step < 5; ++step) {
        tissue.step();
        EXPECT_LE(tissue.balance().energy(), energy + 1e-12);
        energy = tissue.balance().energy();
      }
    }
  }
  EXPECT_GE(cuts, 20);
}

}  // namespace
}  // namespace dyop
