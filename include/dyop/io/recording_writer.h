// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "dyop/dynamics/world.h"
#include "dyop/io/recorded_run.h"

namespace DYOP_EXPORT dyop {

/// What to record about pairs of bodies after every advance.
enum class PairDetail {
  None,      ///< nothing
  Gaps,      ///< proof, bounds of the gap, normal, pivot
  Contacts,  ///< and the contacts with their impulses
};

struct RecordingOptions {
  PairDetail pairs = PairDetail::Contacts;
  /// Seconds after which a frame is in the file, where readers see it and a kill cannot take it, at
  /// the latest when the next one is written; >= 0. Sooner if that costs at most a twentieth of the
  /// run's time; 0: always at once.
  Scalar longest_delay = 0.5;
};

/// Writes a run to a file as described in docs/formats.md: the committed motions of each body,
/// exactly and each once, and separately the events. RecordingReader can read the file at any time:
/// while it is being written, and after the process was killed, it contains whole frames, all but
/// those of RecordingOptions::longest_delay.
///
/// The contents depend only on the calls: the clock decides when they are written, not what. Not
/// for concurrent use.
class RecordingWriter {
 public:
  /// Replaces the file. The World is used only in write(); its bodies may change between calls.
  /// @throws FileError if the file cannot be created, and from every member if it cannot be
  /// written; InvalidArgument if an option is out of its range.
  RecordingWriter(const std::filesystem::path& file, const RunHeader& header,
                  const RecordingOptions& options = {});
  /// Without finish(): as if the process were killed now, but nothing written is lost.
  ~RecordingWriter();
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;

  /// Writes what one advance of `world` reported.
  /// @throws InvalidArgument if a shape is not one of dyop's own.
  void write(const AdvanceReport& report, const World& world);
  /// For a run without its World: pairs are not recorded, energy and momenta are NaN.
  /// @param bodies By slot; the same in every call.
  void write(const AdvanceReport& report, std::span<const BodyDefinition> bodies);

  /// Writes how the run ended, and closes the file.
  void finish();
  /// The same for a run that was ended by an exception with this message.
  void fail(const std::string& error);

 private:
  struct Output;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dyop
