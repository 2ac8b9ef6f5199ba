// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "dyop/io/recording.h"
#include "io/json_reader.h"
#include "io/record/recording_rows.h"

namespace dyop::io_internal {

/// Throws FileError unless it is a recording of the version that this program reads.
Hdf5File open_recording(const std::filesystem::path& path);

/// All datasets of a recording, each as long as it was when it was opened. `frames` comes first:
/// its last row says how long the others are at least.
struct Input {
  template <typename Row>
  InputRows<Row> table(const char* name) {
    return {file, name, row_type<Row>().get(), 1};
  }
  template <typename Row>
  std::optional<InputRows<Row>> since_impulses(const char* name) {
    if (file.integer_attribute("version") < kVersionWithImpulses) return std::nullopt;
    return table<Row>(name);
  }
  InputRows<char> text(const char* name) { return {file, name, H5T_NATIVE_UINT8, 1}; }

  Hdf5File file;
  InputRows<FrameRow> frames = table<FrameRow>("frames");
  InputRows<StepRow> steps = table<StepRow>("steps");
  InputRows<SegmentRow> segments = table<SegmentRow>("segments");
  InputRows<Scalar> numbers{file, "numbers", H5T_NATIVE_DOUBLE, 1};
  InputRows<ImpactRow> impacts = table<ImpactRow>("impacts");
  InputRows<ContactRow> contacts = table<ContactRow>("contacts");
  InputRows<PairRow> pairs = table<PairRow>("pairs");
  InputRows<PairContactRow> pair_contacts = table<PairContactRow>("pair_contacts");
  InputRows<EventRow> events = table<EventRow>("events");
  InputRows<char> bodies = text("bodies");
  InputRows<char> shapes = text("shapes");
  InputRows<std::array<double, 3>> vertices{file, "vertices", H5T_NATIVE_DOUBLE, 3};
  InputRows<std::array<std::int32_t, 3>> triangles{file, "triangles", H5T_NATIVE_INT32, 3};
  InputRows<char> given = text("given");
  InputRows<char> end = text("end");

  /// Since version 3; none in older files.
  std::optional<InputRows<char>> rules = file.integer_attribute("version") < kVersionWithImpulses
                                             ? std::nullopt
                                             : std::optional(text("rules"));
  std::optional<InputRows<VelocityChangeRow>> changes =
      since_impulses<VelocityChangeRow>("velocity_changes");
  std::optional<InputRows<MomentumRow>> momenta = since_impulses<MomentumRow>("momenta");
  std::optional<InputRows<ContactImpulseRow>> contact_impulses =
      since_impulses<ContactImpulseRow>("contact_impulses");
  std::optional<InputRows<LinkImpulseRow>> link_impulses =
      since_impulses<LinkImpulseRow>("link_impulses");
  std::optional<InputRows<WrenchImpulseRow>> wrench_impulses =
      since_impulses<WrenchImpulseRow>("wrench_impulses");

  explicit Input(const std::filesystem::path& path) : file(open_recording(path)) {}
};

/// Runs f; errors in the content of `file` become a FileError.
template <typename Function>
auto guard_content(const std::filesystem::path& file, Function f) {
  try {
    return f();
  } catch (const InvalidArgument& error) {
    throw FileError(file, error.what());
  } catch (const Json::exception& error) {
    throw FileError(file, error.what());
  }
}

std::string text_of(const std::vector<char>& bytes);

/// Both throw exceptions of nlohmann for a text of the wrong form.
std::vector<Json> json_lines(const std::string& text);
RunHeader header_from(const Json& json);

}  // namespace dyop::io_internal
