// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/recording.h"

#include <gtest/gtest.h>

#include <random>

#include "dyop/io/file_error.h"
#include "io/record/hdf5_file.h"
#include "io/record/recorded_world.h"
#include "io/record/recording_version.h"
#include "support/message_of.h"
#include "support/same_bits.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using testing::busy_header;
using testing::has_same_bits;
using testing::kBusyFrames;

class Recording : public ::testing::Test {
 protected:
  std::filesystem::path file(const char* name = "run.h5") const { return directory_.path() / name; }
  testing::TemporaryDirectory directory_;
};

// Every frame can be read as soon as it is written.
const RecordingOptions kAtOnce{.longest_delay = 0};

// Compares the reader with the motions of the run, at random times and at both ends of every step.
void expect_same_motions(const RecordingReader& reader, const std::vector<AdvanceReport>& reports) {
  std::mt19937 random(1);
  std::uniform_real_distribution<Scalar> part(0, 1);
  int checked = 0;
  for (const AdvanceReport& report : reports) {
    for (const CommittedStep& step : report.steps) {
      for (std::size_t body = 0; body < step.motions.size(); ++body) {
        for (int k = 0; k < 8; ++k) {
          const Scalar t = k == 0 ? step.interval.begin
                                  : step.interval.begin + part(random) * step.interval.length();
          if (t >= step.interval.end) continue;
          ASSERT_TRUE(has_same_bits(reader.pose(BodyId(body), t), step.motions[body]->pose(t)))
              << "body " << body << " at " << t;
          const Twist twist = reader.state(BodyId(body), t).twist;
          const Twist expected = step.motions[body]->state(t).twist;
          ASSERT_TRUE(has_same_bits(twist.v_WB, expected.v_WB));
          ASSERT_TRUE(has_same_bits(twist.w_WB, expected.w_WB));
          ++checked;
        }
      }
    }
  }
  EXPECT_GT(checked, 5000);
}

TEST_F(Recording, GivesTheBitsOfTheCommittedMotions) {
  const std::vector<AdvanceReport> reports = testing::record_busy_run(file());
  const RecordingReader reader(file());
  EXPECT_EQ(reader.interval().end, reports.back().t);
  expect_same_motions(reader, reports);
}

TEST_F(Recording, KeepsHeaderBodiesStepsAndEnd) {
  const std::vector<AdvanceReport> reports = testing::record_busy_run(file());
  const RecordingReader reader(file());
  EXPECT_EQ(reader.header().title, busy_header().title);
  EXPECT_EQ(reader.header().scene, busy_header().scene);
  EXPECT_EQ(reader.header().rest_offset, 0.25);
  EXPECT_FALSE(reader.header().target_distance.has_value());
  EXPECT_EQ(reader.gravity(), testing::busy_world().gravity());
  EXPECT_NE(reader.gravity(), Vector3(Vector3::Zero()));
  ASSERT_EQ(reader.bodies().size(), 8u);
  EXPECT_EQ(reader.bodies()[0].kind, BodyKind::Static);
  EXPECT_EQ(reader.bodies()[3].name, "thrown");
  EXPECT_EQ(reader.bodies()[3].shape, reader.bodies()[5].shape);  // stored once
  EXPECT_EQ(reader.bodies()[4].p_BoBcm, Vector3(0, 0.02, 0.2));
  EXPECT_TRUE(reader.bodies()[7].is_sensor);
  std::vector<TimeInterval> steps;
  for (const AdvanceReport& report : reports) {
    for (const CommittedStep& step : report.steps) steps.push_back(step.interval);
  }
  ASSERT_EQ(reader.steps().size(), steps.size());
  for (std::size_t k = 0; k < steps.size(); ++k) {
    EXPECT_EQ(reader.steps()[k].begin, steps[k].begin);
    EXPECT_EQ(reader.steps()[k].end, steps[k].end);
  }
  ASSERT_TRUE(reader.end().has_value());
  EXPECT_EQ(reader.end()->status, AdvanceStatus::Completed);
  EXPECT_EQ(reader.end()->error, "");
}

