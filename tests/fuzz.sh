#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the fuzz targets of tests/fuzz with clang++ and its sanitizers, and runs each for so many
# seconds on one core. What was learned stays in build/fuzz/runs; a second run goes on from there.
# Usage: bash tests/fuzz.sh SECONDS [TARGET...]
# Exit code 1 if an input broke a promise: it is then in build/fuzz/runs/TARGET/found.
set -euo pipefail
cd "$(dirname "$0")/.."

if [ $# -lt 1 ] || ! [[ $1 =~ ^[1-9][0-9]*$ ]]; then
  sed -n '2,6p' "$0" | sed 's/^# //'
  exit 2
fi
seconds=$1
shift
build=build/fuzz
if [ $# -eq 0 ]; then
  set -- triangle_kernel motion_bounds mesh_query mesh_reader scene_reader record_reader robot_reader \
    check_kernel
fi

cmake --preset fuzz >/dev/null
cmake --build --preset fuzz --target fuzz_targets

# One row: what libFuzzer counted, and where in the run it last saw something new.
report() {
  awk -v target="$1" '
    /cov: [0-9]+ ft: [0-9]+/ {
      sub("#", "", $1)
      for (k = 1; k < NF; ++k) {
        if ($k == "cov:") coverage = $(k + 1)
        if ($k == "ft:") { if ($(k + 1) != features) last = $1; features = $(k + 1) }
      }
    }
    /stat::number_of_executed_units/ { executions = $2 }
    /^Done .* in [0-9]+ second/ { seconds = $(NF - 1) }
    END { printf "%-16s %12d %9d %9d %12d %8d\n", target, executions, coverage, features, last, seconds }' \
    "$2"
}

failures=0
reports=()
for target in "$@"; do
  work=$build/runs/$target
  mkdir -p "$work/corpus" "$work/found"
  options=(-max_total_time="$seconds" -timeout=60 -rss_limit_mb=2048 -max_len=4096
           -print_final_stats=1 -reload=0 -artifact_prefix="$work/found/")
  # On damaged files assimp, a third-party library, leaks what it had read.
  leaks=1
  if [ "$target" = mesh_reader ]; then leaks=0; fi
  dictionary=tests/fuzz/dictionaries/$target.dict
  if [ -f "$dictionary" ]; then options+=(-dict="$dictionary"); fi
  echo "fuzzing $target for $seconds s, log in $work/log"
  if ! ASAN_OPTIONS=detect_leaks=$leaks "$build/tests/fuzz/fuzz_$target" "${options[@]}" "$work/corpus" "tests/fuzz/corpus/$target" \
      >"$work/log" 2>&1; then
    failures=$((failures + 1))
    grep -E 'broken promise|ERROR|SUMMARY|runtime error' "$work/log" | head -5 || true
  fi
  reports+=("$(report "$target" "$work/log")")
done

printf '\n%-16s %12s %9s %9s %12s %8s\n' target executions edges features "last new at" seconds
printf '%s\n' "${reports[@]}"
if [ $failures -gt 0 ]; then
  printf '%d targets stopped at an input that broke a promise\n' $failures
  exit 1
fi
