// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_session.h"
#include "dyop/io/haptic_recording.h"
#include "io/record/haptic_inputs.h"
#include "io/record/recording_rows.h"
#include "io/record/tick_row.h"
#include "io/record/waypoint_row.h"

namespace dyop {
namespace io_internal {

// Snapshots of an obstacle.
struct SnapshotCount {
  std::size_t vertices = 0;  // of each
  std::int64_t added = 0;    // by hand
  std::int64_t written = 0;
};

}  // namespace io_internal

namespace {

using io_internal::InputQueue;
using io_internal::Json;
using io_internal::OutputRows;
using io_internal::SnapshotCount;
using io_internal::TickRow;
using io_internal::WaitingSnapshot;

// In the session's time.
constexpr Scalar kFlushPeriod = 0.1;
constexpr std::int64_t kUsualFlush = 100;  // ticks, if their period is unknown

std::vector<bool> stored_obstacles(const HapticScene& scene, std::span<const TissueFeed> tissue) {
  std::vector<bool> is_stored;
  for (const ToolObstacle& obstacle : scene.obstacles) {
    is_stored.push_back(io_internal::deforms(obstacle));
  }
  for (const TissueFeed& feed : tissue) {
    DYOP_REQUIRE(feed.obstacle < is_stored.size(), "the feed of obstacle ", feed.obstacle,
                 ", which the scene does not have");
    if (!feed.formula.empty()) is_stored[feed.obstacle] = false;
  }
  return is_stored;
}

std::vector<SnapshotCount> counts_of(const HapticScene& scene) {
  std::vector<SnapshotCount> counts;
  for (const ToolObstacle& obstacle : scene.obstacles) {
    counts.push_back({.vertices = obstacle.vertices.size()});
  }
  return counts;
}

}  // namespace

struct HapticRecordingWriter::Impl {
  Impl(const std::filesystem::path& path, const HapticScene& scene,
       std::span<const TissueFeed> tissue, Scalar period)
      : file(io_internal::Hdf5File::create(path)),
        inputs(std::make_shared<InputQueue>(stored_obstacles(scene, tissue))),
        counts(counts_of(scene)),
        turns(scene.obstacles.size()),
        seen(scene.obstacles.size()),
        row({scene, io_internal::kToolRecordingVersion}),
        waypoint_rows(scene),
        flush_ticks(period > 0 ? std::int64_t(std::max(1.0, std::round(kFlushPeriod / period)))
                               : kUsualFlush) {}
  ~Impl() { inputs->close(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  OutputRows<char> text(const char* name) { return {file, name, H5T_NATIVE_UINT8, 1, 4096}; }
  void start(const HapticRunHeader& header, const io_internal::SessionText& session);
  SnapshotCount& stored_count(std::size_t obstacle);
  void write_snapshot(std::uint32_t obstacle, const WaitingSnapshot& snapshot);
  void write_seen_snapshots(const HapticTick& tick);
  void write_inputs(const TickRecord& record);
  void flush();
  void end(const Json& json);

  io_internal::Hdf5File file;
  std::shared_ptr<InputQueue> inputs;
  bool is_observing = false;
  std::vector<SnapshotCount> counts;  // per obstacle
  io_internal::TurnFinder turns;
  std::vector<std::int64_t> seen;  // per obstacle, by the last tick
  TickRow row;
  io_internal::WaypointRows waypoint_rows;
  std::int64_t flush_ticks;
  std::vector<char> waiting;  // bytes of ticks
  std::int64_t waiting_ticks = 0;
  std::vector<char> waiting_waypoints;  // bytes of their waypoints
  std::int64_t waypoint_count = 0;
  io_internal::Hdf5Dataset ticks{file, "ticks", row.type().get(), 1, 256};
  io_internal::Hdf5Dataset waypoints{file, "waypoints", waypoint_rows.row().type().get(), 1, 256};
  OutputRows<io_internal::SnapshotRow> snapshots{
      file, "snapshots", io_internal::row_type<io_internal::SnapshotRow>().get(), 1, 512};
  OutputRows<std::array<double, 3>> snapshot_vertices{file, "snapshot_vertices", H5T_NATIVE_DOUBLE,
                                                      3, 4096};
  OutputRows<io_internal::MeshRow> meshes{
      file, "meshes", io_internal::row_type<io_internal::MeshRow>().get(), 1, 64};
  OutputRows<TriangleIndices> snapshot_triangles{file, "snapshot_triangles", H5T_NATIVE_INT32, 3,
                                                 1024};
  OutputRows<char> session_rows = text("session");
  OutputRows<char> scene_rows = text("scene");
  OutputRows<char> shapes = text("shapes");
  OutputRows<std::array<double, 3>> vertices{file, "vertices", H5T_NATIVE_DOUBLE, 3, 512};
  OutputRows<std::array<std::int32_t, 3>> triangles{file, "triangles", H5T_NATIVE_INT32, 3, 1024};
  OutputRows<char> end_rows = text("end");
  OutputRows<char> input_rows = text("inputs");
};

// All that ticks refer to is in the file before the first of them.
void HapticRecordingWriter::Impl::start(const HapticRunHeader& header,
                                        const io_internal::SessionText& session) {
  file.write_attribute("format", std::string(io_internal::kToolRecordingFormat));
  file.write_attribute("version", row.shape().version);
  const Json json{{"title", header.title}, {"period", header.period}, {"version", DYOP_VERSION}};
  file.write_attribute("header", json.dump());
  session_rows.add_all(session.json);
  scene_rows.add_all(header.scene);
  shapes.add_all(session.shapes);
  vertices.add_all(session.rows.vertices);
  triangles.add_all(session.rows.triangles);
  file.share_with_readers();
  session_rows.flush();
  scene_rows.flush();
  shapes.flush();
  vertices.flush();
  triangles.flush();
}

SnapshotCount& HapticRecordingWriter::Impl::stored_count(std::size_t obstacle) {
  DYOP_REQUIRE(!is_observing, "the recording is told of snapshots by the session");
  DYOP_REQUIRE(inputs->is_stored(obstacle), "no snapshots of obstacle ", obstacle, " are stored");
  return counts[obstacle];
}

void HapticRecordingWriter::Impl::write_snapshot(std::uint32_t obstacle,
                                                 const WaitingSnapshot& waiting_snapshot) {
  const RecordedSnapshot& snapshot = waiting_snapshot.content;
  const auto number = std::uint32_t(waiting_snapshot.number);
  snapshots.add(
      {obstacle, number, snapshot.duration, snapshot_vertices.length(), snapshot.vertices.size()});
  for (const Vector3& p : snapshot.vertices) snapshot_vertices.add({p.x(), p.y(), p.z()});
  if (snapshot.triangles.empty()) return;
  meshes.add({obstacle, number, snapshot_triangles.length(), snapshot.triangles.size()});
  snapshot_triangles.add_all(snapshot.triangles);
}

void HapticRecordingWriter::Impl::write_seen_snapshots(const HapticTick& tick) {
  for (std::size_t k = 0; k < counts.size(); ++k) {
    if (!inputs->is_stored(k)) continue;
    std::int64_t& written = counts[k].written;
    for (const WaitingSnapshot& snapshot : inputs->take_snapshots(k, tick.snapshots[k])) {
      write_snapshot(std::uint32_t(k), snapshot);
      written = snapshot.number;
    }
    DYOP_REQUIRE(written >= tick.snapshots[k], "snapshot ", written + 1, " of obstacle ", k,
                 " was not given to the recording");
  }
}

// After put_tick(), which counts the snapshots.
void HapticRecordingWriter::Impl::write_inputs(const TickRecord& record) {
  const auto add = [&](const io_internal::TimedInput& input) {
    input_rows.add_all(io_internal::input_json(input).dump() + '\n');
  };
  for (const auto& input : inputs->take_settings(record.number)) add(input);
  for (const auto& input : turns.turns(record, row.new_snapshots)) add(input);
}

// A tick is in the file, and all that it has seen, once its row is.
void HapticRecordingWriter::Impl::flush() {
  snapshot_vertices.flush();
  snapshot_triangles.flush();
  meshes.flush();
  snapshots.flush();
  input_rows.flush();
  waypoints.append(waiting_waypoints.data(), std::size_t(waypoint_count));
  waypoints.flush();
  waiting_waypoints.clear();
  waypoint_count = 0;
  ticks.append(waiting.data(), std::size_t(waiting_ticks));
  ticks.flush();
  waiting.clear();
  waiting_ticks = 0;
}

void HapticRecordingWriter::Impl::end(const Json& json) {
  flush();
  end_rows.add_all(json.dump());
  end_rows.flush();
  file.close();
  inputs->close();
}

HapticRecordingWriter::HapticRecordingWriter(const std::filesystem::path& file,
                                             const HapticRunHeader& header,
                                             const HapticScene& scene, const HapticOptions& options,
                                             std::span<const TissueFeed> tissue) {
  // Before there is a file: it throws for what cannot be recorded.
  const io_internal::SessionText session = io_internal::session_text(scene, options, tissue);
  impl_ = std::make_unique<Impl>(file, scene, tissue, header.period);
  impl_->start(header, session);
}

HapticRecordingWriter::HapticRecordingWriter(const std::filesystem::path& file,
                                             const HapticRunHeader& header, HapticSession& session,
                                             std::span<const TissueFeed> tissue)
    : HapticRecordingWriter(file, header, io_internal::recordable(session).scene(),
                            session.options(), tissue) {
  impl_->is_observing = true;
  session.observe(impl_->inputs);
}

HapticRecordingWriter::~HapticRecordingWriter() = default;
HapticRecordingWriter::HapticRecordingWriter(HapticRecordingWriter&&) noexcept = default;
HapticRecordingWriter& HapticRecordingWriter::operator=(HapticRecordingWriter&&) noexcept = default;

void HapticRecordingWriter::add_snapshot(std::size_t obstacle, std::span<const Vector3> vertices,
                                         Scalar duration) {
  SnapshotCount& count = impl_->stored_count(obstacle);
  DYOP_REQUIRE(vertices.size() == count.vertices, "a snapshot of obstacle ", obstacle, " has ",
               count.vertices, " vertices, not ", vertices.size());
  impl_->inputs->add(obstacle, {++count.added, {{vertices.begin(), vertices.end()}, duration}});
}

void HapticRecordingWriter::add_mesh(std::size_t obstacle, std::span<const Vector3> vertices,
                                     std::span<const TriangleIndices> triangles) {
  SnapshotCount& count = impl_->stored_count(obstacle);
  DYOP_REQUIRE(!triangles.empty(), "the mesh of obstacle ", obstacle, " has no triangles");
  count.vertices = vertices.size();
  impl_->inputs->add(
      obstacle, {++count.added,
                 {{vertices.begin(), vertices.end()}, 0, {triangles.begin(), triangles.end()}}});
}

void HapticRecordingWriter::add(const TickRecord& record) {
  impl_->inputs->require_complete();
  impl_->write_seen_snapshots(record.tick);
  impl_->waypoint_count += impl_->waypoint_rows.append(record, impl_->waiting_waypoints);
  io_internal::put_tick(record, impl_->seen, impl_->row);
  impl_->write_inputs(record);
  impl_->row.append_to(impl_->waiting);
  if (++impl_->waiting_ticks >= impl_->flush_ticks) impl_->flush();
}

std::shared_ptr<HapticObserver> HapticRecordingWriter::observer() const {
  return impl_->inputs;
}

void HapticRecordingWriter::finish(const RunnerReport& report) {
  impl_->end({{"ticks", report.ticks},
              {"late_starts", report.late_starts},
              {"unlogged", report.unlogged},
              {"rights", report.rights},
              {"error", ""}});
}

void HapticRecordingWriter::fail(const std::string& error) {
  impl_->end({{"error", error}});
}

std::size_t HapticRecordingWriter::bytes_per_tick() const {
  return impl_->row.bytes();
}

}  // namespace dyop
