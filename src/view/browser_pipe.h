// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace dyop::internal {

/// Runs a program found on the path and returns its exit code. Throws FileError if it cannot be
/// started.
int run_program(const std::vector<std::string>& words);

/// Chromium without a window, driven through its debugging pipe (the DevTools protocol): JSON
/// messages with a zero byte after each.
class BrowserPipe {
 public:
  /// Throws FileError if it cannot be started.
  BrowserPipe(const std::string& program, int width, int height);
  ~BrowserPipe();
  BrowserPipe(const BrowserPipe&) = delete;
  BrowserPipe& operator=(const BrowserPipe&) = delete;

  void open(const std::string& address);
  /// The value of an expression in the page, once what it promises is there.
  nlohmann::json evaluate(const std::string& expression);
  /// The page as a PNG.
  std::string picture();

 private:
  nlohmann::json ask(const std::string& method, nlohmann::json parameters);
  void send(const std::string& message);
  std::string receive();

  std::string program_;
  std::string profile_;  // its own folder of settings, removed at the end
  std::string session_;
  std::string read_ahead_;
  pid_t process_ = -1;
  int to_ = -1;
  int from_ = -1;
  std::int64_t asked_ = 0;
};

}  // namespace dyop::internal
