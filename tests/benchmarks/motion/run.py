#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Contacts found from the poses of frames alone, against those of an engine at 2400 Hz: a table for each engine.

Blows of less than 3 % of the strongest do not count; those of a pair within 8 ms are one. `--crowd` lets fifty boxes
fall for 20 s at 60 frames a second instead, and measures the time. `--piles` prints the means over ten piles of blocks
instead. `--sound` renders what is found from Bullet's poses, and prints its levels less those of Bullet's own contacts,
in dB.
"""

import os
import pathlib
import subprocess
import sys

import sound_difference

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import bench  # noqa: E402

COLUMNS = ("scene", "frames/s", "found (share of J)", "false (J)", "dt, dt90, ms", "size of J, J as vector",
           "point, mm", "unexplained", "ambiguous", "CPU, wall, s")


def print_sound(build):
    bench.use(build, "client_sdk/examples/falls")
    os.environ["PATH"] = f"{build}/bin:{os.environ['PATH']}"
    bench.print_head(*sound_difference.COLUMNS)
    with bench.daemon() as daemon:
        for cells in sound_difference.rows(daemon, build):
            bench.print_row(*cells)


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--engines", nargs="+", default=("bullet", "ode", "mujoco"))
    parser.add_argument("--crowd", action="store_true")
    parser.add_argument("--piles", action="store_true")
    parser.add_argument("--sound", action="store_true")
    options = parser.parse_args()
    if options.sound:
        print_sound(options.build)
        return
    for engine in options.engines:
        words = [options.build / "benchmarks/motion_benchmark", engine, *["crowd"] * options.crowd,
                 *["piles"] * options.piles]
        print(f"\n{engine}\n")
        bench.print_head(*(COLUMNS[:4] if options.piles else COLUMNS))
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as program:
            for line in program.stdout:
                bench.print_row(*line.rstrip().split("\t"))
        if program.returncode:
            raise SystemExit(program.returncode)


if __name__ == "__main__":
    main()
