#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Line coverage of the library by the tests of its rooms, without the soaks: one row per room.
# Usage: bash tests/coverage.sh [LINES]      LINES: list the uncovered lines of every file, too
set -euo pipefail
cd "$(dirname "$0")/.."
build=build/coverage
rooms=(core exact geometry motion hierarchy distance toi chain contact dynamics haptics paper io
  view cli)
targets=("${rooms[@]/#/dyop_}")
targets=("${targets[@]/%/_test}")

bash .ci/install.sh build python run test page coverage
cmake --preset coverage >/dev/null
cmake --build --preset coverage --target "${targets[@]}"
find "$build" -name '*.gcda' -delete
for room in "${rooms[@]}"; do
  "$build/tests/$room/dyop_${room}_test" --gtest_brief=1 >"$build/$room.log" 2>&1 ||
    echo "coverage.sh: tests of $room failed, see $build/$room.log"
done

gcovr --root . --object-directory "$build" --filter 'src/' --filter 'include/' \
  --exclude-throw-branches --exclude-unreachable-branches --csv "$build/coverage.csv" \
  --txt "$build/coverage.txt" "$build"
awk -F, '
  NR > 1 {
    split($1, part, "/")
    room = part[1] == "include" ? part[3] : part[2]
    lines[room] += $2
    covered[room] += $3
  }
  END {
    printf "| room | lines | covered | %% |\n|---|---|---|---|\n"
    count = split("'"${rooms[*]}"'", rooms, " ")
    for (k = 1; k <= count; ++k) {
      room = rooms[k]
      if (!lines[room]) continue
      printf "| %s | %d | %d | %.1f |\n", room, lines[room], covered[room], 100 * covered[room] / lines[room]
      all += lines[room]
      all_covered += covered[room]
    }
    printf "| all | %d | %d | %.1f |\n", all, all_covered, 100 * all_covered / all
  }' "$build/coverage.csv"
if [ "${1:-}" = LINES ]; then cat "$build/coverage.txt"; fi
