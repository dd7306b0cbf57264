#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Finds the links of installed pages that lead to no installed file.

Usage: installed_links.py ROOT

All packages are unpacked in the folder ROOT. Links to the web and within a page are not followed.
"""

import os
import pathlib
import re
import sys

CODE = re.compile(r"(?ms)^```.*?^```$|^    .*?$")
TARGET = re.compile(r"\]\(([^)\s]+)\)|^\[[^\]]+\]:\s*(\S+)|\b(?:src|href)=\"([^\"]+)\"", re.MULTILINE)


def dead_links(root):
    for page in sorted((root / "usr/share/doc").rglob("*.md")):
        for match in TARGET.finditer(CODE.sub("", page.read_text())):
            target = next(filter(None, match.groups())).split("#")[0]
            # Outside of the root is what the machine of the test has.
            place = pathlib.Path(os.path.normpath(page.parent / target))
            if "://" not in target and not (place.is_relative_to(root) and place.exists()):
                yield f"{page.relative_to(root)}: {target}"


if __name__ == "__main__":
    found = list(dead_links(pathlib.Path(sys.argv[1]).resolve()))
    print(*found, f"{len(found)} dead links", sep="\n")
    sys.exit(1 if found else 0)
