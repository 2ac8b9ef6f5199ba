#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Compiles the wide kernels for aarch64 with Debian's cross compiler, runs them under qemu, and
# compares the bits of their results with those of this processor, for every backend of core/simd.h.
# Needs the packages of `.ci/install.sh build aarch64`; says what is missing and exits with code 77.
set -euo pipefail
cd "$(dirname "$0")/.."

missing=()
command -v aarch64-linux-gnu-g++ >/dev/null || missing+=(g++-aarch64-linux-gnu libc6-dev-arm64-cross)
command -v qemu-aarch64 >/dev/null || missing+=(qemu-user)
if [ ${#missing[@]} -gt 0 ]; then
  echo "aarch64.sh: missing ${missing[*]}: bash .ci/install.sh aarch64" >&2
  exit 77
fi

build=build/aarch64
mkdir -p $build
sources=(tests/core/simd_hash.cpp)
for kernel in hierarchy/box_gaps toi/rigid/box_steps distance/triangle_wide/triangle_wide; do
  simd=$build/$(basename "$kernel")_simd.cpp
  # Under one name, whatever it is compiled for.
  printf '#include "core/simd.h"\n#undef DYOP_KERNEL\n#define DYOP_KERNEL(name) name##_baseline\n#include "%s_simd.h"\n' \
    "$kernel" >"$simd"
  sources+=("$simd" "src/$kernel.cpp")
done

# hash NAME RUNNER COMPILER OPTION...
hash() {
  local name=$1 runner=$2 compiler=$3
  shift 3
  "$compiler" -std=c++20 -O2 -ffp-contract=off -Wall -Wextra -Isrc -Iinclude \
    -isystem /usr/include/eigen3 -DEIGEN_DONT_VECTORIZE -ffunction-sections -Wl,--gc-sections \
    "$@" "${sources[@]}" -static -o "$build/$name"
  $runner "$build/$name" >"$build/$name.txt"
}

hash aarch64 qemu-aarch64 aarch64-linux-gnu-g++
cat $build/aarch64.txt

others=()
if [ "$(uname -m)" = x86_64 ]; then
  hash sse2 "" g++
  hash portable "" g++ -U__SSE2__  # the backend of aarch64, on this processor
  others+=(sse2 portable)
  if grep -qw avx2 /proc/cpuinfo; then
    hash avx2 "" g++ -mavx2
    others+=(avx2)
  fi
  if grep -qw avx512vl /proc/cpuinfo; then
    hash avx512 "" g++ -mavx512f -mavx512vl -Wno-uninitialized -Wno-maybe-uninitialized
    others+=(avx512)
  fi
else
  hash native "" g++
  others+=(native)
fi

failures=0
for other in "${others[@]}"; do
  if diff "$build/aarch64.txt" "$build/$other.txt"; then
    echo "same bits: aarch64, $other"
  else
    echo "DIFFERENT BITS: aarch64 (<), $other (>)"
    failures=$((failures + 1))
  fi
done
exit $((failures > 0))