TEST_F(Recording, KeepsImpactsAndEvents) {
  const std::vector<AdvanceReport> reports = testing::record_busy_run(file());
  const RecordingReader reader(file());
  std::vector<ImpactEvent> impacts;
  std::size_t asleep = 0;
  std::size_t sensed = 0;
  for (const AdvanceReport& report : reports) {
    impacts.insert(impacts.end(), report.impacts.begin(), report.impacts.end());
    asleep += report.fell_asleep.size();
    sensed += report.sensors.size();
  }
  ASSERT_GT(impacts.size(), 2u);
  ASSERT_GT(asleep, 0u);
  ASSERT_GT(sensed, 0u);
  ASSERT_EQ(reader.impacts().size(), impacts.size());
  for (std::size_t k = 0; k < impacts.size(); ++k) {
    const ImpactEvent& read = reader.impacts()[k];
    EXPECT_EQ(read.t, impacts[k].t);
    EXPECT_EQ(read.a, impacts[k].a);
    EXPECT_EQ(read.b, impacts[k].b);
    EXPECT_EQ(read.toi.t_safe, impacts[k].toi.t_safe);
    EXPECT_EQ(read.toi.t_hit, impacts[k].toi.t_hit);
    EXPECT_EQ(read.toi.status, impacts[k].toi.status);
    ASSERT_EQ(read.contacts.size(), impacts[k].contacts.size());
    for (std::size_t i = 0; i < read.contacts.size(); ++i) {
      EXPECT_EQ(read.contacts[i].impulse_W, impacts[k].contacts[i].impulse_W);
      EXPECT_EQ(read.contacts[i].contact.lower, impacts[k].contacts[i].contact.lower);
      EXPECT_EQ(read.contacts[i].contact.p_WCb, impacts[k].contacts[i].contact.p_WCb);
      EXPECT_EQ(read.contacts[i].contact.feature_a, impacts[k].contacts[i].contact.feature_a);
      EXPECT_EQ(read.contacts[i].contact.triangle_a, impacts[k].contacts[i].contact.triangle_a);
    }
  }
  const auto count = [&](RunEventKind kind) {
    return std::count_if(reader.events().begin(), reader.events().end(),
                         [&](const RunEvent& event) { return event.kind == kind; });
  };
  EXPECT_EQ(count(RunEventKind::FellAsleep), std::ptrdiff_t(asleep));
  EXPECT_EQ(count(RunEventKind::SensorBegins) + count(RunEventKind::SensorEnds),
            std::ptrdiff_t(sensed));
}

