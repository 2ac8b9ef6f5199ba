#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every C++ file is as clang-format 14 with .clang-format writes it. Usage: bash check_format.sh ROOT
# Ends with 77, "skipped", where that program is missing.
set -euo pipefail
cd "$1"
program=$(command -v clang-format-14 || true)
if [ -z "$program" ]; then
  echo "skipped: clang-format-14 is not installed (apt-get install clang-format-14)"
  exit 77
fi
find include src tests examples \( -name '*.h' -o -name '*.cpp' \) -print0 |
  xargs -0 "$program" --dry-run -Werror
