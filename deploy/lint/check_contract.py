#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Lints proto/ with buf, and checks it for changes that would break clients in the field.

It is compared with how it was at the newest release (a tag v*). Before the first release no client depends on it,
and only the lint is done.
"""

import io
import os
import pathlib
import subprocess
import tarfile
import tempfile

import project


def buf(root, *arguments):
    if "CARILLON_BUF" not in os.environ:
        return ["CARILLON_BUF is not set: start this through deploy/test.sh, which installs buf"]
    with tempfile.TemporaryDirectory() as cache:
        result = subprocess.run([os.environ["CARILLON_BUF"], *arguments], cwd=root,
                                env=os.environ | {"BUF_CACHE_DIR": cache},
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                check=False)
    lines = result.stdout.splitlines()
    return lines or ["buf failed without a word"] if result.returncode else []


def git(root, *arguments):
    """What git prints, as bytes; None where it fails. The checkout may belong to somebody else."""
    command = ["git", "-c", f"safe.directory={root}", "-C", str(root), *arguments]
    result = subprocess.run(command, capture_output=True, check=False)
    return result.stdout if result.returncode == 0 else None


def newest_release(root):
    """The tag of the newest release; None where there is none."""
    if not (root / ".git").exists():
        return None
    tag = git(root, "describe", "--tags", "--abbrev=0", "--match", "v*")
    return tag.decode().strip() if tag else None


def breaking(root):
    release = newest_release(root)
    archive = git(root, "archive", release, "proto") if release else None
    if not archive:
        print("no release of the contract to compare with: only linted")
        return []
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
            tar.extractall(folder)
        return buf(root, "breaking", "proto", "--against", str(pathlib.Path(folder) / "proto"))


def check(root):
    return buf(root, "lint", "proto") + breaking(root)


if __name__ == "__main__":
    project.run(check)
