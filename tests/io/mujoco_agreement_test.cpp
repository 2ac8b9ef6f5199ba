// SPDX-License-Identifier: BSD-3-Clause

// MuJoCo itself as a second opinion on the reader of its format.

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dyop/distance/ray_cast.h"
#include "dyop/io/robot_file.h"
#include "support/inputs/mujoco_models.h"
#include "support/inputs/random_inputs.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using testing::Both;
using testing::random_direction;
using testing::random_number;
using testing::RandomModel;

// MuJoCo keeps meshes in single precision, and counts visual ones.
void expect_same_masses(const Both& both) {
  const Robot& robot = both.robot;
  for (std::size_t link = 0; link < robot.masses.size(); ++link) {
    const std::string& name = robot.chain->links()[link].name;
    const int body = both.body(name);
    const std::string note = "the mass of '" + name + "' leaves out a mesh";
    if (body < 0 || std::count(robot.notes.begin(), robot.notes.end(), note) > 0) continue;
    const Scalar mass = both.model->body_mass[body];
    EXPECT_NEAR(robot.masses[link], mass, 1e-6 * mass) << name;
  }
}

void expect_same_poses(const Both& both) {
  for (std::size_t link = 0; link < both.poses.size(); ++link) {
    const int body = both.body(both.robot.chain->links()[link].name);
    if (body < 0) continue;
    const RigidPose& X_WL = both.poses[link];
    const mjtNum* p = both.data->xpos + 3 * body;
    const mjtNum* R = both.data->xmat + 9 * body;
    for (int row = 0; row < 3; ++row) {
      ASSERT_NEAR(X_WL.translation()[row], p[row], 1e-12) << both.robot.chain->links()[link].name;
      for (int column = 0; column < 3; ++column) {
        ASSERT_NEAR(X_WL.rotation()(row, column), R[3 * row + column], 1e-12);
      }
    }
  }
}

Scalar first_hit(const Both& both, const Vector3& origin, const Vector3& direction) {
  Scalar first = kInfinity;
  for (std::size_t link = 0; link < both.poses.size(); ++link) {
    const std::shared_ptr<const Shape>& shape = both.robot.chain->links()[link].shape;
    if (!shape) continue;
    const RayHit hit = ray_cast(*shape, both.poses[link], {origin, direction});
    if (hit.status != RayStatus::Miss) first = std::min(first, hit.distance);
  }
  return first;
}

// Rays from outside. MuJoCo keeps meshes in single precision, and either program may miss by
// rounding what the ray grazes: such rays are few.
void expect_same_shapes(const Both& both, std::mt19937_64& random) {
  int different = 0;
  constexpr int kRays = 40;
  for (int k = 0; k < kRays; ++k) {
    Vector3 origin = 30 * random_direction(random);
    origin.z() = std::abs(origin.z());  // above the floor
    const Vector3 target = 3 * random_number(0, 1, random) * random_direction(random);
    const Vector3 direction = (target - origin).normalized();
    int geom = -1;
    const mjtNum there = mj_ray(both.model.get(), both.data.get(), origin.data(), direction.data(),
                                nullptr, 1, -1, &geom);
    const Scalar here = first_hit(both, origin, direction);
    const bool agree = there < 0 ? here == kInfinity : std::abs(here - there) < 1e-5;
    if (!agree) ++different;
  }
  EXPECT_LE(different, 1);
}

// With margins as wide as the model, every pair that MuJoCo examines becomes a contact.
void expect_same_pairs(const Both& both) {
  using Pairs = std::set<std::pair<int, int>>;
  Pairs there;
  for (int k = 0; k < both.data->ncon; ++k) {
    const mjContact& contact = both.data->contact[k];
    there.insert(std::minmax(both.model->geom_bodyid[contact.geom1],
                             both.model->geom_bodyid[contact.geom2]));
  }
  Pairs here;
  for (const KinematicChain::LinkPair& pair : both.robot.chain->self_pairs()) {
    here.insert(std::minmax(both.body_of_link(pair.first), both.body_of_link(pair.second)));
  }
  EXPECT_EQ(here, there);
}

