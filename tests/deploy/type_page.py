#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Types a page of docs/ as a reader would: saves the files that it names, and runs its commands, in the order printed.

Usage: type_page.py PAGE PACKAGES

Commands run as root in the current folder, except that those under "Install" run in the folder PACKAGES. The WAV files
that the page makes must hold sound.
"""

import os
import pathlib
import re
import subprocess
import sys

# A reader who is root already, and answers yes.
SHIMS = 'sudo() { "$@"; }\napt() { apt-get -q -y -o Dpkg::Use-Pty=0 "$@"; }\nset -euo pipefail\n'
BLOCK = re.compile(r"(?m)^```(\w+)\n(.*?)^```$", re.DOTALL)
SAVED = re.compile(r"[Ss]ave (?:this|it) as `([^`]+)`:\s*$")
LEAST_PEAK = 1e-3


def steps(text):
    """(heading, name of the file or None for commands, content) of each block."""
    for block in BLOCK.finditer(text):
        before = text[:block.start()]
        heading = re.findall(r"(?m)^## (.*)$", before)[-1]
        if block[1] == "sh":
            yield heading, None, block[2]
        elif named := SAVED.search(before):
            yield heading, named[1], block[2]
        else:
            raise SystemExit(f"a block under \"{heading}\" is neither commands nor a file to save:\n{block[2]}")


def run(commands, folder):
    done = subprocess.run(["bash", "-c", SHIMS + commands], cwd=folder, stdin=subprocess.DEVNULL, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env={**os.environ, "DEBIAN_FRONTEND": "noninteractive"})
    if done.returncode:
        raise SystemExit(f"{done.stdout}\nthese commands ended with {done.returncode}:\n{commands}")


def peak(path):
    """The largest sample of a WAV file of 24 bits, full scale 1."""
    data = path.read_bytes()
    samples = data[data.index(b"data") + 8:]
    values = (int.from_bytes(samples[i:i + 3], "little", signed=True) for i in range(0, len(samples) - 2, 3))
    return max(map(abs, values), default=0) / 2**23


def main():
    page, packages = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    here = pathlib.Path.cwd()
    for heading, name, content in steps(page.read_text()):
        if name:
            (here / name).write_text(content)
        else:
            run(content, packages if heading == "Install" else here)
    sounds = sorted(here.glob("*.wav"))
    if not sounds:
        raise SystemExit(f"{page} made no WAV file")
    for sound in sounds:
        if peak(sound) < LEAST_PEAK:
            raise SystemExit(f"{sound.name} of {page} is silent")
        print(f"{page.name}: {sound.name} has a peak of {peak(sound):.4f}")


if __name__ == "__main__":
    main()
