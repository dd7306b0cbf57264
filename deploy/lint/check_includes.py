#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks every #include, and every DEPENDS in CMake, against the table in rooms.toml."""

import fnmatch
import re
import tomllib

import project

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
ROOM_CALL = re.compile(r"carillon_(room|program)\(\s*([\w-]+)([^)]*)\)")


class Rules:
    def __init__(self, table):
        self.rooms = table["rooms"]
        self.libraries = table["libraries"]
        self.system_headers = set(table["system_headers"])
        self.targets = table["targets"]
        self.include_roots = table.get("include_roots", [])

    def file_of(self, root, header):
        """The path from `root` of an included file of the project; other headers as they are."""
        inside = (f"{folder}/{header}" for folder in self.include_roots)
        return next((path for path in inside if (root / path).is_file()), header)

    def room_of(self, name):
        """The room with the longest name that `name`, a path from the root, lies in."""
        inside = [room for room in self.rooms if name == room or name.startswith(room + "/")]
        return max(inside, key=len, default=None)

    def may_include(self, room, included):
        at = self.room_of(included)
        return any(
            at == one or fnmatch.fnmatch(included, one) or (at is None and included.startswith(one + "/"))
            for one in (room, *self.rooms[room]))

    def library_of(self, header):
        for name, library in self.libraries.items():
            if any(fnmatch.fnmatch(header, pattern) for pattern in library["headers"]):
                return name
        return None

    def is_system(self, header):
        return re.fullmatch(r"[a-z_]+", header) is not None or header in self.system_headers

    def problem(self, name, room, header):
        """What is wrong with `name`, of `room`, including `header`; None where nothing is."""
        library = self.library_of(header)
        if library is not None:
            files = self.libraries[library]["files"]
            if not any(fnmatch.fnmatch(name, pattern) for pattern in files):
                return f"{library} ({header}) may appear in {', '.join(files)} only"
        if header.split("/")[0] in (*project.TOP_FOLDERS, "carillon"):
            return None if self.may_include(room, header) else f"{room} may not include {header}"
        if library is None and not self.is_system(header):
            return f"{header} belongs to no library of rooms.toml"
        return None


def check_sources(root, rules):
    for path in project.cxx_files(root):
        name = str(path.relative_to(root))
        room = rules.room_of(name)
        if room is None:
            yield f"{name}:1: lies in no room of rooms.toml"
            continue
        for number, line in enumerate(path.read_text().splitlines(), start=1):
            if found := INCLUDE.match(line):
                if problem := rules.problem(name, room, rules.file_of(root, found[2])):
                    yield f"{name}:{number}: {problem}"


def depends_of(arguments):
    found = re.search(r"\bDEPENDS\b(.*?)(?:\b(?:SOURCES|LIBRARIES|LABELS|ONCE_A_CALL)\b|$)", arguments, re.S)
    return found[1].split() if found else []


def cmake_targets(root):
    """(file, kind, target, arguments) of each room and program."""
    for path in project.own_files(root):
        if path.name == "CMakeLists.txt":
            text = re.sub(r"#.*", "", path.read_text())
            for found in ROOM_CALL.findall(text):
                yield (str(path.relative_to(root)), *found)


def check_targets(root, rules):
    targets = list(cmake_targets(root))
    folders = {target: name.rpartition("/")[0] for name, kind, target, _ in targets
               if kind == "room"} | rules.targets
    for name, _, target, arguments in targets:
        room = rules.room_of(name)
        for depended in depends_of(arguments):
            if room is None or depended not in folders:
                yield f"{name}:1: {target} depends on {depended}, of which rooms.toml knows nothing"
            elif not rules.may_include(room, folders[depended]):
                yield f"{name}:1: {target} ({room}) may not depend on {depended}"


def check(root):
    rules = Rules(tomllib.loads((root / "deploy/lint/rooms.toml").read_text()))
    yield from check_sources(root, rules)
    yield from check_targets(root, rules)


if __name__ == "__main__":
    project.run(check)
