// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "dyop/core/export.h"
#include "dyop/dynamics/world.h"
#include "dyop/view/page_encoder.h"

namespace DYOP_EXPORT dyop {

/// Whether this dyop was built with a server (it needs cpp-httplib).
bool has_live_server();

/// Serves the page of a live run from its own thread, on this machine only (127.0.0.1), under an
/// address that cannot be guessed. The page may stop the run and, unless PageScene::keeps_time,
/// pause it; opening, closing or losing it changes nothing.
class LiveServer {
 public:
  /// @param port 0: any free port.
  /// @throws InvalidArgument unless has_page() and has_live_server(), or if the port is taken.
  explicit LiveServer(PageEncoder encoder, int port = 0);
  /// Stops the server after it has sent all pending data.
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  /// The address to open in a browser.
  std::string address() const;

  /// Adds what happened next. Spans are put together until a page asks for them, so that a page
  /// that is slower than the run gets few, large blocks.
  void publish(PageSpan span);
  /// Nothing more will come.
  void finish();
  /// All that was published, as blocks of a page, the head first.
  std::vector<std::string> blocks();

  /// Pauses the run, as a page can.
  void pause();
  /// Waits while the run is paused, or until `stop` asks to go on. False if the run must end,
  /// because the page or `stop` says so. The page calls the run paused from here on only: it then
  /// has all that was published.
  bool may_go_on(const std::stop_token& stop);
  /// Is stopped when the page stops the run; pass it as AdvanceLimits::stop.
  std::stop_token stop_token() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Collects the data of a page from a World while it runs.
class RunFollower {
 public:
  /// The World's bodies at its time; `end_time` is what is planned.
  static PageScene scene_of(const World& world, const std::string& title, const Vector3& gravity_W,
                            Scalar end_time);

  /// @param gravity_W For the potential energy.
  explicit RunFollower(const Vector3& gravity_W) : gravity_W_(gravity_W) {}

  /// Where the bodies are before the first advance, for a page that opens before its end.
  static PageSpan start(const World& world);
  /// The data of the last advance of `world`. To be called after each advance.
  PageSpan follow(const AdvanceReport& report, const World& world);
  /// After the last advance, which had this status: why the run ended.
  static PageSpan ended(const World& world, AdvanceStatus status, Scalar planned_end);

 private:
  void add_segments(const AdvanceReport& report, PageSpan& span);
  void add_frame(const AdvanceReport& report, const World& world, PageSpan& span);
  void add_pairs(const World& world, PageSpan& span);
  void add_marks(const AdvanceReport& report, const World& world, PageSpan& span) const;

  Vector3 gravity_W_;
  bool has_started_ = false;
  std::vector<std::shared_ptr<const Motion>> rests_;  // by slot: what the page knows already
  std::vector<std::pair<BodyId, BodyId>> resting_;    // sorted
};

}  // namespace dyop
