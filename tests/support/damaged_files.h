// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <thread>

#include "dyop/core/error.h"
#include "support/temporary_directory.h"

namespace dyop::testing {

/// A damaged copy of a file: flipped bits, a part cut off, left out or doubled, or a number that
/// became an extreme one.
inline std::string damage(std::string bytes, std::mt19937_64& random) {
  constexpr std::array<const char*, 8> kWords{"1e999", "-1",         "nan", "99999999999999999999",
                                              "0",     "4294967295", "[[[", "\x1b[2J"};
  const auto below = [&](std::size_t n) { return n == 0 ? std::size_t{0} : random() % n; };
  const std::size_t at = below(bytes.size());
  const std::size_t length = std::min(below(64), bytes.size() - at);
  switch (random() % 6) {
    case 0:
      bytes.resize(at);
      break;
    case 1:
      bytes.erase(at, length);
      break;
    case 2:
      bytes.insert(at, bytes.substr(at, length));
      break;
    case 3: {
      const std::size_t digit = bytes.find_first_of("0123456789", at);
      if (digit == std::string::npos) break;
      const std::size_t end = bytes.find_first_not_of("0123456789.e-+", digit);
      bytes.replace(digit, end == std::string::npos ? end : end - digit,
                    kWords[random() % kWords.size()]);
      break;
    }
    default:
      for (std::size_t k = random() % 4 + 1; k > 0 && !bytes.empty(); --k) {
        char& byte = bytes[below(bytes.size())];
        byte = char(byte ^ (1 << (random() % 8)));
      }
  }
  return bytes;
}

/// What became of damaged copies of a file.
struct DamageReport {
  int read = 0;
  int refused = 0;       ///< with an Error
  std::string disaster;  ///< a crash, a hang or another exception, and at which copy; else empty
};

/// How many copies of each file a test takes: DYOP_DAMAGE_COUNT, which a soak sets.
inline int damage_count() {
  const char* count = std::getenv("DYOP_DAMAGE_COUNT");
  return count == nullptr ? 60 : std::atoi(count);
}

/// Reads damaged copies one after another in a process of its own. A copy may take two seconds of
/// processor time, so that a busy machine makes no difference.
/// @param read Takes the bytes of one copy; may throw Error.
inline DamageReport read_damaged(const std::string& whole,
                                 const std::function<void(const std::string& bytes)>& read) {
  constexpr std::uint64_t kSeed = 20261124;
  struct Progress {
    int copy, read, refused;
  };
  void* shared =
      mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) throw std::bad_alloc();
  auto& progress = *new (shared) Progress{};
  const pid_t child = fork();
  if (child == 0) {
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
    try {
      for (; progress.copy < damage_count(); ++progress.copy) {
        std::mt19937_64 random(kSeed + std::uint64_t(progress.copy));
        const itimerval two_seconds{{0, 0}, {2, 0}};
        setitimer(ITIMER_PROF, &two_seconds, nullptr);  // ends the process
        try {
          read(damage(whole, random));
          ++progress.read;
        } catch (const Error&) {
          ++progress.refused;
        }
      }
      _exit(0);
    } catch (...) {
      _exit(1);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  DamageReport report{progress.read, progress.refused, ""};
  const std::string copy = " at copy " + std::to_string(progress.copy);
  munmap(shared, sizeof(Progress));
  if (WIFSIGNALED(status)) {
    report.disaster = (WTERMSIG(status) == SIGPROF ? std::string("more than two seconds")
                                                   : "signal " + std::to_string(WTERMSIG(status))) +
                      copy;
  } else if (WEXITSTATUS(status) != 0) {
    report.disaster = "an exception that is no Error" + copy;
  }
  return report;
}

enum class DamageOutcome { SameContent, Error, OtherContent, Crash, Hang };

/// Reads in a process of its own, which may take two seconds of processor time; only one that
/// sleeps is waited for longer.
inline DamageOutcome read_in_child(const std::function<std::uint64_t()>& content,
                                   std::uint64_t expected) {
  const pid_t child = fork();
  if (child == 0) {
    const rlimit two_seconds{2, 3};
    ::setrlimit(RLIMIT_CPU, &two_seconds);
    try {
      _exit(content() == expected ? 0 : 2);
    } catch (const Error&) {
      _exit(1);
    } catch (...) {
      _exit(3);
    }
  }
  int status = 0;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > deadline) {
      kill(child, SIGKILL);
      waitpid(child, &status, 0);
      return DamageOutcome::Hang;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(300));
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) return DamageOutcome::Hang;
  if (!WIFEXITED(status) || WEXITSTATUS(status) > 2) return DamageOutcome::Crash;
  constexpr std::array kOutcomes{DamageOutcome::SameContent, DamageOutcome::Error,
                                 DamageOutcome::OtherContent};
  return kOutcomes[std::size_t(WEXITSTATUS(status))];
}

/// Flips one bit of a recording at a time, and expects of its content that it is the same or an
/// Error. Returns how often it was an Error.
/// @param content Reads the file; a digest of all that a reader tells.
/// @param flips   How many, unless DYOP_DAMAGE_COUNT says it.
inline int flip_bits(const std::filesystem::path& file,
                     const std::function<std::uint64_t()>& content, int flips) {
  const std::uint64_t expected = content();
  const std::string whole = TemporaryDirectory::read(file);
  const char* count = std::getenv("DYOP_DAMAGE_COUNT");
  if (count != nullptr) flips = std::atoi(count);
  std::mt19937_64 random(20261123);
  int errors = 0;
  for (int k = 0; k < flips; ++k) {
    std::string damaged = whole;
    // Metadata stands in the first kilobytes, half of the flips with it.
    const std::size_t range =
        k % 2 == 0 ? whole.size() : std::min<std::size_t>(whole.size(), 20'000);
    const std::size_t place = random() % range;
    damaged[place] = char(damaged[place] ^ (1 << (random() % 8)));
    std::ofstream(file, std::ios::binary) << damaged;
    const DamageOutcome outcome = read_in_child(content, expected);
    EXPECT_NE(outcome, DamageOutcome::Hang) << "byte " << place;
    EXPECT_NE(outcome, DamageOutcome::Crash) << "byte " << place;
    EXPECT_NE(outcome, DamageOutcome::OtherContent) << "byte " << place;
    errors += outcome == DamageOutcome::Error;
  }
  return errors;
}

}  // namespace dyop::testing
