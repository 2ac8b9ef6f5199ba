#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs the examples of docs/gallery.md: for each scene a recording, its page with the verdict of
# dyop-check, a picture, and a row of figures in OUT/figures.md; for the paper's 90 tests their tables
# and figures.
# Usage: bash examples/gallery.sh [OUT [NAME...]]     OUT: build/gallery
# Environment: DYOP, the command (default build/release/dyop). Bunnies: Debian's glmark2-data. Pictures:
# chromium and ffmpeg (bash .ci/install.sh page); without them the pages are written all the same.
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-build/gallery}
[ $# -eq 0 ] || shift
dyop=${DYOP:-build/release/dyop}
mkdir -p "$out"

# name, scene (a file, or a kind and a number), time of the picture, theme, more of its link
scenes=$(cat <<'LIST'
bunny-throw   examples/scenes/bunny-throw.json    0.3337242145962022 light cam=-0.28,0.35,1.0,-0.11,0.11,0.03
arch          arch:25                             0.1  light
cards         cards:4                             0.1  dark
chain-net     examples/scenes/chain-net.json      0.9  light
gears         examples/scenes/gears.json          0.6  dark
cradle        examples/scenes/cradle.json         1.2  light
domino        examples/scenes/domino.json         1.0  light
wrecking-ball examples/scenes/wrecking-ball.json  1.6  light
pile          pile:40                             1.5  light
bolt          bolt:4                              2.0  light view=ghost&body=bolt&show=joints
LIST
)

rows="$out/figures.md"
echo "| run | bodies | simulated | computed in | impacts | most contacts | stalls | recording | page |" > "$rows"
echo "|---|---|---|---|---|---|---|---|---|" >> "$rows"

# The page of a recording, and its picture at a time.
show_one() {
  local name=$1 time=$2 link=$3
  "$dyop" view "$out/$name.h5" --check -o "$out/$name.html" > /dev/null
  if command -v chromium >/dev/null && command -v ffmpeg >/dev/null; then
    "$dyop" export "$out/$name.h5" --frames "$out/$name.frames" --from "$time" --to "$time" \
      --width 640 --height 400 --link "$link" > /dev/null
    # 256 colours are enough for a page of the docs.
    ffmpeg -nostdin -y -loglevel error -i "$out/$name.frames/frame-00000.png" -frames:v 1 \
      -vf 'split[a][b];[a]palettegen=reserve_transparent=0[p];[b][p]paletteuse=dither=none' "$out/$name.png"
    rm -r "$out/$name.frames"
  fi
}

make_one() {
  local name=$1 scene=$2 time=$3 link="theme=$4"
  [ -z "${5:-}" ] || link="$link&$5"
  if [[ $scene == *:* ]]; then
    "$dyop" scene "${scene%:*}" "${scene#*:}" --out "$out/$name.json"
    scene="$out/$name.json"
  fi
  "$dyop" simulate "$scene" -o "$out/$name.h5" --no-progress --json --threads 1 \
    --mesh-path /usr/share/glmark2/models > "$out/$name.result.json"
  show_one "$name" "$time" "$link"
  python3 - "$out" "$name" >> "$rows" <<'ROW'
import json, os, sys
out, name = sys.argv[1:]
run = json.load(open(f"{out}/{name}.result.json"))
size = lambda ending: f"{os.path.getsize(f'{out}/{name}.{ending}') / 1e6:.1f} MB"
print(f"| {name} | {len(run['bodies'])} | {run['t']:.1f} | {run['seconds']:.1f} s | {run['impacts']} | "
      f"{run['contacts']} | {run['stalls']} | {size('h5')} | {size('html')} |")
ROW
  echo "$name"
}

is_wanted() {
  [ ${#wanted[@]} -eq 0 ] || [[ " ${wanted[*]} " == *" $1 "* ]]
}

wanted=("$@")
while read -r name scene time theme link; do
  if is_wanted "$name"; then make_one "$name" "$scene" "$time" "$theme" "$link"; fi
done <<< "$scenes"
# Planning needs OMPL: without it its example was not built.
planner=$(dirname "$dyop")/examples/example_planning_arm_at_shelf
if is_wanted planning && [ -x "$planner" ]; then
  "$planner" "$out/planning.h5"
  show_one planning 3 "theme=light&show=trails&body=hand"
  echo planning
fi
make_tool() {
  local name=$1 scene=$2 time=$3 link=$4
  "$dyop" tool "$scene" -o "$out/$name.h5" > "$out/$name.txt"
  show_one "$name" "$time" "$link"
  echo "$name"
}
if is_wanted tool; then make_tool tool examples/surgery/scene.json 2.2 "theme=light"; fi
if is_wanted hands; then
  make_tool hands examples/surgery/two-hands.json 8.3 "theme=light&cam=200,-230,190,55,0,85"
fi
if is_wanted paper; then
  "$dyop" paper --out "$out/paper" > "$out/paper.txt"
  echo paper
fi
