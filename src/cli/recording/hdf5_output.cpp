// SPDX-License-Identifier: BSD-3-Clause
#include "cli/recording/run_output.h"
#include "dyop/io/recording_writer.h"
#include "dyop/io/scene_recording.h"

namespace dyop::cli {
namespace {

class Hdf5Output final : public RunOutput {
 public:
  Hdf5Output(const std::filesystem::path& file, const Scene& scene, const RecordingOptions& options)
      : writer_(file, run_header(scene), options) {}

  void write(const AdvanceReport& report, const World& world) override {
    writer_.write(report, world);
  }
  void finish() override { writer_.finish(); }
  void fail(const std::string& error) override { writer_.fail(error); }

 private:
  RecordingWriter writer_;
};

PairDetail detail_of(const std::string& word) {
  if (word == "none") return PairDetail::None;
  if (word == "gaps") return PairDetail::Gaps;
  DYOP_REQUIRE(word == "contacts", "pairs must be none, gaps or contacts, not ", word);
  return PairDetail::Contacts;
}

}  // namespace

std::unique_ptr<RunOutput> make_hdf5_output(const std::filesystem::path& file, const Scene& scene,
                                            const std::string& pairs) {
  RecordingOptions options;
  options.pairs = detail_of(pairs);
  return std::make_unique<Hdf5Output>(file, scene, options);
}

}  // namespace dyop::cli
