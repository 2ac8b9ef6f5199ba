// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace dyop::cli {

/// A study: one scene, and values in it that change from case to case (docs/formats.md). What a
/// case is depends on its number only, so that any shard can be run anywhere.
class Study {
 public:
  /// @throws FileError with the key that cannot be used.
  explicit Study(const std::filesystem::path& file);

  std::int64_t case_count() const { return case_count_; }
  const std::filesystem::path& scene_file() const { return scene_file_; }
  /// Sixteen hexadecimal digits that change with the study and its scene file, mesh files aside.
  const std::string& digest() const { return digest_; }

  /// The changed values of a case, by JSON pointer.
  nlohmann::ordered_json values(std::int64_t number) const;
  /// The scene file's text for a case.
  std::string scene_text(std::int64_t number) const;

 private:
  struct Sweep {
    std::string pointer;
    std::vector<nlohmann::ordered_json> values;
  };
  struct Range {
    std::string pointer;
    double low;
    double high;
  };
  void read_sweeps(const nlohmann::ordered_json& node);
  void read_random(const nlohmann::ordered_json& node);
  void check_pointer(const std::string& pointer) const;
  [[noreturn]] void fail(const std::string& problem) const;

  std::filesystem::path file_;
  std::filesystem::path scene_file_;
  nlohmann::ordered_json scene_;
  std::vector<Sweep> sweeps_;
  std::vector<Range> ranges_;
  std::uint64_t seed_ = 0;
  std::int64_t samples_ = 1;
  std::int64_t case_count_ = 1;
  std::string digest_;
};

}  // namespace dyop::cli
