// SPDX-License-Identifier: BSD-3-Clause

// The promise of the loop, judged by an oracle that samples the committed motions densely: whatever
// the device does, the tool never passes through tissue and never breaches a hard margin.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dyop/distance/distance.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/proxy_oracle.h"

namespace dyop {
namespace {

using testing::kMillisecond;
using testing::random_number;

// A rod with a head, some 12 long.
testing::MeshArrays rod() {
  auto head = testing::icosphere(1, 1.2);
  const auto shaft = testing::box_mesh({0.4, 0.4, 5}).moved(Matrix3::Identity(), {0, 0, 5.5});
  const auto offset = std::int32_t(head.vertices.size());
  head.vertices.insert(head.vertices.end(), shaft.vertices.begin(), shaft.vertices.end());
  for (TriangleIndices t : shaft.triangles) {
    for (std::int32_t& vertex : t) vertex += offset;
    head.triangles.push_back(t);
  }
  return head;
}

// A lumpy ball that breathes.
std::vector<Vector3> breath(const testing::MeshArrays& organ, Scalar phase) {
  std::vector<Vector3> vertices = organ.vertices;
  for (Vector3& p : vertices) {
    const Scalar lump = 1 + 0.1 * std::sin(p.x()) * std::cos(0.8 * p.y());
    p = p * lump * (1 + 0.08 * std::sin(phase)) + Vector3(0, 0, 0.6 * std::sin(phase + 1));
  }
  return vertices;
}

// A device that strokes, stabs, turns and jumps.
class Hand {
 public:
  explicit Hand(std::uint64_t seed) : random_(seed) {}

  RigidPose next() {
    if (left_-- == 0) {
      left_ = testing::random_index(60, random_) + 5;
      const bool is_jump = testing::random_index(12, random_) == 0;
      const Vector3 goal = random_number(0, 9, random_) * testing::random_direction(random_);
      velocity_ = is_jump ? Vector3::Zero() : Vector3((goal - place_) / left_);
      if (is_jump) place_ = 30 * goal;
      turn_ = 0.04 * testing::random_direction(random_) * random_number(0, 1, random_);
    }
    place_ += velocity_;
    turned_ = Matrix3(rotation_from_vector(turn_) * turned_);
    return RigidPose(turned_, place_);
  }
  std::mt19937_64& random() { return random_; }

 private:
  std::mt19937_64 random_;
  int left_ = 0;
  Vector3 place_{0, 0, 9};
  Vector3 velocity_ = Vector3::Zero();
  Vector3 turn_ = Vector3::Zero();
  Matrix3 turned_ = Matrix3::Identity();
};

struct Promise {
  std::vector<TriangleIndices> triangles;
  testing::TissueSpan span;
  Scalar margin;
};

int check_tick(const TriangleMesh& tool, const HapticTick& tick, const Promise& promise, int k) {
  if (tick.path.size() < 2) return 0;
  int samples = 0;
  const Scalar whole = tick.path.back().time;
  // Where no time passes tissue stands.
  const auto part = [&](std::size_t i) { return whole > 0 ? tick.path[i].time / whole : 0; };
  for (std::size_t i = 1; i < tick.path.size(); ++i) {
    const testing::ToolSpan span{tick.path[i - 1].tool.X_WT, tick.path[i].tool.X_WT};
    const testing::TissueSpan tissue{promise.span.at(part(i - 1)), promise.span.at(part(i))};
    const auto least = testing::sample_distance(tool, span, promise.triangles, tissue,
                                                promise.margin + 1e-3, 2e-3);
    EXPECT_GE(least.least, promise.margin + 1e-3) << "tick " << k << " piece " << i;
    EXPECT_GT(least.proven, promise.margin - 2e-3 + 1e-3) << "tick " << k;
    samples += least.samples;
  }
  return samples;
}

// An organ whose mesh is replaced now and then by one with a patch less.
class Organ {
 public:
  explicit Organ(const testing::MeshArrays& whole) : whole_(whole), given_(whole.triangles) {}

  std::vector<Vector3> start() const { return breath(whole_, 0); }
  void give_next(HapticSession& session) {
    const Scalar phase = 0.4 * Scalar(number_ + 1);
    if (number_ % 3 < 2) {
      number_ += session.give_snapshot(0, breath(whole_, phase), 0.02);
      return;
    }
    // Where the last snapshot ended.
    std::vector<TriangleIndices> rest(given_.begin() + kPatch, given_.end());
    if (!session.give_mesh(0, breath(whole_, phase - 0.4), rest)) return;
    ++number_;
    given_ = rest;
    mesh_number_ = number_;
  }
  // The triangles that a session moves on which has taken so many shapes.
  const std::vector<TriangleIndices>& shown(std::int64_t taken) {
    if (taken >= mesh_number_) shown_ = given_;
    return shown_;
  }

