// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>

#include "dyop/distance/distance.h"
#include "dyop/io/file_error.h"
#include "dyop/io/recording.h"
#include "dyop/view/run_files.h"
#include "io/record/recorded_world.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

// A glTF file, read by the definition of the format: what a viewer draws.
class GltfScene {
 public:
  explicit GltfScene(const std::filesystem::path& file) {
    std::string error;
    std::string warning;
    EXPECT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromFile(&model_, &error, &warning, file.string()));
    EXPECT_EQ(error + warning, "");
  }

  const tinygltf::Model& model() const { return model_; }

  std::vector<float> numbers(int accessor) const {
    const tinygltf::Accessor& a = model_.accessors[std::size_t(accessor)];
    const tinygltf::BufferView& view = model_.bufferViews[std::size_t(a.bufferView)];
    std::vector<float> result(a.count *
                              std::size_t(tinygltf::GetNumComponentsInType(std::uint32_t(a.type))));
    std::memcpy(result.data(), model_.buffers[0].data.data() + view.byteOffset + a.byteOffset,
                result.size() * sizeof(float));
    return result;
  }

  // The node's own value, or that of its channel at t: glTF 2.0, appendix C.
  std::vector<double> value(int node, const std::string& path, std::vector<double> own,
                            double t) const {
    if (model_.animations.empty()) return own;
    for (const tinygltf::AnimationChannel& channel : model_.animations[0].channels) {
      if (channel.target_node != node || channel.target_path != path) continue;
      const auto& sampler = model_.animations[0].samplers[std::size_t(channel.sampler)];
      const std::vector<float> times = numbers(sampler.input);
      const std::vector<float> rows = numbers(sampler.output);
      const std::size_t width = own.size();
      const bool is_cubic = sampler.interpolation == "CUBICSPLINE";
      const auto at = [&](std::size_t key, std::size_t part, std::size_t k) {
        return double(rows[((is_cubic ? 3 * key + part : key)) * width + k]);
      };
      std::size_t key = 0;
      while (key + 2 < times.size() && double(times[key + 1]) <= t) ++key;
      const double h = double(times[key + 1]) - double(times[key]);
      const double s = std::clamp((t - double(times[key])) / h, 0.0, 1.0);
      for (std::size_t k = 0; k < width; ++k) {
        if (!is_cubic) {
          own[k] = at(t >= double(times[key + 1]) ? key + 1 : key, 0, k);
          continue;
        }
        own[k] = (2 * s * s * s - 3 * s * s + 1) * at(key, 1, k) +
                 h * (s * s * s - 2 * s * s + s) * at(key, 2, k) +
                 (-2 * s * s * s + 3 * s * s) * at(key + 1, 1, k) +
                 h * (s * s * s - s * s) * at(key + 1, 0, k);
      }
    }
    return own;
  }

  RigidPose pose(const std::string& name, double t) const {
    for (std::size_t k = 0; k < model_.nodes.size(); ++k) {
      if (model_.nodes[k].name != name) continue;
      const auto p = value(int(k), "translation", model_.nodes[k].translation, t);
      const auto q = value(int(k), "rotation", model_.nodes[k].rotation, t);
      return RigidPose(Quaternion(q[3], q[0], q[1], q[2]).normalized(), Vector3(p[0], p[1], p[2]));
    }
    ADD_FAILURE() << "no node " << name;
    return {};
  }

 private:
  tinygltf::Model model_;
};

class Gltf : public ::testing::Test {
 protected:
  Gltf() {
    testing::record_busy_run(recording_);
    write_gltf(recording_, file_);
  }
  testing::TemporaryDirectory directory_;
  std::filesystem::path recording_ = directory_.path() / "run.h5";
  std::filesystem::path file_ = directory_.path() / "run.glb";
};

// Names of the busy world's bodies are unique but for the cubes.
constexpr std::array kBodies{std::pair{3, "thrown"}, std::pair{4, "spinning"},
                             std::pair{5, "drawn"}, std::pair{6, "drill"}};

TEST_F(Gltf, FollowsTheRun) {
  const RecordingReader reader(recording_);
  const GltfScene scene(file_);
  for (const auto& [slot, name] : kBodies) {
    const BodyId body{std::size_t(slot)};
    const Scalar radius =
        reader.shapes()[reader.bodies()[body.slot].shape].shape->bounding_radius();
    for (int k = 0; k <= 2000; ++k) {
      const Scalar t = 2.0 * k / 2000;
      const RigidPose expected = reader.pose(body, t);
      const RigidPose drawn = scene.pose(name, t);
      // The tolerance, on the smallest radius (0.3), and single precision of some 10 metres, also
      // of the time.
      const Scalar error = (drawn.translation() - expected.translation()).norm() +
                           radius * (drawn.rotation() - expected.rotation()).norm();
      ASSERT_LT(error, 0.3e-4 + 2e-5) << name << " at " << t;
    }
  }
}

