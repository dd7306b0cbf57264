#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs clang's thread-safety analysis on the rooms that have locks or thread roles: a function called by a thread of
the wrong role, a lock taken by the rendering thread, a guarded member touched without its lock.

Usage: check_thread_roles.py BUILD_FOLDER [FILE...]
"""

import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys

import project

ROOMS = ("server/base/", "server/mode_database/", "server/decomposition/", "server/synthesis/", "server/audio_device/",
         "server/live_output/", "server/scene/")
# Compiled once for each SIMD target, and without a lock or a role: minutes for nothing.
KERNELS = ("server/synthesis/ringing/force_kernel.cc", "server/synthesis/ringing/ring_kernel.cc",
           "server/synthesis/ringing/strike_kernel.cc", "server/synthesis/spectrum/spectral_kernel.cc")
KEPT = ("-I", "-isystem", "-D", "-std")


def flags_of(command):
    words = shlex.split(command)
    for word, following in zip(words, words[1:] + [""]):
        if word.startswith(KEPT):
            yield word
            if word in ("-I", "-isystem"):
                yield following


def analyse(entry):
    run = subprocess.run(
        ["clang++", "-fsyntax-only", "-Wno-everything", "-Werror=thread-safety", *flags_of(entry["command"]),
         entry["file"]], cwd=entry["directory"], capture_output=True, text=True)
    return run.stderr if run.returncode else ""


def main():
    entries = json.loads((pathlib.Path(sys.argv[1]) / "compile_commands.json").read_text())
    if len(sys.argv) > 2:
        like = next(entry for entry in entries if entry["file"].endswith("server/synthesis/mixer.cc"))
        entries = [dict(like, file=str(pathlib.Path(name).resolve())) for name in sys.argv[2:]]
    else:
        names = {entry["file"]: os.path.relpath(entry["file"], project.ROOT) for entry in entries}
        entries = [entry for entry in entries
                   if names[entry["file"]].startswith(ROOMS) and names[entry["file"]] not in KERNELS]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        problems = [text for text in pool.map(analyse, entries) if text]
    print("".join(problems) + f"{len(problems)} problems in {len(entries)} files")
    return 1 if problems or not entries else 0


if __name__ == "__main__":
    sys.exit(main())
