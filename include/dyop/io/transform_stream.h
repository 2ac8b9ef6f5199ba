// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"

namespace DYOP_EXPORT dyop {

/// A TRANSFORM message of OpenIGTLink [Tokuda2009]: a pose with a name, in single precision. Its
/// length unit is the millimetre.
struct TransformMessage {
  std::string name;  ///< at most 20 bytes
  RigidPose pose;
};

/// The bytes of a message with a header of version 1: a header of 58 and a body of 48.
/// @throws InvalidArgument if the name is longer than 20 bytes.
std::vector<std::uint8_t> pack_transform(const TransformMessage& message);

/// Reads a message with a header of version 1, or of version 2 or 3 with an extended header and
/// metadata, which are passed over. Nothing if the bytes are not such a message: another type or
/// length, a wrong checksum, or a matrix that is not a rotation to single precision.
std::optional<TransformMessage> unpack_transform(std::span<const std::uint8_t> bytes);

/// Finds TRANSFORM messages in a stream of messages that arrives in pieces. Messages of other
/// types, and TRANSFORM messages that unpack_transform() refuses, are passed over.
class TransformReader {
 public:
  /// @return Whether the bytes still read as OpenIGTLink. Once they do not, the place where the
  /// next message starts is lost, and all later bytes are ignored.
  bool add(std::span<const std::uint8_t> bytes);

  /// The newest message completed since the last call; older ones are dropped.
  std::optional<TransformMessage> take();

 private:
  bool end_header();

  std::vector<std::uint8_t> message_;  // what has arrived of it
  std::uint64_t missing_ = 0;          // bytes of its body, once its header is here
  bool is_kept_ = true;                // otherwise its body is passed over
  bool is_lost_ = false;
  std::optional<TransformMessage> newest_;
};

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