TEST_F(Gltf, KinksWhereTheRunDoes) {
  const RecordingReader reader(recording_);
  const GltfScene scene(file_);
  int kinks = 0;
  for (const ImpactEvent& impact : reader.impacts()) {
    if (impact.b != BodyId(3) && impact.a != BodyId(3)) continue;
    constexpr Scalar kNear = 1e-3;
    if (impact.t + kNear > 2) continue;
    const auto speed = [&](Scalar t) {
      return Vector3((scene.pose("thrown", t + kNear / 4).translation() -
                      scene.pose("thrown", t - kNear / 4).translation()) /
                     (kNear / 2));
    };
    const Vector3 jump = speed(impact.t + kNear / 2) - speed(impact.t - kNear / 2);
    const Vector3 expected = reader.state(BodyId(3), impact.t + kNear / 2).twist.v_WB -
                             reader.state(BodyId(3), impact.t - kNear / 2).twist.v_WB;
    EXPECT_LT((jump - expected).norm(), 0.02 + 0.02 * expected.norm());
    kinks += expected.norm() > 1;
  }
  EXPECT_GT(kinks, 0);
}

TEST_F(Gltf, DrawsNoPenetrationThatIsNotInTheRun) {
  const RecordingReader reader(recording_);
  const GltfScene scene(file_);
  const Shape& ball = *reader.shapes()[reader.bodies()[3].shape].shape;
  const Shape& floor = *reader.shapes()[reader.bodies()[0].shape].shape;
  for (int k = 0; k <= 4000; ++k) {
    const Scalar t = 2.0 * k / 4000;
    const Scalar gap = distance(ball, scene.pose("thrown", t), floor, scene.pose("floor", t)).upper;
    // Resting bodies keep 5e-4 of their radius.
    EXPECT_GT(gap, 0) << t;
  }
}

TEST_F(Gltf, HasTimesThatIncreaseAndRotationsOfOneSign) {
  const GltfScene scene(file_);
  ASSERT_EQ(scene.model().animations.size(), 1u);
  for (const tinygltf::AnimationChannel& channel : scene.model().animations[0].channels) {
    const auto& sampler = scene.model().animations[0].samplers[std::size_t(channel.sampler)];
    const std::vector<float> times = scene.numbers(sampler.input);
    for (std::size_t k = 1; k < times.size(); ++k) ASSERT_LT(times[k - 1], times[k]);
    if (channel.target_path != "rotation") continue;
    const std::vector<float> rows = scene.numbers(sampler.output);
    Eigen::Vector4f last = Eigen::Vector4f::Zero();
    for (std::size_t k = 0; k < times.size(); ++k) {
      const Eigen::Vector4f q = Eigen::Map<const Eigen::Vector4f>(rows.data() + 12 * k + 4);
      EXPECT_NEAR(double(q.norm()), 1, 1e-6);
      EXPECT_GE(q.dot(last), 0);
      last = q;
    }
  }
}

TEST_F(Gltf, LeavesOutWhatIsNotDrawn) {
  const GltfScene scene(file_);
  ASSERT_EQ(scene.model().nodes.size(), 8u);  // the root, and all bodies but the sensor
  for (const tinygltf::AnimationChannel& channel : scene.model().animations[0].channels) {
    EXPECT_NE(scene.model().nodes[std::size_t(channel.target_node)].name, "floor");
  }
}

TEST_F(Gltf, PassesTheValidator) {
  const std::filesystem::path modules = DYOP_PAGE_MODULES;
  const std::string node = DYOP_NODE;
  if (node.empty() || node.find("NOTFOUND") != std::string::npos ||
      !std::filesystem::exists(modules / "gltf-validator")) {
    GTEST_SKIP() << "runs with the npm package gltf-validator: bash .ci/install.sh page";
  }
  const std::string command =
      node + " " + DYOP_CHECK_GLTF + " " + modules.string() + " " + file_.string();
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST_F(Gltf, RefusesWhatItCannotUse) {
  GltfOptions options;
  options.tolerance = 0;
  EXPECT_THROW(write_gltf(recording_, file_, options), InvalidArgument);
  EXPECT_THROW(write_gltf(directory_.path() / "none.h5", file_), FileError);
  EXPECT_THROW(write_gltf(recording_, directory_.path() / "no" / "run.glb"), FileError);
}

}  // namespace
}  // namespace dyop
