#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Carillon's mixer beside Klank of SuperCollider, one after the other on one core, and one table.

Modes a core: how many modes one core renders in real time at 48 kHz, from CPU time; of Klank the median of three runs,
fixed costs taken off. Because a shared core's speed changes from minute to minute, Carillon and Klank run
in turns, and the medians over the turns are printed: of Carillon's modes, and of its ratio to Klank in each turn, with
their range. All render the same modes: frequencies log-uniform from 20 Hz to 20 kHz, T60 log-uniform from 20 ms to
60 s; none ever sleeps.
"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

import supercollider_peer

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import bench  # noqa: E402


def carillon(build, *arguments, most_target=None):
    environment = dict(os.environ, **({"CARILLON_MOST_TARGET": most_target} if most_target else {}))
    run = subprocess.run([build / "tests/mixer_measure", *map(str, arguments)], check=True, capture_output=True,
                         text=True, env=environment)
    return [json.loads(line) for line in run.stdout.splitlines()]


def population(build):
    text = subprocess.run([build / "tests/mixer_measure", "population"], check=True,
                          capture_output=True, text=True).stdout
    return [tuple(map(float, line.split())) for line in text.splitlines()]


def has(target, build):
    return subprocess.run([build / "tests/mixer_measure", "population"], capture_output=True,
                          env=dict(os.environ, CARILLON_MOST_TARGET=target)).returncode == 0


def turns(options, folder, modes):
    """Carillon's results by target, kind and count of modes: (load, modes a core, times Klank) of each turn."""
    found = {}
    targets = [name for name in ("AVX3", "AVX2", "SSE4", "NEON") if has(name, options.build)]
    for _ in range(options.turns):
        for target in targets:
            klank = supercollider_peer.throughput(folder, modes)
            for what in ("struck", "ringing"):
                for result in carillon(options.build, what, options.seconds, most_target=target):
                    found.setdefault((target, what, result["modes"]), []).append(
                        (result["load"], result["modes_per_core"], result["modes_per_core"] / klank))
    return found


def ringing(options, folder):
    print("\n## Modes a core\n")
    bench.print_head("what", "modes", "load", "modes a core", "times Klank", "from ... to")
    modes = population(options.build)
    klank = supercollider_peer.throughput(folder, modes)
    bench.print_row("scsynth Klank, 800 modes", "", "", f"{klank:,.0f}", "1.00", "")
    for (target, what, count), results in turns(options, folder, modes).items():
        loads, rates, times = zip(*results)
        what = {"ringing": "ringing freely", "struck": "every bank struck in every block"}[what]
        bench.print_row(f"Carillon {target}, {what}", f"{count:,.0f}", f"{statistics.median(loads):.1%}",
                        f"{statistics.median(rates):,.0f}", f"{statistics.median(times):.1f}",
                        f"{min(times):.1f} ... {max(times):.1f}")


def directed(options, _folder):
    print("\n## Objects with a place, and with directions\n")
    bench.print_head("what", "objects x modes", "harmonics", "load of one core", "slowest hundredth of the blocks, ms")
    for result in carillon(options.build, "directed", options.seconds):
        bench.print_row(result["what"], f"{result['objects']} x {result['modes']}", f"{result['harmonics']:,}",
                        f"{result['load']:.2%}", f"{result['p99_block_ms']:.3f}")


def flood(options, _folder):
    print("\n## Flood: 20 ringing bodies of 10,000 vertices and 800 modes, random triangles, four streams\n")
    bench.print_head("impulses/s", "taken/s", "merged/s", "shed/s", "lost", "load", "median, worst block ms",
                     "over 2.67 ms", "missed behind 8 blocks")
    for result in carillon(options.build, "flood", options.flood_seconds):
        bench.print_row(f"{result['rate']:,.0f}", f"{result['taken_per_s']:,.0f}", f"{result['merged_per_s']:,.0f}",
                        f"{result['shed_per_s']:,.0f}", result["dropped"], f"{result['load']:.1%}",
                        f"{result['median_block_ms']:.2f}, {result['worst_block_ms']:.2f}", result["late_blocks"],
                        result["missed"])


PARTS = {"ringing": ringing, "directed": directed, "flood": flood}


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--parts", type=bench.names, default=list(PARTS), help="some of " + ",".join(PARTS))
    parser.add_argument("--seconds", type=float, default=5,
                        help="of sound, for each measurement of 80,000 modes or more; of fewer it is longer")
    parser.add_argument("--turns", type=int, default=5, help="of measurements of modes")
    parser.add_argument("--flood-seconds", type=float, default=60)
    options = parser.parse_args()
    print(f"load average before: {os.getloadavg()[0]:.1f}", flush=True)
    for part in options.parts:
        with tempfile.TemporaryDirectory() as folder:
            PARTS[part](options, pathlib.Path(folder))
    print(f"\nload average after: {os.getloadavg()[0]:.1f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
