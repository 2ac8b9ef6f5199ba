// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/live_server.h"

#include <httplib.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <random>
#include <thread>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/view/run_files.h"

namespace dyop {
namespace {

constexpr const char* kHost = "127.0.0.1";
constexpr int kNotFound = 404;
constexpr int kNoContent = 204;
constexpr int kForbidden = 403;
constexpr std::chrono::milliseconds kWait{1};
constexpr int kMostWaits = 5000;
constexpr std::size_t kBytesOfAnswer = 1 << 20;
constexpr std::size_t kSegmentsOfBlock = 20000;
constexpr int kMethodNotAllowed = 405;
constexpr int kConflict = 409;
constexpr int kPayloadTooLarge = 413;
// Idle connections hold a worker each until they time out: more than a browser opens.
constexpr std::size_t kWorkers = 64;
constexpr time_t kSecondsToRead = 2;

// 128 bits that another page cannot guess.
std::string random_name() {
  std::random_device device;
  std::string name;
  for (int k = 0; k < 4; ++k) {
    std::array<char, 9> digits{};
    std::snprintf(digits.data(), digits.size(), "%08x", static_cast<unsigned>(device()));
    name += digits.data();
  }
  return name;
}

}  // namespace

struct LiveServer::Impl {
  // Pausing: the run has been asked to pause, but is still about its last step.
  enum class State { Running, Pausing, Paused, Finished };

  explicit Impl(PageEncoder the_encoder) : encoder(std::move(the_encoder)) {}

  PageEncoder encoder;
  std::mutex mutex;
  std::condition_variable_any changed;
  State state = State::Running;
  std::vector<std::string> blocks{encoder.head()};
  PageSpan pending;  // what follows the blocks
  std::stop_source stop;
  std::string page;
  std::string name = random_name();
  int port = 0;
  httplib::Server server;
  std::jthread thread;

  const char* state_word() const {
    switch (state) {
      case State::Running:
        return "running";
      case State::Pausing:
        return "pausing";
      case State::Paused:
        return "paused";
      case State::Finished:
        return "finished";
    }
    return "";
  }

  void change(State wanted) {
    const std::scoped_lock lock(mutex);
    if (state == State::Finished || (state == State::Paused && wanted == State::Pausing)) return;
    state = wanted;
    changed.notify_all();
  }

  // Makes a block of what is pending; the caller holds the mutex.
  void encode_pending() {
    if (pending.frames.empty() && pending.segments.empty()) return;
    encoder.add_bodies(pending.bodies);
    blocks.push_back(encoder.span(std::exchange(pending, {})));
  }

  // Some of the blocks from the one asked for on, each after its length (32 bits, little-endian).
  void send_blocks(const httplib::Request& request, httplib::Response& response) {
    const std::size_t first = std::stoul(request.matches[1].str());
    const std::scoped_lock lock(mutex);
    if (first >= blocks.size()) encode_pending();
    response.set_header("X-Dyop-State", state_word());
    response.set_header("Cache-Control", "no-store");
    std::string bytes;
    for (std::size_t k = first; k < blocks.size() && bytes.size() < kBytesOfAnswer; ++k) {
      for (int shift = 0; shift < 32; shift += 8) bytes += char(blocks[k].size() >> shift & 255);
      bytes += blocks[k];
    }
    if (bytes.empty()) response.status = kNoContent;
    response.set_content(std::move(bytes), "application/octet-stream");
  }

  // The status of a request that is refused before its body is read; 0 for others.
  static int refusal_of(const httplib::Request& request) {
    if (request.method != "GET" && request.method != "HEAD" && request.method != "POST")
      return kMethodNotAllowed;
    const std::string length = request.get_header_value("Content-Length");
    const bool has_body =
        request.has_header("Transfer-Encoding") || !(length.empty() || length == "0");
    return has_body ? kPayloadTooLarge : 0;
  }

