#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How fast sound comes in step: environments that are performed together, over a Unix socket.

In each step every body of every environment has a pose, and one of them is struck. The CPU is told apart into that of
the daemon and that of the client.
"""

import json
import os
import pathlib
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import bench  # noqa: E402

CASES = ((1, 5, 60, 0.02), (64, 5, 60, 0.02), (1024, 1, 20, 0.002))  # environments, bodies, modes of each, step, s
COLUMNS = ("client", "environments", "bodies", "modes", "step, ms", "times real time", "a step, us",
           "an environment's step, us of CPU", "of that the client's")


class Python:
    """The package for Python, in this process."""

    def __init__(self, client):
        self.client = client

    def run(self, model, case, seconds, begin):
        from performed import STEPS_BEFORE, Performed
        environments, bodies, _, step_s = case
        performed = Performed(self.client, model, environments, bodies, step_s)
        with performed.sound:
            for number in range(STEPS_BEFORE):
                performed.step(number)
            begin()
            begun, cpu_before_s, count, loudest = time.perf_counter(), time.process_time(), 0, 0.0
            while time.perf_counter() - begun < seconds:
                loudest = max(loudest, performed.step(STEPS_BEFORE + count).max())
                count += 1
            return {"steps": count, "seconds": time.perf_counter() - begun,
                    "cpu_s": time.process_time() - cpu_before_s, "loudest": loudest}


class Cpp:
    """The client for C++, in a process of its own."""

    def __init__(self, program, server):
        self.program, self.server = program, server

    def run(self, model, case, seconds, begin):
        environments, bodies, _, step_s = case
        words = [self.program, self.server, model.name, *map(str, (environments, bodies, step_s, seconds)), os.devnull]
        with subprocess.Popen(words, stdout=subprocess.PIPE) as process:
            assert process.stdout.readline() == b"begun\n"
            begin()
            return json.loads(process.stdout.readline())


def measure(daemon, language, client, model, case, seconds):
    before = []
    found = client.run(model, case, seconds, lambda: before.append(bench.cpu_s(daemon.process.pid)))
    daemon_s = bench.cpu_s(daemon.process.pid) - before[0]
    assert found["loudest"] > 0, "nothing was heard"
    environments, bodies, modes, step = case
    each = 1e6 / found["steps"] / environments  # from seconds in all to us of each environment and step
    bench.print_row(language, environments, bodies, modes, 1000 * step,
                    f"{found['steps'] * step / found['seconds']:.2f}", f"{1e6 * found['seconds'] / found['steps']:.0f}",
                    f"{(daemon_s + found['cpu_s']) * each:.1f}", f"{found['cpu_s'] * each:.1f}")


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--seconds", type=float, default=5, help="of each case")
    parser.add_argument("--cases", type=int, nargs="+", default=range(len(CASES)))
    options = parser.parse_args()
    bench.use(options.build, "tests/integration/clients")
    # They need the paths of `use`.
    import carillon
    import meshes
    with bench.daemon() as daemon, carillon.connect(daemon.server) as connection:
        clients = {"Python": Python(connection), "C++": Cpp(options.build / "tests/performed", daemon.server)}
        bench.print_head(*COLUMNS)
        for case in (CASES[i] for i in options.cases):
            model = connection.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL,
                                            settings={"keep_mode_count": case[2]}, without_transfer=True)
            for language, client in clients.items():
                measure(daemon, language, client, model, case, options.seconds)


if __name__ == "__main__":
    main()
