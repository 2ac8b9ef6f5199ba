#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes a wheel of the Python package in a build folder, with Debian's tools only and no network.
# Usage: make_wheel.sh BUILD_FOLDER OUTPUT_DIRECTORY     needs python3-wheel
set -euo pipefail
build=$1
out=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python=$(sed -n 's/^_\?Python_EXECUTABLE:[A-Z]*=//p' "$build/CMakeCache.txt" | head -n 1)
python=${python:-/usr/bin/python3}
cmake --install "$build" --component python --prefix "$scratch/tree" >/dev/null
mkdir -p "$scratch/wheel" "$out"
mv "$scratch/tree/lib/python3/dist-packages/dyop" "$scratch/wheel/dyop"
strip --strip-unneeded "$scratch"/wheel/dyop/_dyop*.so
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
tag=$("$python" -c 'import sys, sysconfig
v = "cp%d%d" % sys.version_info[:2]
print(v, v, sysconfig.get_platform().replace("-", "_").replace(".", "_"), sep="-")')
info="$scratch/wheel/dyop-$version.dist-info"
mkdir "$info"
cp "$(dirname "$0")/../../LICENSE" "$info/LICENSE"
cat > "$info/METADATA" <<METADATA
Metadata-Version: 2.1
Name: dyop
Version: $version
Summary: Certified continuous collision detection and stepping of rigid bodies
License: BSD-3-Clause
Requires-Python: >=3.9
Requires-Dist: numpy
Provides-Extra: study
Requires-Dist: distributed; extra == "study"
METADATA
printf 'Wheel-Version: 1.0\nGenerator: make_wheel.sh\nRoot-Is-Purelib: false\nTag: %s\n' "$tag" > "$info/WHEEL"
"$python" -m wheel pack "$scratch/wheel" --dest-dir "$out"