  void add_routes() {
    const std::string at = "/" + name + "/";
    // By default two servers may share a port.
    server.set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    });
    server.new_task_queue = [] { return new httplib::ThreadPool(kWorkers); };
    server.set_read_timeout(kSecondsToRead);
    server.set_keep_alive_timeout(kSecondsToRead);
    server.set_payload_max_length(0);
    server.set_default_headers({{"X-Content-Type-Options", "nosniff"},
                                {"X-Frame-Options", "DENY"},
                                {"Content-Security-Policy", "frame-ancestors 'none'"},
                                {"Referrer-Policy", "no-referrer"}});
    // A page of another site that resolves its own name to this machine is refused.
    server.set_pre_routing_handler([this](const auto& request, auto& response) {
      const std::string host = request.get_header_value("Host");
      const std::string own = std::string(kHost) + ":" + std::to_string(port);
      const int refusal = host != own ? kForbidden : refusal_of(request);
      if (refusal == 0) return httplib::Server::HandlerResponse::Unhandled;
      response.status = refusal;
      response.set_header("Connection", "close");  // a body that is not read follows
      return httplib::Server::HandlerResponse::Handled;
    });
    server.Get(at, [this](const auto&, auto& response) {
      response.set_content(page, "text/html; charset=utf-8");
    });
    server.Get(at + R"(blocks/(\d{1,9}))",
               [this](const auto& request, auto& response) { send_blocks(request, response); });
    server.Post(at + "pause", [this](const auto&, auto& response) {
      if (encoder.scene().keeps_time) {
        response.status = kConflict;
      } else {
        change(State::Pausing);
      }
    });
    server.Post(at + "resume", [this](const auto&, auto&) { change(State::Running); });
    server.Post(at + "stop", [this](const auto&, auto&) {
      stop.request_stop();
      change(State::Running);
    });
    server.set_error_handler([](const auto&, auto& response) {
      if (response.status == kNotFound) response.set_content("not here\n", "text/plain");
    });
  }
};

bool has_live_server() {
  return true;
}

LiveServer::LiveServer(PageEncoder encoder, int port)
    : impl_(std::make_unique<Impl>(std::move(encoder))) {
  impl_->page = live_page_html(impl_->encoder.scene().title);
  impl_->add_routes();
  if (port == 0) {
    impl_->port = impl_->server.bind_to_any_port(kHost);
  } else {
    impl_->port = impl_->server.bind_to_port(kHost, port) ? port : -1;
  }
  DYOP_REQUIRE(impl_->port > 0, "port ", port, " of ", kHost, " cannot be used");
  impl_->thread = std::jthread([server = &impl_->server] { server->listen_after_bind(); });
  // The port is bound already: what comes before the thread listens waits in the system's queue.
  // But stop() before that would be forgotten.
  for (int k = 0; k < kMostWaits && !impl_->server.is_running(); ++k) {
    std::this_thread::sleep_for(kWait);
  }
}

LiveServer::~LiveServer() {
  impl_->server.stop();
}

std::string LiveServer::address() const {
  return "http://" + std::string(kHost) + ":" + std::to_string(impl_->port) + "/" + impl_->name +
         "/";
}

void LiveServer::publish(PageSpan span) {
  const std::scoped_lock lock(impl_->mutex);
  append(impl_->pending, std::move(span));
  if (impl_->pending.segments.size() > kSegmentsOfBlock) impl_->encode_pending();
}

void LiveServer::finish() {
  const std::scoped_lock lock(impl_->mutex);
  impl_->state = Impl::State::Finished;
}

std::vector<std::string> LiveServer::blocks() {
  const std::scoped_lock lock(impl_->mutex);
  impl_->encode_pending();
  return impl_->blocks;
}

void LiveServer::pause() {
  impl_->change(Impl::State::Pausing);
}

bool LiveServer::may_go_on(const std::stop_token& stop) {
  using State = Impl::State;
  std::unique_lock lock(impl_->mutex);
  if (impl_->state == State::Pausing) impl_->state = State::Paused;
  impl_->changed.wait(
      lock, stop, [this] { return impl_->state != State::Paused || impl_->stop.stop_requested(); });
  return !stop.stop_requested() && !impl_->stop.stop_requested();
}

std::stop_token LiveServer::stop_token() const {
  return impl_->stop.get_token();
}

}  // namespace dyop
