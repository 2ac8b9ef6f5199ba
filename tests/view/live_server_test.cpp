// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/live_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <memory>
#include <regex>
#include <thread>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/view/run_files.h"

namespace dyop {
namespace {

#define DYOP_SKIP_WITHOUT_SERVER()       \
  if (!has_page() || !has_live_server()) \
  GTEST_SKIP() << "runs where page and server are built: bash .ci/install.sh build page"

struct Address {
  int port = 0;
  std::string path;
};

Address parts_of(const std::string& address) {
  std::smatch match;
  EXPECT_TRUE(std::regex_match(address, match, std::regex(R"(http://127\.0\.0\.1:(\d+)(/.*/))")));
  return {std::stoi(match[1].str()), match[2].str()};
}

// One request over a socket of its own; the whole answer, head and body.
std::string ask(const Address& address, const std::string& method, const std::string& path,
                const std::string& host = "") {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(std::uint16_t(address.port));
  inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
  EXPECT_EQ(connect(socket, reinterpret_cast<sockaddr*>(&to), sizeof(to)), 0);
  const std::string request = method + " " + path + " HTTP/1.1\r\nHost: " +
                              (host.empty() ? "127.0.0.1:" + std::to_string(address.port) : host) +
                              "\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";
  EXPECT_EQ(send(socket, request.data(), request.size(), 0), ssize_t(request.size()));
  std::string answer;
  std::array<char, 4096> buffer{};
  for (;;) {
    const ssize_t count = recv(socket, buffer.data(), buffer.size(), 0);
    if (count <= 0) break;
    answer.append(buffer.data(), std::size_t(count));
  }
  close(socket);
  return answer;
}

// Sockets that are connected and say nothing, or only what they are given.
class Idle {
 public:
  Idle(const Address& address, const std::string& words)
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(std::uint16_t(address.port));
    inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
    EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof(to)), 0);
    EXPECT_EQ(send(socket_, words.data(), words.size(), MSG_NOSIGNAL), ssize_t(words.size()));
  }
  ~Idle() { close(socket_); }
  Idle(const Idle&) = delete;
  Idle& operator=(const Idle&) = delete;

  std::string answer() const {
    std::array<char, 4096> buffer{};
    const ssize_t count = recv(socket_, buffer.data(), buffer.size(), 0);
    return {buffer.data(), std::size_t(std::max<ssize_t>(count, 0))};
  }

 private:
  int socket_;
};

int status_of(const std::string& answer) {
  return std::stoi(answer.substr(answer.find(' ') + 1));
}

std::string body_of(const std::string& answer) {
  return answer.substr(answer.find("\r\n\r\n") + 4);
}

// A block as it is sent: after its length.
std::string sent(const std::string& block) {
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += char(block.size() >> shift & 255);
  return bytes + block;
}

PageEncoder encoder() {
  PageScene scene;
  scene.title = "A run";
  return PageEncoder(scene);
}

PageSpan frame(int k) {
  PageSpan span;
  span.frames.emplace_back().interval = {Scalar(k), Scalar(k + 1)};
  return span;
}

std::string state_at(const Address& address, int block) {
  const std::string answer = ask(address, "GET", address.path + "blocks/" + std::to_string(block));
  const std::string key = "X-Dyop-State: ";
  const std::size_t at = answer.find(key) + key.size();
  return answer.substr(at, answer.find('\r', at) - at);
}

TEST(LiveServer, ServesItsPageAndBlocksAsTheyCome) {
  DYOP_SKIP_WITHOUT_SERVER();
  LiveServer server(encoder());
  const Address address = parts_of(server.address());
  EXPECT_NE(ask(address, "GET", address.path).find("id=\"live\""), std::string::npos);
  EXPECT_EQ(body_of(ask(address, "GET", address.path + "blocks/0")), sent(encoder().head()));
  EXPECT_EQ(status_of(ask(address, "GET", address.path + "blocks/1")), 204);
  // What comes while nobody asks is one block.
  server.publish(frame(0));
  server.publish(frame(1));
  PageSpan both = frame(0);
  append(both, frame(1));
  const std::string answer = ask(address, "GET", address.path + "blocks/1");
  EXPECT_EQ(body_of(answer), sent(encoder().span(both)));
  EXPECT_NE(answer.find("X-Dyop-State: running"), std::string::npos);
  server.publish(frame(2));
  EXPECT_EQ(body_of(ask(address, "GET", address.path + "blocks/1")), sent(encoder().span(both)));
  EXPECT_EQ(body_of(ask(address, "GET", address.path + "blocks/2")),
            sent(encoder().span(frame(2))));
  server.finish();
  EXPECT_NE(ask(address, "GET", address.path + "blocks/3").find("X-Dyop-State: finished"),
            std::string::npos);
  EXPECT_EQ(server.blocks(), (std::vector<std::string>{encoder().head(), encoder().span(both),
                                                       encoder().span(frame(2))}));
}

