#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs codespell over the project's pages, sources and scripts."""

import subprocess

import project

SUFFIXES = project.CXX_SUFFIXES + (".md", ".proto", ".py", ".sh", ".toml", ".txt", ".cmake")
# Right although codespell has them in its list: "to and fro", and the journal Numer. Math.
RIGHT = "fro,numer,te"


def check(root):
    files = [*sorted(root.glob("*.md")),
             *(path for path in project.own_files(root) if path.suffix in SUFFIXES)]
    if not files:
        return []
    result = subprocess.run(
        ["codespell", "--ignore-words-list", RIGHT, *(str(path.relative_to(root)) for path in files)],
        cwd=root, stdout=subprocess.PIPE, text=True, check=False)
    return result.stdout.splitlines()


if __name__ == "__main__":
    project.run(check)
