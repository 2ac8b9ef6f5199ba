// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "dyop/toi/time_of_impact.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

/// Writes a query and its result so that both can be compared bit by bit later: shapes and motions
/// by value, every number in hexadecimal floating point. Format: docs/formats.md.
///
/// A query ended by its deadline is recorded with a budget equal to the node pairs it used, which
/// ends it at the same point.
/// @param query The query as asked, with valid options; shapes and motions must be dyop's own.
/// @param result From time_of_impact(); one of resume_time_of_impact() counts its own work only.
/// @throws InvalidArgument for another shape or motion (a UserMotion is code, not data),
///         or an answer that cannot be reproduced: Cancelled, NotRun, or stopped before its first
///         step. FileError if the file cannot be written.
void write_query_record(const std::filesystem::path& file, const ToiQuery& query,
                        const ToiResult& result);

/// The same for a query that threw an exception with this message.
void write_failure_record(const std::filesystem::path& file, const ToiQuery& query,
                          const std::string& failure);

/// One field in which two results differ.
struct FieldDifference {
  std::string field;     ///< such as "contact.p_WCa[2]"
  std::string recorded;  ///< JSON, numbers in hexadecimal; empty if absent
  std::string now;
};

/// A query read from a record. Owns its shapes and motions.
class QueryRecord {
 public:
  /// @throws FileError naming the key, what was expected and found.
  explicit QueryRecord(const std::filesystem::path& file);
  ~QueryRecord();
  QueryRecord(QueryRecord&&) noexcept;
  QueryRecord& operator=(QueryRecord&&) noexcept;

  /// Version of dyop that wrote it.
  const std::string& version() const;

  /// Refers to data of this record.
  ToiQuery query() const;

  /// The message of the error that ended the query; empty if it was answered.
  const std::string& failure() const;

  /// All fields of a result that differ in any bit from the recorded ones, where all NaNs are
  /// equal; every field if the recorded query failed.
  std::vector<FieldDifference> differences(const ToiResult& now) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// The version of this library, such as "0.1.0".
std::string library_version();

}  // namespace dyop
