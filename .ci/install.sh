#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the Debian packages that a job needs and that are missing. The only list of packages:
# tests/architecture checks that the build asks for nothing else.
# Usage: bash .ci/install.sh GROUP...     groups: build python run test page firefox package bench coverage aarch64
set -euo pipefail

packages() {
  case "$1" in
    build) echo g++ cmake ninja-build pkg-config libeigen3-dev libccd-dev libsundials-dev libtbb-dev \
                libassimp-dev nlohmann-json3-dev libcli11-dev zlib1g-dev libtinyxml2-dev libyaml-cpp-dev \
                libompl-dev libhdf5-dev libtinygltf-dev librsvg2-dev libcpp-httplib-dev libssl-dev ;;
    python) echo pybind11-dev python3-dev python3-numpy ;;
    run)   echo glmark2-data ;;
    test)  echo libgtest-dev libcgal-dev libgmp-dev libsiconos-numerics-dev libopenigtlink-dev liboctomap-dev libmujoco-dev clang libclang-rt-dev clang-format-14 \
                abigail-tools luajit \
                python3-pytest python3-h5py python3-matplotlib python3-distributed python3-nbconvert python3-ipykernel python3-torch \
                mypy python3-mypy python3-build python3-pip python3-venv patchelf ;;
    page)  echo chromium ffmpeg $(command -v npm >/dev/null || echo nodejs npm) ;;
    firefox) echo firefox-esr xvfb xauth libgl1-mesa-dri libegl1 ;;
    package) echo debhelper dpkg-dev dh-python fakeroot help2man lintian bash-completion \
                  mkdocs mkdocs-material doxygen ;;
    coverage) echo gcovr ;;
    aarch64) echo g++-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user ;;
    bench) echo libbenchmark-dev libfcl-dev libbullet-dev libode-dev libmujoco-dev ;;
    *)     echo "install.sh: unknown group '$1' (build, python, run, test, page, firefox, package, bench, coverage, aarch64)" >&2; exit 2 ;;
  esac
}

# The npm packages of the page, below the build folder. Without them everything else builds.
install_page_modules() {
  local here target
  here=$(cd "$(dirname "$0")/.." && pwd)
  target="$here/build/npm"
  if cmp -s "$here/src/view/page/package-lock.json" "$target/installed-lock.json"; then
    echo "packages: the page's npm packages are installed"
    return
  fi
  mkdir -p "$target"
  cp "$here/src/view/page/package.json" "$here/src/view/page/package-lock.json" "$target/"
  if (cd "$target" && npm ci --no-audit --no-fund --silent); then
    cp "$target/package-lock.json" "$target/installed-lock.json"
  else
    echo "packages: npm cannot install the page's packages; dyop builds without its page" >&2
  fi
}

wanted=()
for group in "$@"; do
  list=$(packages "$group")
  read -r -a names <<< "$list"
  wanted+=("${names[@]}")
done

missing=()
for package in "${wanted[@]}"; do
  if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then
    missing+=("$package")
  fi
done
if [ ${#missing[@]} -eq 0 ]; then
  echo "packages: all ${#wanted[@]} are installed"
else
  as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "install.sh: needs root or sudo to install: ${missing[*]}" >&2; exit 1; }
    as_root=(sudo)
  fi
  echo "packages: installing ${missing[*]}"
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    "${missing[@]}" >/dev/null
fi

for group in "$@"; do
  if [ "$group" = page ]; then install_page_modules; fi
done
