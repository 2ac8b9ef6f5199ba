#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, builds with warnings as errors, and passes all tests, among them projects
# that use the installed library; then builds the command once more without optimisation and with all
# assertions, and runs it. tests/sanitize.sh does more, and takes longer.
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

say "4/4 the command without optimisation (build/assertions)"
# Without debugging information, which takes a quarter of the time.
cmake --preset dev -B build/assertions -DDYOP_BUILD_TESTS=ON -DCMAKE_CXX_FLAGS_DEBUG=-O0 >/dev/null
cmake --build build/assertions --target dyop_cli dyop_core_test dyop_exact_test
ctest --test-dir build/assertions --output-on-failure -R '^(core|exact)\.' | tail -n 3
dyop=build/assertions/dyop
$dyop simulate examples/scenes/arch.json -o build/assertions/run.h5 --no-progress | tail -n 3
$dyop tool examples/surgery/scene.json --seconds 0.02
if [ -f build/assertions/page/page.html ]; then
  $dyop view build/assertions/run.h5 -o build/assertions/run.html
fi

say "all passed in $SECONDS s"
