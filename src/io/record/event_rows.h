// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string_view>

#include "dyop/io/recorded_run.h"
#include "io/record/recording_rows.h"

/// Impacts, pairs, events and reports as rows, and back.
namespace dyop::io_internal {

inline Row3 row_of(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

inline Vector3 vector_of(const Row3& row) {
  return {row[0], row[1], row[2]};
}
inline Vector3 vector_of(const FloatRow3& row) {
  return {Scalar(row[0]), Scalar(row[1]), Scalar(row[2])};
}

std::string_view name_of_kind(BodyKind kind);
/// Throws InvalidArgument.
BodyKind kind_of_name(std::string_view name);

/// A report with one of these statuses did not reach its end.
bool is_undecided(AdvanceStatus status);

/// Does not set the rows of contacts; the caller does.
ImpactRow impact_row(const ImpactEvent& impact);
ImpactEvent impact_from(const ImpactRow& row, std::span<const ContactRow> contacts);
ContactRow contact_row(const WorldContact& contact);

PairRow pair_row(const PairRecord& record);
PairRecord pair_from(const PairRow& row, std::span<const PairContactRow> contacts);
PairContactRow pair_contact_row(const PairContact& contact, const Vector3& pivot_W);

EventRow event_row(const RunEvent& event);
RunEvent event_from(const EventRow& row);

/// Everything in a frame except its start, its energies and the lengths.
void put_report(const AdvanceReport& report, FrameRow& row);
RecordedFrame frame_from(const FrameRow& row);

}  // namespace dyop::io_internal
