#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs clang's thread-safety analysis on the rooms that have locks or thread roles: a function called by a thread of
the wrong role, a lock taken by the rendering thread, a guarded member touched without its lock.

Usage: check_thread_roles.py BUILD_FOLDER [FILE...]
"""

import concurrent.futures
import os
import pathlib
import subprocess
import sys

import compilation
import project

ROOMS = ("server/base/", "server/mode_database/", "server/decomposition/", "server/synthesis/", "server/audio_device/",
         "server/live_output/", "server/scene/", "precompute/sparse/", "precompute/program/")
# Compiled once for each SIMD target, and without a lock or a role: minutes for nothing.
KERNELS = ("server/synthesis/ringing/force_kernel.cc", "server/synthesis/ringing/ring_kernel.cc",
           "server/synthesis/ringing/strike_kernel.cc", "server/synthesis/spectrum/spectral_kernel.cc",
           "server/synthesis/voice/convolution_kernel.cc", "precompute/sparse/block_kernels.cc",
           "precompute/sparse/tile_kernels.cc")
KEPT = ("-I", "-D", "-std")


def flags_of(batch):
    words = compilation.arguments(batch)
    for word, following in zip(words, [*words[1:], ""]):
        if word == "-isystem":
            yield from (word, following)
        elif word.startswith(KEPT):
            yield word


def analyse(batch):
    run = subprocess.run(
        ["clang++", "-fsyntax-only", "-Wno-everything", "-Werror=thread-safety", *flags_of(batch), "-x", "c++", "-"],
        input=compilation.text_of(project.ROOT, batch), capture_output=True, text=True)
    return run.stderr if run.returncode else ""


def main():
    sources = compilation.sources(project.ROOT, pathlib.Path(sys.argv[1]).resolve())
    if len(sys.argv) > 2:
        like = next(source for source in sources if source.name == "server/synthesis/mixer.cc")
        sources = [like._replace(name=str(pathlib.Path(name).resolve())) for name in sys.argv[2:]]
    else:
        sources = [source for source in sources if source.name.startswith(ROOMS) and source.name not in KERNELS]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        found = pool.map(lambda batch: compilation.findings(batch, analyse), compilation.batches(project.ROOT, sources))
        problems = [text for batch in found for _, text in batch]
    print("".join(problems) + f"{len(problems)} problems in {len(sources)} files")
    return 1 if problems or not sources else 0


if __name__ == "__main__":
    sys.exit(main())
