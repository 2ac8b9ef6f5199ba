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

say "4/4 the command without optimisation (build/dev)"
cmake --preset dev -DDYOP_BUILD_TESTS=ON >/dev/null
cmake --build --preset dev --target dyop_cli dyop_core_test dyop_exact_test
ctest --preset dev -R '^(core|exact)\.' | tail -n 3
dev=build/dev/dyop
$dev simulate examples/scenes/arch.json -o build/dev/run.h5 --no-progress | tail -n 3
$dev tool examples/surgery/scene.json --seconds 0.02
if [ -f build/dev/page/page.html ]; then $dev view build/dev/run.h5 -o build/dev/run.html; fi

say "all passed in $SECONDS s"
