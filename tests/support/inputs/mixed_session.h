// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "dyop/core/error.h"
#include "support/inputs/haptic_runs.h"

/// Sessions that are given everything that a session may be given, at random.
namespace dyop::testing {

/// As scene_of_two() or its first tool alone, over a region that pushes back and deforms.
inline HapticScene mixed_scene(std::size_t tools) {
  HapticScene scene = tools > 1 ? scene_of_two() : heaving_scene();
  MeshArrays low = sheet(30, 6);
  for (Vector3& p : low.vertices) p.z() -= 0.5;
  ToolObstacle soft = deforming_tissue(low);
  soft.role = ObstacleRole::SoftRegion;
  soft.soft_stiffness = 0.2;
  soft.margin = 1.5;
  scene.obstacles.push_back(soft);
  return scene;
}

/// Gives tissue at random: from one thread.
class TissueGiver {
 public:
  TissueGiver(HapticSession& session, std::uint64_t seed)
      : session_(session), random_(seed), tissue_(session.scene().obstacles[0]) {}

  int retargets() const { return retargets_; }
  int meshes() const { return meshes_; }

  void give() {
    const int what = number(0, 19);
    if (what == 0) {
      give_mesh();
    } else if (what <= 7) {
      session_.give_snapshot(0, shape(), duration());
    } else if (what <= 15) {
      constexpr std::array<Scalar, 4> kLeads{0, 3e-4, 2e-3, 2e-2};
      retargets_ += session_.retarget(0, shape(), duration(), kLeads[std::size_t(number(0, 3))]);
    } else if (what <= 18) {
      give_region();
    } else {
      ask_amiss();
    }
  }

 private:
  int number(int first, int last) { return std::uniform_int_distribution(first, last)(random_); }
  Scalar duration() { return 1e-3 * number(1, 30); }

  // Where the tool pushes it up, it may be a hill.
  std::vector<Vector3> shape() {
    const Scalar height = 1e-2 * number(-100, 100), phase = 0.1 * number(0, 60);
    std::vector<Vector3> vertices = tissue_.vertices;
    for (Vector3& p : vertices) p.z() += height * std::sin(phase + 0.2 * p.x() + 0.1 * p.y());
    return vertices;
  }

  void give_mesh() {
    std::vector<TriangleIndices> triangles = tissue_.triangles;
    const auto first = std::size_t(number(0, int(triangles.size() / 3)));
    triangles.erase(triangles.begin(), triangles.begin() + std::ptrdiff_t(first));
    std::vector<Vector3> vertices = shape();
    vertices.push_back(Vector3(0, 0, -1));  // of no triangle
    if (!session_.give_mesh(0, vertices, triangles)) return;
    tissue_.vertices = vertices;
    tissue_.triangles = triangles;
    ++meshes_;
  }

  void give_region() {
    std::vector<Vector3> vertices = session_.scene().obstacles[2].vertices;
    const Scalar height = 1e-2 * number(-50, 50);
    for (Vector3& p : vertices) p.z() += height;
    session_.give_snapshot(2, vertices, duration());
  }

  // Refused: nothing has been given then.
  void ask_amiss() {
    const std::vector<Vector3> few(3, Vector3::Zero());
    const auto is_refused = [](const auto& ask) {
      try {
        return !ask();
      } catch (const InvalidArgument&) {
        return true;
      }
    };
    const bool all = is_refused([&] { return session_.retarget(0, few, 1e-3); }) &&
                     is_refused([&] { return session_.give_snapshot(0, few, 1e-3); }) &&
                     is_refused([&] { return session_.retarget(0, shape(), std::nan("")); }) &&
                     is_refused([&] { return session_.retarget(2, shape(), 1e-3); }) &&
                     is_refused([&] { return session_.give_mesh(0, few, {}); });
    if (!all) throw InternalError("a session took what it must refuse");
  }

  HapticSession& session_;
  std::mt19937_64 random_;
  ToolObstacle tissue_;
  int retargets_ = 0;
  int meshes_ = 0;
};

/// What the thread of ticks does: devices that wander and fail, other springs, tools put elsewhere.
class HandsAtRandom {
 public:
  HandsAtRandom(HapticSession& session, std::uint64_t seed) : session_(session), random_(seed) {
    for (const HapticTool& tool : session.scene().tools()) poses_.push_back(tool.start());
  }

  int resets() const { return resets_; }
  int couplings() const { return couplings_; }

  /// Runs a tick, and what comes before it.
  TickRecord tick(std::int64_t number) {
    if (chance(60)) set_coupling();
    if (chance(150)) reset();
    std::vector<DevicePose> devices;
    for (ToolPose& pose : poses_) devices.push_back(next_device(pose));
    constexpr std::array<Scalar, 4> kOddTimes{0, -1, 5e-3, std::numeric_limits<Scalar>::infinity()};
    const Scalar dt = chance(40) ? kOddTimes[random_() % kOddTimes.size()] : 1e-3;
    std::optional<TickCutoff> cutoff;
    if (chance(15)) cutoff = TickCutoff{1 + std::int64_t(random_() % 20), 0};
    const auto ticks = session_.replay(devices, dt, cutoff);
    TickRecord record{number, devices[0], dt, ticks[0], {}};
    for (std::size_t k = 1; k < ticks.size(); ++k) record.others.push_back({devices[k], ticks[k]});
    return record;
  }

 private:
  bool chance(unsigned in) { return random_() % in == 0; }
  Scalar real(Scalar low, Scalar high) {
    return std::uniform_real_distribution<Scalar>(low, high)(random_);
  }

  DevicePose next_device(ToolPose& pose) {
    const Vector3& p = pose.X_WT.translation();
    const Vector3 step(real(-0.05, 0.05), real(-0.05, 0.05), real(-0.09, 0.06));
    const Vector3 next = (p + step).cwiseMin(Vector3(7, 7, 6)).cwiseMax(Vector3(-9, -7, 0.5));
    pose.X_WT = RigidPose(pose.X_WT.quaternion(), next);
    DevicePose device(pose.X_WT);
    device.angles[0] = real(0, 0.3);
    if (chance(50)) device.p_WD.x() = std::nan("");
    return device;
  }

  void set_coupling() {
    CouplingOptions springs = haptic_options().coupling;
    springs.stiffness.setConstant(real(0.3, 4));
    springs.largest_force = chance(2) ? kInfinity : real(1, 5);
    springs.device_damping = chance(2) ? kInfinity : 0;
    session_.set_coupling(springs, random_() % poses_.size());
    ++couplings_;
  }

  void reset() {
    const std::size_t tool = random_() % poses_.size();
    const Scalar side = tool == 0 ? 0.3 : -6;
    poses_[tool].X_WT = RigidPose(rotation_from_vector(Vector3(0, 0, real(-1, 1))),
                                  Vector3(side + real(-0.5, 0.5), real(-1, 1), real(4.5, 6)));
    poses_[tool].angles[0] = real(0, 0.3);
    session_.reset(poses_[tool], tool);
    ++resets_;
  }

  HapticSession& session_;
  std::mt19937_64 random_;
  std::vector<ToolPose> poses_;
  int resets_ = 0;
  int couplings_ = 0;
};

}  // namespace dyop::testing