TEST_F(Recording, KeepsPairsAndEnergyOfEveryFrame) {
  World world = testing::busy_world();
  std::vector<std::vector<PairRecord>> pairs;
  std::vector<Scalar> energies;
  {
    RecordingWriter writer(file(), busy_header(), kAtOnce);
    for (int k = 0; k < kBusyFrames; ++k) {
      writer.write(world.advance(busy_header().step), world);
      pairs.push_back(world.pairs());
      energies.push_back(world.kinetic_energy());
    }
  }
  const RecordingReader reader(file());
  EXPECT_FALSE(reader.end().has_value());
  ASSERT_EQ(reader.frames().size(), std::size_t(kBusyFrames));
  std::size_t contacts = 0;
  std::size_t left_out = 0;
  for (std::size_t frame = 0; frame < pairs.size(); ++frame) {
    EXPECT_EQ(reader.frames()[frame].kinetic_energy, energies[frame]);
    const std::vector<PairRecord> read = reader.pairs(frame);
    const std::vector<NearPair> near = reader.near_pairs(frame);
    ASSERT_EQ(near.size(), read.size());
    for (std::size_t k = 0; k < near.size(); ++k) {
      EXPECT_TRUE(near[k].a == read[k].a && near[k].b == read[k].b);
      EXPECT_EQ(near[k].gap_lower, read[k].gap_lower);
      EXPECT_EQ(std::size_t(near[k].contacts), read[k].contacts.size());
    }
    auto next = read.begin();
    for (const PairRecord& pair : pairs[frame]) {
      const bool is_there = next != read.end() && next->a == pair.a && next->b == pair.b;
      if (!is_there) {
        EXPECT_EQ(pair.proof, ProofKind::AtRest);
        ++left_out;
        continue;
      }
      EXPECT_EQ(next->proof, pair.proof);
      EXPECT_EQ(next->gap_lower, pair.gap_lower);
      EXPECT_EQ(next->gap_upper, pair.gap_upper);
      EXPECT_EQ(next->pivot_W, pair.pivot_W);
      EXPECT_EQ(next->residual, pair.residual);
      ASSERT_EQ(next->contacts.size(), pair.contacts.size());
      for (std::size_t i = 0; i < pair.contacts.size(); ++i) {
        const ContactPoint& expected = pair.contacts[i].point;
        const Scalar arm = (expected.p_WCa - pair.pivot_W).norm() + pair.pivot_W.norm() * 1e-8;
        EXPECT_LE((next->contacts[i].point.p_WCa - expected.p_WCa).norm(), 1e-7 * arm);
        EXPECT_EQ(next->contacts[i].point.lower, expected.lower);
        ++contacts;
      }
      ++next;
    }
    EXPECT_EQ(next, read.end());
  }
  EXPECT_GT(contacts, 100u);
  EXPECT_GT(left_out, 0u);
}

TEST_F(Recording, GrowsUnderTheEyesOfAReader) {
  World world = testing::busy_world();
  RecordingWriter writer(file(), busy_header(), kAtOnce);
  RecordingReader reader(file());
  EXPECT_EQ(reader.interval().length(), 0);
  EXPECT_EQ(reader.bodies().size(), 0u);
  EXPECT_FALSE(reader.refresh());
  for (int k = 1; k <= 40; ++k) {
    const AdvanceReport report = world.advance(busy_header().step);
    writer.write(report, world);
    EXPECT_TRUE(reader.refresh());
    EXPECT_EQ(reader.frames().size(), std::size_t(k));
    EXPECT_EQ(reader.interval().end, world.time());
    const CommittedStep& step = report.steps.back();
    const Scalar t = (step.interval.begin + step.interval.end) / 2;
    for (std::size_t body = 0; body < step.motions.size(); ++body) {
      EXPECT_TRUE(has_same_bits(reader.pose(BodyId(body), t), step.motions[body]->pose(t)));
    }
  }
  writer.fail("the solver gave up");
  EXPECT_TRUE(reader.refresh());
  ASSERT_TRUE(reader.end().has_value());
  EXPECT_EQ(reader.end()->error, "the solver gave up");
}

// However fast it is written, and without an end.
TEST_F(Recording, HasEveryFrameOfAWriterThatIsGone) {
  World world = testing::busy_world();
  {
    RecordingWriter writer(file(), busy_header());
    for (int k = 0; k < 50; ++k) writer.write(world.advance(busy_header().step), world);
  }
  const RecordingReader reader(file());
  EXPECT_EQ(reader.frames().size(), 50u);
  EXPECT_EQ(reader.interval().end, world.time());
  EXPECT_FALSE(reader.end().has_value());
}

TEST_F(Recording, RefusesADelayBelowZero) {
  RecordingOptions options;
  options.longest_delay = -1;
  EXPECT_NE(testing::message_of<InvalidArgument>([&] {
              RecordingWriter(file(), busy_header(), options);
            }).find("-1"),
            std::string::npos);
}

TEST_F(Recording, IsReadTwiceAtOnce) {
  const std::vector<AdvanceReport> reports = testing::record_busy_run(file());
  const RecordingReader first(file());
  expect_same_motions(first, reports);
  RecordingReader second(file());
  expect_same_motions(second, reports);
  EXPECT_FALSE(second.refresh());
  expect_same_motions(first, reports);
  expect_same_motions(second, reports);
}

