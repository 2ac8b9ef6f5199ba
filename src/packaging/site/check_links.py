#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that every link and picture of a folder of HTML pages leads somewhere within it.

Links to other sites are not followed. Anchors are checked in the pages of the prose; the reference
(api/) is only checked for files, as its anchors are made by doxygen itself.
Usage: check_links.py FOLDER
"""
import html.parser
import pathlib
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    """The links of a page, and the anchors it has."""

    def __init__(self, path):
        super().__init__()
        self.links = []
        self.anchors = set()
        self.feed(path.read_text(encoding="utf-8", errors="replace"))

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if value is None:
                continue
            if name in ("href", "src"):
                self.links.append(value)
            elif name == "id" or (name == "name" and tag == "a"):
                self.anchors.add(value)


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    pages = {path: Page(path) for path in sorted(root.rglob("*.html"))}
    checked = 0
    wrong = []
    for path, page in pages.items():
        is_prose = (root / "api") not in path.parents
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc or (not parts.path and not parts.fragment):
                continue
            target = path
            if parts.path:
                target = (path.parent / urllib.parse.unquote(parts.path)).resolve()
            if target.is_dir():
                target = target / "index.html"
            checked += 1
            if not target.is_file():
                wrong.append(f"{path.relative_to(root)}: {link} leads nowhere")
            elif is_prose and parts.fragment and target in pages:
                if urllib.parse.unquote(parts.fragment) not in pages[target].anchors:
                    wrong.append(f"{path.relative_to(root)}: {link} has no such place")
    print("\n".join(wrong) if wrong else f"site: {len(pages)} pages, {checked} links, all lead somewhere")
    if not pages or not checked:
        wrong.append("no pages")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
