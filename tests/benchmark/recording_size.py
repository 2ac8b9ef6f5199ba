#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What recordings cost: bytes of a motion segment, and the share of a run that is not stepping.

Usage: /usr/bin/python3 recording_size.py GALLERY     (the folder that examples/gallery.sh has made)

The share is that of everything outside World::advance: reading the scene and its meshes, building the
bodies, recording, the summary. It bounds what recording costs from above.
"""
import gzip
import json
import pathlib
import sys

import h5py

print("| run | segments | bytes each | compressed recording | page | outside the steps |")
print("|---|---|---|---|---|---|")
for file in sorted(pathlib.Path(sys.argv[1]).glob("*.h5")):
    run = json.loads(file.with_suffix(".result.json").read_text())
    with h5py.File(file, "r") as recording:
        segments = len(recording["segments"])
        size = recording["segments"].nbytes + recording["numbers"].nbytes
    compressed = len(gzip.compress(file.read_bytes())) / 1e6
    page = file.with_suffix(".html").stat().st_size / 1e6
    outside = 100 * (1 - run["step_seconds"]["total"] / run["seconds"])
    print(f"| {file.stem} | {segments} | {size / segments:.0f} | {compressed:.1f} MB | {page:.1f} MB | "
          f"{run['seconds'] * outside / 100:.2f} s, {outside:.0f} % |")
