#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the Debian packages of the tree into a folder, and runs lintian over them.
# Usage: bash src/packaging/build_debs.sh OUT_FOLDER
# Needs: debhelper dpkg-dev fakeroot help2man lintian, and what the build needs (.ci/install.sh package build).
set -euo pipefail
[ $# -eq 1 ] || { sed -n '4,5s/^# //p' "$0" >&2; exit 2; }
root=$(cd "$(dirname "$0")/../.." && pwd)
mkdir -p "$1"
out=$(cd "$1" && pwd)
version=$(sed -n 's/^project(dyop VERSION \([0-9.]*\).*/\1/p' "$root/CMakeLists.txt")
tree=$out/dyop-$version

# dpkg-buildpackage insists on debian/ at the top of the tree: a copy has it.
rm -rf "$tree"
mkdir -p "$tree"
git -C "$root" ls-files -z --cached --others --exclude-standard |
  tar -C "$root" --null --files-from - --create --ignore-failed-read | tar -C "$tree" --extract
cp -r "$root/src/packaging/debian" "$tree/debian"
# The list of changes is docs/CHANGELOG.md; the date is that of the last commit, so that a package is
# the same whenever it is built.
cat > "$tree/debian/changelog" <<END
dyop ($version) unstable; urgency=medium

  * Release $version: see docs/CHANGELOG.md.

 -- The dyop developers <dyop@example.org>  $(git -C "$root" log -1 --format=%aD)
END
if [ -f "$root/src/python/CMakeLists.txt" ] && ! [[ ${DYOP_CMAKE_OPTIONS:-} == *DYOP_BUILD_PYTHON=OFF* ]]; then
  cat "$tree/debian/control.python" >> "$tree/debian/control"
  sed -i 's/^ pkg-config,$/ pkg-config,\n dh-python,\n pybind11-dev,\n python3-dev,\n python3-numpy,/' \
    "$tree/debian/control"
  echo 'usr/lib/python3/dist-packages/dyop' > "$tree/debian/python3-dyop.install"
fi
rm "$tree/debian/control.python"

# A package for each library, with the name that its soname asks for: who needs queries gets neither
# OMPL nor HDF5. Names, then what the library is for.
soname=${version%.*}
libraries=
while read -r stem purpose; do
  package=${stem//_/-}$soname
  echo "usr/lib/*/$stem.so.*" > "$tree/debian/$package.install"
  [ "$stem" = libdyop_ompl ] || libraries+="${libraries:+, }$package (= \${binary:Version})"
  cat >> "$tree/debian/control" <<END

Package: $package
Architecture: any
Multi-Arch: same
Section: libs
Depends: \${misc:Depends}, \${shlibs:Depends}
Description: certified time of impact of moving rigid bodies - $purpose
 dyop says when two moving rigid bodies first come within a chosen distance,
 proves that they stayed apart until then, and steps whole scenes through time
 without ever letting bodies pass through each other.
 .
 This package holds the shared library $stem.
END
done <<'END'
libdyop queries
libdyop_chain robots
libdyop_ompl validator for OMPL
libdyop_contact contact solvers
libdyop_dynamics stepping
libdyop_haptics haptic tools
libdyop_tissue soft tissue
libdyop_io mesh and robot files
libdyop_scene_io scene files
libdyop_recording recordings
libdyop_haptics_io files of haptic tools
libdyop_view player
libdyop_paper published algorithms
libdyop_c C interface
libdyop_c_io C interface to files
END
printf '%s\n' "dyop:Libraries=$libraries" "dyop:Ompl=libdyop-ompl$soname (= \${binary:Version})" \
  > "$tree/debian/libraries.substvars"

(cd "$tree" && DEB_BUILD_OPTIONS="noautodbgsym ${DEB_BUILD_OPTIONS:-}" dpkg-buildpackage -us -uc -b)
lintian --fail-on error,warning --info "$out"/dyop_"${version}"_*.changes
rm -rf "$tree"
ls -l "$out"/*.deb
