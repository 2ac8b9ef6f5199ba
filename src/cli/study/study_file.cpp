// SPDX-License-Identifier: BSD-3-Clause
#include "cli/study/study_file.h"

#include <cmath>
#include <fstream>
#include <sstream>

#include "dyop/io/file_error.h"
#include "io/digest.h"

namespace dyop::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::int64_t kMostCases = 1'000'000'000;

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw FileError(file, "could not be read");
  return text.str();
}

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
  const std::string text = read_text(file);
  const Json study = parse(file, text);
  if (!study.is_object()) fail("must be an object");
  for (const auto& [key, value] : study.items()) {
    if (key != "scene" && key != "sweep" && key != "random") fail("unknown key '" + key + "'");
  }
  if (!study.contains("scene") || !study["scene"].is_string()) {
    fail("/scene must be the name of a scene file");
  }
  scene_file_ = file.parent_path() / study["scene"].get<std::string>();
  const std::string scene_text = read_text(scene_file_);
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

}  // namespace dyop::cli
