// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/haptics/haptic_session.h"
#include "dyop/io/recorded_tick.h"

namespace DYOP_EXPORT dyop {

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