TEST_F(Recording, WritesNothingForBodiesThatSleep) {
  World world = testing::busy_world();
  RecordingWriter writer(file(), busy_header(), kAtOnce);
  for (int k = 0; k < 400 && !world.is_asleep(BodyId(1)); ++k) {
    writer.write(world.advance(busy_header().step), world);
  }
  ASSERT_TRUE(world.is_asleep(BodyId(1)));
  RecordingReader reader(file());
  writer.write(world.advance(busy_header().step), world);
  reader.refresh();
  const std::size_t count = reader.segment_count(BodyId(1));
  for (int k = 0; k < 20; ++k) writer.write(world.advance(busy_header().step), world);
  reader.refresh();
  EXPECT_EQ(reader.segment_count(BodyId(1)), count);
  EXPECT_EQ(reader.segment_count(BodyId(0)), 1u);  // the floor
  EXPECT_EQ(reader.segment_count(BodyId(6)), 1u);  // a given motion is one
  EXPECT_EQ(reader.segment(BodyId(6), 0).kind, SegmentKind::Given);
}

TEST_F(Recording, FollowsBodiesThatComeAndGo) {
  World world = testing::busy_world();
  RecordingWriter writer(file(), busy_header(), kAtOnce);
  const Scalar step = busy_header().step;
  writer.write(world.advance(step), world);
  world.remove_body(BodyId(3));
  writer.write(world.advance(step), world);
  const BodyId added = world.add_body(
      testing::dynamic_body("late", std::make_shared<Box>(Vector3(0.1, 0.2, 0.3)), {9, 9, 9}));
  EXPECT_EQ(added.slot, 3u);
  writer.write(world.advance(step), world);
  const RecordingReader reader(file());
  EXPECT_NO_THROW(reader.pose(BodyId(3), 0.5 * step));
  EXPECT_THROW(reader.pose(BodyId(3), 1.5 * step), InvalidArgument);
  EXPECT_NEAR(reader.pose(BodyId(3), 2.5 * step).translation().x(), 9, 1e-12);
  EXPECT_EQ(reader.bodies()[3].name, "late");
}

TEST_F(Recording, StatesWhatItDoesNotHave) {
  testing::record_busy_run(file(), {PairDetail::None});
  const RecordingReader reader(file());
  EXPECT_TRUE(reader.pairs(0).empty());
  EXPECT_THROW(reader.pairs(kBusyFrames), InvalidArgument);
  EXPECT_THROW(reader.near_pairs(kBusyFrames), InvalidArgument);
  EXPECT_THROW(reader.pose(BodyId(0), -0.1), InvalidArgument);
  EXPECT_THROW(reader.pose(BodyId(0), 2.1), InvalidArgument);
  EXPECT_THROW(reader.pose(BodyId(8), 1), InvalidArgument);
  EXPECT_THROW(reader.segment(BodyId(0), 99), InvalidArgument);
}

// Here the bound for a run of every kind
// of motion, without what a file of any length has.
TEST_F(Recording, TakesAtMost250BytesASegment) {
  testing::record_busy_run(file(), {PairDetail::None});
  io_internal::Hdf5File input = io_internal::Hdf5File::open(file());
  const auto numbers = io_internal::Hdf5Dataset::open(input, "numbers", H5T_NATIVE_DOUBLE, 1);
  const RecordingReader reader(file());
  std::size_t segments = 0;
  for (std::size_t body = 0; body < reader.bodies().size(); ++body) {
    segments += reader.segment_count(BodyId(body));
  }
  constexpr std::size_t kRowBytes = 24;
  EXPECT_GT(segments, 100u);
  EXPECT_LE(numbers.length() * sizeof(Scalar), (250 - kRowBytes) * segments);
}

