#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs shellcheck over the project's shell scripts."""

import subprocess

import project


def check(root):
    files = [str(path.relative_to(root)) for path in project.own_files(root)
             if project.is_script(path, "bash")]
    if not files:
        return []
    result = subprocess.run(["shellcheck", "--external-sources", "--format=gcc", *files], cwd=root,
                            stdout=subprocess.PIPE, text=True, check=False)
    return result.stdout.splitlines()


if __name__ == "__main__":
    project.run(check)
