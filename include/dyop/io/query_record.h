#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "dyop/toi/toi_batch.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

/// Writes a query and its answer so that both can be compared bit by bit later: shapes and motions
/// by value, every number in hexadecimal floating point. Format: docs/replay-format.md.
///
/// A query that its deadline ended is recorded with a budget of the node pairs it took, which ends
/// it at the same place.
/// @param query As it was asked, with valid options; the shapes and motions must be dyop's own.
/// @param result Of time_of_impact(); that of resume_time_of_impact() counts its own work only.
/// @throws InvalidArgument for another shape or motion (a UserMotion is code, which no file holds),
///         or an answer that cannot be had again: Cancelled, NotRun, or stopped before its first
///         step. FileError if the file cannot be written.
void write_query_record(const std::filesystem::path& file, const ToiQuery& query,
                        const ToiResult& result);

/// The same for a query that ended in an exception with this message.
void write_failure_record(const std::filesystem::path& file, const ToiQuery& query,
                          const std::string& failure);

/// One field of an answer that is not the same.
struct FieldDifference {
  std::string field;     ///< as "contact.p_WCa[2]"
  std::string recorded;  ///< JSON, numbers in hexadecimal; empty: not there
  std::string now;
};

/// A query that was read from a record. Owns its shapes and motions.
class QueryRecord {
 public:
  /// @throws FileError naming the key, what was expected and found.
  explicit QueryRecord(const std::filesystem::path& file);
  ~QueryRecord();
  QueryRecord(QueryRecord&&) noexcept;
  QueryRecord& operator=(QueryRecord&&) noexcept;

  /// Of the dyop that wrote it.
  const std::string& version() const;

  /// Refers to this record.
  ToiQuery query() const;

  /// What the query ended in, if not in an answer; else empty.
  const std::string& failure() const;

  /// All fields of an answer that differ in any bit from those of the recorded one, NaNs being
  /// alike; all fields there are if that was a failure.
  std::vector<FieldDifference> differences(const ToiResult& now) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// The version of this library, as "0.1.0".
std::string library_version();

}  // namespace dyop