TEST(MujocoAgreement, HoldsForRandomModels) {
  const testing::TemporaryDirectory directory;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const auto file = directory.write("model.xml", RandomModel(seed).text());
    Both both(file);
    ASSERT_TRUE(both.data);
    expect_same_masses(both);
    std::mt19937_64 random(seed);
    for (int state = 0; state < 3; ++state) {
      both.move(random);
      expect_same_poses(both);
      expect_same_shapes(both, random);
      expect_same_pairs(both);
    }
    if (::testing::Test::HasFailure()) return;
  }
}

// Models with the compiler's ways to set masses. Meshes that are left out would change the total.
TEST(MujocoAgreement, MassesFollowTheCompiler) {
  const testing::TemporaryDirectory directory;
  const std::string from_geoms = "inertiafromgeom='true'";
  const std::string geom = "<geom type='sphere' size='.2' pos=";
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    std::string text = RandomModel(seed).text();
    for (std::size_t at = 0; (at = text.find(geom, at)) != std::string::npos;) {
      const std::string inertial = "<inertial pos='0 0 0' mass='" +
                                   std::to_string(random_number(0.1, 9, random)) +
                                   "' diaginertia='1 1 1'/>";
      text.insert(at, inertial);
      at += inertial.size() + geom.size();
    }
    const std::string source = seed % 3 == 0 ? "true" : seed % 3 == 1 ? "false" : "auto";
    text.replace(text.find(from_geoms), from_geoms.size(),
                 "inertiafromgeom='" + source + "' boundmass='2'" +
                     (seed % 2 == 0 ? " settotalmass='7'" : ""));
    const Both both(directory.write("model.xml", text));
    ASSERT_TRUE(both.data);
    if (both.robot.notes.empty()) {
      expect_same_masses(both);
      ++compared;
    }
  }
  EXPECT_GT(compared, 30);
}

std::string random_ground(std::mt19937_64& random) {
  const std::int32_t counts[] = {2 + std::int32_t(random() % 6), 2 + std::int32_t(random() % 6)};
  std::vector<float> heights;
  for (std::int32_t k = 0; k < counts[0] * counts[1]; ++k) {
    heights.push_back(float(random_number(-5, 5, random)));
  }
  std::string bytes(reinterpret_cast<const char*>(counts), sizeof(counts));
  return bytes.append(reinterpret_cast<const char*>(heights.data()),
                      heights.size() * sizeof(float));
}

// From above: MuJoCo 2.2 gives the sides of a grid that is not square wrong heights.
void expect_same_heights(const Both& both, const RigidPose& X_WG, std::mt19937_64& random) {
  for (int k = 0; k < 100; ++k) {
    const Vector3 p(random_number(-2.5, 2.5, random), random_number(-1.5, 1.5, random), 3);
    const Vector3 down(random_number(-0.1, 0.1, random), random_number(-0.1, 0.1, random), -1);
    const Vector3 origin = X_WG * p;
    const Vector3 direction = X_WG.rotation() * down.normalized();
    int geom = -1;
    const mjtNum there = mj_ray(both.model.get(), both.data.get(), origin.data(), direction.data(),
                                nullptr, 1, -1, &geom);
    // MuJoCo keeps heights in single precision.
    EXPECT_NEAR(first_hit(both, origin, direction), there, 1e-5) << p.transpose();
  }
}

TEST(MujocoAgreement, HoldsForHeightFields) {
  const testing::TemporaryDirectory directory;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    directory.write("ground.bin", random_ground(random));
    const auto file = directory.write("model.xml", R"(<mujoco model="ground"><asset>
        <hfield name="h" file="ground.bin" size="3 2 1.5 .5"/></asset><worldbody>
        <geom type="hfield" hfield="h" pos=".1 .2 .3" quat="1 .2 -.1 .7"/>
        <body name="b0" pos="0 0 40"><joint name="j0"/><geom size=".1"/></body>
        </worldbody></mujoco>)");
    Both both(file);
    ASSERT_TRUE(both.data);
    both.move(random);
    const RigidPose X_WG(Quaternion(1, 0.2, -0.1, 0.7).normalized(), Vector3(0.1, 0.2, 0.3));
    expect_same_heights(both, X_WG, random);
  }
}

}  // namespace
}  // namespace dyop
