// SPDX-License-Identifier: BSD-3-Clause

// Query records of any bytes: a query that can be asked and is refused or answered with its
// promises kept, or a FileError with a readable message.

#include <algorithm>
#include <filesystem>

#include "dyop/io/file_error.h"
#include "dyop/io/query_record.h"
#include "dyop/toi/time_of_impact.h"
#include "fuzz/fuzz_input.h"
#include "fuzz/scratch_file.h"
#include "support/oracles/toi_promises.h"

namespace dyop::fuzz {
namespace {

void check(const QueryRecord& record) {
  ToiQuery query = record.query();
  constexpr std::int64_t kBudget = 500;
  query.options.max_node_pairs = std::min(query.options.max_node_pairs, kBudget);
  const ToiResult result =
      time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval, query.options);
  const char* const broken = testing::broken_form(query, result);
  require(broken == nullptr, broken == nullptr ? "" : broken);
  record.differences(result);
}

}  // namespace
}  // namespace dyop::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dyop;
  const std::filesystem::path file = fuzz::scratch_file(".json", data, size);
  try {
    fuzz::check(QueryRecord(file));
  } catch (const Error& error) {
    fuzz::require_readable(error.what());
  }
  std::filesystem::remove(file);
  return 0;
}
