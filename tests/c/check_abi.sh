#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Fails if a program that was built with the C header of the last release would not run with this
# library: compares it with the interface kept beside this script. New functions are welcome, and new
# fields at the end of structs that begin with their size.
# Usage: bash check_abi.sh LIBRARY INCLUDE_FOLDER WORK_FOLDER
#        bash check_abi.sh --release LIBRARY INCLUDE_FOLDER      keeps LIBRARY's interface
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
kept=$here/released.abi
command -v abidiff >/dev/null || { echo "skipped: apt-get install abigail-tools"; exit 77; }

describe() {  # LIBRARY INCLUDE_FOLDER OUT; only what the header shows, nothing of this machine
  abidw --headers-dir "$2/dyop" --drop-private-types --no-corpus-path --no-comp-dir-path \
        --no-show-locs --no-elf-needed --exported-interfaces-only --out-file "$3" "$1"
  sed -i "s|path='[^']*/src/|path='src/|" "$3"
}

if [ "$1" = --release ]; then
  describe "$2" "$3" "$kept"
  exit
fi
describe "$1" "$2" "$3/now.abi"
functions=$(grep -c "<elf-symbol" "$3/now.abi")
[ "$functions" -ge 30 ] || { echo "only $functions functions are visible: the check sees nothing"; exit 1; }
abidiff --ignore-soname --no-added-syms --suppressions "$here/growth.abignore" "$kept" "$3/now.abi"
