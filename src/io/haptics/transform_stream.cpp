// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/transform_stream.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "io/haptics/transform_peer.h"

namespace dyop {

using io_internal::Descriptor, io_internal::TransformPeer;

namespace {

constexpr std::size_t kMostPeers = 16;
constexpr int kConnectMilliseconds = 5000;

[[noreturn]] void fail_on(const std::string& place, int code) {
  throw FileError("TCP " + place, std::strerror(code));
}

Descriptor open_socket(const std::string& place) {
  Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0));
  if (socket.get() < 0) fail_on(place, errno);
  return socket;
}

Descriptor listen_on(const TransformStream::Listen& listen) {
  const std::string place = listen.address + ":" + std::to_string(listen.port);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(listen.port);
  DYOP_REQUIRE(::inet_pton(AF_INET, listen.address.c_str(), &address.sin_addr) == 1,
               "expected a numeric IPv4 address, not '", listen.address, "'");
  Descriptor socket = open_socket(place);
  const int yes = 1;  // a port whose last connections have just ended is free
  ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  const auto* generic = reinterpret_cast<const sockaddr*>(&address);
  if (::bind(socket.get(), generic, sizeof(address)) != 0 ||
      ::listen(socket.get(), int(kMostPeers)) != 0) {
    fail_on(place, errno);
  }
  return socket;
}

Descriptor connect_to(const std::string& name, std::uint16_t port) {
  const std::string place = name + ":" + std::to_string(port);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  DYOP_REQUIRE(::inet_pton(AF_INET, name.c_str(), &address.sin_addr) == 1,
               "expected a numeric IPv4 address, not '", name, "'");
  Descriptor socket = open_socket(place);
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) {
    return socket;
  }
  if (errno != EINPROGRESS) fail_on(place, errno);
  pollfd wait{socket.get(), POLLOUT, 0};
  const int ready = ::poll(&wait, 1, kConnectMilliseconds);
  int code = ready == 0 ? ETIMEDOUT : errno;
  socklen_t length = sizeof(code);
  if (ready > 0) ::getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &code, &length);
  if (ready <= 0 || code != 0) fail_on(place, code);
  return socket;
}

std::uint16_t local_port(const Descriptor& socket) {
  sockaddr_in address{};
  socklen_t length = sizeof(address);
  if (::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &length) != 0) {
    fail_on("port", errno);
  }
  return ntohs(address.sin_port);
}

}  // namespace

struct TransformStream::State {
  // Peers that wait for us; the system's queue bounds the loop.
  void accept_peers() {
    for (std::size_t k = 0; listener.get() >= 0 && k < kMostPeers; ++k) {
      Descriptor socket(::accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK));
      if (socket.get() < 0) break;
      // Peers that only listen, or do nothing, do not lock out the device.
      if (peers.size() >= kMostPeers) {
        const auto silent = std::find_if(peers.begin(), peers.end(), [](const TransformPeer& peer) {
          return !peer.is_device();
        });
        peers.erase(silent);
      }
      peers.emplace_back(std::move(socket));
    }
  }

  // From the device alone, once there is one.
  std::optional<TransformMessage> receive() {
    const auto device = std::find_if(peers.begin(), peers.end(),
                                     [](const TransformPeer& peer) { return peer.is_device(); });
    std::optional<TransformMessage> newest;
    bool has_device = device != peers.end() && device->is_open();
    if (has_device) newest = device->receive();
    for (auto peer = peers.begin(); peer != peers.end(); ++peer) {
      if (has_device && peer == device) continue;
      if (has_device) {
        peer->discard();
      } else {
        newest = peer->receive();
        has_device = newest.has_value();
      }
    }
    return newest;
  }

  void drop_closed_peers() {
    std::erase_if(peers, [](const TransformPeer& peer) { return !peer.is_open(); });
  }

  mutable std::mutex mutex;
  Descriptor listener;  // none for a stream that connected
  std::vector<TransformPeer> peers;
  std::uint16_t port = 0;
};

TransformStream::TransformStream(std::uint16_t port) : TransformStream(Listen{"127.0.0.1", port}) {}

TransformStream::TransformStream(const Listen& place) : state_(std::make_unique<State>()) {
  state_->listener = listen_on(place);
  state_->port = local_port(state_->listener);
}

TransformStream::TransformStream(const std::string& address, std::uint16_t port)
    : state_(std::make_unique<State>()) {
  Descriptor socket = connect_to(address, port);
  state_->port = local_port(socket);
  state_->peers.emplace_back(std::move(socket));
}

TransformStream::~TransformStream() = default;

std::uint16_t TransformStream::port() const {
  return state_->port;
}

std::optional<TransformMessage> TransformStream::receive() {
  const std::lock_guard lock(state_->mutex);
  state_->accept_peers();
  std::optional<TransformMessage> newest = state_->receive();
  state_->drop_closed_peers();
  return newest;
}

int TransformStream::send(const TransformMessage& message) {
  const std::vector<std::uint8_t> bytes = pack_transform(message);
  const std::lock_guard lock(state_->mutex);
  state_->accept_peers();
  int count = 0;
  for (TransformPeer& peer : state_->peers) count += peer.send(bytes) ? 1 : 0;
  state_->drop_closed_peers();
  return count;
}

int TransformStream::peers() const {
  const std::lock_guard lock(state_->mutex);
  return int(state_->peers.size());
}

}  // namespace dyop
