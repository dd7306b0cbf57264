#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that every source file says its licence in its first lines, and the right one for its folder."""

import project

COPYLEFT_FOLDERS = ("precompute/", "tests/precompute/")
SUFFIXES = (".cc", ".h", ".py", ".sh", ".proto", ".js", ".ts")


def licence_of(name):
    return "AGPL-3.0-or-later" if name.startswith(COPYLEFT_FOLDERS) else "Apache-2.0"


def check(root):
    for path in project.own_files(root):
        name = str(path.relative_to(root))
        if path.suffix not in SUFFIXES and not project.is_script(path, "bash"):
            continue
        head = path.read_text().splitlines()[:3]
        expected = f"SPDX-License-Identifier: {licence_of(name)}"
        if not any(line.endswith(" " + expected) for line in head):
            yield f"{name}:1: its first lines must hold \"{expected}\""


if __name__ == "__main__":
    project.run(check)
