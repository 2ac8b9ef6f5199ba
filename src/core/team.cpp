// SPDX-License-Identifier: BSD-3-Clause
#include "core/team.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <thread>

#include "core/batch_run.h"
#include "dyop/core/batch_options.h"

namespace dyop::core_internal {
namespace {

constexpr int kLoopBits = 32;
constexpr std::uint64_t kMask = (std::uint64_t{1} << kLoopBits) - 1;
// More even the work out better, and cost more to hand out.
constexpr std::size_t kPartsPerThread = 4;
// So often a thread looks again at once, some tens of microseconds in all, before it lets others
// run.
constexpr int kPatience = 1000;

// Waits a moment, longer each time.
class Wait {
 public:
  void once() {
    if (++times_ > kPatience) {
      std::this_thread::yield();
      return;
    }
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
  }

 private:
  int times_ = 0;
};

}  // namespace

void Team::run_loop(Call call, const void* context, std::size_t count, std::size_t least) {
  const std::size_t portion = std::max(least, count / (kPartsPerThread * threads_) + 1);
  if (threads_ == 1 || count <= portion) {
    if (count > 0) call(context, 0, count);
    return;
  }
  loop_ = {call, context, count, portion, (count + portion - 1) / portion};
  done_.store(0, std::memory_order_relaxed);
  const std::uint64_t number = ((next_.load(std::memory_order_relaxed) >> kLoopBits) + 1) & kMask;
  next_.store(number << kLoopBits | loop_.parts, std::memory_order_release);
  take_parts(number);
  for (Wait wait; done_.load(std::memory_order_acquire) < loop_.parts;) wait.once();
}

// Runs parts of the loop of this number until none is left.
void Team::take_parts(std::uint64_t number) {
  std::size_t done = 0;
  std::uint64_t next = next_.load(std::memory_order_acquire);
  while (next >> kLoopBits == number && (next & kMask) > 0) {
    if (!next_.compare_exchange_weak(next, next - 1, std::memory_order_acq_rel,
                                     std::memory_order_acquire)) {
      continue;
    }
    const std::size_t begin = (loop_.parts - std::size_t(next & kMask)) * loop_.portion;
    loop_.call(loop_.context, begin, std::min(begin + loop_.portion, loop_.count));
    ++done;
    next = next_.load(std::memory_order_acquire);
  }
  if (done > 0) done_.fetch_add(done, std::memory_order_release);
}

void Team::help() {
  std::uint64_t seen = 0;
  for (Wait wait; !has_ended_.load(std::memory_order_acquire); wait.once()) {
    const std::uint64_t loop = next_.load(std::memory_order_acquire) >> kLoopBits;
    if (loop == seen) continue;
    take_parts(loop);
    seen = loop;
    wait = {};
  }
}

// The first thread that comes leads.
void Team::work(std::size_t /*worker*/) {
  if (has_leader_.load(std::memory_order_acquire) || has_leader_.exchange(true)) {
    help();
  } else {
    try {
      (*lead_)(*this);
    } catch (...) {
      error_ = std::current_exception();
    }
    has_ended_.store(true, std::memory_order_release);
  }
  left_.fetch_add(1, std::memory_order_release);
}

void with_team(int thread_count, const std::function<void(Team&)>& lead) {
  BatchOptions batch;
  batch.thread_count = thread_count;
  Team team;
  team.threads_ = batch_worker_count(std::numeric_limits<std::size_t>::max(), batch);
  if (team.threads_ == 1) {
    lead(team);
    return;
  }
  team.lead_ = &lead;
  // As in batch_run.cpp: what these two order, oneTBB does too, where thread sanitizers cannot see.
  team.has_leader_.store(false, std::memory_order_release);
  run_workers(team, team.threads_);
  team.left_.load(std::memory_order_acquire);
  if (team.error_) std::rethrow_exception(team.error_);
}

}  // namespace dyop::core_internal
