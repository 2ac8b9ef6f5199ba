// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of Tesseract 0.33 with just what the adapter and its tests use.
#pragma once

#include <memory>
#include <string>

namespace tesseract_common {
class ContactAllowedValidator {
 public:
  virtual ~ContactAllowedValidator() = default;
  virtual bool operator()(const std::string&, const std::string&) const = 0;
};
}  // namespace tesseract_common
