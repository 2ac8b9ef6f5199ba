// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/tissue/soft_tissue.h"
#include "support/inputs/haptic_scenes.h"
#include "support/inputs/tissue_bars.h"
#include "support/message_of.h"

namespace dyop {
namespace {

constexpr Scalar kPeriod = 0.02;
constexpr Scalar kFriction = 0.4;
constexpr Scalar kBall = 5;

// A ball of 5 mm over a slab of 32 x 32 x 16 mm that stands on its lowest cubes of 4 mm; liver.
struct PressedSlab {
  explicit PressedSlab(Scalar stiffness, const std::vector<ModelledCut>& cuts = {})
      : arrays(testing::divided_box({32, 32, 16}, {16, 16, 8}, RigidPose(Vector3(-16, -16, -16)))),
        scene(testing::ball_tool(kBall, {0.3, 0.2, kBall + 2})),
        options(testing::haptic_options()) {
    scene.obstacles.push_back(testing::deforming_tissue(arrays, kFriction));
    options.coupling.stiffness.setConstant(stiffness);
    options.coupling.rotational_stiffness.setConstant(2000 * stiffness);
    SoftTissueOptions tissue;
    tissue.material = {5e-3, 0.45, 1.05e-9, 2, 0.05};
    tissue.cube_edge = 4;
    tissue.period = kPeriod;
    tissue.fixed.emplace_back(Vector3(-20, -20, -20), Vector3(20, 20, -15.9));
    model = std::make_shared<SoftTissueModel>(
        SoftTissue(arrays.mesh(), tissue),
        ModelledObstacle{options.coupling, {}, options.rest_offset, kFriction, {}, cuts});
  }

  // What a run felt.
  struct Felt {
    Scalar largest = 0;
    Scalar last = 0;
    Scalar jitter = 0;  // over the last 200 ticks
    Scalar stopped = 0;
    Scalar deepest = 0;
    Vector3 impulse = Vector3::Zero();
    Vector3 tool = Vector3::Zero();
    int unproven = 0;
  };

  Felt run(std::int64_t ticks, const std::function<Vector3(Scalar)>& device,
           const std::function<void(const TickRecord&)>& also = {}) {
    HapticSession session(scene, options);
    TissueFeed feed;
    feed.period = kPeriod;
    feed.model = model;
    RunnerOptions runner;
    runner.is_paced = false;
    runner.ticks = ticks;
    Felt felt;
    Scalar low = kInfinity, high = 0;
    run_session(
        session, [&](std::int64_t k) { return testing::device_at(device(1e-3 * Scalar(k))); },
        {feed},
        [&](const TickRecord& record) {
          see(record.tick, felt);
          if (also) also(record);
          if (record.number < ticks - 200) return;
          low = std::min(low, felt.last);
          high = std::max(high, felt.last);
        },
        runner);
    felt.jitter = high - low;
    return felt;
  }

  static void see(const HapticTick& tick, Felt& felt) {
    felt.last = tick.wrench.force_W.norm();
    felt.largest = std::max(felt.largest, felt.last);
    felt.stopped += tick.tissue_stopped;
    felt.tool = tick.tool.X_WT.translation();
    felt.deepest = std::min(felt.deepest, tick.tool.X_WT.translation().z() - kBall);
    felt.unproven += tick.status == HapticStatus::Overlapping;
    for (const ToolImpulse& impulse : tick.impulses) felt.impulse += impulse.impulse_W;
    for (const ToolClearance& clearance : tick.clearances) EXPECT_GT(clearance.lower, 0);
  }

  testing::MeshArrays arrays;
  HapticScene scene;
  HapticOptions options;
  std::shared_ptr<SoftTissueModel> model;
};

Vector3 pressed(Scalar t, Scalar depth) {
  return {0.3, 0.2, kBall + 2 - (depth + 2) * std::min(Scalar{1}, t / 0.4)};
}

// A hand at rest does no work, so what tissue and springs hold must not grow: relative to what they
// hold first.
class EnergyWatch {
 public:
  EnergyWatch(const SoftTissue& tissue, Scalar stiffness, const Vector3& hand)
      : tissue_(tissue), stiffness_(stiffness), hand_(hand) {}

