# SPDX-License-Identifier: BSD-3-Clause
"""Checks what can be checked of the recipes without their tools.

They parse, have the version of CMakeLists.txt, and set only options that it has.
"""

import ast
import json
import re
import sys
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[2]


def main():
    cmake = (ROOT / "CMakeLists.txt").read_text()
    version = re.search(r"project\(dyop VERSION ([\d.]+)", cmake)[1]
    options = set(re.findall(r"option\((DYOP_\w+)", cmake))
    json.loads((HERE / "vcpkg" / "vcpkg.json").read_text())
    for file in HERE.glob("*/*.py"):
        ast.parse(file.read_text(), str(file))
    problems = []
    for name in ("vcpkg/vcpkg.json", "conan/conanfile.py", "spack/package.py", "conda-forge/meta.yaml"):
        if version not in (HERE / name).read_text():
            problems.append(f"{name} is not of version {version}")
    for file in [*HERE.glob("*/*.py"), *HERE.glob("*/*.yaml"), *HERE.glob("*/*.cmake")]:
        text = file.read_text()
        used = set(re.findall(r"DYOP_(?:BUILD|WITH)_\w+", text))
        # The lists of what is off, without its prefix.
        if listed := re.search(r'"([A-Z ]+ [A-Z ]+)"\.split\(\)', text):
            used |= {f"DYOP_BUILD_{word}" for word in listed[1].split()}
        if listed := re.search(r"for option in \(([^)]*)\)", text):
            used |= {f"DYOP_BUILD_{word}" for word in re.findall(r'"(\w+)"', listed[1])}
        unknown = {word for word in used if not word.endswith("_")} - options
        problems += [f"{file.relative_to(HERE)} sets {word}, which is no option" for word in sorted(unknown)]
    print("\n".join(problems) or f"recipes: version {version}, options are there")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
