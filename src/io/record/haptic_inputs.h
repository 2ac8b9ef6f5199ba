// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "dyop/haptics/haptic_observer.h"
#include "dyop/haptics/haptic_session.h"
#include "dyop/io/haptic_recording.h"
#include "io/record/recording_rows.h"

namespace dyop::io_internal {

/// An input, and the tick that comes after it: a line of /inputs.
using TimedInput = std::pair<std::int64_t, RecordedInput>;

/// The session.
/// @throws InvalidArgument if it is too late to record it, before there is a file.
HapticSession& recordable(HapticSession& session);

Json input_json(const TimedInput& input);
/// @throws InvalidArgument or an exception of nlohmann unless it is an input of such a scene.
TimedInput input_from(const Json& json, const HapticScene& scene);

/// What an obstacle goes on as, until a tick that has seen it is written.
struct WaitingSnapshot {
  std::int64_t number = 0;
  RecordedSnapshot content;
};

/// The inputs of a session on their way into a recording: kept as they are given, taken when the
/// ticks that saw them are written. Giving and writing may be in different threads.
class InputQueue final : public HapticObserver {
 public:
  /// @param is_stored By obstacle: its snapshots are to be kept.
  explicit InputQueue(std::vector<bool> is_stored) : is_stored_(std::move(is_stored)) {
    waiting_.resize(is_stored_.size());
  }

  bool is_stored(std::size_t obstacle) const {
    return obstacle < is_stored_.size() && is_stored_[obstacle];
  }
  /// Keeps a snapshot, in place of the one with the same number.
  void add(std::size_t obstacle, WaitingSnapshot snapshot);
  /// Those of an obstacle with these numbers and below.
  std::deque<WaitingSnapshot> take_snapshots(std::size_t obstacle, std::int64_t number);
  /// Springs and poses that tools were given before a tick, in their order.
  std::vector<TimedInput> take_settings(std::int64_t tick);
  /// @throws InvalidArgument if something that was given could not be kept.
  void require_complete();
  /// From now on all is ignored.
  void close();

  void on_tissue(const TissueInput& input) noexcept override;
  void on_coupling(std::size_t tool, const CouplingOptions& coupling) noexcept override;
  void on_reset(std::size_t tool, const ToolPose& pose) noexcept override;
  void on_tick(std::span<const DevicePose> devices, Scalar dt,
               std::span<const HapticTick> ticks) noexcept override;

 private:
  template <typename Keep>
  void keep(const Keep& keep) noexcept;

  std::vector<bool> is_stored_;
  std::int64_t ticks_ = 0;  // of the session; its thread
  std::atomic<bool> is_closed_{false};
  std::atomic<bool> has_failed_{false};
  std::mutex mutex_;  // of what follows
  std::vector<std::deque<WaitingSnapshot>> waiting_;
  std::deque<TimedInput> settings_;
  std::string failure_;
};

/// Which inputs of tissue a row of /ticks does not tell: all but snapshots that are given once the
/// one before is started on, and that set out from its end.
class TurnFinder {
 public:
  explicit TurnFinder(std::size_t obstacles) : left_(obstacles) {}

  /// @param new_snapshots By obstacle: as the row of the tick counts them.
  std::vector<TimedInput> turns(const TickRecord& record,
                                std::span<const std::uint8_t> new_snapshots);

 private:
  std::vector<ObstacleInput> left_;  // by obstacle: as the next tick finds it unless told otherwise
};

}  // namespace dyop::io_internal
