#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Asks apt whether the packages of a folder can be installed, unpacks them into a scratch root and uses
# what is in them: the command, its manual page and completion, a program built with pkg-config, one with
# find_package, one in C, and a query from Python.
# Usage: bash src/packaging/check_debs.sh FOLDER_OF_DEBS
set -euo pipefail
[ $# -eq 1 ] || { sed -n '6s/^# //p' "$0" >&2; exit 2; }
root=$(cd "$(dirname "$0")/../.." && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
debs=$(cd "$1" && pwd)
echo "apt"
apt-get install --simulate --no-install-recommends "$debs"/*.deb | grep '^Inst.*dyop'
for deb in "$debs"/*.deb; do
  dpkg-deb --extract "$deb" "$scratch"
done
libraries=$(dirname "$(find "$scratch" -name 'libdyop.so.*' | head -1)")
export LD_LIBRARY_PATH=$libraries

echo "command"
"$scratch/usr/bin/dyop" toi sphere:0.5 box:1,1,1 --position-a -3 0 0 --velocity-a 1 0 0 --interval 0 10
zcat -f "$scratch"/usr/share/man/man1/dyop.1* | grep -q "time of impact"
zcat -f "$scratch"/usr/share/man/man1/dyop-robot-check.1* | grep -q "path is free"
echo "a query needs neither OMPL nor HDF5"
needed=$(dpkg-deb --field "$debs"/libdyop0.*_*.deb Depends)
[[ $needed != *ompl* && $needed != *hdf5* && $needed != *sundials* && $needed != *assimp* ]]
bash -c "source /usr/share/bash-completion/bash_completion
         PATH=$scratch/usr/bin:\$PATH
         source '$scratch/usr/share/bash-completion/completions/dyop'
         COMP_WORDS=(dyop si) COMP_CWORD=1 COMP_LINE='dyop si' COMP_POINT=7
         _dyop; [ \"\${COMPREPLY[0]}\" = simulate ]"

echo "pkg-config"
# With the files of no other package but Eigen's, which every header includes.
export PKG_CONFIG_LIBDIR=$libraries/pkgconfig:$scratch/eigen
mkdir "$scratch/eigen"
ln -s /usr/share/pkgconfig/eigen3.pc "$scratch/eigen"
for pc in "$libraries"/pkgconfig/*.pc; do
  pkg-config --cflags --libs "$(basename "$pc" .pc)" > /dev/null
done
[ ! -e "$scratch/usr/include/dyop/ompl" ] || pkg-config --cflags dyop-ompl | grep -q ompl-
read -r -a flags <<< "$(pkg-config --cflags --libs dyop)"
g++ -std=c++20 "$root/tests/consumer/find_package/main.cpp" -o "$scratch/consumer" "${flags[@]}"
"$scratch/consumer"

echo "C"
read -r -a flags <<< "$(pkg-config --cflags --libs dyop-c)"
gcc -std=c99 "$root/tests/c/consumer.c" -o "$scratch/c_consumer" "${flags[@]}" -lm
"$scratch/c_consumer"
read -r -a flags <<< "$(pkg-config --cflags --libs dyop-c-io)"
gcc -std=c99 "$root/tests/c/files.c" -o "$scratch/c_files" "${flags[@]}" -lm
(cd "$scratch" && ./c_files "$root/examples/scenes/cradle.json" "$root/examples/surgery/scene.json")

echo "find_package"
cmake -S "$root/tests/consumer/find_package" -B "$scratch/build" -DCMAKE_PREFIX_PATH="$scratch/usr" \
  -DCMAKE_BUILD_TYPE=Release > /dev/null
cmake --build "$scratch/build" > /dev/null
"$scratch/build/consumer"
"$scratch/build/stepping"

if [ -d "$scratch/usr/lib/python3/dist-packages/dyop" ]; then
  echo "Python"
  (cd / && PYTHONPATH=$scratch/usr/lib/python3/dist-packages /usr/bin/python3 "$root/examples/python/01_two_spheres.py")
fi
[ -f "$scratch/usr/share/doc/dyop/concepts.md" ]
echo "packages: all is well"
