// SPDX-License-Identifier: BSD-3-Clause
// What the parts that this build lacks do instead: say so.
#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "dyop/view/live_server.h"
#include "dyop/view/run_files.h"

#ifdef DYOP_LACKS_PAGE
namespace dyop::view_internal {

std::string_view page_bytes() {
  return {};
}

}  // namespace dyop::view_internal
#endif

#ifdef DYOP_LACKS_RECORDING
namespace dyop {

std::string recorded_page_html(const std::filesystem::path&, const RecordedPageOptions&) {
  throw InvalidArgument("this dyop was built without HDF5, so it reads no recordings");
}

}  // namespace dyop
#endif

#ifdef DYOP_LACKS_GLTF
namespace dyop {

void write_gltf(const std::filesystem::path&, const std::filesystem::path& out,
                const GltfOptions&) {
  throw FileError(out,
                  "cannot be written: this dyop was built without tinygltf and HDF5 (on Debian: "
                  "libtinygltf-dev, libhdf5-dev)");
}

}  // namespace dyop
#endif

#ifdef DYOP_LACKS_LIVE
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
#endif
