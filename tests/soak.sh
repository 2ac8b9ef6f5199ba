#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Takes many triangle pairs through every path of the triangle kernel, against the exact oracle, in
# chunks on all cores. Usage: bash tests/soak.sh [PAIRS [FIRST_SEED]], 1e8 pairs unless said.
# Needs build/release. The report, one table a chunk and the sum of all, is build/soak/report.txt. A
# chunk that is there already is not repeated, so that a stopped run can go on. The exit code is 1 if
# any promise was broken.
set -euo pipefail
cd "$(dirname "$0")/.."

families=17
pairs=${1:-100000000}
first=${2:-1}
# Pairs of every family in one chunk: a minute or two, less if that would leave cores idle.
chunk=$(((pairs - 1) / (families * $(nproc)) + 1))
if [ "$chunk" -gt 60000 ]; then chunk=60000; fi
chunks=$(((pairs - 1) / (families * chunk) + 1))

soak=$PWD/build/release/tests/property/triangle_distance_soak
if [ ! -x "$soak" ]; then
  cmake --preset release >/dev/null
  cmake --build --preset release --target triangle_distance_soak
fi
mkdir -p build/soak
export soak chunk

run_chunk() {
  local out=build/soak/pairs-$chunk-seed-$1.txt
  if [ -s "$out" ]; then return 0; fi
  local code=0
  "$soak" "$chunk" "$1" >"$out.part" || code=$?
  # A chunk that found something wrong is kept; one that was killed is not.
  if [ "$code" -le 1 ]; then mv "$out.part" "$out"; fi
  return "$code"
}
export -f run_chunk

code=0
last=$((first + chunks - 1))
seq "$first" "$last" | xargs -P "$(nproc)" -I SEED bash -c 'run_chunk SEED' || code=1

files=()
for seed in $(seq "$first" "$last"); do
  out=build/soak/pairs-$chunk-seed-$seed.txt
  if [ -s "$out" ]; then files+=("$out"); fi
done
awk '
  FNR == 1 { next }
  FNR == 2 { header = $0; next }
  {
    if (!($1 in sum)) order[++n] = $1
    sum[$1]
    for (k = 2; k <= 9; ++k) total[$1, k] += $k
    for (k = 10; k <= 11; ++k) if ($k + 0 > most[$1, k] + 0) most[$1, k] = $k
    all += $2
  }
  END {
    printf "%d pairs in %d chunks\n%s\n", all, ARGC - 1, header
    for (i = 1; i <= n; ++i) {
      f = order[i]
      printf "%-16s %10d %7d %7d %7d %7d %7d %11d %9d %12.3f %14.2e\n", f, total[f, 2], total[f, 3],
             total[f, 4], total[f, 5], total[f, 6], total[f, 7], total[f, 8], total[f, 9],
             most[f, 10], most[f, 11]
    }
  }' "${files[@]}" | tee build/soak/report.txt
printf 'seeds %d to %d, %d pairs of every family each, exit code %d, %d s\n' "$first" "$last" \
  "$chunk" "$code" "$SECONDS" | tee -a build/soak/report.txt
exit "$code"
