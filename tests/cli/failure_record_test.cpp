// SPDX-License-Identifier: BSD-3-Clause
#include "cli/failure_record.h"

#include <gtest/gtest.h>

#include "dyop/geometry/primitives.h"
#include "dyop/io/query_record.h"
#include "dyop/motion/steady_motions.h"
#include "support/temporary_directory.h"

namespace dyop::cli {
namespace {

class FailureRecord : public ::testing::Test {
 protected:
  ToiQuery query() const { return {&ball_, &rest_, &ball_, &rest_, {0, 1}, {}}; }

  // What the query ends in if asking for it throws `error`.
  template <typename Error>
  std::string message_after(const Error& error, const std::string& file) const {
    try {
      answer_or_record(query(), file, [&]() -> ToiResult { throw error; });
    } catch (const InternalError& internal) {
      return internal.what();
    }
    return "no internal error";
  }

  testing::TemporaryDirectory directory_;
  std::string file_ = (directory_.path() / "query.json").string();
  Sphere ball_{1};
  RestMotion rest_;
};

TEST_F(FailureRecord, IsNotMadeOfAnAnswer) {
  ToiResult result;
  result.t_safe = 0.5;
  EXPECT_EQ(answer_or_record(query(), file_, [&] { return result; }).t_safe, 0.5);
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST_F(FailureRecord, IsMadeOfAnInternalError) {
  EXPECT_EQ(message_after(InternalError("the impossible"), file_),
            "the impossible; the query is recorded in " + file_);
  EXPECT_EQ(QueryRecord(file_).failure(), "the impossible");
}

TEST_F(FailureRecord, IsMadeOfWhatDyopDoesNotThrow) {
  message_after(std::logic_error("no such state"), file_);
  EXPECT_EQ(QueryRecord(file_).failure(), "no such state");
}

TEST_F(FailureRecord, IsNotMadeOfTheCallersMistake) {
  EXPECT_THROW(
      answer_or_record(query(), file_, []() -> ToiResult { throw InvalidArgument("negative"); }),
      InvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST_F(FailureRecord, ThatCannotBeWrittenHidesNothing) {
  const std::string message = message_after(InternalError("the impossible"), "/no/such/folder/x");
  EXPECT_TRUE(message.starts_with("the impossible; the query could not be recorded: ")) << message;
}

}  // namespace
}  // namespace dyop::cli
