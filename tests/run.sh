#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, builds with warnings as errors, and passes all tests, among them projects
# that use the installed library; then builds the libraries, the command and the fuzz targets with
# clang++, without optimisation and with all assertions, and runs the command.
# tests/sanitize.sh does more, and takes longer.
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\n== %s\n' "$*"; }

say "1/4 packages"
bash .ci/install.sh build python run test page

say "2/4 build (build/release)"
cmake --preset release -DDYOP_BUILD_TESTS=ON -DDYOP_WARNINGS_AS_ERRORS=ON >/dev/null
cmake --build --preset release

say "3/4 test"
ctest --preset release -j "$(nproc)"

say "4/4 clang++, without optimisation (build/clang-debug)"
# Without debugging information, which takes a quarter of the time.
cmake --preset dev -B build/clang-debug -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_CXX_FLAGS_DEBUG=-O0 \
  -DDYOP_BUILD_TESTS=ON -DDYOP_BUILD_PYTHON=OFF -DDYOP_BUILD_EXAMPLES=OFF >/dev/null
cmake --build build/clang-debug --target dyop_cli dyop_ompl dyop_c_io dyop_test_models \
  dyop_test_contacts dyop_test_worlds dyop_core_test dyop_exact_test fuzz_targets
ctest --test-dir build/clang-debug --output-on-failure -R '^(core|exact)\.' | tail -n 3
dyop=build/clang-debug/dyop
$dyop simulate examples/scenes/arch.json -o build/clang-debug/run.h5 --no-progress | tail -n 3
$dyop tool examples/surgery/scene.json --seconds 0.02
if [ -f build/clang-debug/page/page.html ]; then
  $dyop view build/clang-debug/run.h5 -o build/clang-debug/run.html
fi

say "all passed in $SECONDS s"
