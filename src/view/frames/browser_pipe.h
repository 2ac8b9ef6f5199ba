// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace dyop::view_internal {

/// A fresh folder for temporary files, removed with everything in it.
class DYOP_EXPORT ScratchFolder {
 public:
  /// Throws FileError if it cannot be created. `use` is part of its name.
  explicit ScratchFolder(const std::string& use);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Throws FileError, which names the package, unless the program is on the path.
void require_program(const std::string& program, const std::string& package);

/// Runs a program found on the path and returns its exit code. Throws FileError if it cannot be
/// started.
int run_program(const std::vector<std::string>& words);

/// Chromium without a window, driven through its debugging pipe (the DevTools protocol): JSON
/// messages with a zero byte after each.
class BrowserPipe {
 public:
  /// Throws FileError if it cannot be started.
  BrowserPipe(const std::string& program, int width, int height);

  void open(const std::string& address);
  /// The value of an expression in the page, once what it promises is there.
  nlohmann::json evaluate(const std::string& expression);
  /// The page as a PNG.
  std::string picture();

 private:
  nlohmann::json ask(const std::string& method, nlohmann::json parameters);
  void send(const std::string& message);
  std::string receive();

  // The running browser and what it holds; ends with everything of it, also if it fails to start.
  struct Process {
    ~Process();
    ScratchFolder profile{"browser"};  // its own folder of settings
    pid_t id = -1;
    int to = -1;
    int from = -1;
  };
  void start(int width, int height);

  std::string program_;
  Process process_;
  std::string session_;
  std::string read_ahead_;
  std::int64_t asked_ = 0;
};

}  // namespace dyop::view_internal
