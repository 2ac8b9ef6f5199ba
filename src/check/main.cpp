// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "check/check.h"

namespace {

constexpr const char* kUsage = R"(Usage: dyop-check [--touching] RECORDING

Proves, from the file alone and without a line of dyop, that every pair of bodies of a run kept its
target distance at all times, or every haptic tool its margins; docs/check.md says what is trusted.
--touching asks only that nothing touched.

Exit codes: 0 proven, 1 refuted, 2 the file cannot be used, 3 undecided.
)";

}  // namespace

int main(int count, char** words) {
  double scale = 1;
  const char* file = nullptr;
  for (int k = 1; k < count; ++k) {
    if (std::strcmp(words[k], "--help") == 0 || std::strcmp(words[k], "-h") == 0) {
      std::cout << kUsage;
      return 0;
    }
    if (std::strcmp(words[k], "--touching") == 0) {
      scale = 0;
    } else if (file == nullptr && words[k][0] != '-') {
      file = words[k];
    } else {
      std::cerr << kUsage;
      return 2;
    }
  }
  if (file == nullptr) {
    std::cerr << kUsage;
    return 2;
  }
  return dyop_check::check_file(file, scale, std::cout, std::cerr);
}
