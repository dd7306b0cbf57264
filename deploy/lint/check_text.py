#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks text: licences of source files, spelling, lines of at most 120 columns, the links of pages to files and
headings, and ARCHITECTURE's table of rooms.

check_text.py --write prints that table anew from rooms.toml.
"""

import fnmatch
import os
import re
import subprocess
import sys
import tomllib

import project
from check_includes import Rules

COPYLEFT_FOLDERS = ("precompute/", "tests/precompute/")
LICENSED = (".cc", ".h", ".py", ".sh", ".proto", ".js", ".ts")
BROKEN = (".md", ".proto", ".py", ".sh", ".cmake")
COLUMNS = 120
SPELT = (*project.CXX_SUFFIXES, ".md", ".proto", ".py", ".sh", ".toml", ".txt", ".cmake")
# Right although codespell has them in its list: the order ACN, "to and fro", the journal Numer. Math., and statements
# of OBJ files.
RIGHT = "acn,fo,fro,lod,numer,parm,te"
FENCED = re.compile(r"(?ms)^```.*?^```$")
LINK = re.compile(r"\]\(([^)\s:]+)\)")
PAGE = "ARCHITECTURE.md"
BEGIN = "<!-- The table of rooms: deploy/lint/check_text.py --write prints it from rooms.toml. -->"
END = "<!-- The end of the table of rooms. -->"
HEAD = ["| room | holds | may include | third-party library |", "| --- | --- | --- | --- |"]


def files_of(root):
    return [*sorted(root.glob("*.md")), *project.own_files(root)]


def check_lines(root):
    for path in files_of(root):
        name = str(path.relative_to(root))
        lines = path.read_text(errors="replace").splitlines()
        licence = "AGPL-3.0-or-later" if name.startswith(COPYLEFT_FOLDERS) else "Apache-2.0"
        if path.suffix in LICENSED or project.is_script(path, "bash"):
            if not any(line.endswith(" SPDX-License-Identifier: " + licence) for line in lines[:3]):
                yield f'{name}:1: its first lines must hold "SPDX-License-Identifier: {licence}"'
        if path.suffix in BROKEN:
            for number, line in enumerate(lines, start=1):
                # A table's row and an address cannot be broken.
                if len(line) > COLUMNS and not line.startswith("|") and "://" not in line:
                    yield f"{name}:{number}: {len(line)} columns, {COLUMNS} are the limit"


def check_spelling(root):
    files = [str(path.relative_to(root)) for path in files_of(root) if path.suffix in SPELT]
    if files:
        found = subprocess.run(["codespell", "--ignore-words-list", RIGHT, *files], cwd=root, stdout=subprocess.PIPE,
                               text=True, check=False)
        yield from found.stdout.splitlines()


def anchors(text):
    """The anchors of a page's headings, as GitHub makes them."""
    for heading in re.findall(r"(?m)^#+ (.*)$", FENCED.sub("", text)):
        shown = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)
        yield re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")


def check_links(root):
    """Each link of a page to a file or a heading that is not there; pictures and sounds are links, too."""
    pages = {path: path.read_text() for path in files_of(root) if path.suffix == ".md"}
    for path, text in pages.items():
        for link in LINK.finditer(FENCED.sub(lambda code: "\n" * code[0].count("\n"), text)):
            target, _, anchor = link[1].partition("#")
            place = root / os.path.normpath(path.relative_to(root).parent / target) if target else path
            if not place.exists() or (anchor and place in pages and anchor not in anchors(pages[place])):
                number = text.count("\n", 0, link.start()) + 1
                yield f"{path.relative_to(root)}:{number}: the link {link[1]} leads nowhere"


def cell(names):
    return ", ".join(f"`{name}`" if "*" in name else name for name in names) or "-"


def libraries_of(root, rules):
    """For each room the libraries that its own files may include; those that every file may are no news."""
    found = {room: set() for room in rules.rooms}
    for path in project.cxx_files(root):
        name = str(path.relative_to(root))
        for library, entry in rules.libraries.items():
            if "*" not in entry["files"] and any(fnmatch.fnmatch(name, pattern) for pattern in entry["files"]):
                found.get(rules.room_of(name), set()).add(library)
    return found


def check_room_table(root, write=False):
    described = tomllib.loads((root / "deploy/lint/rooms.toml").read_text())
    rules, holds = Rules(described), described["holds"]
    for room in sorted(set(rules.rooms) - set(holds)):
        yield f"deploy/lint/rooms.toml: [holds] has no line for {room}"
    for room in holds:
        if room not in rules.rooms and not (root / room).is_dir():
            yield f"deploy/lint/rooms.toml: [holds] names {room}, which is no folder"
    libraries = libraries_of(root, rules)
    table = HEAD + [f"| {room} | {held} | {cell(rules.rooms.get(room, []))} | {cell(sorted(libraries.get(room, [])))} |"
                    for room, held in holds.items()]
    text = (root / PAGE).read_text()
    before, begin, rest = text.partition(BEGIN + "\n")
    _, end, after = rest.partition(END + "\n")
    wanted = "".join([before, begin, *(line + "\n" for line in table), end, after])
    if write and end:
        (root / PAGE).write_text(wanted)
    elif not end or wanted != text:
        yield (f"{PAGE}:{before.count(chr(10)) + 1}: the table of rooms differs from rooms.toml; "
               "deploy/lint/check_text.py --write prints it anew")


def check(root, write=False):
    yield from check_lines(root)
    yield from check_spelling(root)
    yield from check_links(root)
    yield from check_room_table(root, write)


if __name__ == "__main__":
    WRITE = "--write" in sys.argv
    sys.argv = [argument for argument in sys.argv if argument != "--write"]
    project.run(lambda root: check(root, WRITE))