 private:
  static constexpr int kPatch = 16;

  testing::MeshArrays whole_;
  std::vector<TriangleIndices> given_;
  std::vector<TriangleIndices> shown_ = given_;
  std::int64_t number_ = 0;
  std::int64_t mesh_number_ = 0;  // of the last mesh
};

enum class Cuts { Sometimes, Always };

void run(std::uint64_t seed, int ticks, Cuts cuts) {
  const auto whole = testing::icosphere(2, 5);
  Organ organ(whole);
  const auto vessel = testing::torus(7, 0.8, 16, 6).moved(Matrix3::Identity(), {0, 0, 2});
  HapticScene scene;
  scene.tool.push_back({testing::shared_mesh(rod()), RigidPose()});
  scene.X_WT = RigidPose(Vector3(0, 0, 9));
  ToolObstacle liver = testing::deforming_tissue(whole, 0.3);
  liver.vertices = organ.start();
  ToolObstacle region = testing::rigid_tissue(testing::shared_mesh(vessel));
  region.role = ObstacleRole::HardRegion;
  region.margin = 0.5;
  scene.obstacles = {liver, region};
  const HapticOptions options = testing::haptic_options();
  HapticSession session(scene, options);
  const auto& tool = static_cast<const TriangleMesh&>(*scene.tool[0].shape);
  const TriangleMesh vessel_mesh = vessel.mesh();
  Hand hand(seed);
  int held = 0, free = 0, checked = 0, cut = 0, known = 0;
  bool is_known = true;
  Scalar travelled = 0;
  for (int k = 0; k < ticks; ++k) {
    if (k % 20 == 0) organ.give_next(session);
    Promise soft{{}, {session.tissue_vertices(0), {}}, 0};
    const Vector3 before = session.last().tool.X_WT.translation();
    const std::int64_t taken = session.snapshots_taken(0);
    const std::size_t triangles = organ.shown(taken).size();
    const int kind = testing::random_index(20, hand.random());
    DevicePose device(hand.next());
    if (kind == 0) device.p_WD.x() = std::nan("");
    const Scalar dt = kind == 1 ? 2 * kMillisecond : kind == 2 ? 0 : kMillisecond;
    HapticSession::Deadline deadline;
    if (kind == 3) {
      deadline = std::chrono::steady_clock::now() + std::chrono::microseconds(k % 50);
    }
    // Few pieces of work, or so many that contacts, solves and proofs are cut off too.
    const int most = k % 2 == 0 ? 40 : 400;
    const std::optional<TickCutoff> cutoff{{1 + testing::random_index(most, hand.random()), 0}};
    const HapticTick& tick = cuts == Cuts::Always ? session.replay(device, dt, cutoff)
                                                  : session.update(device, dt, deadline);
    // After the cut nothing is begun.
    if (cuts == Cuts::Always && tick.cutoff) {
      EXPECT_EQ(tick.statistics.checkpoints, cutoff->checkpoint);
    }
    cut += tick.cutoff.has_value();
    soft.span.end = session.tissue_vertices(0);
    soft.triangles = organ.shown(session.snapshots_taken(0));
    // Where a snapshot is taken within a tick, the tissue's path has a corner; left out.
    const bool is_straight = session.snapshots_taken(0) == taken || tick.path.size() == 2;
    checked += is_straight;
    if (is_straight) check_tick(tool, tick, soft, k);
    const Promise hard{vessel.triangles, {vessel.vertices, vessel.vertices}, 0.5};
    check_tick(tool, tick, hard, k);
    // What the proof of the motion says is told, also of a tick that was cut off; but of another
    // mesh nothing is known until something has been proven.
    if (soft.triangles.size() != triangles) is_known = false;
    EXPECT_TRUE(!is_known || tick.clearances[0].lower > 0) << k;
    is_known |= tick.clearances[0].lower > 0;
    known += is_known;
    EXPECT_GE(tick.clearances[1].lower, 0.5) << k;
    const DistanceResult truth = distance(vessel_mesh, RigidPose(), tool, tick.tool.X_WT);
    EXPECT_LE(tick.clearances[1].lower, truth.upper + 1e-9) << k;  // literal: rounding
    held += tick.status == HapticStatus::Held;
    free += (tick.tool.X_WT.translation() - device.p_WD).norm() < 1e-3;
    travelled += (tick.tool.X_WT.translation() - before).norm();
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(checked, ticks * 9 / 10);
  EXPECT_GT(known, ticks * 9 / 10);
  if (cuts == Cuts::Always) {
    EXPECT_GT(cut, ticks / 3);
    return;
  }
  EXPECT_GT(held, ticks / 20);
  EXPECT_GT(free, ticks / 100);
  EXPECT_GT(travelled, 0.02 * ticks);
}

TEST(ProxyPath, NeverPassesTissueNorBreachesAMarginOverWildStrokes) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) run(seed, 150, Cuts::Sometimes);
}

// A clock that counts pieces of work in place of time.
TEST(ProxyPath, NeverUnsafeWhereverATickIsCutOff) {
  for (const std::uint64_t seed : {4U, 5U}) run(seed, 100, Cuts::Always);
}

// A tick in which the tool is driven at a swelling organ, or at a region at rest, far past what its
// reach gathers: it has to ask the impact query. Cut off in each of its queries, after every number
// of node pairs.
TEST(ProxyPath, NeverUnsafeWhereverAnImpactQueryIsCutOff) {
  const auto whole = testing::icosphere(2, 5);
  const auto tool_mesh = rod();
  const TriangleMesh tool = tool_mesh.mesh();
  int inside = 0, partly = 0;
  for (const bool is_soft : {true, false}) {
    HapticScene scene;
    scene.tool.push_back({testing::shared_mesh(tool_mesh), RigidPose()});
    scene.X_WT = RigidPose(Vector3(0, 0, 8));
    Promise promise{whole.triangles, {breath(whole, 0), breath(whole, 0)}, 0};
    ToolObstacle organ = testing::deforming_tissue(whole, 0.3);
    organ.vertices = promise.span.start;
    if (!is_soft) {
      organ = testing::rigid_tissue(
          std::make_shared<const TriangleMesh>(promise.span.start, whole.triangles));
    }
    scene.obstacles = {organ};
    const auto tick_until = [&](const std::optional<TickCutoff>& cutoff) {
      HapticSession session(scene, testing::haptic_options());
      if (is_soft) session.give_snapshot(0, breath(whole, 1), 2 * kMillisecond);
      const RigidPose X_WD(rotation_from_vector({0.1, 0.2, 0}), Vector3(0, 0, 2));
      const HapticTick tick = session.replay(DevicePose(X_WD), kMillisecond, cutoff);
      if (is_soft) promise.span.end = session.tissue_vertices(0);
      if (tick.cutoff) check_tick(tool, tick, promise, int(tick.cutoff->checkpoint));
      return tick;
    };
    const HapticTick whole_tick = tick_until({});
    EXPECT_GT(whole_tick.statistics.impact_queries, 0);
    for (std::int64_t checkpoint = 1; checkpoint <= whole_tick.statistics.checkpoints;
         ++checkpoint) {
      for (std::int64_t pairs = 1; pairs <= whole_tick.statistics.node_pairs; pairs += pairs) {
        const HapticTick tick = tick_until(TickCutoff{checkpoint, pairs});
        if (!tick.cutoff) break;  // no query began there
        EXPECT_EQ(tick.cutoff, (TickCutoff{checkpoint, pairs}));
        ++inside;
        partly += tick.path.size() > 1 && tick.path[1].time < kMillisecond;
      }
    }
  }
  EXPECT_GT(inside, 20);
  EXPECT_GT(partly, 5);
}

// The poses of a path do not tell of half turns and more between them: what jumps far while a rod
// leans on tissue would turn it about in one motion.
TEST(ProxyPath, TurnsLessThanARadianInAMotionAgainstHolds) {
  HapticScene scene;
  scene.tool.push_back({testing::shared_mesh(rod()), RigidPose()});
  scene.X_WT = RigidPose(Vector3(0, 0, 6.3));
  scene.obstacles.push_back(
      testing::rigid_tissue(testing::shared_mesh(testing::icosphere(2, 5)), RigidPose(), 0.3));
  HapticOptions options = testing::haptic_options();
  options.coupling.rotational_stiffness = Vector3::Constant(5);
  std::mt19937_64 random(21);
  int pushed = 0;
  for (int i = 0; i < 400; ++i) {
    HapticSession session(scene, options);
    session.update(testing::device_at({0, 0, 4}), kMillisecond);
    session.update(
        testing::device_at(random_number(30, 900, random) * testing::random_direction(random)),
        kMillisecond);
    const auto& path = session.last().path;
    if (session.last().status == HapticStatus::Free) continue;
    for (std::size_t k = 1; k < path.size(); ++k) {
      const Matrix3 turn =
          path[k].tool.X_WT.rotation() * path[k - 1].tool.X_WT.rotation().transpose();
      const Scalar angle = Eigen::AngleAxis<Scalar>(turn).angle();
      EXPECT_LE(angle, 1 + 1e-9);
      pushed += angle > 0.5;
    }
  }
  EXPECT_GT(pushed, 10);
}

}  // namespace
}  // namespace dyop
