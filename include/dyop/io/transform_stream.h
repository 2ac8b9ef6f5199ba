// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "dyop/io/transform_message.h"

namespace DYOP_EXPORT dyop {

/// TRANSFORM messages over TCP, to and from every peer that is connected. No call but the
/// connecting constructor waits for the network; calls from several threads are allowed.
class TransformStream {
 public:
  /// Accepts up to 16 peers; one that leaves may come back.
  /// @param port Local port to listen on, on all addresses; 0: any.
  /// @throws FileError naming the port, if it cannot be opened.
  explicit TransformStream(std::uint16_t port);

  /// Connects to one peer, and waits at most 5 s for it.
  /// @param address A numeric IPv4 address.
  /// @throws InvalidArgument if it is not an IPv4 address.
  /// @throws FileError naming address and port, if nobody answers there.
  TransformStream(const std::string& address, std::uint16_t port);
  ~TransformStream();
  TransformStream(const TransformStream&) = delete;
  TransformStream& operator=(const TransformStream&) = delete;

  /// The local port.
  std::uint16_t port() const;

  /// The newest message that has arrived from any peer since the last call; older ones, and
  /// messages of other types, are dropped. A peer that sends anything else is disconnected.
  std::optional<TransformMessage> receive();

  /// Sends to all peers. One whose connection is full misses the whole message, never a part.
  /// @return The number of peers the message was handed to.
  int send(const TransformMessage& message);

  /// Number of peers connected at the last receive() or send().
  int peers() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dyop
