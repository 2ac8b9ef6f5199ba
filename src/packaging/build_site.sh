#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Renders docs/ and the reference of the public headers to a site that needs no network and no server,
# and checks its links.
# Usage: bash src/packaging/build_site.sh OUT_FOLDER
# Needs: mkdocs mkdocs-material doxygen (.ci/install.sh package). With the Python package on PYTHONPATH its
# reference is made, too.
set -euo pipefail
[ $# -eq 1 ] || { sed -n '5s/^# //p' "$0" >&2; exit 2; }
root=$(cd "$(dirname "$0")/../.." && pwd)
here=$root/src/packaging/site
mkdir -p "$1"
out=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

mkdir "$work/docs"
cp -r "$root/docs/." "$work/docs/"
cp "$here/mkdocs.yml" "$work/"
# The reference is beside the prose, and one click away.
printf '\n[Reference of the headers](api/index.html)\n' >> "$work/docs/README.md"
if PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -c 'import dyop' 2> /dev/null; then
  PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 "$here/python_reference.py" "$work/docs/python-reference.md"
  printf '\n[Reference of the Python package](python-reference.md)\n' >> "$work/docs/README.md"
fi
mkdir "$work/docs/api"
echo '<html></html>' > "$work/docs/api/index.html"  # replaced below
# Files of the tree that the prose points to, outside docs/, come along: ../X from a page of docs/,
# ../../X from a page of a folder in it.
sed -i 's/](\.\.\//](tree\//' "$work"/docs/*.md
sed -i 's/](\.\.\/\.\.\//](..\/tree\//' "$work"/docs/*/*.md
{ grep -ohE '\]\((\.\./)?tree/[^)#]+' "$work"/docs/*.md "$work"/docs/*/*.md || true; } |
  sed -E 's/^\]\((\.\.\/)?tree\///' | sort -u |
  while read -r path; do
    mkdir -p "$work/docs/tree/$(dirname "$path")"
    cp "$root/$path" "$work/docs/tree/$path"
  done
# The prose points to the README, which points back and to files that are not here.
if [ -f "$work/docs/tree/README.md" ]; then
  sed -i -e 's/](docs\//](..\//g' -e 's/src="docs\//src="..\//g' \
    -e 's/\[\([^]]*\)\](\(include\|examples\|src\|tests\)[^)]*)/\1/g' "$work/docs/tree/README.md"
fi
# Pictures of the gallery lead to the pages that play them, if `bash examples/gallery.sh` has made them.
for page in "$root"/build/gallery/*.html; do
  [ -f "$page" ] || continue
  name=$(basename "$page" .html)
  mkdir -p "$work/docs/runs"
  cp "$page" "$work/docs/runs/"
  sed -i "s#^!\\[[^]]*\\](figures/gallery/$name\\.png)#[&](runs/$name.html)#" "$work/docs/gallery.md"
done
(cd "$work" && mkdocs build > mkdocs.log 2>&1) || { grep -v "^INFO" "$work/mkdocs.log" >&2; exit 1; }
version=$(sed -n 's/^project(dyop VERSION \([0-9.]*\).*/\1/p' "$root/CMakeLists.txt")
{ cat "$here/Doxyfile"
  echo "PROJECT_NUMBER = $version"
  echo "INPUT = $root/include"
  echo "STRIP_FROM_PATH = $root/include"
  echo "OUTPUT_DIRECTORY = $work/site"
} | doxygen -
rm "$work/site/404.html"  # for servers only
rm -rf "${out:?}"/*
cp -r "$work/site/." "$out/"
python3 "$here/check_links.py" "$out"
