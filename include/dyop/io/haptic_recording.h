// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/haptics/haptic_session.h"
#include "dyop/haptics/haptic_tick.h"

namespace DYOP_EXPORT dyop {

/// Data of a tool's run, besides its scene and options.
struct HapticRunHeader {
  std::string title;
  std::string scene;    ///< text of the scene file; empty: none
  Scalar period = 0;    ///< of a tick as planned; 0: unknown
  std::string version;  ///< of the dyop that wrote the recording, which sets it
};

/// How the snapshots of a deforming obstacle come into a recording.
struct SnapshotSource {
  std::string formula;  ///< see TissueFeed; empty: their vertices are stored
  Scalar period = 0;    ///< from one snapshot to the next, if there is a formula
};

/// A further tool's part of a tick.
struct RecordedTool {
  DevicePose device;
  HapticStatus status = HapticStatus::NotRun;
  ToolPose tool;      ///< position exact, rotation and angles in single precision
  ToolWrench wrench;  ///< from here on in single precision
  Scalar energy_returned = 0;
  std::vector<ToolClearance> clearances;  ///< bounds rounded outwards, no points
};

/// Springs that a tool was given: HapticSession::set_coupling().
struct RecordedCoupling {
  std::size_t tool = 0;
  CouplingOptions coupling;
};

/// Where a tool was put: HapticSession::reset().
struct RecordedReset {
  std::size_t tool = 0;
  ToolPose pose;
};

/// What a tick found after a HapticSession::retarget(), if it is not what the one before left.
struct RecordedTurn {
  std::size_t obstacle = 0;
  std::int64_t snapshot = 0;  ///< that comes next
  Scalar from = 1;            ///< it sets out at this fraction of the motion to the one before
  bool is_given = false;  ///< the tick found it, and not the one that another tick may have found
};

using RecordedInput = std::variant<RecordedCoupling, RecordedReset, RecordedTurn>;

/// One tick as a recording stores it: its exact inputs, and results for looking at. The digest
/// stands for all bits of the result.
struct RecordedTick {
  std::int64_t number = 0;
  DevicePose device;
  Scalar dt = 0;
  std::optional<TickCutoff> cutoff;
  std::vector<std::uint8_t> new_snapshots;  ///< per obstacle: given since the tick before
  std::vector<RecordedInput> inputs;        ///< all else that came before it, in this order

  HapticStatus status = HapticStatus::NotRun;
  ToolPose tool;      ///< position exact, rotation and angles in single precision
  ToolWrench wrench;  ///< from here on in single precision
  int contacts = 0;   ///< places that held the proxy; 255: or more
  std::vector<ToolClearance> clearances;  ///< bounds rounded outwards
  /// The obstacle with the least upper bound: only its witness points are stored.
  std::optional<std::size_t> nearest;
  Scalar energy_returned = 0;
  Scalar tissue_stopped = 0;
  Scalar tissue_lag = 0;     ///< not known, 0, in recordings of version 1 and 2
  Scalar tissue_behind = 0;  ///< not known, 0, in recordings of versions 1 to 6
  std::chrono::nanoseconds latency{0};
  TickStatistics statistics;
  std::vector<RecordedTool> others;  ///< further tools
  /// Between tools: one for each pair, (0, 1), (0, 2), (1, 2) and so on, as the second one of the
  /// pair sees it.
  std::vector<ToolClearance> tool_clearances;
  std::uint64_t digest = 0;

  /// How far the session advanced: dt, or 0 if dt is invalid.
  Scalar time_passed() const { return dt >= 0 && dt < kInfinity ? dt : 0; }
};

/// How a recorded run ended.
struct HapticRunEnd {
  std::int64_t ticks = 0;
  std::int64_t late_starts = 0;
  std::int64_t unlogged = 0;
  std::string rights;  ///< as RunnerReport
  std::string error;   ///< message of the error that ended it; empty: none
};

/// A hash of every bit of a tick's results, latency and statistics excepted: equal for equal bits.
std::uint64_t tick_digest(const HapticTick& tick);
/// The same of the ticks of all tools.
std::uint64_t tick_digest(std::span<const HapticTick> ticks);

/// Records the run of a HapticSession in a file of docs/formats.md: the scene with all its
/// meshes once, then every tick with its inputs and results. HapticRecordingReader, h5py and the
/// like can read it while it is written, and after the process was killed: it then lacks at most
/// the ticks since the last flush, a tenth of a second.
///
/// Bytes of a tick: 208, and 12 for each hinge and 13 for each obstacle; for each further tool 125,
/// 12 for each of its hinges and 8 for each obstacle; and 32 for each pair of tools. Bytes of each
/// motion in it: 13, and 56 for each tool, 8 for each hinge and 12 for each obstacle that deforms.
class HapticRecordingWriter {
 public:
  /// Replaces the file.
  /// @param tissue Feeds of the run. Obstacles whose feed has a formula need no add_snapshot().
  /// @throws FileError if the file cannot be created, as all members if it cannot be written;
  ///         InvalidArgument if a shape is not one of dyop's own.
  HapticRecordingWriter(const std::filesystem::path& file, const HapticRunHeader& header,
                        const HapticScene& scene, const HapticOptions& options,
                        std::span<const TissueFeed> tissue = {});
  /// The same of a fresh session, and observes it: all of its inputs are recorded, and only its
  /// ticks must be added, from any one thread. See also record_session().
  /// @throws InvalidArgument also if the session is not fresh or has an observer.
  HapticRecordingWriter(const std::filesystem::path& file, const HapticRunHeader& header,
                        HapticSession& session, std::span<const TissueFeed> tissue = {});
  /// Without finish(): as if the process were killed now.
  ~HapticRecordingWriter();
  HapticRecordingWriter(HapticRecordingWriter&&) noexcept;
  HapticRecordingWriter& operator=(HapticRecordingWriter&&) noexcept;

