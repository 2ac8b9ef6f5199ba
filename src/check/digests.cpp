// SPDX-License-Identifier: BSD-3-Clause
#include "check/digests.h"

#include <cstdint>
#include <vector>

namespace dyop_check {
namespace {

// FNV-1a over words of 64 bits.
std::uint64_t digest_of(const std::vector<std::uint64_t>& words) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const std::uint64_t word : words) hash = (hash ^ word) * 0x100000001b3;
  return hash;
}

}  // namespace

std::optional<std::string> find_damage(const Hdf5Reader& file) {
  constexpr const char* kTable = "digests";
  if (!file.has(kTable)) return std::nullopt;
  const std::uint64_t count = file.length(kTable);
  const std::vector<std::string> datasets = file.names(kTable, "dataset", count);
  const std::vector<std::uint64_t> first = file.integers(kTable, "first", count);
  const std::vector<std::uint64_t> rows = file.integers(kTable, "count", count);
  const std::vector<std::uint64_t> digest = file.integers(kTable, "digest", count);
  for (std::size_t k = 0; k < count; ++k) {
    if (digest_of(file.words(datasets[k], first[k], rows[k])) != digest[k]) return datasets[k];
  }
  return std::nullopt;
}

}  // namespace dyop_check
