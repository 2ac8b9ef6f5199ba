// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "dyop/io/transform_message.h"

namespace DYOP_EXPORT dyop {

/// TRANSFORM messages over TCP: to every peer that is connected, and from one of them, the first
/// that sends such a message, until it leaves. No call but the connecting constructor waits for the
/// network; calls from several threads are allowed.
class TransformStream {
 public:
  /// Accepts up to 16 peers; one that leaves may come back. One more takes the place of the oldest
  /// that has sent no TRANSFORM message.
  /// @param port Local port to listen on, at the loopback address; 0: any.
  /// @throws FileError naming the port, if it cannot be opened.
  explicit TransformStream(std::uint16_t port);

  /// The same at a local address; 0.0.0.0: all.
  struct Listen {
    std::string address = "127.0.0.1";  ///< numeric, IPv4
    std::uint16_t port = 0;
  };
  /// @throws InvalidArgument if it is not an IPv4 address.
  explicit TransformStream(const Listen& place);

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

  /// The newest message that has arrived from the device since the last call; older ones, and
  /// messages of other types, are dropped. What other peers send is thrown away unread; a peer that
  /// sends anything but OpenIGTLink before there is a device is disconnected.
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
