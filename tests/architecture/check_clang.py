# SPDX-License-Identifier: BSD-3-Clause
"""A second compiler reads the library, the fuzz targets and what tests share, without making code of
it. Its warnings are errors, so that tests/sanitize.sh and tests/fuzz.sh, which use it, build.

Usage: check_clang.py BUILD_FOLDER
Takes the commands from BUILD_FOLDER/compile_commands.json. Ends with 77, "skipped", without clang++.
"""
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

# What only g++ or the build knows: precompiled headers, its memory, its own warnings, outputs.
DROPPED = ("-Winvalid-pch", "-fpch-preprocess", "-fprofile-update", "-Wno-maybe-uninitialized",
           "-fno-schedule-insns2")
WITH_VALUE = ("-o", "-MT", "-MF", "-MQ")


def clang_command(command, folder):
    words = shlex.split(command)
    while not words[0].endswith(("++", "cpp", "c++")):
        words.pop(0)  # a compiler launcher
    kept = []
    skip = False
    for i, word in enumerate(words[1:], 1):
        if skip:
            skip = False
        elif word in WITH_VALUE:
            skip = True
        elif word == "-include":  # the header itself: g++'s compiled form lies beside it
            skip = True
            kept += ["-include", str(folder / words[i + 1].replace("/", "_"))]
            shutil.copyfile(words[i + 1], kept[-1])
        elif not word.startswith(("--param", "-MD", "-c") + DROPPED) or word.startswith("-coverage"):
            kept.append(word)
    return ["clang++", "-fsyntax-only", *kept]


def main(build):
    if shutil.which("clang++") is None:
        print("skipped: clang++ is not installed (apt-get install clang)")
        return 77
    entries = json.loads((Path(build) / "compile_commands.json").read_text())
    unwanted = ("cmake_pch.hxx.cxx", ".h.cxx")  # headers: tests/sanitize.sh compiles each alone
    folders = [f"{os.sep}{os.path.join(*parts)}{os.sep}"
               for parts in (["src"], ["tests", "support"], ["tests", "fuzz"])]
    library = [e for e in entries
               if any(f in e["file"] for f in folders) and not e["file"].endswith(unwanted)]
    if len(library) < 10:
        print(f"only {len(library)} sources in {build}/compile_commands.json")
        return 1
    with tempfile.TemporaryDirectory() as folder:
        commands = [clang_command(e["command"], Path(folder)) for e in library]

        def run(i):
            return subprocess.run(commands[i], cwd=library[i]["directory"], stderr=subprocess.PIPE, text=True)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            results = list(pool.map(run, range(len(commands))))
    failed = [r for r in results if r.returncode != 0]
    for result in failed:
        print(result.stderr)
    print(f"{len(library)} sources read by clang++, {len(failed)} refused")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
