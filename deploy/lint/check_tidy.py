#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy on every source file that has changed since it last passed.

A file has changed if its text, that of a header of ours that it includes, directly or not, its compile
command or .clang-tidy has. What passed is remembered in $CARILLON_CACHE, for all checkouts alike. Changed files are
checked many at a time, so that the headers of libraries are read once for all of them.

Usage: check_tidy.py BUILD_FOLDER [ROOT]
"""

import concurrent.futures
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import compilation
import project

INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.M)
DEFAULT_CACHE = pathlib.Path.home() / ".cache/carillon"


class Reader:
    """Texts of files, each read once."""

    def __init__(self, root):
        self.root = root
        self.texts = {}

    def text(self, name):
        if name not in self.texts:
            path = self.root / name
            self.texts[name] = path.read_text() if path.is_file() else None
        return self.texts[name]

    def with_headers(self, name):
        """`name` and the headers of ours that it includes, sorted; the contract stands for the code
        generated from it."""
        seen, queue = set(), [name]
        while queue:
            one = queue.pop()
            if one.startswith("carillon/v1/"):
                one = "proto/" + re.sub(r"(\.grpc)?\.pb\.h$", ".proto", one)
            elif one.startswith("carillon/"):
                one = "client_sdk/cpp/include/" + one
            if one not in seen and (text := self.text(one)) is not None:
                seen.add(one)
                queue += INCLUDE.findall(text)
        return sorted(seen)


def digest_of(reader, source, version):
    digest = hashlib.sha256((version + reader.text(".clang-tidy")).encode())
    digest.update(" ".join(source.arguments).replace(str(reader.root), "").encode())
    for one in reader.with_headers(source.name):
        digest.update(f"\0{one}\0{reader.text(one)}".encode())
    return digest.hexdigest()


def tidy(root, batch):
    """What clang-tidy finds in a batch and in the headers of ours that it includes; None if nothing."""
    with tempfile.TemporaryDirectory(prefix="carillon-tidy-") as folder:
        file = root / batch[0].name
        if len(batch) > 1:
            file = pathlib.Path(folder, "batch.cc")
            file.write_text(compilation.text_of(root, batch))
        result = subprocess.run(
            ["clang-tidy", "--quiet", f"--config-file={root}/.clang-tidy", f"--header-filter=^{re.escape(str(root))}/"
             f"({'|'.join(project.TOP_FOLDERS)})/", file, "--", *compilation.arguments(batch),
             # The build compiles with g++, some of whose warnings clang does not know. A name of one file may shadow
             # one of another file. Of Highway's instruction sets, one shows what all do.
             "-Wno-unknown-warning-option", "-Wno-shadow", "-DHWY_COMPILE_ONLY_STATIC"],
            cwd=root, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False)
    if result.returncode == 0:
        return None
    return result.stdout.replace(f"{root}/", "") or f"{batch[0].name}: clang-tidy failed without a word"


def check(root, build):
    reader = Reader(root)
    cache = pathlib.Path(os.environ.get("CARILLON_CACHE", DEFAULT_CACHE)) / "clang-tidy"
    cache.mkdir(parents=True, exist_ok=True)
    version = subprocess.run(["clang-tidy", "--version"], capture_output=True, text=True, check=True)
    sources = compilation.sources(root, build)
    passed = {source: cache / digest_of(reader, source, version.stdout) for source in sources}
    changed = [source for source, mark in passed.items() if not mark.exists()]
    print(f"{len(changed)} of {len(passed)} files to check")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        running = {pool.submit(compilation.findings, batch, lambda part: tidy(root, part)): batch
                   for batch in compilation.batches(root, changed)}
        for done in concurrent.futures.as_completed(running):
            failed = dict(done.result())
            for source in running[done]:
                if source not in failed:
                    passed[source].touch()
            yield from failed.values()


if __name__ == "__main__":
    build_folder = pathlib.Path(sys.argv.pop(1)).resolve()
    project.run(lambda root: check(root, build_folder))
