#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds with clang++ without warnings, compiles every public header alone, and runs the tests under
# the address and undefined behaviour sanitizers, and those that use threads under the thread sanitizer.
# Instrumented code makes g++ 12 see numbers without a value that have one: there warnings are no errors.
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\n== %s\n' "$*"; }

say "1/4 packages"
bash .ci/install.sh build python run test page

say "2/4 g++, address and undefined behaviour sanitizers (build/asan)"
cmake --preset asan >/dev/null
cmake --build --preset asan
ctest --preset asan -j "$(nproc)"

say "3/4 clang++, build without warnings, every public header alone (build/clang)"
cmake --preset clang >/dev/null
cmake --build --preset clang --target all all_verify_interface_header_sets

say "4/4 g++, thread sanitizer (build/tsan)"
cmake --preset tsan >/dev/null
cmake --build --preset tsan --target dyop_core_test dyop_geometry_test dyop_distance_test dyop_toi_test \
  dyop_contact_test dyop_dynamics_test dyop_haptics_test dyop_check_test
TSAN_OPTIONS="suppressions=$PWD/tests/tsan_suppressions.txt" ctest --preset tsan -R 'Determinism|AskAtOnce|TwoThreads|AnotherThread|Team|Shared'

say "all passed in $SECONDS s"
