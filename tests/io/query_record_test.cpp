// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/query_record.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <stop_token>

#include "dyop/geometry/primitives.h"
#include "dyop/io/file_error.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "geometry/all_shapes.h"
#include "motion/all_motions.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using Json = nlohmann::ordered_json;

ToiResult ask(const ToiQuery& query) {
  return time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval,
                        query.options);
}

// A cube of half extent 1 at the origin, and one that comes from z = 5 at speed 2: the gap of 3 is
// closed at t = 1.5.
class QueryRecords : public ::testing::Test {
 protected:
  QueryRecords()
      : cube_(testing::box_mesh(Vector3(1, 1, 1)).mesh()),
        falling_(RigidPose(Vector3(0.1, 0.2, 5)), Twist{{0, 0, -2}, {0.1, 0.2, 0.3}}) {}

  ToiQuery query() const { return {&cube_, &rest_, &cube_, &falling_, {0, 3}, {}}; }

  void expect_same_after_reading(const ToiQuery& query) const {
    const ToiResult result = ask(query);
    write_query_record(file_, query, result);
    const QueryRecord record(file_);
    EXPECT_EQ(record.version(), library_version());
    EXPECT_EQ(record.failure(), "");
    for (const FieldDifference& difference : record.differences(ask(record.query()))) {
      ADD_FAILURE() << difference.field << ": " << difference.recorded << ", " << difference.now;
    }
  }

  Json written() const { return Json::parse(std::ifstream(file_)); }

