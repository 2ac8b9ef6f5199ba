#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Pictures of fifteen runs' pages, to be looked at one by one: three sizes, light and dark, four
# moments; 4 minutes on two cores.
# Usage: bash tests/screenshots.sh [OUT [NAME...]]     OUT: build/screenshots
# Environment: DYOP, the command (default build/release/dyop), DYOP_PAGE_MODULES.
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-build/screenshots}
[ $# -eq 0 ] || shift
dyop=${DYOP:-build/release/dyop}
export DYOP_PAGE_MODULES=${DYOP_PAGE_MODULES:-build/npm/node_modules}
chromium=$(command -v chromium) || { echo "screenshots: needs chromium: bash .ci/install.sh page" >&2; exit 2; }
mkdir -p "$out"

# name and scene: a file, or a kind and a number
scenes=$(cat <<'LIST'
bunny-throw   examples/scenes/bunny-throw.json
arch          arch:25
cards         cards:4
gears         examples/scenes/gears.json
cradle        examples/scenes/cradle.json
domino        examples/scenes/domino.json
wrecking-ball examples/scenes/wrecking-ball.json
pile          pile:40
chain-net     examples/scenes/chain-net.json
pyramid       examples/scenes/pyramid.json
ragdolls      ragdolls:8
liver         examples/surgery/soft-liver.json
cut           examples/surgery/cut.json
needle        examples/surgery/needle.json
hands         examples/surgery/two-hands.json
LIST
)

pages=()
while read -r name scene; do
  if [ $# -gt 0 ] && [[ " $* " != *" $name "* ]]; then continue; fi
  echo "screenshots: $name"
  if [[ $scene == *:* ]]; then
    "$dyop" scene "${scene%:*}" "${scene#*:}" --out "$out/$name.json"
    scene="$out/$name.json"
  fi
  if [[ $scene == examples/surgery/* ]]; then
    "$dyop" tool "$scene" -o "$out/$name.h5" > /dev/null
  else
    "$dyop" simulate "$scene" -o "$out/$name.h5" --no-progress --mesh-path /usr/share/glmark2/models > /dev/null
  fi
  "$dyop" view "$out/$name.h5" -o "$out/$name.html" > /dev/null
  pages+=("$out/$name.html")
done <<< "$scenes"
[ ${#pages[@]} -gt 0 ] || { echo "screenshots: no scene is named $*" >&2; exit 2; }
node tests/view/screenshots.mjs "$chromium" "$out" "${pages[@]}"
echo "screenshots: $(find "$out" -name '*.png' | wc -l) pictures in $out"
