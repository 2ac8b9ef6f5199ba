// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/io/haptic_recording.h"
#include "io/record/haptic_inputs.h"
#include "io/record/recording_input.h"
#include "io/record/tick_row.h"

namespace dyop {
namespace {

using io_internal::Hdf5File;
using io_internal::InputRows;
using io_internal::Json;
using io_internal::TickRow;

Hdf5File open_haptic_recording(const std::filesystem::path& path) {
  Hdf5File file = Hdf5File::open(path);
  if (file.text_attribute("format") != io_internal::kToolRecordingFormat) {
    throw FileError(path, "is no recording of a tool");
  }
  const std::int64_t version = file.integer_attribute("version");
  if (version < 1 || version > io_internal::kToolRecordingVersion) {
    throw FileError(path,
                    core_internal::compose_message("is a recording of a tool of version ", version,
                                                   ", this program reads versions 1 to ",
                                                   io_internal::kToolRecordingVersion));
  }
  return file;
}

}  // namespace

struct HapticRecordingReader::Impl {
  explicit Impl(const std::filesystem::path& path) : file(open_haptic_recording(path)) {
    io_internal::guard_content(path, [&] {
      read_session();
      read_ticks();
      read_snapshots();
      if (file.integer_attribute("version") >= 2) read_meshes();
      if (file.integer_attribute("version") >= 6) read_inputs();
      read_end();
    });
  }

  std::string text(const char* name) {
    const InputRows<char> rows(file, name, H5T_NATIVE_UINT8, 1);
    return io_internal::text_of(rows.read(0, rows.length()));
  }
  void read_session();
  void read_ticks();
  void read_snapshots();
  void read_meshes();
  void read_inputs();
  void add_inputs(RecordedTick& tick) const;
  void read_end();

  Hdf5File file;
  HapticRunHeader header;
  io_internal::StoredSession session;
  std::optional<io_internal::Hdf5Dataset> ticks;
  template <typename Row>
  using RowsByNumber = std::map<std::pair<std::size_t, std::int64_t>, Row>;
  RowsByNumber<io_internal::SnapshotRow> snapshots;
  RowsByNumber<io_internal::MeshRow> meshes;
  std::optional<InputRows<std::array<double, 3>>> snapshot_vertices;
  std::optional<InputRows<std::array<std::int32_t, 3>>> snapshot_triangles;
  std::vector<io_internal::TimedInput> inputs;  // in the order of ticks
  std::optional<HapticRunEnd> end;

