#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that the table of error reasons in proto/README.md and the code name the same reasons."""

import re

import project

TABLE = "proto/README.md"
ROW = re.compile(r"^\| *`?([A-Z][A-Z0-9_]+)`? *\|")
NAME = r"([A-Z][A-Z0-9]*(?:_[A-Z0-9]+)*)"
# A literal "REASON: ..." or "REASON" as the second argument of a Refusal.
USES = (
    re.compile(rf'"{NAME}: '),
    re.compile(rf'Refusal\(\s*[^,;"]+,\s*"{NAME}"'),
)
MENTION = re.compile(rf'"{NAME}(?:: |")')


def listed(root):
    """(reason, line number) of each row of the table."""
    lines = (root / TABLE).read_text().splitlines()
    return [(row[1], number) for number, line in enumerate(lines, start=1) if (row := ROW.match(line))]


def uses(root):
    """(reason, file, line number) of each refusal in the code, and every name in quotes."""
    found, mentioned = [], set()
    for path in project.cxx_files(root):
        name = str(path.relative_to(root))
        if name.startswith("tests/"):
            continue
        text = re.sub(r"^\s*//.*$", "", path.read_text(), flags=re.M)
        mentioned.update(MENTION.findall(text))
        for pattern in USES:
            found += [(use[1], name, text.count("\n", 0, use.start(1)) + 1)
                      for use in pattern.finditer(text)]
    return found, mentioned


def check(root):
    rows = listed(root)
    known = {reason for reason, _ in rows}
    found, mentioned = uses(root)
    for reason, name, number in found:
        if reason not in known:
            yield f"{name}:{number}: {reason} is not in the table of {TABLE}"
    for reason, number in rows:
        if reason not in mentioned:
            yield f"{TABLE}:{number}: no code gives {reason}"
    names = [reason for reason, _ in rows]
    if names != sorted(set(names)):
        yield f"{TABLE}: the reasons are not in alphabetical order, each once"


if __name__ == "__main__":
    project.run(check)