TEST_F(Recording, RefusesOtherFiles) {
  const auto message = [&](const std::filesystem::path& path) {
    return testing::message_of<FileError>([&] { RecordingReader reader(path); });
  };
  EXPECT_NE(message(file("none.h5")).find("no such file"), std::string::npos);
  EXPECT_NE(message(directory_.write("text.h5", "hello")).find("is not a readable HDF5 file"),
            std::string::npos);
  {
    io_internal::Hdf5File other = io_internal::Hdf5File::create(file("other.h5"));
    other.write_attribute("format", "something else");
    other.close();
  }
  EXPECT_NE(message(file("other.h5")).find("is no recording of dyop"), std::string::npos);
  {
    io_internal::Hdf5File other = io_internal::Hdf5File::create(file("new.h5"));
    other.write_attribute("format", "dyop recording");
    other.write_attribute("version", 99);
    other.close();
  }
  EXPECT_NE(message(file("new.h5")).find("version 99"), std::string::npos);
}

TEST_F(Recording, OfTheFirstVersionIsRead) {
  testing::record_busy_run(file());
  testing::set_version(file(), 1);
  EXPECT_FALSE(RecordingReader(file()).frames().empty());
  testing::set_version(file(), 0);
  EXPECT_THROW(RecordingReader{file()}, FileError);
}

TEST_F(Recording, RefusesAFileThatWasCutOff) {
  testing::record_busy_run(file());
  const std::string whole = testing::TemporaryDirectory::read(file());
  for (const std::size_t length : {whole.size() / 3, whole.size() / 2, whole.size() - 100}) {
    const auto cut = directory_.write("cut.h5", whole.substr(0, length));
    EXPECT_THROW(RecordingReader{cut}, FileError) << length;
  }
}

TEST_F(Recording, ReportsAFileThatCannotBeWritten) {
  EXPECT_THROW(RecordingWriter(directory_.path() / "no" / "run.h5", busy_header()), FileError);
}

// All impulses come back with every bit.
TEST_F(Recording, KeepsImpulsesExactly) {
  WorldOptions options = testing::earth_options();
  options.records_impulses = true;
  World world(options);
  world.add_body(testing::floor_body(0.5, 0.3));
  world.add_body(testing::resting_cube(0, 0, 0.01));
  std::vector<VelocityChange> changes;
  RecordingWriter writer(file(), {}, kAtOnce);
  for (int k = 0; k < 10; ++k) {
    const AdvanceReport report = world.advance(1.0 / 64);
    changes.insert(changes.end(), report.velocity_changes.begin(), report.velocity_changes.end());
    writer.write(report, world);
  }
  writer.finish();
  const std::vector<VelocityChange> read = RecordingReader(file()).velocity_changes();
  ASSERT_EQ(read.size(), changes.size());
  std::size_t contacts = 0;
  for (std::size_t k = 0; k < read.size(); ++k) {
    EXPECT_EQ(read[k].kind, changes[k].kind);
    EXPECT_EQ(read[k].interval, changes[k].interval);
    ASSERT_EQ(read[k].bodies.size(), changes[k].bodies.size());
    for (std::size_t i = 0; i < read[k].bodies.size(); ++i) {
      EXPECT_EQ(read[k].bodies[i].v_before_W, changes[k].bodies[i].v_before_W);
      EXPECT_EQ(read[k].bodies[i].L_before_W, changes[k].bodies[i].L_before_W);
      EXPECT_EQ(read[k].bodies[i].v_W, changes[k].bodies[i].v_W);
      EXPECT_EQ(read[k].bodies[i].L_W, changes[k].bodies[i].L_W);
    }
    ASSERT_EQ(read[k].contacts.size(), changes[k].contacts.size());
    contacts += read[k].contacts.size();
    for (std::size_t i = 0; i < read[k].contacts.size(); ++i) {
      EXPECT_EQ(read[k].contacts[i].p_W, changes[k].contacts[i].p_W);
      EXPECT_EQ(read[k].contacts[i].impulse_W, changes[k].contacts[i].impulse_W);
      EXPECT_EQ(read[k].contacts[i].target, changes[k].contacts[i].target);
    }
  }
  EXPECT_GT(contacts, 0U);
}

}  // namespace
}  // namespace dyop
