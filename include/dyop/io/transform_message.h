// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
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

}  // namespace dyop
