#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs every scene of examples/scenes, some that `dyop scene` makes, the plan of examples/planning and
# the tools of examples/surgery, and lets dyop-check prove each recording. Prints a table with the processor time of both; the exit
# code is 1 if anything is not proven. Usage: bash tests/check_scenes.sh [NAME...]; recordings stay in
# build/checked. Needs build/release; for the bunny Debian's glmark2-data.
set -euo pipefail
cd "$(dirname "$0")/.."
dyop=${DYOP:-build/release/dyop}
out=build/checked
mkdir -p "$out"

scenes=()
for file in examples/scenes/*.json; do scenes+=("$(basename "$file" .json)=$file"); done
for made in arch:25 cards:4 pile:40 bolt:4 spheres:100 hulls:40 ragdolls:10 rope:20; do
  scenes+=("${made/:/-}=$out/${made/:/-}.json")
  "$dyop" scene "${made%:*}" "${made#*:}" --out "$out/${made/:/-}.json" > /dev/null
done

# Runs a command, with its output to a file, and sets `seconds` to the processor time it took.
timed() {
  local TIMEFORMAT=%U status=0 file=$1
  shift
  { time "$@" > "$file" 2>&1; } 2> "$out/seconds" || status=$?
  seconds=$(cat "$out/seconds")
  return "$status"
}

code=0
check_one() {
  local name=$1 simulated=$2 verdict status=0
  timed "$out/$name.check.txt" "$dyop-check" "$out/$name.h5" || status=$?
  verdict=$(awk '/^(geometry|flight|contact)/ {printf "%s%s", sep, $2; sep = ", "}' "$out/$name.check.txt")
  awk -v n="$name" -v s="$simulated" -v c="$seconds" -v v="${verdict//:/}" \
    -v m="$(stat -c %s "$out/$name.h5")" \
    'BEGIN {printf "| %s | %s | %s | %.1f | %s |\n", n, s, c, m / 1e6, v}'
  if [ "$status" -ne 0 ]; then
    code=1
    sed 's/^/    /' "$out/$name.check.txt"
  fi
}

echo "| scene | simulate, s | check, s | recording, MB | geometry, flight, contact |"
echo "|---|---|---|---|---|"
for scene in "${scenes[@]}"; do
  name=${scene%%=*}
  if [ $# -gt 0 ] && [[ " $* " != *" $name "* ]]; then continue; fi
  timed "$out/$name.result.txt" "$dyop" simulate "${scene#*=}" -o "$out/$name.h5" --no-progress \
    --threads 1 --mesh-path /usr/share/glmark2/models
  check_one "$name" "$seconds"
done
planner=$(dirname "$dyop")/examples/example_planning_arm_at_shelf
if [ -x "$planner" ] && { [ $# -eq 0 ] || [[ " $* " == *" planning "* ]]; }; then
  timed "$out/planning.txt" "$planner" "$out/planning.h5"
  check_one planning "$seconds"
fi
for scene in examples/surgery/*.json; do
  name=$(basename "$scene" .json)
  if [ $# -gt 0 ] && [[ " $* " != *" $name "* ]]; then continue; fi
  timed "$out/$name.result.txt" "$dyop" tool "$scene" -o "$out/$name.h5"
  check_one "$name" "$seconds"
done
exit "$code"
