// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/haptic_recorder.h"

#include <atomic>
#include <exception>
#include <thread>
#include <utility>

#include "dyop/core/error.h"
#include "haptics/runner/record_ring.h"
#include "io/record/haptic_inputs.h"

namespace dyop {

struct HapticRecorder::Impl {
  Impl(std::unique_ptr<HapticRecordingWriter> to, bool may_wait)
      : writer(std::move(to)),
        inputs(writer->observer()),
        waits(may_wait),
        ring(haptics_internal::kWaitingTicks),
        thread([this](const std::stop_token& stop) { write(stop); }) {}

  // For the thread of ticks.
  TickRecord* place();
  void end();

  // In a thread of its own.
  void write(const std::stop_token& stop) noexcept;

  std::unique_ptr<HapticRecordingWriter> writer;
  std::shared_ptr<HapticObserver> inputs;
  const bool waits;
  bool is_over = false;
  std::int64_t ticks = 0;
  std::int64_t unlogged = 0;
  haptics_internal::RecordRing ring;
  std::exception_ptr failure;  // of the thread
  std::atomic<bool> has_failed{false};
  std::jthread thread;  // ends before what it uses
};

void HapticRecorder::Impl::write(const std::stop_token& stop) noexcept {
  try {
    for (bool is_last = false; !is_last;) {
      is_last = stop.stop_requested();
      for (; const TickRecord* record = ring.front(); ring.pop()) writer->add(*record);
      if (!is_last) std::this_thread::sleep_for(haptics_internal::kIdle);
    }
  } catch (...) {
    failure = std::current_exception();
    writer.reset();  // keeps no more inputs
    has_failed = true;
  }
}

TickRecord* HapticRecorder::Impl::place() {
  TickRecord* free = ring.free_place();
  while (!free && waits && !has_failed) {
    std::this_thread::sleep_for(haptics_internal::kIdle);
    free = ring.free_place();
  }
  return free;
}

void HapticRecorder::Impl::end() {
  DYOP_REQUIRE(!is_over, "HapticRecorder: ", "the recording is over already");
  is_over = true;
  thread.request_stop();
  thread.join();
  if (failure) std::rethrow_exception(failure);
}

HapticRecorder::HapticRecorder(std::unique_ptr<HapticRecordingWriter> writer, bool waits)
    : impl_(std::make_unique<Impl>(std::move(writer), waits)) {}

HapticRecorder::~HapticRecorder() = default;

void HapticRecorder::finish() {
  impl_->end();
  RunnerReport report;
  report.ticks = impl_->ticks;
  report.unlogged = impl_->unlogged;
  impl_->writer->finish(report);
}

void HapticRecorder::fail(const std::string& error) {
  impl_->end();
  impl_->writer->fail(error);
}

std::int64_t HapticRecorder::unlogged() const {
  return impl_->unlogged;
}

// After the end the writer ignores inputs.
void HapticRecorder::on_tissue(const TissueInput& input) noexcept {
  impl_->inputs->on_tissue(input);
}

void HapticRecorder::on_coupling(std::size_t tool, const CouplingOptions& coupling) noexcept {
  impl_->inputs->on_coupling(tool, coupling);
}

void HapticRecorder::on_reset(std::size_t tool, const ToolPose& pose) noexcept {
  impl_->inputs->on_reset(tool, pose);
}

void HapticRecorder::on_tick(std::span<const DevicePose> devices, Scalar dt,
                             std::span<const HapticTick> ticks) noexcept {
  if (impl_->is_over) return;
  impl_->inputs->on_tick(devices, dt, ticks);
  const std::int64_t number = impl_->ticks++;
  TickRecord* place = impl_->place();
  if (!place) {
    ++impl_->unlogged;
    return;
  }
  haptics_internal::put_record(number, devices, dt, ticks, *place);
  impl_->ring.push();
}

std::shared_ptr<HapticRecorder> record_session(HapticSession& session,
                                               const std::filesystem::path& file,
                                               const HapticRunHeader& header, bool waits) {
  const HapticSession& fresh = io_internal::recordable(session);
  auto writer =
      std::make_unique<HapticRecordingWriter>(file, header, fresh.scene(), fresh.options());
  auto recorder = std::make_shared<HapticRecorder>(std::move(writer), waits);
  session.observe(recorder);
  return recorder;
}

}  // namespace dyop