  TickRow row() const { return TickRow({session.scene, file.integer_attribute("version")}); }
  std::vector<RecordedTick> ticks_as_stored(std::int64_t first, std::int64_t count) const;
};

void HapticRecordingReader::Impl::read_session() {
  const Json json = Json::parse(file.text_attribute("header"));
  header.title = json.at("title").get<std::string>();
  header.period = json.at("period").get<Scalar>();
  header.version = json.at("version").get<std::string>();
  header.scene = text("scene");
  const InputRows<std::array<double, 3>> vertices(file, "vertices", H5T_NATIVE_DOUBLE, 3);
  const InputRows<std::array<std::int32_t, 3>> triangles(file, "triangles", H5T_NATIVE_INT32, 3);
  const io_internal::ShapeRows rows{vertices.read(0, vertices.length()),
                                    triangles.read(0, triangles.length())};
  std::vector<std::shared_ptr<const Shape>> shapes;
  for (const Json& line : io_internal::json_lines(text("shapes"))) {
    shapes.push_back(io_internal::shape_from(line, rows, shapes));
  }
  session = io_internal::session_from(Json::parse(text("session")), shapes);
}

// Before the snapshots, which the writer flushes first.
void HapticRecordingReader::Impl::read_ticks() {
  ticks.emplace(io_internal::Hdf5Dataset::open(file, "ticks", row().type().get(), 1));
}

void HapticRecordingReader::Impl::read_snapshots() {
  const InputRows<io_internal::SnapshotRow> rows(
      file, "snapshots", io_internal::row_type<io_internal::SnapshotRow>().get(), 1);
  for (const io_internal::SnapshotRow& row : rows.read(0, rows.length())) {
    snapshots[{row.obstacle, row.number}] = row;
  }
  snapshot_vertices.emplace(file, "snapshot_vertices", H5T_NATIVE_DOUBLE, 3);
}

void HapticRecordingReader::Impl::read_meshes() {
  const InputRows<io_internal::MeshRow> rows(
      file, "meshes", io_internal::row_type<io_internal::MeshRow>().get(), 1);
  for (const io_internal::MeshRow& row : rows.read(0, rows.length())) {
    meshes[{row.obstacle, row.number}] = row;
  }
  snapshot_triangles.emplace(file, "snapshot_triangles", H5T_NATIVE_INT32, 3);
}

// After the ticks, before which the writer flushes them.
void HapticRecordingReader::Impl::read_inputs() {
  for (const Json& line : io_internal::json_lines(text("inputs"))) {
    inputs.push_back(io_internal::input_from(line, session.scene));
  }
  DYOP_REQUIRE(std::ranges::is_sorted(inputs, {}, &io_internal::TimedInput::first),
               "the inputs are not in the order of their ticks");
}

void HapticRecordingReader::Impl::add_inputs(RecordedTick& tick) const {
  auto next = std::ranges::lower_bound(inputs, tick.number, {}, &io_internal::TimedInput::first);
  for (; next != inputs.end() && next->first == tick.number; ++next) {
    tick.inputs.push_back(next->second);
  }
}

void HapticRecordingReader::Impl::read_end() {
  const std::string words = text("end");
  if (words.empty()) return;
  const Json json = Json::parse(words);
  end.emplace();
  end->error = json.at("error").get<std::string>();
  end->ticks = json.value("ticks", std::int64_t(ticks->length()));
  end->late_starts = json.value("late_starts", std::int64_t{0});
  end->unlogged = json.value("unlogged", std::int64_t{0});
  end->rights = json.value("rights", std::string());
}

std::vector<RecordedTick> HapticRecordingReader::Impl::ticks_as_stored(std::int64_t first,
                                                                       std::int64_t count) const {
  TickRow stored = row();
  const std::size_t size = stored.bytes();
  std::vector<char> bytes(size * std::size_t(count));
  ticks->read(std::uint64_t(first), std::uint64_t(count), bytes.data());
  std::vector<RecordedTick> result;
  result.reserve(std::size_t(count));
  for (std::size_t k = 0; k < std::size_t(count); ++k) {
    stored.read_from(bytes.data() + k * size);
    result.push_back(io_internal::guard_content(
        file.path(), [&] { return io_internal::tick_from(stored, session.scene); }));
    add_inputs(result.back());
  }
  return result;
}

bool is_haptic_recording(const std::filesystem::path& file) {
  return Hdf5File::open(file).text_attribute("format") == io_internal::kToolRecordingFormat;
}

HapticRecordingReader::HapticRecordingReader(const std::filesystem::path& file)
    : impl_(std::make_unique<Impl>(file)) {}

HapticRecordingReader::~HapticRecordingReader() = default;
HapticRecordingReader::HapticRecordingReader(HapticRecordingReader&&) noexcept = default;
HapticRecordingReader& HapticRecordingReader::operator=(HapticRecordingReader&&) noexcept = default;

const HapticRunHeader& HapticRecordingReader::header() const {
  return impl_->header;
}

const HapticScene& HapticRecordingReader::scene() const {
  return impl_->session.scene;
}

const HapticOptions& HapticRecordingReader::options() const {
  return impl_->session.options;
}

std::span<const SnapshotSource> HapticRecordingReader::sources() const {
  return impl_->session.sources;
}

const std::optional<HapticRunEnd>& HapticRecordingReader::end() const {
  return impl_->end;
}

std::int64_t HapticRecordingReader::tick_count() const {
  return std::int64_t(impl_->ticks->length());
}

std::vector<RecordedTick> HapticRecordingReader::ticks(std::int64_t first,
                                                       std::int64_t count) const {
  DYOP_REQUIRE(first >= 0 && count >= 0 && first <= tick_count() && count <= tick_count() - first,
               "there are no ticks ", first, " to ", first + count, " among ", tick_count());
  std::vector<RecordedTick> ticks = impl_->ticks_as_stored(first, count);
  if (!impl_->row().tissue_stopped.empty()) return ticks;
  // From sums to what each tick added.
  Scalar before = first > 0 ? impl_->ticks_as_stored(first - 1, 1)[0].tissue_stopped : 0;
  for (RecordedTick& tick : ticks)
    tick.tissue_stopped -= std::exchange(before, tick.tissue_stopped);
  return ticks;
}

std::size_t HapticRecordingReader::bytes_per_tick() const {
  return impl_->row().bytes();
}

RecordedSnapshot HapticRecordingReader::snapshot(std::size_t obstacle, std::int64_t number) const {
  const auto entry = impl_->snapshots.find({obstacle, number});
  DYOP_REQUIRE(entry != impl_->snapshots.end(), "obstacle ", obstacle, " has no stored snapshot ",
               number);
  const io_internal::SnapshotRow& row = entry->second;
  RecordedSnapshot snapshot;
  snapshot.duration = row.duration;
  for (const auto& p : impl_->snapshot_vertices->read(row.first_vertex, row.vertex_count)) {
    snapshot.vertices.emplace_back(p[0], p[1], p[2]);
  }
  const auto mesh = impl_->meshes.find({obstacle, number});
  if (mesh == impl_->meshes.end()) return snapshot;
  snapshot.triangles =
      impl_->snapshot_triangles->read(mesh->second.first_triangle, mesh->second.triangle_count);
  return snapshot;
}

}  // namespace dyop
