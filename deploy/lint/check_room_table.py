#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that the table of rooms in ARCHITECTURE.md is the one that rooms.toml describes.

Repair: check_room_table.py --write, which prints the table between its two marker comments.
"""

import fnmatch
import sys
import tomllib

import project
from check_includes import Rules

PAGE = "ARCHITECTURE.md"
BEGIN = "<!-- The table of rooms: deploy/lint/check_room_table.py --write prints it from rooms.toml. -->"
END = "<!-- The end of the table of rooms. -->"
HEAD = ["| room | holds | may include | third-party library |", "| --- | --- | --- | --- |"]


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


def table(root, rules, holds):
    libraries = libraries_of(root, rules)
    return HEAD + [f"| {room} | {held} | {cell(rules.rooms.get(room, []))} | {cell(sorted(libraries.get(room, [])))} |"
                   for room, held in holds.items()]


def between_markers(lines):
    """The range of lines between the two markers; None where they are not there, in order."""
    if BEGIN not in lines or END not in lines:
        return None
    begin, end = lines.index(BEGIN) + 1, lines.index(END)
    return slice(begin, end) if begin <= end else None


def check_descriptions(root, rules, holds):
    for room in rules.rooms:
        if room not in holds:
            yield f"deploy/lint/rooms.toml: [holds] has no line for {room}"
    for room in holds:
        if room not in rules.rooms and not (root / room).is_dir():
            yield f"deploy/lint/rooms.toml: [holds] names {room}, which is no folder"


def check(root, write=False):
    described = tomllib.loads((root / "deploy/lint/rooms.toml").read_text())
    rules, holds = Rules(described), described["holds"]
    yield from check_descriptions(root, rules, holds)
    lines = (root / PAGE).read_text().splitlines()
    place = between_markers(lines)
    if place is None:
        yield f"{PAGE}:1: lacks the lines \"{BEGIN}\" and \"{END}\", in this order"
        return
    wanted = table(root, rules, holds)
    if lines[place] == wanted:
        return
    if write:
        lines[place] = wanted
        (root / PAGE).write_text("\n".join(lines) + "\n")
        return
    yield (f"{PAGE}:{place.start + 1}: the table of rooms differs from rooms.toml; "
           "deploy/lint/check_room_table.py --write prints it anew")


if __name__ == "__main__":
    arguments = sys.argv[1:]
    sys.argv[1:] = [argument for argument in arguments if argument != "--write"]
    project.run(lambda root: check(root, "--write" in arguments))
