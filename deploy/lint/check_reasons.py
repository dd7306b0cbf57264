#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that the tables of proto/errors.md and the code, that of the clients for Python and Node included, name the
same error reasons and the same warnings, and that `carillon doctor` has each finding of docs/troubleshoot.md."""

import re

import project

TABLES, FINDINGS = "proto/errors.md", "docs/troubleshoot.md"
ROW = re.compile(r"^\| *`?([A-Z][A-Z0-9_]+)`? *\| *([A-Z_]*)")
NAME = r"([A-Z][A-Z0-9]*(?:_[A-Z0-9]+)*)"
QUOTED = rf"['\"]{NAME}['\"]"
# Of C++, a literal "REASON: ..." or "REASON" as the second argument of a Refusal; of a client, the first argument of an
# error, or what a reason is compared with.
REASONS = {
    "cxx": (re.compile(rf'"{NAME}: '), re.compile(rf'Refusal\(\s*[^,;"]+,\s*"{NAME}"')),
    "client": (re.compile(rf"(?:CarillonError|ServerUnavailable)\(\s*{QUOTED}"),
               re.compile(rf"\breason\s*[!=]==?\s*{QUOTED}")),
}
WARNINGS = {
    "cxx": (re.compile(rf'\bAdd\(\s*warnings,\s*"{NAME}"'), re.compile(rf'set_id\("{NAME}"\)'),
            re.compile(rf'^    {{"{NAME}", "', re.MULTILINE)),  # the rows of kMistakes
    "client": (re.compile(rf"\bid(?:=|: ){QUOTED}"),),
}
MENTION = re.compile(rf'"{NAME}(?:: |")')


def listed(root):
    """The rows (group, name, gRPC code, line number) of the tables of reasons, and those of the table of warnings."""
    reasons, warnings, heading = [], [], ""
    for number, line in enumerate((root / TABLES).read_text().splitlines(), start=1):
        if line.startswith("## "):
            heading = line[3:]
        if row := ROW.match(line):
            (warnings if heading == "Warnings" else reasons).append((heading, row[1], row[2], number))
    return reasons, warnings


def unused_findings(root, mentioned):
    """Each row of the page of findings that no code mentions."""
    page = root / FINDINGS
    for number, line in enumerate(page.read_text().splitlines() if page.exists() else (), start=1):
        if (row := ROW.match(line)) and line.count(" | ") == 2 and row[1] not in mentioned:
            yield f"{FINDINGS}:{number}: carillon doctor has no finding {row[1]}"


def sources(root):
    """(kind, name, text without comments) of each file of the product's C++ and of the clients."""
    for path in project.cxx_files(root):
        if not path.is_relative_to(root / "tests"):
            yield "cxx", path.relative_to(root), re.sub(r"^\s*//.*$", "", path.read_text(), flags=re.M)
    for folder, suffix in (("client_sdk/python/src/carillon", "*.py"), ("client_sdk/node/lib", "*.js")):
        for path in sorted((root / folder).glob(suffix)):
            yield "client", path.relative_to(root), path.read_text()


def uses(files, patterns):
    """(name, file, line number) of each use."""
    for kind, path, text in files:
        for pattern in patterns[kind]:
            for use in pattern.finditer(text):
                yield use[1], path, text.count("\n", 0, use.start(1)) + 1


def check(root):
    files = list(sources(root))
    reasons, warnings = listed(root)
    codes = {code for _, _, code, _ in reasons}  # the reasons of errors without one
    mentioned = {name for kind, _, text in files if kind == "cxx" for name in MENTION.findall(text)}
    yield from unused_findings(root, mentioned)
    for rows, patterns, more_known, more_used in ((reasons, REASONS, codes, mentioned),
                                                  (warnings, WARNINGS, set(), set())):
        names = [name for _, name, _, _ in rows]
        found = list(uses(files, patterns))
        used = more_used | {name for name, _, _ in found}
        for name, path, number in found:
            if name not in more_known.union(names):
                yield f"{path}:{number}: {name} is not in the table of {TABLES}"
        for _, name, _, number in rows:
            if name not in used:
                yield f"{TABLES}:{number}: no code gives {name}"
        places = [(group, name) for group, name, _, _ in rows]
        groups = list(dict.fromkeys(group for group, _ in places))
        if places != sorted(places, key=lambda place: (groups.index(place[0]), place[1])):
            yield f"{TABLES}: the names of a group are not in alphabetical order"
        if len(names) != len(set(names)):
            yield f"{TABLES}: a name has two rows"


if __name__ == "__main__":
    project.run(check)
