// SPDX-License-Identifier: BSD-3-Clause
#include "support/allocation_count.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

// literal: a counter of the whole process, as operator new is.
std::atomic<std::int64_t> count{0};

}  // namespace

std::int64_t dyop::testing::allocation_count() {
  return count;
}

// Every allocation of this executable is counted.
void* operator new(std::size_t size) {
  ++count;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  ++count;
  const auto multiple = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(multiple, (size + multiple - 1) / multiple * multiple)) {
    return memory;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
