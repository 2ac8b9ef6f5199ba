// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/transform_stream.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"

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

namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kHeader = 58;
constexpr std::size_t kContent = 48;
constexpr std::size_t kTypeAt = 2, kTypeLength = 12;
constexpr std::size_t kNameAt = 14, kNameLength = 20;
constexpr std::size_t kSizeAt = 42;
constexpr std::size_t kSumAt = 50;
constexpr std::string_view kType = "TRANSFORM";

// Newest version of headers that we read. From version 2 on a body may start with an extended
// header, whose first number is its own length, and end with metadata.
constexpr std::uint16_t kLastVersion = 3;
constexpr std::size_t kLeastExtended = 12;

// Longer messages are passed over: no transform has so much metadata.
constexpr std::uint64_t kLongestBody = 1 << 12;

// Longer than any volume sent as an image: not a length but noise.
constexpr std::uint64_t kLongestPassedOver = std::uint64_t{1} << 32;

// Matrices in single precision after a few products, or written with four decimals; what is farther
// off is scaled, or not meant as a rotation.
constexpr Scalar kRotationNoise = 1e-3;  // literal: of R^T R - 1

// CRC-64 of ECMA-182, most significant bit first.
std::uint64_t check_sum(Bytes bytes) {
  constexpr std::uint64_t kPolynomial = 0x42F0E1EBA9EA3693;
  std::uint64_t sum = 0;
  for (const std::uint8_t byte : bytes) {
    sum ^= std::uint64_t{byte} << 56;
    for (int bit = 0; bit < 8; ++bit) sum = (sum << 1) ^ ((sum >> 63) != 0 ? kPolynomial : 0);
  }
  return sum;
}

// Numbers are big-endian.
template <typename Unsigned>
void put(std::vector<std::uint8_t>& bytes, std::size_t at, Unsigned number) {
  for (std::size_t k = 0; k < sizeof(Unsigned); ++k) {
    bytes[at + k] = std::uint8_t(number >> (8 * (sizeof(Unsigned) - 1 - k)));
  }
}

template <typename Unsigned>
Unsigned read(Bytes bytes, std::size_t at) {
  Unsigned number = 0;
  for (std::size_t k = 0; k < sizeof(Unsigned); ++k) {
    number = Unsigned(number << 8) | Unsigned(bytes[at + k]);
  }
  return number;
}

std::string read_text(Bytes bytes, std::size_t at, std::size_t length) {
  std::string text;
  for (std::size_t k = 0; k < length && bytes[at + k] != 0; ++k) text += char(bytes[at + k]);
  return text;
}

// Whether a header's type is text, as in every message.
bool is_printable(Bytes header) {
  const std::string type = read_text(header, kTypeAt, kTypeLength);
  return !type.empty() &&
         std::all_of(type.begin(), type.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

// The matrix within a message of this type.
std::optional<Bytes> content_of(Bytes bytes) {
  const auto version = read<std::uint16_t>(bytes, 0);
  const Bytes body = bytes.subspan(kHeader);
  if (version < 1 || version > kLastVersion) return std::nullopt;
  if (body.size() == kContent) return body;
  const auto extended = std::size_t(read<std::uint16_t>(body, 0));
  if (version == 1 || extended < kLeastExtended || body.size() < extended + kContent) {
    return std::nullopt;
  }
  return body.subspan(extended, kContent);
}

// The nearest rotation, if the matrix is within the noise of one.
std::optional<Matrix3> rotation_near(const Matrix3& R) {
  if (!R.allFinite()) return std::nullopt;
  const Scalar error = (R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kRotationNoise) || !(R.determinant() > 0)) return std::nullopt;
  return Quaternion(R).normalized().toRotationMatrix();
}

}  // namespace

std::vector<std::uint8_t> pack_transform(const TransformMessage& message) {
  DYOP_REQUIRE(message.name.size() <= kNameLength, "a transform's name has at most 20 bytes, not ",
               message.name.size());
  std::vector<std::uint8_t> bytes(kHeader + kContent);
  put(bytes, 0, std::uint16_t{1});
  std::copy(kType.begin(), kType.end(), bytes.begin() + kTypeAt);
  std::copy(message.name.begin(), message.name.end(), bytes.begin() + kNameAt);
  put(bytes, kSizeAt, std::uint64_t{kContent});
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) {
      const Scalar entry =
          column < 3 ? message.pose.rotation()(row, column) : message.pose.translation()[row];
      const auto place = kHeader + 4 * std::size_t(3 * column + row);
      put(bytes, place, std::bit_cast<std::uint32_t>(float(entry)));
    }
  }
  put(bytes, kSumAt, check_sum(Bytes(bytes).subspan(kHeader)));
  return bytes;
}

std::optional<TransformMessage> unpack_transform(Bytes bytes) {
  if (bytes.size() < kHeader + kContent || read_text(bytes, kTypeAt, kTypeLength) != kType ||
      read<std::uint64_t>(bytes, kSizeAt) != bytes.size() - kHeader ||
      read<std::uint64_t>(bytes, kSumAt) != check_sum(bytes.subspan(kHeader))) {
    return std::nullopt;
  }
  const std::optional<Bytes> content = content_of(bytes);
  if (!content) return std::nullopt;
  std::array<Scalar, 12> numbers;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    numbers[k] = Scalar(std::bit_cast<float>(read<std::uint32_t>(*content, 4 * k)));
  }
  const std::optional<Matrix3> R = rotation_near(Eigen::Map<const Matrix3>(numbers.data()));
  const Vector3 p(numbers[9], numbers[10], numbers[11]);
  if (!R || !p.allFinite()) return std::nullopt;
  return TransformMessage{read_text(bytes, kNameAt, kNameLength), RigidPose(*R, p)};
}

