#!/usr/bin/env bash
# Installs what is missing, builds with both compilers, and passes all tests, plain and under the
# address and undefined behaviour sanitizers.
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\n== %s\n' "$*"; }
seconds_at_start=$SECONDS

say "1/5 packages"
bash .ci/install.sh build run test

say "2/5 g++, optimised: build and test (build/release)"
cmake --preset release -DDYOP_BUILD_TESTS=ON >/dev/null
cmake --build --preset release
ctest --preset release -j "$(nproc)"

say "3/5 g++, sanitizers: build and test (build/asan)"
cmake --preset asan >/dev/null
cmake --build --preset asan
ctest --preset asan -j "$(nproc)" -LE 'slow|package'

say "4/5 clang++: build without warnings (build/clang)"
cmake --preset clang >/dev/null
cmake --build --preset clang

say "5/5 g++, thread sanitizer: the tests that use threads (build/tsan)"
cmake --preset tsan >/dev/null
cmake --build --preset tsan --target dyop_dynamics_test
ctest --preset tsan -R 'Thread|Determinism' -j "$(nproc)"

say "all passed in $((SECONDS - seconds_at_start)) s"
