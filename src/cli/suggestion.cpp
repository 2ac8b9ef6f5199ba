// SPDX-License-Identifier: BSD-3-Clause
#include "cli/suggestion.h"

#include <algorithm>
#include <cstddef>

namespace dyop::cli {
namespace {

// How many letters must be changed, added, dropped or swapped with the next one to get from one
// word to the other.
std::size_t edits(const std::string& from, const std::string& to) {
  std::vector<std::vector<std::size_t>> cost(from.size() + 1,
                                             std::vector<std::size_t>(to.size() + 1, 0));
  for (std::size_t i = 0; i <= from.size(); ++i) {
    for (std::size_t j = 0; j <= to.size(); ++j) {
      if (i == 0 || j == 0) {
        cost[i][j] = i + j;
        continue;
      }
      const std::size_t change = from[i - 1] == to[j - 1] ? 0 : 1;
      cost[i][j] = std::min({cost[i - 1][j] + 1, cost[i][j - 1] + 1, cost[i - 1][j - 1] + change});
      const bool is_swap = i > 1 && j > 1 && from[i - 1] == to[j - 2] && from[i - 2] == to[j - 1];
      if (is_swap) cost[i][j] = std::min(cost[i][j], cost[i - 2][j - 2] + 1);
    }
  }
  return cost[from.size()][to.size()];
}

}  // namespace

std::string suggestion(const std::string& word, const std::vector<std::string>& known) {
  constexpr std::size_t kLongest = 40;  // longer words are no slips
  constexpr std::size_t kShortest = 3;  // of a beginning
  if (word.size() > kLongest) return {};
  const std::string* best = nullptr;
  std::size_t least = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& each : known) {
    const bool begins = word.size() >= kShortest && each.starts_with(word);
    const std::size_t count = begins ? 1 : edits(word, each);
    if (count >= least) continue;
    least = count;
    best = &each;
  }
  return best == nullptr ? "" : "; did you mean '" + *best + "'?";
}

}  // namespace dyop::cli
