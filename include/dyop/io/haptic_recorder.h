// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "dyop/haptics/haptic_observer.h"
#include "dyop/io/haptic_recording.h"

namespace DYOP_EXPORT dyop {

/// Records all that a session is given and all of its ticks, whoever makes them: record_session().
/// A thread of its own writes; the session's copies each tick and hardly ever waits.
class HapticRecorder final : public HapticObserver {
 public:
  explicit HapticRecorder(std::unique_ptr<HapticRecordingWriter> writer, bool waits);
  /// Without finish() or fail(): as if the process were killed now.
  ~HapticRecorder() override;

  /// Writes what waits and how the run ended, and closes the file; what comes later is left out.
  /// From the thread that calls update(), or while none does.
  /// @throws FileError if something could not be written; InvalidArgument if it was over already.
  void finish();
  /// The same for a run that was ended by an exception with this message.
  void fail(const std::string& error);

  /// Ticks that are not in the file, as it was too slow for them.
  std::int64_t unlogged() const;

  void on_tissue(const TissueInput& input) noexcept override;
  void on_coupling(std::size_t tool, const CouplingOptions& coupling) noexcept override;
  void on_reset(std::size_t tool, const ToolPose& pose) noexcept override;
  void on_tick(std::span<const DevicePose> devices, Scalar dt,
               std::span<const HapticTick> ticks) noexcept override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Records a fresh session in a file, which is replaced, until finish(). The session's observer.
/// @param waits Where 2048 ticks wait to be written, update() waits, too; otherwise a tick is left
///              out, and the run can be looked at but not replayed.
/// @throws FileError if the file cannot be created, InvalidArgument as HapticRecordingWriter.
std::shared_ptr<HapticRecorder> record_session(HapticSession& session,
                                               const std::filesystem::path& file,
                                               const HapticRunHeader& header = {},
                                               bool waits = true);

}  // namespace dyop
