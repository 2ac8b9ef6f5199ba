// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/adapters/mujoco_geoms.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <random>
#include <utility>

#include "dyop/distance/distance.h"
#include "support/inputs/mujoco_models.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using testing::Both;
using testing::MujocoDeleter;
using testing::RandomModel;

bool is_round(int type) {
  return type == mjGEOM_SPHERE || type == mjGEOM_CAPSULE;
}

// What MuJoCo computes in closed form.
bool is_exact(const mjModel& model, int geom1, int geom2) {
  const int a = std::min(model.geom_type[geom1], model.geom_type[geom2]);
  const int b = std::max(model.geom_type[geom1], model.geom_type[geom2]);
  return (a == mjGEOM_PLANE && is_round(b)) || (is_round(a) && is_round(b));
}

// The least distance of two geoms among the contacts, which MuJoCo lists within wide margins.
std::map<std::pair<int, int>, Scalar> contact_distances(const Both& both) {
  std::map<std::pair<int, int>, Scalar> least;
  for (int k = 0; k < both.data->ncon; ++k) {
    const mjContact& contact = both.data->contact[k];
    const auto [at, is_new] = least.try_emplace({contact.geom1, contact.geom2}, contact.dist);
    at->second = std::min(at->second, contact.dist);
  }
  return least;
}

TEST(MujocoGeoms, DistancesAreThoseOfMujocoInClosedForm) {
  const testing::TemporaryDirectory directory;
  int compared = 0;
  int overlapping = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Both both(directory.write("model.xml", RandomModel(seed).text()));
    std::mt19937_64 random(seed);
    both.move(random);
    const adapters::MujocoGeoms geoms(*both.model);
    for (const auto& [pair, expected] : contact_distances(both)) {
      if (!is_exact(*both.model, pair.first, pair.second)) continue;
      std::array<mjtNum, 6> fromto{};
      const Scalar found =
          geoms.signed_distance(*both.data, pair.first, pair.second, 1e3, fromto.data());
      const bool is_deep = expected < 0;
      EXPECT_NEAR(found, expected, is_deep ? 1e-4 : 1e-12) << seed;
      const Scalar length =
          (Vector3(fromto[3], fromto[4], fromto[5]) - Vector3(fromto[0], fromto[1], fromto[2]))
              .norm();
      EXPECT_NEAR(length, std::abs(expected), is_deep ? 1e-4 : 1e-12);
      ++compared;
      if (is_deep) ++overlapping;
    }
  }
  EXPECT_GT(compared, 500);
  EXPECT_GT(overlapping, 5);
}

// The same geometry on two ways: through the reader, and through MuJoCo's compiler, which keeps
// meshes in single precision.
TEST(MujocoGeoms, DistancesAreThoseOfTheReader) {
  const testing::TemporaryDirectory directory;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    Both both(directory.write("model.xml", RandomModel(seed).text()));
    std::mt19937_64 random(seed);
    both.move(random);
    const adapters::MujocoGeoms geoms(*both.model, adapters::MujocoGeoms::Meshes::Surfaces);
    std::map<std::pair<int, int>, Scalar> least;
    for (int a = 0; a < both.model->ngeom; ++a) {
      for (int b = a + 1; b < both.model->ngeom; ++b) {
        const bool is_visual =
            both.model->geom_rgba[4 * a + 3] == 0 || both.model->geom_rgba[4 * b + 3] == 0;
        if (is_visual) continue;
        const std::pair<int, int> bodies =
            std::minmax(both.model->geom_bodyid[a], both.model->geom_bodyid[b]);
        const auto at = least.try_emplace(bodies, kInfinity).first;
        at->second = std::min(at->second, geoms.distance(*both.data, a, b).upper);
      }
    }
    for (const KinematicChain::LinkPair& pair : both.robot.chain->self_pairs()) {
      const Link& a = both.robot.chain->links()[pair.first];
      const Link& b = both.robot.chain->links()[pair.second];
      if (as_half_space(*a.shape)) continue;  // a link of its own here, one geom of the world there
      const Scalar here =
          distance(*a.shape, both.poses[pair.first], *b.shape, both.poses[pair.second]).upper;
      const std::pair<int, int> bodies =
          std::minmax(both.body_of_link(pair.first), both.body_of_link(pair.second));
      const Scalar there = least.at(bodies);
      // The world has a floor besides its other geoms.
      if (bodies.first == 0) {
        EXPECT_LE(there, here + 1e-6);
      } else {
        EXPECT_NEAR(here, there, 1e-6);
      }
    }
  }
}

TEST(MujocoGeoms, ReadsHeightFieldsAndStopsAtTheLargestDistance) {
  const testing::TemporaryDirectory directory;
  const auto file = directory.write("model.xml", R"(<mujoco><asset>
      <hfield name="h" nrow="3" ncol="5" size="4 2 1 1"/></asset><worldbody>
      <geom type="hfield" hfield="h"/><body pos="1 1 3"><freejoint/><geom size=".5"/></body>
      </worldbody></mujoco>)");
  std::array<char, 1000> error{};
  const std::unique_ptr<mjModel, MujocoDeleter> model(
      mj_loadXML(file.c_str(), nullptr, error.data(), int(error.size())));
  ASSERT_TRUE(model) << error.data();
  for (int k = 0; k < 15; ++k) model->hfield_data[k] = 0.5F;
  const std::unique_ptr<mjData, MujocoDeleter> data(mj_makeData(model.get()));
  mj_kinematics(model.get(), data.get());
  const adapters::MujocoGeoms geoms(*model);
  std::array<mjtNum, 6> fromto{};
  EXPECT_NEAR(geoms.signed_distance(*data, 0, 1, 9, fromto.data()), 2, 1e-12);
  EXPECT_NEAR(fromto[2], 0.5, 1e-12);
  EXPECT_NEAR(fromto[5], 2.5, 1e-12);
  EXPECT_EQ(geoms.signed_distance(*data, 0, 1, 1, fromto.data()), 1);
  EXPECT_EQ(fromto[5], 0);
  EXPECT_THROW(geoms.signed_distance(*data, 0, 1, -1, nullptr), InvalidArgument);
  EXPECT_THROW(geoms.signed_distance(*data, 0, 2, 1, nullptr), InvalidArgument);
  data->qpos[2] = -0.25;  // wholly in the ground
  mj_kinematics(model.get(), data.get());
  EXPECT_EQ(geoms.signed_distance(*data, 0, 1, 9, nullptr), 0);
}

}  // namespace
}  // namespace dyop
