#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs the example in Rust against a shared library of the C interface.
# Usage: run_rust.sh RUSTC LIBRARY EXAMPLES CMAKE FOLDER
set -euo pipefail
rustc=$1 library=$2 examples=$3 cmake=$4 folder=$5

if ! "$rustc" --version; then  # rustup's stand-in, without a compiler behind it
  exit 77
fi
mkdir -p "$folder"
ln -sf "$library" "$folder/libdyop_c.so"
"$rustc" -O "$examples/rust/first_impact.rs" -L "$folder" -o "$folder/first_impact"
LD_LIBRARY_PATH="$(dirname "$library")" "$cmake" -DEXAMPLE="$folder/first_impact" \
  -DSOURCE="$examples/rust/first_impact.rs" -P "$examples/run_example.cmake"
