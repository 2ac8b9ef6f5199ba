// SPDX-License-Identifier: BSD-3-Clause

// Tissue whose mesh is replaced while a tool is near: cuts.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_session.h"
#include "support/allocation_count.h"
#include "support/inputs/haptic_scenes.h"
#include "support/message_of.h"
#include "support/oracles/proxy_oracle.h"

namespace dyop {
namespace {

using testing::device_at;
using testing::kMillisecond;

// What is left of a mesh without the triangles whose center is nearer to the z axis than radius.
testing::MeshArrays with_hole(const testing::MeshArrays& whole, Scalar radius) {
  testing::MeshArrays rest = whole;
  std::erase_if(rest.triangles, [&](const TriangleIndices& t) {
    Vector3 center = Vector3::Zero();
    for (const std::int32_t i : t) center += whole.vertices[std::size_t(i)] / 3;
    return center.head<2>().norm() < radius;
  });
  return rest;
}

// A mesh cut along the plane x = 0: no vertex is used on both sides of it.
testing::MeshArrays slit(const testing::MeshArrays& whole) {
  testing::MeshArrays cut = whole;
  const auto count = std::int32_t(whole.vertices.size());
  cut.vertices.insert(cut.vertices.end(), whole.vertices.begin(), whole.vertices.end());
  for (TriangleIndices& t : cut.triangles) {
    Scalar x = 0;
    for (const std::int32_t i : t) x += whole.vertices[std::size_t(i)].x();
    if (x < 0) continue;
    for (std::int32_t& i : t) i += count;
  }
  return cut;
}

testing::MeshArrays at_height(testing::MeshArrays mesh, Scalar height) {
  for (Vector3& p : mesh.vertices) p.z() += height;
  return mesh;
}

// A ball of radius 2 over a sheet.
struct Theatre {
  explicit Theatre(Scalar height = 2.5, Scalar margin = 0) : sheet(testing::sheet(30, 12)) {
    HapticScene scene = testing::ball_tool(2, {0.3, 0.2, height});
    ToolObstacle organ = testing::deforming_tissue(sheet, 0.2);
    organ.margin = margin;
    scene.obstacles.push_back(organ);
    ball = std::static_pointer_cast<const TriangleMesh>(scene.tool[0].shape);
    session = std::make_unique<HapticSession>(scene, testing::haptic_options());
    mesh = sheet;
  }
  bool give(const testing::MeshArrays& next) {
    if (!session->give_mesh(0, next.vertices, next.triangles)) return false;
    mesh = next;
    return true;
  }
  // A tick at rest or on the way; the tissue does not move.
  const HapticTick& tick(Scalar height) {
    const HapticTick& tick = session->update(device_at({0.3, 0.2, height}), kMillisecond);
    const testing::TissueSpan tissue{mesh.vertices, mesh.vertices};
    for (std::size_t k = 1; k < tick.path.size(); ++k) {
      const testing::ToolSpan span{tick.path[k - 1].tool.X_WT, tick.path[k].tool.X_WT};
      const auto least = testing::sample_distance(*ball, span, mesh.triangles, tissue, 1e-3, 1e-3);
      least_seen = std::min(least_seen, least.least);
    }
    return tick;
  }
  // By samples, where the tool is at the tick's end.
  void expect_true_clearance(const HapticTick& tick) const {
    const testing::ToolSpan still{tick.tool.X_WT, tick.tool.X_WT};
    const auto truth = testing::sample_distance(*ball, still, mesh.triangles,
                                                {mesh.vertices, mesh.vertices}, 0, 1e-4);
    EXPECT_LE(tick.clearances[0].lower, truth.least + 1e-4);
    EXPECT_GE(tick.clearances[0].upper, truth.least);
  }
  Scalar height() const { return session->last().tool.X_WT.translation().z(); }

