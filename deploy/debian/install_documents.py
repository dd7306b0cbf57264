#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Installs the documents and examples that CMake does not install, and mends the links of all installed pages.

Usage: install_documents.py SOURCE PACKAGES

A package NAME is assembled in the folder PACKAGES/NAME. A page links to files by their places in the source. A link to
a file of a package leads to its installed place afterwards. A link to a file that is in the source alone becomes its
text.
"""

import os
import pathlib
import re
import shutil
import sys

# The installed place, by the place in the source; of a folder, with everything in it. The package is the first word.
INSTALLED = {
    "README.md": "carillon /usr/share/doc/carillon/README.md",
    "ARCHITECTURE.md": "carillon /usr/share/doc/carillon/ARCHITECTURE.md",
    "CHANGELOG.md": "carillon /usr/share/doc/carillon/CHANGELOG.md",
    "LICENSE": "carillon /usr/share/doc/carillon/copyright",
    "docs": "carillon /usr/share/doc/carillon/docs",
    "proto/README.md": "carillon /usr/share/doc/carillon/CONTRACT.md",
    "proto/errors.md": "carillon /usr/share/doc/carillon/ERRORS.md",
    "proto/materials.textproto": "carillon /usr/share/doc/carillon/materials.textproto",
    "client_sdk/interchange/README.md": "carillon /usr/share/doc/carillon/INTERCHANGE.md",
    "deploy/demo/spectrogram.png": "carillon /usr/share/doc/carillon/spectrogram.png",
    "precompute/LICENSE": "carillon-precompute /usr/share/doc/carillon-precompute/copyright",
    "deploy/prometheus": "carillond /usr/share/carillon/prometheus",
    "deploy/slurm": "carillond /usr/share/doc/carillond/examples/slurm",
    "proto/carillon": "libcarillon-dev /usr/share/carillon/proto/carillon",
    "client_sdk/c/carillon.h": "libcarillon-dev /usr/include/carillon.h",
    "client_sdk/cpp/include/carillon": "libcarillon-dev /usr/include/carillon",
    # The adapters include each other by their places in the source.
    "client_sdk/adapters": "libcarillon-dev /usr/share/doc/libcarillon-dev/examples/client_sdk/adapters",
    "client_sdk/examples/strike/main.cc": "libcarillon-dev /usr/share/doc/libcarillon-dev/examples/strike.cc",
    "client_sdk/console/ui/web/README.md": "carillon-console /usr/share/doc/carillon-console/WEB.md",
    "client_sdk/examples/browser": "carillon-console /usr/share/doc/carillon-console/examples/browser",
    "client_sdk/node/README.md": "node-carillon /usr/share/doc/node-carillon/README.md",
    "client_sdk/python/README.md": "python3-carillon /usr/share/doc/python3-carillon/README.md",
    "client_sdk/python/strike.py": "python3-carillon /usr/share/doc/python3-carillon/examples/strike.py",
}
LINK = re.compile(r"\[([^\[\]]*)\]\(([^)\s:#]+)(#[^)\s]*)?\)")
FENCED = re.compile(r"(?ms)(^```.*?^```$)")


def installed_place(source):
    """The place below the root of a system of a file of the source; None if no package contains it."""
    for place in (source, *source.parents):
        if str(place) in INSTALLED:
            return pathlib.PurePath(INSTALLED[str(place)].split()[1]) / source.relative_to(place)
    return None


def mended(text, source):
    """The text of the page `source` as it is installed."""
    here = installed_place(source).parent

    def link(match):
        name, target, anchor = match.groups()
        place = installed_place(pathlib.PurePath(os.path.normpath(source.parent / target)))
        return name if place is None else f"[{name}]({os.path.relpath(place, here)}{anchor or ''})"

    # Every second part is a block of code.
    parts = FENCED.split(text)
    parts[::2] = [LINK.sub(link, part) for part in parts[::2]]
    return "".join(parts)


def install(root, packages):
    for source, where in INSTALLED.items():
        package, place = where.split()
        copy = pathlib.Path(f"{packages}/{package}{place}")
        # CMake has installed some, and debhelper installs the copyright later.
        if not copy.exists() and copy.name != "copyright":
            copy.parent.mkdir(parents=True, exist_ok=True)
            if (root / source).is_dir():
                shutil.copytree(root / source, copy, ignore=shutil.ignore_patterns("CMakeLists.txt", "node_modules"))
            else:
                shutil.copy(root / source, copy)
        for page in [copy, *copy.rglob("*")]:
            if page.suffix == ".md":
                page.write_text(mended(page.read_text(), source / pathlib.PurePath(page.relative_to(copy))))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(f"install_documents.py: {__doc__[__doc__.index('Usage'):].strip()}")
    install(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