  void expect_refused(const Json& json, const std::string& part) const {
    std::ofstream(file_) << json.dump();
    try {
      QueryRecord{file_};
      ADD_FAILURE() << "accepted, expected " << part;
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }

  testing::TemporaryDirectory directory_;
  std::filesystem::path file_ = directory_.path() / "query.json";
  TriangleMesh cube_;
  RestMotion rest_;
  ConstantTwistMotion falling_;
};

TEST_F(QueryRecords, GiveTheSameBitsForEveryMotion) {
  testing::Random random(5);
  for (const testing::MotionMaker& maker : testing::kAllMotions) {
    if (std::string(maker.name) == "user") continue;
    SCOPED_TRACE(maker.name);
    for (int k = 0; k < 4; ++k) {
      const auto motion =
          maker.make(random, {.length = 4, .distance = 3, .turn = 2, .span = {0, 3}});
      ToiQuery with_motion = query();
      with_motion.X_WA = motion.get();
      expect_same_after_reading(with_motion);
      // Also where the query did not look.
      const QueryRecord record(file_);
      for (int i = 0; i <= 30; ++i) {
        const RigidPose X = motion->pose(i * 0.1);
        const RigidPose Y = record.query().X_WA->pose(i * 0.1);
        ASSERT_EQ(X.rotation(), Y.rotation());
        ASSERT_EQ(X.translation(), Y.translation());
      }
    }
  }
}

TEST_F(QueryRecords, GiveTheSameBitsForEveryShape) {
  for (const testing::ShapeMaker& maker : testing::all_shapes()) {
    SCOPED_TRACE(maker.name);
    const auto shape = maker.make(0.7);
    ToiQuery with_shape = query();
    with_shape.a = shape.get();
    with_shape.options.with_contacts = true;
    expect_same_after_reading(with_shape);
  }
  const TriangleMesh soup = testing::random_soup(60, 0.5, 3).mesh();
  ToiQuery with_soup = query();
  with_soup.a = &soup;
  expect_same_after_reading(with_soup);
}

TEST_F(QueryRecords, KeepOptionsAndInterval) {
  ToiQuery asked = query();
  asked.interval = {-0.1, 2.7};
  asked.options.target_distance = 0.1;
  asked.options.distance_tolerance = 1.0 / 3;
  asked.options.max_node_pairs = 12345;
  asked.options.with_contacts = true;
  asked.options.solid_b = true;
  expect_same_after_reading(asked);
  const QueryRecord record(file_);
  const ToiQuery read = record.query();
  EXPECT_EQ(read.interval, asked.interval);
  EXPECT_EQ(read.options.target_distance, asked.options.target_distance);
  EXPECT_EQ(read.options.distance_tolerance, asked.options.distance_tolerance);
  EXPECT_EQ(read.options.max_node_pairs, asked.options.max_node_pairs);
  EXPECT_TRUE(read.options.with_contacts);
  EXPECT_FALSE(read.options.solid_a);
  EXPECT_TRUE(read.options.solid_b);
}

TEST_F(QueryRecords, HoldNumbersInHexadecimal) {
  const ToiQuery asked = query();
  write_query_record(file_, asked, ask(asked));
  const Json json = written();
  EXPECT_EQ(json["b"]["motion"]["X_WB0"]["position"][2], "0x1.4p+2");  // 5
  EXPECT_EQ(json["b"]["motion"]["v_WB"][2], "-0x1p+1");
  EXPECT_EQ(json["a"]["shape"]["vertices"].size(), 8u);
}

TEST_F(QueryRecords, TellEveryFieldThatDiffers) {
  const ToiQuery asked = query();
  const ToiResult result = ask(asked);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  write_query_record(file_, asked, result);
  const QueryRecord record(file_);
  ToiResult other = result;
  other.t_safe = std::nextafter(result.t_safe, 0);
  other.contact->p_WCa.y() += 1;
  other.t_hit.reset();
  const std::vector<FieldDifference> differences = record.differences(other);
  ASSERT_EQ(differences.size(), 4u);  // the pivot follows the witness points
  EXPECT_EQ(differences[0].field, "t_safe");
  EXPECT_NE(differences[0].recorded, differences[0].now);
  EXPECT_EQ(differences[1].field, "t_hit");
  EXPECT_EQ(differences[1].now, "null");
  EXPECT_EQ(differences[2].field, "contact.p_WCa[1]");
}

TEST_F(QueryRecords, RepeatWhatADeadlineEnded) {
  const TriangleMesh ball = testing::icosphere(3).mesh();
  ToiQuery asked = query();
  asked.a = &ball;
  asked.options.max_node_pairs = 64;
  ToiResult stopped = ask(asked);
  ASSERT_EQ(stopped.status, ToiStatus::BudgetExhausted);
  asked.options.max_node_pairs = 1000000;  // as if the clock had ended it
  write_query_record(file_, asked, stopped);
  const QueryRecord record(file_);
  EXPECT_EQ(record.query().options.max_node_pairs, 64);
  EXPECT_TRUE(record.differences(ask(record.query())).empty());
  stopped.statistics.node_pairs = 0;
  EXPECT_THROW(write_query_record(file_, asked, stopped), InvalidArgument);
}

TEST_F(QueryRecords, RefuseWhatNoFileHolds) {
  testing::Random random(1);
  const auto user = testing::user(random, {.span = {0, 3}});
  const testing::MotionPointer rest = std::make_shared<RestMotion>();
  const ComposedMotion composed(rest, user);
  for (const Motion* motion : {user.get(), static_cast<const Motion*>(&composed)}) {
    ToiQuery asked = query();
    asked.X_WA = motion;
    EXPECT_THROW(write_query_record(file_, asked, ask(asked)), InvalidArgument);
  }
  ToiQuery cancelled = query();
  std::stop_source stop;
  stop.request_stop();
  cancelled.options.stop = stop.get_token();
  EXPECT_THROW(write_query_record(file_, cancelled, ask(cancelled)), InvalidArgument);
  EXPECT_THROW(write_query_record(file_, query(), ToiResult{}), InvalidArgument);
  EXPECT_THROW(write_query_record(directory_.path() / "no" / "such", query(), ask(query())),
               FileError);
  // A shape of the user's.
  class Dot final : public ConvexShape {
   public:
    SupportPoint core_support(const Vector3&) const override { return {}; }
    Vector3 core_center() const override { return Vector3::Zero(); }
    AlignedBox bounding_box() const override { return {Vector3::Zero(), Vector3::Zero()}; }
    Scalar bounding_radius() const override { return 0; }
    MassProperties compute_mass_properties(Scalar) const override { return {}; }
  };
  const Dot dot;
  ToiQuery strange = query();
  strange.a = &dot;
  EXPECT_THROW(write_query_record(file_, strange, ask(query())), InvalidArgument);
}

TEST_F(QueryRecords, HoldFailures) {
  write_failure_record(file_, query(), "the impossible happened");
  const QueryRecord record(file_);
  EXPECT_EQ(record.failure(), "the impossible happened");
  EXPECT_FALSE(record.differences(ask(record.query())).empty());
}

TEST_F(QueryRecords, RefuseDamageByName) {
  write_query_record(file_, query(), ask(query()));
  const Json good = written();
  const auto with = [&](const char* pointer, const Json& value) {
    Json json = good;
    json[Json::json_pointer(pointer)] = value;
    return json;
  };
  expect_refused(with("/dyop_query_record", 2), "dyop_query_record: expected 1, found 2");
  expect_refused(with("/surprise", 2), "surprise");
  expect_refused(with("/failure", "both"), "either result or failure");
  expect_refused(with("/result", 3), "result: expected the fields of a result");
  expect_refused(with("/a/motion/kind", "dance"), "a.motion.kind: expected one of rest");
  expect_refused(with("/a/shape/kind", "torus"), "a.shape.kind: expected one of mesh");
  expect_refused(with("/a/shape/triangles/0/0", 99), "99");
  expect_refused(with("/a/shape/triangles/0", Json::array({0, 1})), "three vertex numbers");
  expect_refused(with("/a/shape/triangles/0/0", 0.5), "three vertex numbers");
  expect_refused(with("/interval/0", "0x1p+9"), "interval: time interval must not be reversed");
  for (const char* text : {"1.5", "0x", "0x1p", "0x1p+9999", "0x-1p+0", "nan", "inf", "0x1p+0 "}) {
    expect_refused(with("/interval/0", text), "interval[0]: expected a finite number");
  }
  expect_refused(with("/b/motion/v_WB/0", "fast"), "b.motion.v_WB: expected 3 times a finite");
  expect_refused(with("/b/motion/X_WB0/rotation/0", "0x1p+1"), "orthonormal");
  expect_refused(with("/options/max_node_pairs", 0), "options.max_node_pairs: expected an integer");
  // Deeper than any answer.
  Json deep = 1;
  for (int k = 0; k < 20; ++k) deep = Json::array({deep});
  expect_refused(with("/result/t_safe", deep), "result: expected the fields of a result");
}

TEST_F(QueryRecords, MayBeWrittenByHandInDecimal) {
  write_query_record(file_, query(), ask(query()));
  Json json = written();
  json["interval"] = {0, 2.5};
  std::ofstream(file_) << json.dump();
  EXPECT_EQ(QueryRecord(file_).query().interval, (TimeInterval{0, 2.5}));
}

}  // namespace
}  // namespace dyop
