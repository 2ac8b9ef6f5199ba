// SPDX-License-Identifier: BSD-3-Clause

// Queries that once went wrong, or that are easily got wrong, by their records in tests/regression.
// Held to the recorded status and to the promises of ToiResult, not to the last bit, which another
// version or another C library may round differently.

#include <gtest/gtest.h>

#include <filesystem>

#include "dyop/io/query_record.h"
#include "dyop/io/result_text.h"
#include "dyop/toi/time_of_impact.h"
#include "support/oracles/toi_promises.h"

namespace dyop::testing {
namespace {

std::vector<std::filesystem::path> record_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(DYOP_REGRESSION_RECORDS)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

class RegressionRecords : public ::testing::TestWithParam<std::filesystem::path> {};

TEST_P(RegressionRecords, KeepStatusAndPromises) {
  const QueryRecord record(GetParam());
  const ToiQuery query = record.query();
  const ToiResult result =
      time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval, query.options);
  for (const FieldDifference& difference : record.differences(result)) {
    EXPECT_NE(difference.field, "status") << difference.recorded << " is now " << difference.now;
  }
  EXPECT_STREQ(broken_form(query, result), nullptr);
  EXPECT_STREQ(ToiJudge(query).broken_distance(result, 200), nullptr);
}

std::string test_name(const ::testing::TestParamInfo<std::filesystem::path>& info) {
  return info.param.stem().string();
}

INSTANTIATE_TEST_SUITE_P(All, RegressionRecords, ::testing::ValuesIn(record_files()), test_name);

}  // namespace
}  // namespace dyop::testing
