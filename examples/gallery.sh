#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs the ten scenes of docs/gallery.md: for each one a recording, its page, a picture, and a row of
# figures in OUT/figures.md.
# Usage: bash examples/gallery.sh [OUT [NAME...]]     OUT: build/gallery
# Environment: DYOP, the command (default build/release/dyop). Bunnies: Debian's glmark2-data. Pictures:
# chromium; without it the pages are written all the same.
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-build/gallery}
[ $# -eq 0 ] || shift
dyop=${DYOP:-build/release/dyop}
mkdir -p "$out"

# name, scene (a file, or a kind and a number), time of the picture, more of its link
scenes=$(cat <<'LIST'
bunny-throw examples/scenes/bunny-throw.json 0.36
arch        examples/scenes/arch.json        0.1
cards       examples/scenes/cards.json       0.1
chain-net   examples/scenes/chain-net.json   0.9
gears       examples/scenes/gears.json       0.6
cradle      examples/scenes/cradle.json      1.2
domino      examples/scenes/domino.json      1.5
wall        examples/scenes/wall.json        0.9
pile        pile:40                          1.5
pyramid     examples/scenes/pyramid.json     0.1
LIST
)

rows="$out/figures.md"
echo "| run | bodies | simulated | computed in | impacts | stalls | recording | page |" > "$rows"
echo "|---|---|---|---|---|---|---|---|" >> "$rows"

make_one() {
  local name=$1 scene=$2 time=$3
  if [[ $scene == *:* ]]; then
    "$dyop" scene "${scene%:*}" "${scene#*:}" --out "$out/$name.json"
    scene="$out/$name.json"
  fi
  "$dyop" simulate "$scene" --out "$out/$name" --record "$out/$name.h5" --no-progress --json \
    --mesh-path /usr/share/glmark2/models > "$out/$name.result.json" || true
  "$dyop" view "$out/$name.h5" -o "$out/$name.html" > /dev/null
  if command -v chromium >/dev/null; then
    "$dyop" view "$out/$name.h5" --frames "$out/$name.frames" --from "$time" --to "$time" \
      --width 640 --height 400 > /dev/null
    mv "$out/$name.frames/frame-00000.png" "$out/$name.png"
    rmdir "$out/$name.frames"
  fi
  python3 - "$out" "$name" >> "$rows" <<'ROW'
import json, os, sys
out, name = sys.argv[1:]
run = json.load(open(f"{out}/{name}.result.json"))
size = lambda ending: f"{os.path.getsize(f'{out}/{name}.{ending}') / 1e6:.1f} MB"
print(f"| {name} | {len(run['bodies'])} | {run['t']:.1f} | {run['seconds']:.1f} s | {run['impacts']} | "
      f"{run['stalls']} | {size('h5')} | {size('html')} |")
ROW
  echo "$name"
}

while read -r name scene time; do
  if [ $# -eq 0 ] || [[ " $* " == *" $name "* ]]; then make_one "$name" "$scene" "$time"; fi
done <<< "$scenes"
