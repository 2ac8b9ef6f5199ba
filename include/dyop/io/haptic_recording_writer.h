// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/io/recorded_tick.h"

namespace DYOP_EXPORT dyop {

/// Records the run of a HapticSession in a file of docs/formats.md: the scene with all its
/// meshes once, then every tick with its inputs and results. HapticRecordingReader, h5py and the
/// like can read it while it is written, and after the process was killed: it then lacks at most
/// the ticks since the last flush, a tenth of a second.
///
/// Bytes of a tick: 204, and 12 for each hinge and 13 for each obstacle.
class HapticRecordingWriter {
 public:
  /// Replaces the file.
  /// @param tissue Feeds of the run. Obstacles whose feed has a formula need no add_snapshot().
  /// @throws FileError if the file cannot be created, as all members if it cannot be written;
  ///         InvalidArgument if a shape is not one of dyop's own.
  HapticRecordingWriter(const std::filesystem::path& file, const HapticRunHeader& header,
                        const HapticScene& scene, const HapticOptions& options,
                        std::span<const TissueFeed> tissue = {});
  /// Without finish(): as if the process were killed now.
  ~HapticRecordingWriter();
  HapticRecordingWriter(HapticRecordingWriter&&) noexcept;
  HapticRecordingWriter& operator=(HapticRecordingWriter&&) noexcept;

  /// The next snapshot of an obstacle, in their order and before the tick that sees it: with each
  /// HapticSession::give_snapshot() that returns true. From any thread.
  /// @throws InvalidArgument if the obstacle does not deform or has a formula, or the number of
  ///         vertices differs.
  void add_snapshot(std::size_t obstacle, std::span<const Vector3> vertices, Scalar duration);

  /// The same for another mesh: with each HapticSession::give_mesh() that returns true.
  /// @throws InvalidArgument if the obstacle does not deform or has a formula, or there is no
  ///         triangle.
  void add_mesh(std::size_t obstacle, std::span<const Vector3> vertices,
                std::span<const TriangleIndices> triangles);

  /// A tick, in their order.
  /// @throws InvalidArgument if it has seen a snapshot that was not added.
  void add(const TickRecord& record);

  /// Writes how the run ended, and closes the file.
  void finish(const RunnerReport& report);
  /// The same for a run that was ended by an exception with this message.
  void fail(const std::string& error);

  /// Size of one tick in the file.
  std::size_t bytes_per_tick() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dyop
