# SPDX-License-Identifier: BSD-3-Clause
"""Writes what the page that plays recordings is made of, as CycloneDX 1.5 JSON, from its lock file.

    python3 src/packaging/sbom.py > sbom.json
    python3 src/packaging/sbom.py --check     # do the notices name what pages contain?

Scope "required" is bundled into pages and into dyop::view, "excluded" is used by builds and tests.
"""

import base64
import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def components():
    lock = json.loads((ROOT / "src/view/page/package-lock.json").read_text())
    for path, package in sorted(lock["packages"].items()):
        if not path:
            continue  # the page itself
        name = package.get("name", path.split("node_modules/")[-1])
        version = package["version"]
        component = {
            "type": "library",
            "name": name,
            "version": version,
            "purl": f"pkg:npm/{name.replace('@', '%40', 1)}@{version}",
            "scope": "excluded" if package.get("dev") else "required",
            "licenses": [{"license": {"id": package["license"]}}],
        }
        if package.get("integrity", "").startswith("sha512-"):
            digest = base64.b64decode(package["integrity"].removeprefix("sha512-"))
            component["hashes"] = [{"alg": "SHA-512", "content": digest.hex()}]
        yield component


def missing_notices():
    notices = (ROOT / "docs/third-party-notices.md").read_text().lower()
    names = {"three": "three.js", "uplot": "uplot"}
    for component in components():
        if component["scope"] != "required":
            continue
        name = names.get(component["name"], component["name"])
        if f"## {name} {component['version']}\n".lower() not in notices:
            yield f"{component['name']} {component['version']}"


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        missing = list(missing_notices())
        sys.exit(f"docs/third-party-notices.md lacks: {', '.join(missing)}" if missing else 0)
    json.dump({"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
               "metadata": {"component": {"type": "application", "name": "dyop-page"}},
               "components": list(components())}, sys.stdout, indent=1)
    print()
