// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of SOFA as of 2025 with just what the adapter and its tests use.
#pragma once

#include <sstream>
#include <string>
#include <vector>

namespace sofa::helper::logging::stub {
// For tests: all errors so far.
inline std::vector<std::string>& errors() {
  static std::vector<std::string> list;
  return list;
}

class Message {
 public:
  Message() = default;
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;
  ~Message() { errors().push_back(text_.str()); }
  template <typename T>
  Message& operator<<(const T& part) {
    text_ << part;
    return *this;
  }

 private:
  std::ostringstream text_;
};
}  // namespace sofa::helper::logging::stub

#define msg_error() ::sofa::helper::logging::stub::Message()
