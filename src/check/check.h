// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <iosfwd>
#include <string>

namespace dyop_check {

/// Checks a recording and prints the verdict.
/// @param program What its errors begin with.
/// @return 0 proven; 1 refuted; 2 the file cannot be used; 3 undecided.
int check_file(const std::string& file, double scale, std::ostream& out, std::ostream& errors,
               const char* program = "dyop-check");

}  // namespace dyop_check
