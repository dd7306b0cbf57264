#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that a class has one pair of files: a.cc defines members of classes that a.h, or a.cc itself, declares.

A class that needs a second file has a second class inside.
"""

import re

import project

CLASS = re.compile(r"^ *(?:template <[^;{]*> *)?(?:class|struct)(?: [A-Z_]+(?:\([^)]*\))?)? (\w+)[^;(]*{", re.M)
MEMBER = re.compile(r"^(?!using|namespace|static|#|//)[\w][^\n;={}]*?\b(\w+)::(?:\w+::)*~?\w+\(", re.M)


def declared(text):
    return set(CLASS.findall(text))


def check(root):
    classes = {}
    for path in project.cxx_files(root):
        if path.suffix == ".h":
            for name in declared(path.read_text()):
                classes.setdefault((path.parent, name), set()).add(path.stem)
    for path in project.cxx_files(root):
        if path.suffix != ".cc":
            continue
        text = path.read_text()
        own = declared(text)
        for found in MEMBER.finditer(text):
            stems = classes.get((path.parent, found[1]), set())
            if stems and path.stem not in stems and found[1] not in own:
                line = text.count("\n", 0, found.start()) + 1
                name = path.relative_to(root)
                yield f"{name}:{line}: defines a member of {found[1]}, which {sorted(stems)[0]}.h declares"
                break


if __name__ == "__main__":
    project.run(check)
