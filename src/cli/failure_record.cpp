// SPDX-License-Identifier: BSD-3-Clause
#include "cli/failure_record.h"

#include "dyop/io/query_record.h"

namespace dyop::cli {
namespace {

[[noreturn]] void fail_with_record(const ToiQuery& query, const std::string& record_file,
                                   const std::string& failure) {
  const std::string file = record_file.empty() ? "dyop-failure.json" : record_file;
  std::string note = "; the query is recorded in " + file;
  try {
    write_failure_record(file, query, failure);
  } catch (const Error& error) {
    note = std::string("; the query could not be recorded: ") + error.what();
  }
  throw InternalError(failure + note);
}

}  // namespace

ToiResult answer_or_record(const ToiQuery& query, const std::string& record_file,
                           const std::function<ToiResult()>& ask) {
  try {
    return ask();
  } catch (const InternalError& error) {
    fail_with_record(query, record_file, error.what());
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    fail_with_record(query, record_file, error.what());
  }
}

}  // namespace dyop::cli
