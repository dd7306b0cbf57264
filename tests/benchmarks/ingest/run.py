#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Impulses a second from each client into a playing scene, and the latency of steps on their way.

Every impulse must be accounted for: applied in time, or applied and then merged or left out by the mixer, which counts
both. The scheduling delay is long enough for what waits in a client, and short enough that the mixer has places for
what waits there. In rows and columns each object is struck at one point, so that the impulses of a message become one
event for each object; in "spread" columns each impulse has a point, and an event, of its own.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
HERE = pathlib.Path(__file__).parent
DELAYS_S = {"C++": 0.1, "Python": 1, "Node": 1}
OBJECT_COUNT = 16
LATENCY_DELAYS_S = (0.003, 0.004, 0.005, 0.006, 0.008, 0.010, 0.015, 0.020, 0.030, 0.050, 0.1)


def cpu_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Bench:
    def __init__(self, build, daemon, client, scene, environment):
        self.daemon, self.client, self.scene, self.environment = daemon, client, scene, environment
        self.programs = {"C++": [build / "tests/ingest"], "Python": [sys.executable, HERE / "ingest.py"],
                         "Node": ["node", HERE / "ingest.js"]}

    def run(self, language, server, *arguments):
        """Runs a client and returns its counts, with those of the mixer."""
        before, cpu_before = self.client.status(), cpu_s(self.daemon.process.pid)
        words = [*self.programs[language], server, self.scene.name, *map(str, arguments)]
        done = subprocess.run(words, check=True, stdout=subprocess.PIPE, env=self.environment)
        counts = json.loads(done.stdout)
        counts["daemon_cpu_s"] = cpu_s(self.daemon.process.pid) - cpu_before
        # The mixer counts what it merges when it is due.
        time.sleep(float(arguments[3]) + 0.2)
        after = self.client.status()
        counts["merged"] = after.merged_impulse_count - before.merged_impulse_count
        counts["shed"] = after.shed_impulse_count - before.shed_impulse_count
        return counts

    def throughput(self, language, place, server, form, size, seconds):
        more = (0,) if language == "C++" else ()
        counts = self.run(language, server, form, size, seconds, DELAYS_S[language], *more)
        total = counts["accepted"] + counts["late"] + counts["dropped"] + counts["rejected"]
        assert total == size * counts["steps"], counts
        row = (f"{language} | {place} | {form} | {size} | {total / counts['seconds'] / 1000:.1f} | "
               f"{1e6 * counts['cpu_s'] / total:.2f} | {1e6 * counts['daemon_cpu_s'] / total:.2f} | "
               f"{counts['late']} | {counts['dropped']} | {(counts['merged'] + counts['shed']) / total:.0%}")
        print(f"| {row} |", flush=True)

    def latency(self, place, server, seconds):
        """The share of steps that are later than a delay, by the daemon's own count of late impulses."""
        print(f"\nOne step of one impulse each millisecond, {place}: share that arrives later than the delay.\n")
        print("| delay, ms | late |\n| --- | --- |")
        for delay in LATENCY_DELAYS_S:
            counts = self.run("C++", server, "columns", 1, seconds, delay, 1000)
            share = counts["late"] / (counts["late"] + counts["accepted"])
            print(f"| {1000 * delay:.0f} | {share:.4f} |", flush=True)
            if share == 0:
                return


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--seconds", type=float, default=3, help="of each run")
    parser.add_argument("--sizes", type=int, nargs="*", default=[1, 16, 64, 256], help="impulses a message")
    parser.add_argument("--languages", nargs="*", default=["C++", "Python", "Node"])
    options = parser.parse_args()
    build = options.build.resolve()
    python = [str(build / "client_sdk/python"), str(ROOT / "client_sdk/python"), str(ROOT / "tests/integration")]
    sys.path[:0] = python
    os.environ.update(CARILLON_BIN_DIR=str(build / "bin"), CARILLON_BUILD_DIR=str(build))
    # They need the paths above.
    import carillon
    import meshes
    from daemon import Daemon
    from node import node_environment
    with tempfile.TemporaryDirectory(prefix="carillon-") as name:
        folder = pathlib.Path(name)
        daemon = Daemon(folder, "--listen", "127.0.0.1:0")
        try:
            places = {"socket": daemon.server, "TCP": daemon.listening[-1].split()[-1]}
            environment = {**node_environment(folder), "PYTHONPATH": ":".join(python)}
            with carillon.connect(daemon.server) as c, c.scene() as scene:
                model = c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL)
                for handle in range(1, OBJECT_COUNT + 1):
                    scene.add(model, handle=handle, gain=0.01)
                bench = Bench(build, daemon, c, scene, environment)
                print("| client | over | form | a message | thousand a second | client's CPU, us | daemon's CPU, us | "
                      "late | dropped | merged or left out |")
                print("| --- " * 10 + "|")
                for language in options.languages:
                    for place, server in places.items():
                        for form in ("rows", "columns", *(("spread",) if language == "C++" else ())):
                            for size in options.sizes:
                                bench.throughput(language, place, server, form, size, options.seconds)
                for place, server in places.items():
                    bench.latency(place, server, options.seconds)
        finally:
            daemon.stop()


if __name__ == "__main__":
    main()
