// SPDX-License-Identifier: BSD-3-Clause
#include "cli/study/shard_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "dyop/io/file_error.h"
#include "dyop/io/query_record.h"
#include "io/digest.h"

namespace dyop::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Of a damaged line in a message.
constexpr std::size_t kShownLetters = 60;

std::string file_name(const Shard& shard) {
  return "shard-" + std::to_string(shard.number) + "-of-" + std::to_string(shard.count) + ".jsonl";
}

std::string header_of(const Study& study) {
  const Json header{{"study", study.digest()}, {"version", library_version()}};
  return header.dump();
}

// What follows the last member of a line: its digest.
constexpr std::string_view kDigestKey = ",\"digest\":\"";

// A JSON object on a line, with a digest of its text as the last member.
std::string sealed(const std::string& line) {
  std::string text = line.substr(0, line.size() - 1);
  text += kDigestKey;
  return text + io_internal::hex_digits(io_internal::digest_of(line)) + "\"}";
}

// The line that sealed() got.
std::string unsealed(const fs::path& file, const std::string& text) {
  const std::size_t place = text.rfind(kDigestKey);
  const std::string line = text.substr(0, place) + "}";
  if (place == std::string::npos || text != sealed(line)) {
    throw FileError(file, "holds a damaged line: " + text.substr(0, kShownLetters));
  }
  return line;
}

// The whole lines of a file, without their ends and digests.
std::vector<std::string> whole_lines(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  std::vector<std::string> lines;
  std::string rest = text.str();
  for (std::size_t start = 0, end; (end = rest.find('\n', start)) != std::string::npos;) {
    lines.push_back(unsealed(file, rest.substr(start, end - start)));
    start = end + 1;
  }
  return lines;
}

// The case that a line is about.
std::int64_t case_of(const fs::path& file, const std::string& line) {
  try {
    return Json::parse(line).at("case").get<std::int64_t>();
  } catch (const nlohmann::json::exception& error) {
    throw FileError(file, std::string("holds a line that is no result: ") + error.what());
  }
}

void require_header(const fs::path& file, const std::string& line, const Study& study) {
  if (line != header_of(study)) {
    throw FileError(
        file, "holds results of another study or version: " + line + ", not " + header_of(study));
  }
}

}  // namespace

ShardFile::ShardFile(const fs::path& directory, const Study& study, const Shard& shard)
    : file_(directory / file_name(shard)) {
  descriptor_ = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw FileError(file_, "could not be written");
  if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    close(descriptor_);
    throw FileError(file_, "is being written by another process");
  }
  try {
    keep_whole_lines(study, shard);
  } catch (...) {
    close(descriptor_);
    throw;
  }
}

ShardFile::~ShardFile() {
  close(descriptor_);
}

void ShardFile::keep_whole_lines(const Study& study, const Shard& shard) {
  const std::vector<std::string> lines = whole_lines(file_);
  off_t size = 0;
  for (const std::string& line : lines) {
    if (size == 0) {
      require_header(file_, line, study);
    } else {
      const std::int64_t expected = shard.number - 1 + done_ * shard.count;
      if (case_of(file_, line) != expected) {
        throw FileError(file_,
                        "does not hold case " + std::to_string(expected) + " where it should");
      }
      ++done_;
    }
    size += off_t(sealed(line).size()) + 1;
  }
  if (ftruncate(descriptor_, size) != 0 || lseek(descriptor_, size, SEEK_SET) != size) {
    throw FileError(file_, "could not be written");
  }
  if (size == 0) write_all(sealed(header_of(study)) + '\n');
}

void ShardFile::append(const std::string& line) {
  write_all(sealed(line) + '\n');
  ++done_;
}

void ShardFile::write_all(const std::string& text) {
  for (std::size_t written = 0; written < text.size();) {
    const ssize_t count = write(descriptor_, text.data() + written, text.size() - written);
    if (count <= 0) throw FileError(file_, "could not be written completely");
    written += std::size_t(count);
  }
}

MergedShards merge_shards(const fs::path& directory, const Study& study) {
  MergedShards merged;
  merged.lines.resize(std::size_t(study.case_count()));
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("shard-") && name.ends_with(".jsonl")) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const std::vector<std::string> lines = whole_lines(file);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (i == 0) {
        require_header(file, lines[0], study);
        continue;
      }
      const std::int64_t number = case_of(file, lines[i]);
      if (number < 0 || number >= study.case_count()) {
        throw FileError(file, "holds case " + std::to_string(number) + ", which there is not");
      }
      std::string& line = merged.lines[std::size_t(number)];
      if (!line.empty() && line != lines[i]) {
        throw FileError(file, "has another result for case " + std::to_string(number) +
                                  " than a file before it");
      }
      line = lines[i];
    }
  }
  for (std::int64_t i = 0; i < study.case_count(); ++i) {
    if (merged.lines[std::size_t(i)].empty()) merged.missing.push_back(i);
  }
  return merged;
}

}  // namespace dyop::cli
