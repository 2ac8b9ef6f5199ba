// SPDX-License-Identifier: BSD-3-Clause
#include "cli/study/study_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "dyop/io/file_error.h"
#include "dyop/io/query_record.h"
#include "io/file_bytes.h"

namespace dyop::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::int64_t kMostCases = 1'000'000'000;

Json parse(const fs::path& file, const std::string& text) {
  try {
    return Json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    throw FileError(file, std::string("is not JSON: ") + error.what());
  }
}

// The finalizer of SplitMix64 [Steele2014]: neighbouring numbers give unrelated ones.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30u)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27u)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31u);
}

// A number in [0, 1) that depends on the arguments only.
double unit_number(std::uint64_t seed, std::uint64_t number, std::uint64_t place) {
  const std::uint64_t bits = mix(mix(mix(seed) ^ number) ^ place);
  return std::ldexp(static_cast<double>(bits >> 11u), -53);
}

}  // namespace

Study::Study(const fs::path& file) : file_(file) {
  const std::string text = io_internal::read_bytes(file);
  const Json study = parse(file, text);
  if (!study.is_object()) fail("must be an object");
  for (const auto& [key, value] : study.items()) {
    if (key != "scene" && key != "sweep" && key != "random") fail("unknown key '" + key + "'");
  }
  if (!study.contains("scene") || !study["scene"].is_string()) {
    fail("/scene must be the name of a scene file");
  }
  scene_file_ = file.parent_path() / study["scene"].get<std::string>();
  const std::string scene_text = io_internal::read_bytes(scene_file_);
  scene_ = parse(scene_file_, scene_text);
  if (study.contains("sweep")) read_sweeps(study["sweep"]);
  if (study.contains("random")) read_random(study["random"]);
  for (const Sweep& sweep : sweeps_) case_count_ *= std::int64_t(sweep.values.size());
  case_count_ *= samples_;
  std::ostringstream digest;
  digest << std::hex << mix(io_internal::digest_of(text) ^ mix(io_internal::digest_of(scene_text)));
  digest_ = digest.str();
}

void Study::read_sweeps(const Json& node) {
  if (!node.is_object()) fail("/sweep must be an object: JSON pointer, list of values");
  double count = 1;
  for (const auto& [pointer, values] : node.items()) {
    if (!values.is_array() || values.empty())
      fail("/sweep " + pointer + " must be a list of values");
    check_pointer(pointer);
    sweeps_.push_back({pointer, {values.begin(), values.end()}});
    count *= double(values.size());
  }
  if (count > double(kMostCases)) fail("/sweep has more than a billion cases");
}

void Study::read_random(const Json& node) {
  const bool is_complete = node.is_object() && node.contains("samples") &&
                           node.contains("values") && node["samples"].is_number_integer() &&
                           node["values"].is_object();
  if (!is_complete) fail("/random must have samples, a number, and values, an object");
  samples_ = node["samples"].get<std::int64_t>();
  if (samples_ < 1 || samples_ > kMostCases) fail("/random/samples must be 1 to a billion");
  if (node.contains("seed")) {
    if (!node["seed"].is_number_unsigned()) fail("/random/seed must be a number >= 0");
    seed_ = node["seed"].get<std::uint64_t>();
  }
  for (const auto& [pointer, range] : node["values"].items()) {
    const bool is_range = range.is_array() && range.size() == 2 && range[0].is_number() &&
                          range[1].is_number() && range[0] <= range[1];
    if (!is_range) fail("/random/values " + pointer + " must be a pair [low, high]");
    check_pointer(pointer);
    ranges_.push_back({pointer, range[0].get<double>(), range[1].get<double>()});
  }
}

// The parent must be there: a new key may be added to an object, nothing else.
void Study::check_pointer(const std::string& pointer) const {
  try {
    const Json::json_pointer place(pointer);
    if (!place.empty() && scene_.contains(place)) return;
    if (!place.empty() && scene_.contains(place.parent_pointer()) &&
        scene_.at(place.parent_pointer()).is_object()) {
      return;
    }
  } catch (const nlohmann::json::exception& error) {
    fail("'" + pointer + "' is not a JSON pointer: " + error.what());
  }
  fail("'" + pointer + "' points at nothing in " + scene_file_.string());
}

void Study::fail(const std::string& problem) const {
  throw FileError(file_, problem);
}

Json Study::values(std::int64_t number) const {
  Json values = Json::object();
  std::int64_t rest = number / samples_;
  for (std::size_t k = sweeps_.size(); k-- > 0;) {  // the last one changes first
    const auto count = std::int64_t(sweeps_[k].values.size());
    values[sweeps_[k].pointer] = sweeps_[k].values[std::size_t(rest % count)];
    rest /= count;
  }
  for (std::size_t k = 0; k < ranges_.size(); ++k) {
    const Range& range = ranges_[k];
    const double u = unit_number(seed_, std::uint64_t(number), k);
    values[range.pointer] = range.low + u * (range.high - range.low);
  }
  return values;
}

std::string Study::scene_text(std::int64_t number) const {
  Json scene = scene_;
  const Json changed = values(number);
  for (const auto& [pointer, value] : changed.items()) scene[Json::json_pointer(pointer)] = value;
  return scene.dump();
}

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// How much of a damaged line a message shows.
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
