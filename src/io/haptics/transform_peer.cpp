// SPDX-License-Identifier: BSD-3-Clause
#include "io/haptics/transform_peer.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>

namespace dyop::io_internal {
namespace {

constexpr std::size_t kPiece = 4096;  // bytes read at once
constexpr int kMostPieces = 8;        // in one call: some 0.1 ms of checksums

bool would_wait() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

TransformPeer::TransformPeer(Descriptor socket) : socket_(std::move(socket)) {
  const int yes = 1;  // a tick's result leaves at once
  ::setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
}

std::optional<TransformMessage> TransformPeer::receive() {
  std::array<std::uint8_t, kPiece> bytes;
  for (int k = 0; k < kMostPieces && is_open_; ++k) {
    const auto length = ::recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (length < 0 && would_wait()) break;
    is_open_ = length > 0 && reader_.add(std::span(bytes).first(std::size_t(length)));
  }
  auto newest = reader_.take();
  is_device_ |= newest.has_value();
  return newest;
}

void TransformPeer::discard() {
  std::array<std::uint8_t, kPiece> bytes;
  for (int k = 0; k < kMostPieces && is_open_; ++k) {
    const auto length = ::recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (length < 0 && would_wait()) break;
    is_open_ = length > 0;
  }
}

bool TransformPeer::send(std::span<const std::uint8_t> message) {
  flush();
  if (!is_open_ || !rest_.empty()) return false;
  rest_.assign(message.begin(), message.end());
  flush();
  const bool has_left = rest_.size() < message.size();
  if (!has_left) rest_.clear();
  return is_open_ && has_left;
}

void TransformPeer::flush() {
  if (rest_.empty() || !is_open_) return;
  const auto sent = ::send(socket_.get(), rest_.data(), rest_.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (sent > 0) rest_.erase(rest_.begin(), rest_.begin() + sent);
  if (sent < 0) is_open_ = would_wait();
}

}  // namespace dyop::io_internal
