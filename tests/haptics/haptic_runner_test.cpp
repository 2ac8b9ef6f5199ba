// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_runner.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

#include "dyop/core/error.h"
#include "support/inputs/haptic_scenes.h"
#include "support/message_of.h"

namespace dyop {
namespace {

struct Stand {
  Stand() : sheet(testing::sheet(20, 4)) {
    HapticScene scene = testing::ball_tool(2, {0.3, 0.2, 4}, 1);
    scene.obstacles.push_back(testing::deforming_tissue(sheet));
    session = std::make_unique<HapticSession>(scene, testing::haptic_options());
    feed.obstacle = 0;
    feed.period = 0.01;
    feed.shape = [this](std::int64_t number, std::span<Vector3> vertices) {
      for (std::size_t k = 0; k < vertices.size(); ++k) {
        vertices[k] = sheet.vertices[k] + Vector3(0, 0, number % 2 == 0 ? 0 : 1);
      }
    };
  }
  static DevicePose device(std::int64_t tick) {
    return DevicePose(RigidPose(Vector3(0.3, 0.2, 4 - 0.01 * double(tick))));
  }

  testing::MeshArrays sheet;
  std::unique_ptr<HapticSession> session;
  TissueFeed feed;
};

RunnerOptions ticks(std::int64_t count, bool is_paced) {
  RunnerOptions options;
  options.ticks = count;
  options.is_paced = is_paced;
  return options;
}

// The tissue is cut with every third shape; from then on shapes have the new number of vertices.
TEST(HapticRunner, GivesMeshesInPlaceOfSnapshots) {
  for (const bool is_paced : {false, true}) {
    Stand stand;
    std::vector<std::size_t> sizes;
    const auto shape = stand.feed.shape;
    stand.feed.shape = [&](std::int64_t number, std::span<Vector3> vertices) {
      sizes.push_back(vertices.size());
      shape(number, vertices);
    };
    stand.feed.cut = [&](std::int64_t number) -> std::optional<TissueMesh> {
      if (number % 3 != 0) return std::nullopt;
      stand.sheet.vertices.push_back(Vector3::Zero());
      return TissueMesh{stand.sheet.vertices, stand.sheet.triangles};
    };
    run_session(*stand.session, Stand::device, {stand.feed}, {}, ticks(300, is_paced));
    EXPECT_GT(stand.session->snapshots_taken(0), 10);
    EXPECT_EQ(sizes[1], sizes[0]);
    EXPECT_EQ(sizes[2], sizes[0] + 1);
    EXPECT_EQ(sizes[4], sizes[0] + 2);
  }
}

TEST(HapticRunner, RunsAllTicksInOrderAndHandsThemToTheSink) {
  for (const bool is_paced : {false, true}) {
    Stand stand;
    std::int64_t next = 0;
    const RunnerReport report = run_session(
        *stand.session, Stand::device, {stand.feed},
        [&](const TickRecord& record) {
          EXPECT_EQ(record.number, next++);
          EXPECT_EQ(record.dt, 1e-3);
          EXPECT_EQ(record.tick.clearances.size(), 1u);
          EXPECT_GT(record.tick.clearances[0].lower, 0);
        },
        ticks(300, is_paced));
    EXPECT_EQ(report.ticks, 300);
    EXPECT_EQ(next + report.unlogged, 300);
    EXPECT_EQ(report.latency.count(), 300);
    EXPECT_FALSE(report.rights.empty());
    EXPECT_GT(stand.session->snapshots_taken(0), 3);
  }
}

TEST(HapticRunner, UnpacedRunsGiveTheSameBits) {
  std::vector<Vector3> places[2];
  for (auto& run : places) {
    Stand stand;
    run_session(
        *stand.session, Stand::device, {stand.feed},
        [&](const TickRecord& record) { run.push_back(record.tick.tool.X_WT.translation()); },
        ticks(300, false));
  }
  EXPECT_EQ(places[0], places[1]);
}

TEST(HapticRunner, EndsWithWhatTissueOrSinkThrow) {
  for (const bool is_paced : {false, true}) {
    Stand stand;
    EXPECT_THROW(run_session(
                     *stand.session, Stand::device, {stand.feed},
                     [](const TickRecord& record) {
                       if (record.number == 20) throw std::runtime_error("disk is full");
                     },
                     ticks(100'000, is_paced)),
                 std::runtime_error);
    stand.feed.shape = [](std::int64_t number, std::span<Vector3>) {
      if (number > 2) throw std::runtime_error("simulation failed");
    };
    EXPECT_THROW(
        run_session(*stand.session, Stand::device, {stand.feed}, {}, ticks(100'000, is_paced)),
        std::runtime_error);
  }
}

TEST(HapticRunner, StopsWhenAsked) {
  Stand stand;
  std::stop_source stop;
  const RunnerReport report = run_session(
      *stand.session, Stand::device, {},
      [&](const TickRecord& record) {
        if (record.number == 10) stop.request_stop();
      },
      ticks(100'000, false), stop.get_token());
  EXPECT_EQ(report.ticks, 11);
}

TEST(HapticRunner, RefusesABadPeriod) {
  Stand stand;
  RunnerOptions options = ticks(1, false);
  options.period = 0;
  EXPECT_THROW(run_session(*stand.session, Stand::device, {}, {}, options), InvalidArgument);
}

// Two runs of one session with feeders that stay are one run.
TEST(HapticRunner, KeptFeedersGoOnWhereTheLastRunEnded) {
  std::vector<std::vector<Vector3>> shapes;
  std::vector<std::vector<std::int64_t>> numbers(2);
  for (const std::size_t runs : {1, 2}) {
    Stand stand;
    const auto shape = stand.feed.shape;
    stand.feed.shape = [&](std::int64_t number, std::span<Vector3> vertices) {
      numbers[runs - 1].push_back(number);
      shape(number, vertices);
    };
    std::vector<TissueFeeder> feeders = make_feeders(*stand.session, {stand.feed});
    for (std::size_t k = 0; k < runs; ++k) {
      const auto device = [](std::int64_t, std::span<DevicePose> all) {
        all[0] = DevicePose(RigidPose(Vector3(0.3, 0.2, 3)));
      };
      run_session(*stand.session, device, feeders, {}, ticks(std::int64_t(90 / runs), false));
    }
    shapes.push_back(stand.session->tissue_vertices(0));
  }
  EXPECT_EQ(numbers[0].size(), 11u);
  EXPECT_EQ(numbers[0], numbers[1]);
  EXPECT_EQ(shapes[0], shapes[1]);
}

class Counter final : public TissueModel {
 public:
  ContactSearch search() const override { return {1, 0, 1}; }
  void step(const TissueNews& news, std::span<Vector3>) override {
    numbers.push_back(news.number);
    snapshots.push_back(news.progress.snapshot);
  }
  std::vector<std::int64_t> numbers;
  std::vector<std::int64_t> snapshots;
};

// A model that comes to a session that has moved before is asked once a period, as a first one.
TEST(TissueFeeder, BeginsWhereTheSessionIs) {
  Stand stand;
  run_session(*stand.session, Stand::device, {stand.feed}, {}, ticks(95, false));
  const std::int64_t before = stand.session->snapshots_taken(0);
  const auto counter = std::make_shared<Counter>();
  TissueFeed feed;
  feed.period = 0.01;
  feed.model = counter;
  TissueFeeder feeder(*stand.session, feed);
  std::vector<DevicePose> devices{Stand::device(0)};
  int given = 0;
  for (int k = 0; k < 100; ++k) {
    given += feeder.offer() ? 1 : 0;
    const HapticTick& tick = stand.session->update(devices[0], 1e-3);
    feeder.tell(devices, 1e-3, std::span(&tick, 1));
  }
  EXPECT_NEAR(given, 10, 1);
  // The last one may wait for the session to take it.
  const auto asked = std::int64_t(counter->numbers.size());
  ASSERT_TRUE(asked == given || asked == given + 1) << asked << ' ' << given;
  EXPECT_EQ(counter->numbers.back(), asked);
  for (std::size_t k = 2; k < counter->snapshots.size(); ++k) {
    EXPECT_EQ(counter->snapshots[k] - counter->snapshots[k - 1], 1);
  }
  EXPECT_GT(stand.session->snapshots_taken(0), before + 8);
  EXPECT_THROW(feeder.tell({}, 1e-3, {}), InvalidArgument);
}

// A model whose steps take so many ticks, by a clock that only the test moves.
struct SlowModel {
  explicit SlowModel(int ticks_a_step) : busy(ticks_a_step) {
    feed.period = 0.01;
    feed.model = std::make_shared<Counter>();
  }

  const HapticTick& tick(TissueFeeder& feeder) {
    if (tick_number++ % busy == 0) feeder.offer();
    const std::vector<DevicePose> devices{Stand::device(0)};
    const HapticTick& told = stand.session->update(devices[0], 1e-3);
    feeder.tell(devices, 1e-3, std::span(&told, 1));
    const ObstacleProgress& now = told.progress[0];
    if (now.snapshot > 0) {
      passed += 1e-3;
      simulated = feed.period * (Scalar(now.snapshot - 1) + now.fraction);
    }
    return told;
  }

  Stand stand;
  TissueFeed feed;
  int busy;
  std::int64_t tick_number = 0;
  Scalar passed = 0;     // of the session's time since the first snapshot set out
  Scalar simulated = 0;  // of the model's
};

TEST(TissueFeeder, TellsHowFarItsModelIsBehind) {
  for (const int busy : {1, 9, 10, 25, 70}) {
    SlowModel slow(busy);
    TissueFeeder feeder(*slow.stand.session, slow.feed);
    for (int k = 0; k < 1000; ++k) {
      const Scalar behind = slow.tick(feeder).tissue_behind;
      EXPECT_NEAR(behind, slow.passed - slow.simulated, 1e-12) << busy << ' ' << k;
      if (busy < 10) {
        EXPECT_EQ(behind, 0) << busy << ' ' << k;
      }
    }
    const Scalar share = std::max(Scalar{0}, 1 - 10 / Scalar(busy));
    EXPECT_NEAR(slow.stand.session->last().tissue_behind, share * 1, 0.1) << busy;
    EXPECT_EQ(slow.stand.session->last().tissue_lag, 0);
  }
}

// Nothing is late while the first snapshot is made, nor where no snapshots are expected.
TEST(TissueFeeder, IsNotBehindBeforeItsFirstSnapshot) {
  SlowModel slow(1);
  slow.tick_number = 1;
  slow.busy = 200;
  TissueFeeder feeder(*slow.stand.session, slow.feed);
  for (int k = 0; k < 199; ++k) {
    EXPECT_EQ(slow.tick(feeder).tissue_behind, 0) << k;
  }
  Stand stand;
  ASSERT_TRUE(stand.session->give_snapshot(0, stand.sheet.vertices, 0.01));
  for (int k = 0; k < 50; ++k) {
    EXPECT_EQ(stand.session->update(Stand::device(0), 1e-3).tissue_behind, 0) << k;
  }
}

TEST(HapticRunner, IsNeverBehindUnpaced) {
  Stand stand;
  run_session(
      *stand.session, Stand::device, {stand.feed},
      [](const TickRecord& record) { EXPECT_EQ(record.tick.tissue_behind, 0); }, ticks(300, false));
}

TEST(TissueFeeder, NamesWhatIsWrong) {
  Stand stand;
  const auto message = [&](const auto& change) {
    std::vector<TissueFeed> feeds{stand.feed};
    change(feeds);
    return testing::message_of([&] { make_feeders(*stand.session, feeds); });
  };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(message([](auto& feeds) { feeds[0].obstacle = 7; }), "no obstacle 7 of 1");
  EXPECT_THROW(stand.session->expect_snapshots(7), InvalidArgument);
  has(message([](auto& feeds) { feeds[0].period = 0; }), "period must be finite and > 0, not 0");
  has(message([](auto& feeds) { feeds[0].shape = {}; }), "neither a model nor a shape");
  has(message([](auto& feeds) { feeds.push_back(feeds[0]); }), "two feeds are of obstacle 0");
}

TEST(LatencyHistogram, QuantilesAreNoWiderThanABin) {
  LatencyHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5).count(), 0);
  for (int k = 1; k <= 1000; ++k) histogram.add(std::chrono::microseconds(k));
  EXPECT_EQ(histogram.count(), 1000);
  EXPECT_EQ(histogram.worst(), std::chrono::microseconds(1000));
  for (const double part : {0.1, 0.5, 0.9, 0.999}) {
    const double found = double(histogram.quantile(part).count());
    EXPECT_GE(found, part * 1e6 * 0.999) << part;
    EXPECT_LE(found, part * 1e6 * 1.1) << part;
  }
  EXPECT_EQ(histogram.quantile(1), histogram.worst());
  EXPECT_THROW(histogram.quantile(1.5), InvalidArgument);
}

}  // namespace
}  // namespace dyop
