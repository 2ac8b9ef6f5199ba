// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/core/error.h"
#include "dyop/view/live_server.h"

namespace dyop {

struct LiveServer::Impl {};

bool has_live_server() {
  return false;
}

LiveServer::LiveServer(PageEncoder, int) {
  throw InvalidArgument("this dyop was built without cpp-httplib, so it cannot serve a page");
}

LiveServer::~LiveServer() = default;

std::string LiveServer::address() const {
  return {};
}

void LiveServer::publish(PageSpan) {}

void LiveServer::finish() {}

std::vector<std::string> LiveServer::blocks() {
  return {};
}

void LiveServer::pause() {}

bool LiveServer::may_go_on(const std::stop_token&) {
  return false;
}

std::stop_token LiveServer::stop_token() const {
  return {};
}

}  // namespace dyop
