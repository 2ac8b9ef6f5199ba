// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "dyop/dynamics/world.h"
#include "dyop/recording/recorded_run.h"

namespace DYOP_EXPORT dyop {

/// What of the pairs of bodies is recorded after every advance.
enum class PairDetail {
  None,      ///< nothing
  Gaps,      ///< proof, bounds of the gap, normal, pivot
  Contacts,  ///< and the contacts with their impulses
};

struct RecordingOptions {
  PairDetail pairs = PairDetail::Contacts;
  /// The motions are cubics through samples of a run, as an older recording holds it, not those
  /// that were committed: marks them SegmentKind::Approximate.
  bool is_sampled = false;
};

/// Writes a run to a file as docs/recording.md describes: for each body the motions that were
/// committed, exactly and each once, and apart from them what happened. RecordingReader can read
/// the file at any time: while it is written and after the process was killed it holds all that was
/// written before the last return of write().
///
/// The content depends on the calls only: no clock, no host. Not for concurrent use.
class RecordingWriter {
 public:
  /// Replaces the file. The World is used in write() only; its bodies may change between calls.
  /// @throws FileError if the file cannot be made, and every member if it cannot be written.
  RecordingWriter(const std::filesystem::path& file, const RunHeader& header,
                  const RecordingOptions& options = {});
  /// Without finish(): as if the process had been killed now.
  ~RecordingWriter();
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;

  /// Writes what one advance of `world` reported.
  /// @throws InvalidArgument if a shape is none of dyop's own.
  void write(const AdvanceReport& report, const World& world);
  /// For a run without its World: pairs are not recorded, energy and momenta are NaN.
  /// @param bodies By slot; the same in every call.
  void write(const AdvanceReport& report, std::span<const BodyDefinition> bodies);

  /// Writes how the run ended, and closes the file.
  void finish();
  /// The same for a run that an exception with this message ended.
  void fail(const std::string& error);

 private:
  struct Output;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dyop
