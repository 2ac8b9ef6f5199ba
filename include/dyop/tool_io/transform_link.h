// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"

namespace DYOP_EXPORT dyop {

/// A TRANSFORM message of OpenIGTLink, version 1 [Tokuda2009]: a pose with a name, in single
/// precision. Its length unit is the millimetre.
struct TransformMessage {
  std::string name;  ///< at most 20 bytes
  RigidPose pose;
};

/// The bytes of a message: a header of 58 and a body of 48.
/// @throws InvalidArgument if the name is longer than 20 bytes.
std::vector<std::uint8_t> pack_transform(const TransformMessage& message);

/// Nothing if the bytes are not such a message: another type or length, a wrong checksum, or a
/// matrix that is not a rotation to single precision.
std::optional<TransformMessage> unpack_transform(std::span<const std::uint8_t> bytes);

/// Sends and receives such messages as UDP datagrams, without waiting. For one thread.
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
