// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::testing {

/// A block of a page, read again: what the page's own reader does, written from docs/player.md.
class PageBlock {
 public:
  explicit PageBlock(const std::string& bytes);

  const nlohmann::json& header() const { return header_; }
  /// The numbers of a column of any type.
  std::vector<double> numbers(const std::string& column) const;
  /// Row k of a column of vectors.
  Vector3 vector(const std::string& column, std::size_t k) const;

 private:
  nlohmann::json header_;
  std::string data_;
};

}  // namespace dyop::testing
