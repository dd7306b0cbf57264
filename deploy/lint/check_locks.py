#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Finds locks that clang's thread-safety analysis or ThreadSanitizer does not see. The server takes those of
server/base/mutex.h, precompute/, which shares only proto/ with it, those of precompute/sparse/mutex.h, and the client
absl::Mutex; tests may take any."""

import re

import project

THE_WRAPPERS = ("server/base/mutex.h", "server/base/recursive_mutex.h", "precompute/sparse/mutex.h")
STANDARD = (r"\bstd::(?:\w*mutex|lock_guard|unique_lock|scoped_lock|shared_lock|condition_variable\w*)\b"
            r"|\bpthread_mutex_\w+")
ABSEIL = r"\babsl::\w*Mutex\w*\b"
# What each folder does not take, and what it takes instead.
RULES = (("server/", re.compile(f"{STANDARD}|{ABSEIL}"), f"Mutex of {THE_WRAPPERS[0]}"),
         ("precompute/", re.compile(f"{STANDARD}|{ABSEIL}"), f"Mutex of {THE_WRAPPERS[2]}"),
         ("client_sdk/", re.compile(STANDARD), "absl::Mutex"))


def without_comment(line):
    return line.split("//", 1)[0]


def check(root):
    for path in project.cxx_files(root):
        name = str(path.relative_to(root))
        for folder, raw_lock, better in RULES:
            if not name.startswith(folder) or name in THE_WRAPPERS:
                continue
            for number, line in enumerate(path.read_text().splitlines(), start=1):
                for lock in raw_lock.findall(without_comment(line)):
                    yield f"{name}:{number}: {lock} cannot be checked: take {better}"


if __name__ == "__main__":
    project.run(check)