  void see(const HapticTick& tick) {
    const Vector3 drawn = tick.tool.X_WT.translation() - hand_;
    const Scalar held = tissue_.balance().energy() + stiffness_ / 2 * drawn.squaredNorm();
    if (!(first_ > 0)) first_ = held;
    growth_ = std::max(growth_, held - least_);
    least_ = std::min(least_, held);
  }
  Scalar largest_growth() const { return growth_ / first_; }

 private:
  const SoftTissue& tissue_;
  Scalar stiffness_;
  Vector3 hand_;
  Scalar first_ = 0;
  Scalar least_ = kInfinity;
  Scalar growth_ = 0;
};

TEST(SoftTissueModel, YieldsToTheToolAndComesToRest) {
  for (const Scalar stiffness : {1.0, 20.0}) {
    PressedSlab slab(stiffness);
    EnergyWatch energy(slab.model->tissue(), stiffness, pressed(1, 4));
    const auto felt = slab.run(
        1500, [](Scalar t) { return pressed(t, 4); },
        [&](const TickRecord& record) {
          if (record.number >= 500 && record.number % 20 == 0) energy.see(record.tick);
        });
    EXPECT_LT(felt.deepest, -2.5);
    EXPECT_GT(felt.last, 0.05);
    EXPECT_LE(felt.jitter, 0.01 * felt.last) << stiffness;
    EXPECT_LE(felt.stopped, 0.04);
    EXPECT_EQ(felt.unproven, 0);
    EXPECT_LE(energy.largest_growth(), 0.01) << stiffness;
  }
}

// At 60 mm/s; of the material's own viscosity come 75 % above the force at rest. Tissue knows of
// the tool when it sets out, two periods before it is where it shall be, and springs back when the
// hand stops sooner than expected.
TEST(SoftTissueModel, YieldsInTimeToAFastHand) {
  struct Case {
    Scalar stiffness;
    Scalar most;  // of the force at rest
  };
  for (const auto& [stiffness, most] : {Case{0.2, 1.8}, Case{1, 2.3}, Case{5, 3.6}}) {
    PressedSlab slab(stiffness);
    slab.scene.X_WT = RigidPose(Vector3(0.3, 0.2, kBall + 8));
    const auto felt = slab.run(
        1500, [](Scalar t) { return Vector3(0.3, 0.2, kBall + std::max(8 - 60 * t, Scalar{-4})); });
    EXPECT_GT(felt.last, 0.1);
    EXPECT_LE(felt.largest, most * felt.last) << stiffness;
    EXPECT_EQ(felt.unproven, 0);
  }
}

// A slit beside the tool, one across it, and one under the tool: the tool sinks deeper, and rests.
TEST(SoftTissueModel, IsCutWhileTheToolPresses) {
  const auto blade = [](const Vector3& middle, const Vector3& half_extents) {
    return TissueKerf{RigidPose(Quaternion::Identity(), middle), half_extents};
  };
  PressedSlab whole(1);
  PressedSlab slab(1, {{30, blade({6, 0, 0}, {0.2, 12, 8})},
                       {40, blade({0, 0, 20}, {1, 1, 1})},
                       {40, blade({6, 2, 0}, {12, 0.2, 8})},
                       {50, blade({-3, 0, -2}, {0.1, 20, 6})}});
  const auto device = [](Scalar t) { return pressed(t, 4); };
  const auto before = whole.run(2000, device), felt = slab.run(2000, device);
  EXPECT_EQ(felt.unproven, 0);
  EXPECT_LE(felt.jitter, 0.01 * felt.last);
  EXPECT_LT(felt.tool.z(), before.tool.z() - 0.01);
  EXPECT_LT(felt.last, before.last);
  const std::vector<CutReport>& reports = slab.model->cut_reports();
  ASSERT_EQ(reports.size(), 4u);
  EXPECT_EQ(reports[0].status, CutStatus::Cut);
  EXPECT_EQ(reports[1].status, CutStatus::Missed);
  EXPECT_EQ(reports[2].status, CutStatus::Cut);
  EXPECT_EQ(reports[3].status, CutStatus::Cut);
}

TEST(SoftTissueModel, WantsCutsInOrderOfTime) {
  const TissueKerf kerf{RigidPose(), Vector3::Ones()};
  EXPECT_THROW(PressedSlab(1, {{30, kerf}, {20, kerf}}), InvalidArgument);
  EXPECT_THROW(PressedSlab(1, {{-1, kerf}}), InvalidArgument);
}

// Over a second at rest, what the tissue took is what the tool felt.
TEST(SoftTissueModel, TakesWhatItGives) {
  PressedSlab slab(1);
  Vector3 felt = Vector3::Zero(), given_before = Vector3::Zero();
  slab.run(
      2500, [](Scalar t) { return pressed(t, 4); },
      [&](const TickRecord& record) {
        if (record.number < 1500) {
          given_before = slab.model->given_impulse_W();
          return;
        }
        for (const ToolImpulse& impulse : record.tick.impulses) felt += impulse.impulse_W;
      });
  const Vector3 given = slab.model->given_impulse_W() - given_before;
  EXPECT_LE((given - felt).norm(), 0.01 * felt.norm());
  EXPECT_LE(slab.model->owed_impulse_W().norm(), 0.01 * felt.norm());
}

TEST(SoftTissueModel, IsDraggedAlongThenSlips) {
  PressedSlab slab(1);
  const auto felt = slab.run(1600, [](Scalar t) {
    Vector3 p = pressed(t, 3);
    if (t > 0.6) p.x() += 8 * std::min(Scalar{1}, t - 0.6);
    return p;
  });
  EXPECT_EQ(felt.unproven, 0);
  Scalar dragged = 0;
  for (std::size_t k = 0; k < slab.arrays.vertices.size(); ++k) {
    dragged =
        std::max(dragged, slab.model->tissue().vertices()[k].x() - slab.arrays.vertices[k].x());
  }
  EXPECT_GT(dragged, 0.2);
  EXPECT_GT(felt.tool.x(), dragged + 2);
  EXPECT_LT(felt.largest, 1.5);
}

TEST(SoftTissueModel, LetsGo) {
  PressedSlab slab(5);
  const auto felt = slab.run(
      1200, [](Scalar t) { return t < 0.6 ? pressed(t, 4) : Vector3(0.3, 0.2, kBall + 4); });
  EXPECT_EQ(felt.last, 0);
  Scalar away = 0;
  const auto now = slab.model->tissue().vertices();
  for (std::size_t k = 0; k < now.size(); ++k) {
    away = std::max(away, (now[k] - slab.arrays.vertices[k]).norm());
  }
  EXPECT_LT(away, 0.3);
}

// A model that takes three periods to answer: the tissue stands in between, and nothing swings up.
TEST(SoftTissueModel, SurvivesLateSnapshots) {
  PressedSlab slab(20);
  HapticSession session(slab.scene, slab.options);
  PressedSlab::Felt felt;
  TissueNews news;
  ToolNews& of_tool = news.tools.emplace_back();
  std::vector<Vector3> vertices = slab.arrays.vertices;
  std::int64_t given = 0;
  Scalar late_force = 0;
  for (int k = 0; k < 1500; ++k) {
    if (k % 67 == 0 && session.snapshots_taken(0) == given) {
      news.number = ++given;
      news.contacts.clear();
      if (k > 0) {
        of_tool.tick = session.last();
        news.progress = session.last().progress[0];
        session.find_contacts(0, news.progress, session.last().tool, slab.model->search(),
                              news.contacts);
      }
      slab.model->step(news, vertices);
      of_tool.impulse_W.setZero();
      ASSERT_TRUE(session.give_snapshot(0, vertices, kPeriod));
    }
    of_tool.device = testing::device_at(pressed(1e-3 * k, 3));
    const HapticTick& tick = session.update(of_tool.device, testing::kMillisecond);
    if (k % 67 < 20) {
      for (const ToolImpulse& impulse : tick.impulses) of_tool.impulse_W += impulse.impulse_W;
    }
    PressedSlab::see(tick, felt);
    if (k > 1300) late_force = std::max(late_force, felt.last);
  }
  EXPECT_EQ(felt.unproven, 0);
  EXPECT_LT(late_force, 3);
  EXPECT_GT(late_force, 0.05);
}

TEST(SoftTissueModel, TakesNoOtherMesh) {
  PressedSlab slab(1);
  std::vector<Vector3> few(3);
  EXPECT_THROW(slab.model->step({}, few), InvalidArgument);
}

TEST(SoftTissueModel, NamesWhatIsWrong) {
  PressedSlab slab(1);
  const auto message = [&](const auto& change) {
    ModelledObstacle modelled = modelled_obstacle(slab.scene, slab.options, 0);
    change(modelled);
    return testing::message_of([&] {
      SoftTissueModel(SoftTissue(slab.arrays.mesh(), slab.model->tissue().options()), modelled);
    });
  };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  EXPECT_EQ(message([](auto&) {}), "no error");
  has(message([](auto& modelled) { modelled.coupling = {}; }), "stiffness");
  has(message([](auto& modelled) { modelled.friction = -1; }), "friction");
  has(message([](auto& modelled) { modelled.cuts.emplace_back(); }), "half_extents");
  has(testing::message_of([&] { slab.model->add_cut({}); }), "half_extents");
  has(testing::message_of([&] { modelled_obstacle(slab.scene, slab.options, 1); }),
      "no obstacle 1 of 1");
}

// A cut that is added is the same as one that was planned, and does not disturb those to come.
TEST(SoftTissueModel, MakesCutsThatAreAdded) {
  const TissueKerf middle{RigidPose(Vector3(9, 0, 0)), Vector3(0.2, 20, 8)};
  const TissueKerf later{RigidPose(Vector3(-9, 0, 0)), Vector3(0.2, 20, 8)};
  PressedSlab planned(1, {{10, middle}, {12, later}});
  PressedSlab added(1, {{12, later}});
  const auto device = [](Scalar t) { return pressed(t, 2); };
  const auto felt_planned = planned.run(500, device);
  bool is_added = false;
  const auto felt_added = added.run(500, device, [&](const TickRecord&) {
    if (added.model->steps() != 10 || std::exchange(is_added, true)) return;
    EXPECT_EQ(added.model->add_cut(middle), 0u);
  });
  for (const PressedSlab* slab : {&planned, &added}) {
    ASSERT_EQ(slab->model->cut_reports().size(), 2u);
    for (const CutReport& report : slab->model->cut_reports()) {
      EXPECT_EQ(report.status, CutStatus::Cut);
    }
  }
  EXPECT_EQ(felt_planned.tool, felt_added.tool);
  EXPECT_EQ(felt_planned.last, felt_added.last);
}

// Two balls press into the slab, mirror images of each other: the model answers both alike, and
// takes from each what it gave. With the other beside it a ball goes deeper than alone.
TEST(SoftTissueModel, AnswersTwoToolsAtOnce) {
  constexpr Scalar kAside = 5, kDepth = 3;
  const auto press = [&](bool is_alone, std::vector<Vector3>& felt) {
    PressedSlab slab(1);
    slab.scene.X_WT = RigidPose(Vector3(-kAside, 0, kBall + 2));
    ModelledObstacle modelled{slab.options.coupling, {}, slab.options.rest_offset, kFriction};
    if (!is_alone) {
      HapticTool other;
      other.parts = slab.scene.tool;
      other.X_WT = RigidPose(Vector3(kAside, 0, kBall + 2));
      slab.scene.more_tools.push_back(other);
      modelled.more_tools.push_back({slab.options.coupling, {}});
    }
    SoftTissueOptions options = slab.model->tissue().options();
    options.material.poissons_ratio = 0;  // otherwise it bulges beside a ball
    slab.model =
        std::make_shared<SoftTissueModel>(SoftTissue(slab.arrays.mesh(), options), modelled);
    HapticSession session(slab.scene, slab.options);
    TissueFeed feed;
    feed.period = kPeriod;
    feed.model = slab.model;
    RunnerOptions runner;
    runner.is_paced = false;
    runner.ticks = 1500;
    std::vector<Vector3> impulses(2, Vector3::Zero());
    run_session(
        session,
        [&](std::int64_t k, std::span<DevicePose> devices) {
          const Vector3 down = pressed(1e-3 * Scalar(k), kDepth);
          devices[0] = testing::device_at({-kAside, 0, down.z()});
          if (!is_alone) devices[1] = testing::device_at({kAside, 0, down.z()});
        },
        {feed},
        [&](const TickRecord& record) {
          EXPECT_EQ(record.others.size(), is_alone ? 0u : 1u);
          for (const ToolImpulse& one : record.tick.impulses) impulses[0] += one.impulse_W;
          felt = {record.tick.wrench.force_W, record.tick.tool.X_WT.translation()};
          for (const ToolRecord& other : record.others) {
            for (const ToolImpulse& one : other.tick.impulses) impulses[1] += one.impulse_W;
            felt.push_back(other.tick.wrench.force_W);
            felt.push_back(other.tick.tool.X_WT.translation());
          }
        },
        runner);
    for (std::size_t k = 0; k < (is_alone ? 1u : 2u); ++k) {
      const Vector3 taken = slab.model->given_impulse_W(k) + slab.model->owed_impulse_W(k);
      EXPECT_NEAR(taken.z(), impulses[k].z(), 0.02 * impulses[k].z()) << k;
    }
  };
  std::vector<Vector3> both, alone;
  press(false, both);
  press(true, alone);
  EXPECT_NEAR(both[0].z(), both[2].z(), 0.02 * both[0].z());
  EXPECT_NEAR(both[0].x(), -both[2].x(), 0.02 * both[0].z());
  EXPECT_GT(both[0].z(), 0.05);
  EXPECT_LT(both[1].z(), alone[1].z() - 0.01);
}

// A model of one's own: a sheet that gives way under the last force.
class Cushion final : public TissueModel {
 public:
  ContactSearch search() const override { return {1, 0, 1}; }
  void step(const TissueNews& news, std::span<Vector3> vertices) override {
    EXPECT_EQ(news.number, ++calls);
    for (const ToolContactPoint& contact : news.contacts) {
      EXPECT_EQ(contact.obstacle, 0u);
      EXPECT_TRUE(contact.surface);
      ++contacts;
    }
    impulse += news.tools.at(0).impulse_W;
    for (Vector3& p : vertices) p.z() = -0.5 * impulse.z();
  }
  int calls = 0;
  int contacts = 0;
  Vector3 impulse = Vector3::Zero();
};

TEST(TissueModel, IsToldOfContactsAndImpulses) {
  const auto sheet = testing::sheet(40, 8);
  HapticScene scene = testing::ball_tool(2, {0.3, 0.2, 3});
  scene.obstacles.push_back(testing::deforming_tissue(sheet, 0));
  HapticSession session(scene, testing::haptic_options());
  const auto cushion = std::make_shared<Cushion>();
  TissueFeed feed;
  feed.period = 0.01;
  feed.model = cushion;
  int recorded = 0;
  feed.given = [&](std::span<const Vector3> vertices) {
    EXPECT_EQ(vertices.size(), sheet.vertices.size());
    ++recorded;
  };
  RunnerOptions runner;
  runner.is_paced = false;
  runner.ticks = 300;
  Vector3 felt = Vector3::Zero();
  run_session(
      session,
      [](std::int64_t k) {
        return testing::device_at({0.3, 0.2, 3 - 0.01 * Scalar(k)});
      },
      {feed},
      [&](const TickRecord& record) {
        for (const ToolImpulse& impulse : record.tick.impulses) felt += impulse.impulse_W;
      },
      runner);
  EXPECT_NEAR(cushion->calls, 30, 1);
  EXPECT_EQ(recorded, cushion->calls);
  EXPECT_GT(cushion->contacts, 5);
  EXPECT_GT(felt.z(), 0);
  // All but the ticks of the last period.
  EXPECT_GT(cushion->impulse.z(), 0.8 * felt.z());
  EXPECT_LE(cushion->impulse.z(), felt.z() * (1 + 1e-9));
}

}  // namespace
}  // namespace dyop
