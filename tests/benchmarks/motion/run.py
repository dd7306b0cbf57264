#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Contacts found from the poses of frames alone, against those of an engine at 2400 Hz: a table for each engine.

Blows of less than 3 % of the strongest do not count; those of a pair within 8 ms are one. `--crowd` lets fifty boxes
fall for 20 s at 60 frames a second instead, and measures the time.
"""

import argparse
import pathlib
import subprocess

COLUMNS = ("scene", "frames/s", "found (share of J)", "false (J)", "dt, dt90, ms", "size of J, J as vector",
           "point, mm", "unexplained", "ambiguous", "CPU, wall, s")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--engines", nargs="+", default=("bullet", "ode", "mujoco"))
    parser.add_argument("--crowd", action="store_true")
    options = parser.parse_args()
    for engine in options.engines:
        words = [options.build / "benchmarks/motion_benchmark", engine, *(["crowd"] if options.crowd else [])]
        print(f"\n{engine}\n\n| {' | '.join(COLUMNS)} |\n|{' --- |' * len(COLUMNS)}")
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as program:
            for line in program.stdout:
                print(f"| {' | '.join(line.rstrip().split(chr(9)))} |", flush=True)
        if program.returncode:
            raise SystemExit(program.returncode)


if __name__ == "__main__":
    main()
