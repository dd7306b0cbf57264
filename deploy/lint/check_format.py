#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that clang-format would change nothing. Repair: clang-format -i FILE."""

import subprocess

import project


def check(root):
    files = [str(path.relative_to(root)) for path in project.cxx_files(root)]
    if not files:
        return []
    result = subprocess.run(["clang-format", "--dry-run", *files], cwd=root, capture_output=True,
                            text=True, check=True)
    return [line for line in result.stderr.splitlines() if "-Wclang-format-violations" in line]


if __name__ == "__main__":
    project.run(check)