TEST(LiveServer, KeepsForThePageAtTheEndWhatNobodyAskedFor) {
  DYOP_SKIP_WITHOUT_SERVER();
  LiveServer server(encoder());
  server.publish(frame(0));
  server.finish();
  EXPECT_EQ(server.blocks(),
            (std::vector<std::string>{encoder().head(), encoder().span(frame(0))}));
}

TEST(LiveServer, ReadsNoBodies) {
  DYOP_SKIP_WITHOUT_SERVER();
  LiveServer server(encoder());
  const Address address = parts_of(server.address());
  const std::string host = " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(address.port) + "\r\n";
  for (const std::string& path : {std::string("/nothing"), address.path + "pause"}) {
    // Answered although the body never comes.
    const Idle long_one(address, "POST " + path + host + "Content-Length: 4000000000\r\n\r\n");
    EXPECT_EQ(status_of(long_one.answer()), 413);
    const Idle chunked(address,
                       "POST " + path + host + "Transfer-Encoding: chunked\r\n\r\nffffff\r\n");
    EXPECT_EQ(status_of(chunked.answer()), 413);
  }
  EXPECT_EQ(state_at(address, 0), "running");
}

TEST(LiveServer, AnswersWhileOthersSayNothing) {
  DYOP_SKIP_WITHOUT_SERVER();
  LiveServer server(encoder());
  const Address address = parts_of(server.address());
  std::vector<std::unique_ptr<Idle>> idle;
  for (int k = 0; k < 40; ++k) idle.push_back(std::make_unique<Idle>(address, "GET /half"));
  const std::string answer = ask(address, "GET", address.path);
  EXPECT_EQ(status_of(answer), 200);
  for (const char* header : {"X-Content-Type-Options: nosniff", "X-Frame-Options: DENY",
                             "Referrer-Policy: no-referrer"}) {
    EXPECT_NE(answer.find(header), std::string::npos) << header;
  }
}

TEST(LiveServer, RefusesWhoDoesNotKnowItsAddress) {
  DYOP_SKIP_WITHOUT_SERVER();
  LiveServer server(encoder());
  const Address address = parts_of(server.address());
  EXPECT_GE(address.path.size(), 32u);
  EXPECT_EQ(status_of(ask(address, "GET", "/")), 404);
  EXPECT_EQ(status_of(ask(address, "GET", "/blocks/0")), 404);
  EXPECT_EQ(status_of(ask(address, "POST", "/stop")), 404);
  EXPECT_EQ(status_of(ask(address, "GET", address.path, "example.org")), 403);
  EXPECT_FALSE(server.stop_token().stop_requested());
}

TEST(LiveServer, PausesAndStopsTheRunOnlyWhenAsked) {
  DYOP_SKIP_WITHOUT_SERVER();
  LiveServer server(encoder());
  const Address address = parts_of(server.address());
  std::stop_source user;
  EXPECT_TRUE(server.may_go_on(user.get_token()));
  EXPECT_EQ(status_of(ask(address, "POST", address.path + "pause")), 200);
  // The run's last step is still under way.
  EXPECT_EQ(state_at(address, 1), "pausing");
  std::atomic<bool> has_gone_on = false;
  std::jthread run([&] { has_gone_on = server.may_go_on(user.get_token()); });
  for (int k = 0; k < 10000 && state_at(address, 1) != "paused"; ++k) std::this_thread::yield();
  EXPECT_EQ(state_at(address, 1), "paused");
  EXPECT_FALSE(has_gone_on);
  EXPECT_EQ(status_of(ask(address, "POST", address.path + "resume")), 200);
  run.join();
  EXPECT_TRUE(has_gone_on);
  EXPECT_EQ(status_of(ask(address, "POST", address.path + "stop")), 200);
  EXPECT_TRUE(server.stop_token().stop_requested());
  EXPECT_FALSE(server.may_go_on(user.get_token()));
}

TEST(LiveServer, AUsersStopEndsAPause) {
  DYOP_SKIP_WITHOUT_SERVER();
  LiveServer server(encoder());
  server.pause();
  std::stop_source user;
  std::atomic<bool> may = true;
  std::jthread run([&] { may = server.may_go_on(user.get_token()); });
  user.request_stop();
  run.join();
  EXPECT_FALSE(may);
}

TEST(LiveServer, ATakenPortIsNamed) {
  DYOP_SKIP_WITHOUT_SERVER();
  LiveServer server(encoder());
  try {
    LiveServer second(encoder(), parts_of(server.address()).port);
    ADD_FAILURE() << "two servers share a port";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find(std::to_string(parts_of(server.address()).port)),
              std::string::npos);
  }
}

}  // namespace
}  // namespace dyop
