// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dyop/io/transform_message.h"

namespace DYOP_EXPORT dyop {

/// Sends and receives TRANSFORM messages as UDP datagrams, without waiting. For one thread.
class TransformLink {
 public:
  /// @param port Local port to listen on, on all addresses; 0: any.
  /// @throws FileError naming the port, if it cannot be opened.
  explicit TransformLink(std::uint16_t port);
  ~TransformLink();
  TransformLink(const TransformLink&) = delete;
  TransformLink& operator=(const TransformLink&) = delete;

  /// The port on which it listens.
  std::uint16_t port() const;

  /// The newest message that has arrived since the last call; older ones are dropped.
  std::optional<TransformMessage> receive();

  /// @param address A numeric IPv4 address.
  /// @return Whether the system accepted it.
  /// @throws InvalidArgument if it is not an IPv4 address.
  bool send(const std::string& address, std::uint16_t port, const TransformMessage& message);

 private:
  int socket_ = -1;
};

}  // namespace dyop