bool TransformReader::add(Bytes bytes) {
  while (!bytes.empty() && !is_lost_) {
    const bool is_in_header = message_.size() < kHeader;
    const std::uint64_t wanted = is_in_header ? kHeader - message_.size() : missing_;
    const Bytes piece = bytes.first(std::size_t(std::min<std::uint64_t>(wanted, bytes.size())));
    bytes = bytes.subspan(piece.size());
    if (is_in_header || is_kept_) message_.insert(message_.end(), piece.begin(), piece.end());
    if (is_in_header) {
      if (message_.size() < kHeader) break;
      is_lost_ = !end_header();
    } else {
      missing_ -= piece.size();
    }
    if (missing_ > 0 || is_lost_) continue;
    if (is_kept_) {
      if (auto message = unpack_transform(message_)) newest_ = std::move(message);
    }
    message_.clear();
  }
  return !is_lost_;
}

// Whether the header reads as one.
bool TransformReader::end_header() {
  const auto version = read<std::uint16_t>(message_, 0);
  missing_ = read<std::uint64_t>(message_, kSizeAt);
  is_kept_ = read_text(message_, kTypeAt, kTypeLength) == kType && missing_ <= kLongestBody;
  return version >= 1 && version <= kLastVersion && missing_ <= kLongestPassedOver &&
         is_printable(message_);
}

std::optional<TransformMessage> TransformReader::take() {
  return std::exchange(newest_, std::nullopt);
}

namespace {

// Larger than any message; longer datagrams are ignored.
constexpr std::size_t kLongestDatagram = 256;

// Read in one call: some 0.2 ms.
constexpr int kMostDatagrams = 256;

// A peer that has been silent for so long may be replaced by another.
constexpr std::chrono::seconds kSilence{2};

[[noreturn]] void fail(const std::string& address, std::uint16_t port, int code) {
  throw FileError("UDP " + address + ":" + std::to_string(port), std::strerror(code));
}

}  // namespace

TransformLink::TransformLink(std::uint16_t port, const std::string& address) {
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_port = htons(port);
  DYOP_REQUIRE(::inet_pton(AF_INET, address.c_str(), &place.sin_addr) == 1,
               "expected a numeric IPv4 address, not '", address, "'");
  socket_ = ::socket(AF_INET, SOCK_DGRAM, 0);
  sending_ = ::socket(AF_INET, SOCK_DGRAM, 0);
  const bool is_open =
      socket_ >= 0 && sending_ >= 0 &&
      ::bind(socket_, reinterpret_cast<const sockaddr*>(&place), sizeof(place)) == 0;
  if (is_open) return;
  const int code = errno;
  if (socket_ >= 0) ::close(socket_);
  if (sending_ >= 0) ::close(sending_);
  fail(address, port, code);
}

TransformLink::~TransformLink() {
  ::close(socket_);
  ::close(sending_);
}

std::uint16_t TransformLink::port() const {
  sockaddr_in address{};
  socklen_t length = sizeof(address);
  if (::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length) != 0) {
    fail("", 0, errno);
  }
  return ntohs(address.sin_port);
}

// Whether the sender is the peer, or there is none.
bool TransformLink::is_heard(const Peer& sender) {
  const bool is_peer = peer_ && peer_->address == sender.address && peer_->port == sender.port;
  return is_peer || !peer_ || sender.heard - peer_->heard > kSilence;
}

// The number of datagrams read bounds the loop: a flood is not waited out.
std::optional<TransformMessage> TransformLink::receive() {
  std::optional<TransformMessage> newest;
  std::array<std::uint8_t, kLongestDatagram> bytes;
  const auto now = std::chrono::steady_clock::now();
  for (int k = 0; k < kMostDatagrams; ++k) {
    sockaddr_in from{};
    socklen_t size = sizeof(from);
    const auto length = ::recvfrom(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_TRUNC,
                                   reinterpret_cast<sockaddr*>(&from), &size);
    if (length < 0) break;
    const Peer sender{from.sin_addr.s_addr, from.sin_port, now};
    if (std::size_t(length) > bytes.size() || !is_heard(sender)) continue;
    auto message = unpack_transform(std::span(bytes).first(std::size_t(length)));
    if (!message) continue;
    newest = std::move(message);
    peer_ = sender;
  }
  return newest;
}

bool TransformLink::send(const std::string& address, std::uint16_t port,
                         const TransformMessage& message) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  DYOP_REQUIRE(::inet_pton(AF_INET, address.c_str(), &to.sin_addr) == 1,
               "a transform can be sent to a numeric IPv4 address, not to '", address, "'");
  const std::vector<std::uint8_t> bytes = pack_transform(message);
  const auto sent = ::sendto(sending_, bytes.data(), bytes.size(), MSG_DONTWAIT,
                             reinterpret_cast<const sockaddr*>(&to), sizeof(to));
  return sent == ssize_t(bytes.size());
}

}  // namespace dyop

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
