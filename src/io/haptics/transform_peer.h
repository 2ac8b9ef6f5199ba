// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dyop/io/transform_message.h"

namespace dyop::io_internal {

/// A file descriptor, closed with its owner.
class Descriptor {
 public:
  /// @param number -1: none.
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();
  int get() const { return number_; }

 private:
  int number_;
};

/// One end of a TCP connection over which TRANSFORM messages go. No call waits.
class TransformPeer {
 public:
  /// @param socket Connected, and not blocking.
  explicit TransformPeer(Descriptor socket);

  /// Whether the other side is still there, and has sent nothing but OpenIGTLink.
  bool is_open() const { return is_open_; }

  /// The newest message that has arrived since the last call.
  std::optional<TransformMessage> receive();

  /// Throws away what has arrived.
  void discard();
  /// Whether it has sent a message.
  bool is_device() const { return is_device_; }

  /// @return Whether the message leaves. It does not if the connection is full.
  bool send(std::span<const std::uint8_t> message);

 private:
  void flush();

  Descriptor socket_;
  TransformReader reader_;
  std::vector<std::uint8_t> rest_;  // of a message of which the connection took a part
  bool is_open_ = true;
  bool is_device_ = false;
};

}  // namespace dyop::io_internal
