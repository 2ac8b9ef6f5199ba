// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "support/temporary_directory.h"

namespace dyop::testing {

/// How a run of the dyop command ended.
struct CommandResult {
  int exit_code = -1;  ///< -1 if a signal ended it
  std::string out;
  std::string err;
};

/// One run of the dyop command with its output kept in files.
class Command {
 public:
  /// @param input File for standard input; empty: that of the tests.
  explicit Command(const std::vector<std::string>& arguments, const std::string& input = "") {
    std::vector<std::string> words{DYOP_COMMAND};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string out = (directory_.path() / "out").string();
    const std::string err = (directory_.path() / "err").string();
    pid_ = fork();
    if (pid_ != 0) return;
    // What runs the tests may ignore the signals, which children inherit.
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
    dup2(open(out.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600), STDOUT_FILENO);
    dup2(open(err.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600), STDERR_FILENO);
    if (!input.empty()) dup2(open(input.c_str(), O_RDONLY), STDIN_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }

  void send(int signal_number) const { kill(pid_, signal_number); }

  CommandResult wait() const {
    int status = 0;
    waitpid(pid_, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1,
            TemporaryDirectory::read(directory_.path() / "out"),
            TemporaryDirectory::read(directory_.path() / "err")};
  }

 private:
  TemporaryDirectory directory_;
  pid_t pid_ = -1;
};

inline CommandResult run_command(const std::vector<std::string>& arguments) {
  return Command(arguments).wait();
}

}  // namespace dyop::testing
