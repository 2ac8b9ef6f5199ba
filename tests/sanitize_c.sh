#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes random calls of the C interface, built for the address and undefined behaviour sanitizers.
# Usage: bash tests/sanitize_c.sh [COUNT [SEED]]     default: 30000 calls, five minutes
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset asan -DDYOP_BUILD_TESTS=ON > /dev/null
cmake --build build/asan --target dyop_c_abi
library() { g++ -print-file-name="$1"; }
FUZZ_PRELOAD="$(library libasan.so) $(library libstdc++.so)" PYTHONMALLOC=malloc \
  ASAN_OPTIONS=detect_leaks=0:handle_segv=1:allocator_may_return_null=1 \
  UBSAN_OPTIONS=print_stacktrace=1 \
  /usr/bin/python3 tests/c/fuzz_calls.py build/asan/tests/c/libdyop_c_abi.so "${1:-30000}" "${2:-0}"
