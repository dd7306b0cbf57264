# SPDX-License-Identifier: Apache-2.0
"""What the checkers share: the project's own files, and how a checker reports."""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOP_FOLDERS = ("proto", "server", "precompute", "client_sdk", "docs", "tests", "deploy", ".ci")
CXX_SUFFIXES = (".cc", ".h")
NOT_OURS = {"__pycache__", "node_modules"}


def own_files(root):
    """Every file under the project's folders, sorted; builds and caches are elsewhere."""
    for folder in TOP_FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.is_file() and not NOT_OURS & set(path.relative_to(root).parts):
                yield path


def cxx_files(root):
    return [path for path in own_files(root) if path.suffix in CXX_SUFFIXES]


def is_script(path, interpreter):
    """Whether a file's first line names `interpreter` ("bash", "python3") or its suffix does."""
    if path.suffix:
        return path.suffix == {"bash": ".sh", "python3": ".py"}[interpreter]
    with path.open("rb") as file:
        first = file.readline()
    return first.startswith(b"#!") and interpreter.encode() in first


def run(check):
    """Calls check(root) for the root given on the command line, and exits 1 if it finds anything."""
    root = pathlib.Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT
    count = 0
    for count, problem in enumerate(check(root), start=1):
        print(problem, flush=True)
    print(f"{count} problems")
    sys.exit(1 if count else 0)