  /// The next snapshot of an obstacle, in their order and before the tick that sees it: with each
  /// HapticSession::give_snapshot() that returns true. From any one thread.
  /// @throws InvalidArgument if the obstacle does not deform or has a formula, the number of
  ///         vertices differs, or a session is observed.
  void add_snapshot(std::size_t obstacle, std::span<const Vector3> vertices, Scalar duration);

  /// The same for another mesh: with each HapticSession::give_mesh() that returns true.
  /// @throws InvalidArgument if the obstacle does not deform or has a formula, there is no
  ///         triangle, or a session is observed.
  void add_mesh(std::size_t obstacle, std::span<const Vector3> vertices,
                std::span<const TriangleIndices> triangles);

  /// A tick, in their order; those of a session are numbered from its first one, 0.
  /// @throws InvalidArgument if it has seen a snapshot that was not added, or an obstacle with a
  ///         formula was retargeted.
  void add(const TickRecord& record);

  /// Takes inputs, when it is told of them as an observer of the session; of ticks their count.
  std::shared_ptr<HapticObserver> observer() const;

  /// Writes how the run ended, and closes the file.
  void finish(const RunnerReport& report);
  /// The same for a run that was ended by an exception with this message.
  void fail(const std::string& error);

  /// Size of one tick in the file, without its motions.
  std::size_t bytes_per_tick() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A snapshot whose vertices are stored, or another mesh.
struct RecordedSnapshot {
  std::vector<Vector3> vertices;
  Scalar duration = 0;                          ///< see HapticSession::give_snapshot(); 0 of a mesh
  std::vector<TriangleIndices> triangles = {};  ///< of a mesh, see HapticSession::give_mesh()

  bool is_mesh() const { return !triangles.empty(); }
};

/// Whether a file is a recording of a tool's run, and no other file of HDF5.
/// @throws FileError if it is missing or not a readable HDF5 file.
bool is_haptic_recording(const std::filesystem::path& file);

/// The run of a HapticSession, read from a file of docs/formats.md, even while another
/// process writes it or after that process was killed. Not for concurrent use.
class HapticRecordingReader {
 public:
  /// @throws FileError if the file is missing, not a recording of a tool, of another version, or
  ///         damaged; so do all members.
  explicit HapticRecordingReader(const std::filesystem::path& file);
  ~HapticRecordingReader();
  HapticRecordingReader(HapticRecordingReader&&) noexcept;
  HapticRecordingReader& operator=(HapticRecordingReader&&) noexcept;

  const HapticRunHeader& header() const;
  /// With every bit: a HapticSession of these computes what the recorded one did.
  const HapticScene& scene() const;
  const HapticOptions& options() const;
  /// One for each obstacle; of no meaning for rigid ones.
  std::span<const SnapshotSource> sources() const;
  /// How the run ended; none if it was still running when the file was opened, or was killed.
  const std::optional<HapticRunEnd>& end() const;

  /// The number of ticks when the file was opened.
  std::int64_t tick_count() const;
  /// @throws InvalidArgument if there are no such ticks.
  std::vector<RecordedTick> ticks(std::int64_t first, std::int64_t count) const;
  /// Calls visit(const RecordedTick&) for all of them, in order; a block at a time is in memory.
  template <typename Visit>
  void for_each_tick(Visit visit) const {
    constexpr std::int64_t kBlock = 2048;
    const std::int64_t count = tick_count();
    for (std::int64_t first = 0; first < count; first += kBlock) {
      for (const RecordedTick& tick : ticks(first, std::min(kBlock, count - first))) visit(tick);
    }
  }
  std::size_t bytes_per_tick() const;

  /// A stored snapshot or mesh of an obstacle, counted from 1.
  /// @throws InvalidArgument if there is no such snapshot.
  RecordedSnapshot snapshot(std::size_t obstacle, std::int64_t number) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dyop
