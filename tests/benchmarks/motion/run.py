#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Contacts found from the poses of frames alone, against those of an engine at 2400 Hz: a table for each engine.

Blows of less than 3 % of the strongest do not count; those of a pair within 8 ms are one. `--crowd` lets fifty boxes
fall for 20 s at 60 frames a second instead, and measures the time. `--sound` renders what is found from Bullet's poses,
and prints its levels less those of Bullet's own contacts, in dB.
"""

import argparse
import os
import pathlib
import subprocess
import sys

import sound_difference

ROOT = pathlib.Path(__file__).resolve().parents[3]

COLUMNS = ("scene", "frames/s", "found (share of J)", "false (J)", "dt, dt90, ms", "size of J, J as vector",
           "point, mm", "unexplained", "ambiguous", "CPU, wall, s")


def print_row(cells):
    print(f"| {' | '.join(cells)} |", flush=True)


def print_head(columns):
    print_row(columns)
    print(f"|{' --- |' * len(columns)}")


def print_sound(build):
    sys.path[:0] = map(str, (build / "client_sdk/python", ROOT / "client_sdk/python", ROOT / "tests/integration",
                             ROOT / "client_sdk/examples/falls"))
    os.environ.update(CARILLON_BIN_DIR=str(build / "bin"), CARILLON_BUILD_DIR=str(build),
                      PATH=f"{build}/bin:{os.environ['PATH']}")
    print_head(sound_difference.COLUMNS)
    for cells in sound_difference.rows(build):
        print_row(cells)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--engines", nargs="+", default=("bullet", "ode", "mujoco"))
    parser.add_argument("--crowd", action="store_true")
    parser.add_argument("--sound", action="store_true")
    options = parser.parse_args()
    if options.sound:
        print_sound(options.build.resolve())
        return
    for engine in options.engines:
        words = [options.build / "benchmarks/motion_benchmark", engine, *(["crowd"] if options.crowd else [])]
        print(f"\n{engine}\n")
        print_head(COLUMNS)
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as program:
            for line in program.stdout:
                print_row(line.rstrip().split("\t"))
        if program.returncode:
            raise SystemExit(program.returncode)


if __name__ == "__main__":
    main()
