// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace dyop::cli {

/// "; did you mean 'WORD'?" with the known word that is most like this one, or nothing if none is: a
/// third of its letters may be wrong, missing, too many or swapped, or it may go on further.
std::string suggestion(const std::string& word, const std::vector<std::string>& known);

}  // namespace dyop::cli
