#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, builds with warnings as errors, and passes all tests, among them projects
# that use the installed library. tests/sanitize.sh does more, and takes longer.
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\n== %s\n' "$*"; }

say "1/3 packages"
bash .ci/install.sh build python run test page

say "2/3 build (build/release)"
cmake --preset release -DDYOP_BUILD_TESTS=ON -DDYOP_WARNINGS_AS_ERRORS=ON >/dev/null
cmake --build --preset release

say "3/3 test"
ctest --preset release -j "$(nproc)"

say "all passed in $SECONDS s"
