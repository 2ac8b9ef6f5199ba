// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>

#include "cli/recording/run_output.h"
#include "dyop/io/file_error.h"
#include "dyop/io/run_recording.h"

namespace dyop::cli {
namespace {

class TextOutput final : public RunOutput {
 public:
  TextOutput(const std::filesystem::path& file, const Scene& scene)
      : file_(file), out_(file, std::ios::binary), recorder_(checked(), scene) {}

  void write(const AdvanceReport& report, const World&) override { recorder_.write(report); }
  void finish() override {
    recorder_.finish();
    close();
  }
  void fail(const std::string& error) override {
    recorder_.fail(error);
    close();
  }

 private:
  std::ofstream& checked() {
    if (!out_) throw FileError(file_, "cannot be written");
    return out_;
  }
  void close() {
    out_.close();
    if (!out_) throw FileError(file_, "cannot be written to its end");
  }

  std::filesystem::path file_;
  std::ofstream out_;
  RunRecorder recorder_;
};

}  // namespace

std::unique_ptr<RunOutput> make_text_output(const std::filesystem::path& file, const Scene& scene) {
  return std::make_unique<TextOutput>(file, scene);
}

}  // namespace dyop::cli
