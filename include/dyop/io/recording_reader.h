// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/io/recorded_run.h"

namespace DYOP_EXPORT dyop {

/// A pair of RecordingReader::pairs() in short.
struct NearPair {
  BodyId a;
  BodyId b;
  Scalar gap_lower = 0;  ///< proven
  std::int64_t contacts = 0;
};

/// A recorded run, read from a file of docs/formats.md, even while another process writes it or
/// after that process was killed. Bodies, steps, frames and events are read when the file is
/// opened; segments and pairs on demand, a block at a time.
///
/// A body's id is its slot, the index into bodies(). Not for concurrent use.
class RecordingReader {
 public:
  /// @throws FileError if the file is missing, not a recording, of another version, or damaged.
  explicit RecordingReader(const std::filesystem::path& file);
  /// The path that was given.
  const std::filesystem::path& file() const;
  ~RecordingReader();
  RecordingReader(RecordingReader&&) noexcept;
  RecordingReader& operator=(RecordingReader&&) noexcept;

  /// Reads what was written since; returns true if there is anything new. Invalidates spans. Opens
  /// the file again: data written by another process is not seen while another reader of this
  /// process has the same file open.
  /// @throws FileError as the constructor.
  bool refresh();

  const RunHeader& header() const;
  std::span<const RecordedShape> shapes() const;
  std::span<const RecordedBody> bodies() const;

  /// The time from the start to the last commit; of length zero if nothing was committed yet.
  TimeInterval interval() const;
  /// How the run ended; none if it is still running or was killed.
  const std::optional<RunEnd>& end() const;

  /// The committed steps, in order, each starting where the previous one ended.
  std::span<const TimeInterval> steps() const;
  std::span<const RecordedFrame> frames() const;
  /// All impacts in order of time; X_WA and X_WB of `toi` are the poses at t_safe.
  std::span<const ImpactEvent> impacts() const;
  std::span<const RunEvent> events() const;
  /// Pairs at the end of a frame, as World::pairs(), without those whose bodies both rested in the
  /// previous frame too. Only the contact fields listed in docs/formats.md are set: points in
  /// single precision relative to the pivot.
  /// @throws InvalidArgument if there is no such frame.
  std::vector<PairRecord> pairs(std::size_t frame) const;
  /// The same pairs without the rest; faster.
  /// @throws InvalidArgument if there is no such frame.
  std::vector<NearPair> near_pairs(std::size_t frame) const;

  /// All impulses of the run, as AdvanceReport::velocity_changes; none if they were not recorded.
  /// The impulse of forces is stored only for bodies with a wrench of their own; for the others it
  /// is gravity times half of the interval, and zero here.
  std::vector<VelocityChange> velocity_changes() const;

  /// @throws InvalidArgument if there is no such body.
  std::size_t segment_count(BodyId body) const;
  /// @throws InvalidArgument if there is no such body or segment.
  MotionSegment segment(BodyId body, std::size_t index) const;
  /// The index of the segment that contains t; where two meet, the later one.
  /// @throws InvalidArgument if t is outside interval() or there is no such body.
  std::size_t segment_at(BodyId body, Scalar t) const;

  /// Pose X_WB on the committed motion, with the same bits as the run's own motion.
  /// @throws InvalidArgument as segment_at(), and if the body is absent at t.
  RigidPose pose(BodyId body, Scalar t) const;
  /// Pose and twist; where two segments meet, those of the later one.
  MotionState state(BodyId body, Scalar t) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dyop
