// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace dyop::fuzz {

/// The file of this process with that ending, with these bytes. Stays after the process: a fuzzer
/// kills its process when it has found something.
inline std::filesystem::path scratch_file(const std::string& ending, const std::uint8_t* data,
                                          std::size_t size) {
  // On Linux, a directory in memory.
  const std::filesystem::path memory = "/dev/shm";
  const std::filesystem::path folder =
      std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
  const std::filesystem::path file = folder / ("dyop-fuzz-" + std::to_string(getpid()) + ending);
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), std::streamsize(size));
  return file;
}

}  // namespace dyop::fuzz