  testing::MeshArrays sheet;
  testing::MeshArrays mesh;
  std::shared_ptr<const TriangleMesh> ball;
  std::unique_ptr<HapticSession> session;
  Scalar least_seen = kInfinity;
};

TEST(ToolCut, TheNewMeshTakesOverWhereTheLastSnapshotEnds) {
  Theatre theatre(20);
  HapticSession& session = *theatre.session;
  const auto cut = at_height(slit(theatre.sheet), 1);
  ASSERT_TRUE(session.give_snapshot(0, at_height(theatre.sheet, 1).vertices, 0.0045));
  session.update(device_at({0, 0, 20}), kMillisecond);
  ASSERT_TRUE(theatre.give(cut));
  EXPECT_FALSE(theatre.give(cut));
  EXPECT_FALSE(session.give_snapshot(0, cut.vertices, 0.01));
  for (int k = 0; k < 3; ++k) session.update(device_at({0, 0, 20}), kMillisecond);
  EXPECT_EQ(session.tissue_vertices(0).size(), theatre.sheet.vertices.size());
  EXPECT_NEAR(session.tissue_vertices(0)[0].z(), 4.0 / 4.5, 1e-9);
  EXPECT_EQ(session.last().snapshots[0], 2);
  session.update(device_at({0, 0, 20}), kMillisecond);
  EXPECT_EQ(session.tissue_vertices(0), cut.vertices);
  EXPECT_EQ(session.snapshots_taken(0), 2);
  EXPECT_EQ(session.last().tissue_lag, 0);
  // Later snapshots move the new mesh.
  EXPECT_THROW(session.give_snapshot(0, theatre.sheet.vertices, 0.01), InvalidArgument);
  for (int k = 1; k <= 2; ++k) {
    ASSERT_TRUE(session.give_snapshot(0, at_height(cut, k).vertices, 0.002));
    for (int i = 0; i < 2; ++i) session.update(device_at({0, 0, 20}), kMillisecond);
    EXPECT_EQ(session.tissue_vertices(0), at_height(cut, k).vertices);
  }
}

TEST(ToolCut, AToolPressedOnTissueGoesThroughAHoleCutUnderIt) {
  Theatre theatre;
  for (int k = 0; k < 100; ++k) theatre.tick(1);
  EXPECT_EQ(theatre.session->last().status, HapticStatus::Held);
  EXPECT_GT(theatre.height(), 1.9);
  ASSERT_TRUE(theatre.give(with_hole(theatre.sheet, 6)));
  for (int k = 0; k < 200; ++k) theatre.tick(1 - 0.03 * std::min(k, 150));
  EXPECT_EQ(theatre.session->last().status, HapticStatus::Free);
  EXPECT_LT(theatre.height(), -3);
  EXPECT_GT(theatre.least_seen, 1e-3);
  // The border of the hole is clear of the ball, and certified.
  const ToolClearance& clearance = theatre.session->last().clearances[0];
  const RigidPose X_WT = theatre.session->last().tool.X_WT;
  const auto sampled =
      testing::sample_distance(*theatre.ball, {X_WT, X_WT}, theatre.mesh.triangles,
                               {theatre.mesh.vertices, theatre.mesh.vertices}, 0, 1e-6);
  EXPECT_LE(clearance.lower, sampled.least + 1e-6);
  EXPECT_GE(clearance.upper, sampled.least);
}

// A tick that was cut off while it looked for holds is followed by one that goes on with those it
// knows: not with those of a mesh that is gone.
TEST(ToolCut, NothingOfTheOldMeshHoldsTheTool) {
  int in_search = 0;
  for (int checkpoint = 1; checkpoint <= 12; ++checkpoint) {
    SCOPED_TRACE(checkpoint);
    Theatre theatre;
    for (int k = 0; k < 20; ++k) theatre.tick(1);
    ASSERT_EQ(theatre.session->last().status, HapticStatus::Held);
    const Scalar before = theatre.height();
    const HapticTick& cut =
        theatre.session->replay(device_at({0.3, 0.2, 1}), kMillisecond, TickCutoff{checkpoint, 0});
    in_search += cut.cutoff && cut.statistics.solves == 0 ? 1 : 0;
    ASSERT_TRUE(theatre.give(with_hole(theatre.sheet, 6)));
    EXPECT_EQ(theatre.tick(1).status, HapticStatus::Free);
    EXPECT_LT(theatre.height(), before - 0.4);
  }
  EXPECT_GT(in_search, 0);
}

TEST(ToolCut, AToolStaysHeldByWhatIsLeft) {
  Theatre theatre;
  for (int k = 0; k < 100; ++k) theatre.tick(1);
  const Scalar before = theatre.height();
  ASSERT_TRUE(theatre.give(slit(theatre.sheet)));
  for (int k = 0; k < 50; ++k) {
    EXPECT_NE(theatre.tick(1).status, HapticStatus::Overlapping) << k;
    EXPECT_NEAR(theatre.height(), before, 0.02) << k;
  }
  EXPECT_EQ(theatre.session->last().status, HapticStatus::Held);
  EXPECT_GT(theatre.least_seen, 1e-3);
}

TEST(ToolCut, AMeshThatCrossesTheToolIsReportedAndLeft) {
  Theatre theatre;
  theatre.tick(2.5);
  ASSERT_TRUE(theatre.give(at_height(slit(theatre.sheet), 1.5)));
  int overlapping = 0;
  for (int k = 0; k < 400; ++k) {
    const Vector3 before = theatre.session->last().tool.X_WT.translation();
    const HapticTick& tick = theatre.tick(2.5);
    if (tick.status != HapticStatus::Overlapping) break;
    ++overlapping;
    EXPECT_LE((tick.tool.X_WT.translation() - before).norm(),
              testing::haptic_options().recovery_speed * kMillisecond * (1 + 1e-9));
  }
  EXPECT_GT(overlapping, 0);
  EXPECT_LT(overlapping, 400);
  for (int k = 0; k < 100; ++k) theatre.tick(2.5);
  EXPECT_EQ(theatre.session->last().status, HapticStatus::Held);
  EXPECT_GT(theatre.session->last().clearances[0].lower, 0.01);
}

TEST(ToolCut, AMeshWithinTheMarginIsLeftAndNeverComeNearer) {
  Theatre theatre(2.8, 0.5);
  theatre.tick(2.8);
  ASSERT_TRUE(theatre.give(at_height(slit(theatre.sheet), 0.5)));
  EXPECT_EQ(theatre.tick(2.8).status, HapticStatus::Recovering);
  for (int k = 0; k < 100; ++k) theatre.tick(2.8);
  EXPECT_EQ(theatre.session->last().status, HapticStatus::Held);
  EXPECT_GT(theatre.session->last().clearances[0].lower, 0.5);
  EXPECT_GT(theatre.least_seen, 0.25);
}

// Under a ceiling: what comes up while it is within the margin, from this height, is stopped, tick
// after tick. Returns the distance at which it begins, and the least.
std::pair<Scalar, Scalar> rise_in_a_trap(Scalar height, Scalar recovery_speed) {
  const auto sheet = testing::sheet(30, 12);
  HapticScene scene = testing::ball_tool(2, {0.3, 0.2, 2.8});
  scene.obstacles.push_back(testing::deforming_tissue(sheet, 0.2));
  scene.obstacles[0].margin = 0.5;
  scene.obstacles.push_back(
      testing::rigid_tissue(testing::shared_mesh(at_height(testing::sheet(30, 4), 4.85))));
  HapticOptions options = testing::haptic_options();
  options.recovery_speed = recovery_speed;
  HapticSession session(scene, options);
  const auto device = device_at({0.3, 0.2, 2.8});
  session.update(device, kMillisecond);
  const auto cut = at_height(slit(sheet), height);
  EXPECT_TRUE(session.give_mesh(0, cut.vertices, cut.triangles));
  session.update(device, kMillisecond);
  const Scalar before = session.last().clearances[0].lower;
  EXPECT_TRUE(session.give_snapshot(0, at_height(slit(sheet), height + 0.5).vertices, 0.05));
  Scalar least = before;
  for (int k = 0; k < 300; ++k) {
    session.update(device, kMillisecond);
    least = std::min(least, session.last().clearances[0].lower);
  }
  EXPECT_GT(session.last().tissue_lag, 0.2);
  return {before, least};
}

TEST(ToolCut, AMeshWithinTheMarginDoesNotCreepNearerInATrap) {
  const auto [far, least] = rise_in_a_trap(0.5, testing::haptic_options().recovery_speed);
  EXPECT_GT(least, far - testing::haptic_options().rest_offset / 2);
  // Nearer than any tolerance, before a tool that hardly gives way, it stays that near.
  constexpr Scalar kSlow = 1e-6;
  const Scalar bottom = 0.5 + rise_in_a_trap(0.5, kSlow).first;
  constexpr Scalar kGap = 1e-4;
  const auto [near, least_near] = rise_in_a_trap(bottom - kGap, kSlow);
  EXPECT_LT(near, 2 * kGap);
  EXPECT_GT(least_near, 0.74 * near);
}

// The first look at the new mesh, its proof and the search for a way out, ended after any number of
// pieces of work: what is reported is true, and later ticks go on.
TEST(ToolCut, WhereverTheTickAfterItIsCutOffBoundsHold) {
  for (const Scalar height : {0.0, 1.5}) {
    int cut_off = 0;
    for (std::int64_t checkpoint = 1; checkpoint < 200; checkpoint += 1 + checkpoint / 4) {
      Theatre theatre;
      const auto device = device_at({0.3, 0.2, 1});
      for (int k = 0; k < 30; ++k) theatre.session->update(device, kMillisecond);
      ASSERT_TRUE(theatre.give(at_height(slit(theatre.sheet), height)));
      for (int k = 0; k < 3; ++k) {
        const HapticTick& tick =
            theatre.session->replay(device, kMillisecond, TickCutoff{checkpoint, 0});
        EXPECT_LE(tick.statistics.checkpoints, checkpoint);
        cut_off += tick.cutoff.has_value();
        EXPECT_EQ(tick.status == HapticStatus::Overlapping, height > 1) << checkpoint;
        SCOPED_TRACE(checkpoint);
        theatre.expect_true_clearance(tick);
      }
      for (int k = 0; k < 300 && theatre.session->last().status != HapticStatus::Held; ++k) {
        theatre.session->update(device, kMillisecond);
      }
      EXPECT_EQ(theatre.session->last().status, HapticStatus::Held) << checkpoint;
    }
    EXPECT_GT(cut_off, 10);
  }
}

// It takes over within the tick, where the motion before it ends; there the tick may be cut off, so
// that no motion of it has seen the new mesh.
TEST(ToolCut, AMeshThatTakesOverWithinATickIsReportedWhereverThatIsCutOff) {
  int ended_there = 0;
  for (const Scalar height : {0.0, 1.5}) {
    for (std::int64_t checkpoint = 1; checkpoint < 400; checkpoint += 1 + checkpoint / 8) {
      Theatre theatre;
      HapticSession& session = *theatre.session;
      const auto device = device_at({0.3, 0.2, 1});
      for (int k = 0; k < 30; ++k) session.update(device, kMillisecond);
      ASSERT_TRUE(session.give_snapshot(0, theatre.sheet.vertices, 0.4 * kMillisecond));
      session.update(device, 0);
      ASSERT_TRUE(theatre.give(at_height(slit(theatre.sheet), height)));
      const HapticTick& tick = session.replay(device, kMillisecond, TickCutoff{checkpoint, 0});
      if (session.snapshots_taken(0) < 2) {
        EXPECT_NE(tick.status, HapticStatus::Overlapping) << checkpoint;
        continue;
      }
      ended_there += std::abs(tick.path.back().time - 0.4 * kMillisecond) < 1e-9 ? 1 : 0;
      EXPECT_EQ(tick.status == HapticStatus::Overlapping, height > 1) << checkpoint;
      EXPECT_EQ(session.tissue_vertices(0), theatre.mesh.vertices);
      SCOPED_TRACE(checkpoint);
      theatre.expect_true_clearance(tick);
    }
  }
  EXPECT_GT(ended_there, 4);
}

// With less work in a tick than it takes to list all pairs that cross, or to prove that they are
// apart somewhere else.
TEST(ToolCut, AToolThatIsCutOffInEveryTickGetsOutOfTissue) {
  for (const std::int64_t checkpoint : {160, 200, 250}) {
    Theatre theatre;
    theatre.tick(2.5);
    ASSERT_TRUE(theatre.give(at_height(slit(theatre.sheet), 1.5)));
    const auto is_out = [&] {
      return theatre.session->last().clearances[0].lower > 0 && theatre.height() > 3.4;
    };
    for (int k = 0; k < 500 && !is_out(); ++k) {
      theatre.session->replay(device_at({0.3, 0.2, 2.5}), kMillisecond, TickCutoff{checkpoint, 0});
    }
    EXPECT_TRUE(is_out()) << checkpoint << ", " << theatre.height();
  }
}

TEST(ToolCut, RefusesBadMeshesAndNamesWhatIsWrong) {
  Theatre theatre;
  auto bad = theatre.sheet;
  bad.triangles[3][1] = 100'000;
  EXPECT_NE(testing::message_of([&] { theatre.give(bad); }).find("vertex 100000 of 169"),
            std::string::npos);
  bad = theatre.sheet;
  bad.vertices[5].y() = std::nan("");
  EXPECT_NE(testing::message_of([&] { theatre.give(bad); }).find("vertex 5"), std::string::npos);
  bad.triangles.clear();
  EXPECT_THROW(theatre.give(bad), InvalidArgument);
  EXPECT_THROW(theatre.session->give_mesh(1, {}, {}), InvalidArgument);
  // Nothing has happened.
  EXPECT_TRUE(theatre.give(theatre.sheet));
  EXPECT_EQ(theatre.tick(2.5).snapshots[0], 1);
}

TEST(ToolCut, AllocatesNothingInTheTick) {
  Theatre theatre;
  HapticSession& session = *theatre.session;
  const std::vector<testing::MeshArrays> meshes{slit(theatre.sheet), theatre.sheet};
  const auto run = [&](int k) {
    ASSERT_TRUE(theatre.give(meshes[std::size_t(k) % 2]));
    const std::int64_t before = testing::allocation_count();
    for (int i = 0; i < 5; ++i) session.update(device_at({0.3, 0.2, 1}), kMillisecond);
    if (k > 4) {
      EXPECT_EQ(testing::allocation_count() - before, 0) << k;
    }
  };
  for (int k = 0; k < 20; ++k) run(k);
}

TEST(ToolCut, MeshesAndSnapshotsMayComeFromAnotherThread) {
  Theatre theatre(4);
  HapticSession& session = *theatre.session;
  const std::vector<testing::MeshArrays> meshes{slit(theatre.sheet), theatre.sheet};
  std::atomic<bool> is_done{false};
  std::thread giver([&] {
    const auto offer = [&](const auto& give) {
      while (!is_done && !give()) std::this_thread::yield();
    };
    for (std::size_t k = 0; !is_done; ++k) {
      const testing::MeshArrays& mesh = meshes[k % meshes.size()];
      offer([&] { return session.give_mesh(0, mesh.vertices, mesh.triangles); });
      for (const Scalar height : {2.0, 0.0}) {
        const auto moved = at_height(mesh, height);
        offer([&] { return session.give_snapshot(0, moved.vertices, 0.005); });
      }
    }
  });
  for (int k = 0; k < 200'000 && session.snapshots_taken(0) < 30; ++k) {
    const HapticTick& tick = session.update(device_at({0.3, 0.2, 1}), kMillisecond);
    EXPECT_GT(tick.clearances[0].lower, 0) << k;
  }
  is_done = true;
  giver.join();
  EXPECT_EQ(session.snapshots_taken(0), 30);
}

}  // namespace
}  // namespace dyop
