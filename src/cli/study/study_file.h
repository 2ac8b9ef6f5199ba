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

/// One of `count` parts of a study: the cases number - 1, number - 1 + count, and so on.
struct Shard {
  std::int64_t number = 1;  ///< 1 to count
  std::int64_t count = 1;
};

/// The results of a shard: a header, then one line per case in the order of their numbers. A
/// process that is killed leaves at most half a line, which is cut off when the shard is opened
/// again.
class ShardFile {
 public:
  /// Opens the shard's file in a directory, or creates it, and keeps other processes out.
  /// @throws FileError if another process has it, or it holds results of another study or version.
  ShardFile(const std::filesystem::path& directory, const Study& study, const Shard& shard);
  ~ShardFile();
  ShardFile(const ShardFile&) = delete;
  ShardFile& operator=(const ShardFile&) = delete;

  /// Cases that are there; they are the first ones of the shard.
  std::int64_t done() const { return done_; }
  /// Adds the next case's line and hands it to the disk.
  void append(const std::string& line);

 private:
  void keep_whole_lines(const Study& study, const Shard& shard);
  void write_all(const std::string& text);

  std::filesystem::path file_;
  int descriptor_ = -1;
  std::int64_t done_ = 0;
};

/// What the shards in a directory hold.
struct MergedShards {
  std::vector<std::string> lines;     ///< by case; empty if missing
  std::vector<std::int64_t> missing;  ///< cases without a result
};

/// @throws FileError if a file is of another study or version, or two of them differ in a case.
MergedShards merge_shards(const std::filesystem::path& directory, const Study& study);

}  // namespace dyop::cli
