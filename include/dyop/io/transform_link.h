// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "dyop/io/transform_message.h"

namespace DYOP_EXPORT dyop {

/// Sends and receives TRANSFORM messages as UDP datagrams, without waiting. For one thread.
///
/// The first sender of such a message is the peer: what others send is dropped, until the peer has
/// been silent for two seconds.
class TransformLink {
 public:
  /// @param port    Local port to listen on; 0: any.
  /// @param address Local numeric IPv4 address: by default this machine only; 0.0.0.0: all.
  /// @throws FileError naming address and port, if they cannot be opened.
  /// @throws InvalidArgument if it is not an IPv4 address.
  explicit TransformLink(std::uint16_t port, const std::string& address = "127.0.0.1");
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
  struct Peer {
    std::uint32_t address = 0;
    std::uint16_t port = 0;
    std::chrono::steady_clock::time_point heard;
  };
  bool is_heard(const Peer& sender);

  int socket_ = -1;
  int sending_ = -1;  // bound to no address: may send anywhere
  std::optional<Peer> peer_;
};

}  // namespace dyop
