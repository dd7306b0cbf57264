#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Impulses a second from each client into a playing scene.

Every impulse must be accounted for: applied in time, or applied and then merged or left out by the mixer, which counts
both. The scheduling delay is long enough for what waits in a client, and short enough that the mixer has places for
what waits there. In rows and columns each object is struck at one point, so that the impulses of a message become one
event for each object; in "spread" columns each impulse has a point, and an event, of its own.
"""

import json
import pathlib
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import bench  # noqa: E402

HERE = pathlib.Path(__file__).parent
DELAYS_S = {"C++": 0.1, "Python": 1, "Node": 1}
OBJECT_COUNT = 16


class Clients:
    def __init__(self, build, daemon, client, scene, environment):
        self.daemon, self.client, self.scene, self.environment = daemon, client, scene, environment
        self.programs = {"C++": [build / "tests/ingest"], "Python": [sys.executable, HERE / "ingest.py"],
                         "Node": ["node", HERE / "ingest.js"]}

    def run(self, language, server, *arguments):
        """Runs a client and returns its counts, with those of the mixer."""
        before, cpu_before = self.client.status(), bench.cpu_s(self.daemon.process.pid)
        words = [*self.programs[language], server, self.scene.name, *map(str, arguments)]
        done = subprocess.run(words, check=True, stdout=subprocess.PIPE, env=self.environment)
        counts = json.loads(done.stdout)
        counts["daemon_cpu_s"] = bench.cpu_s(self.daemon.process.pid) - cpu_before
        # The mixer counts what it merges when it is due.
        time.sleep(float(arguments[3]) + 0.2)
        after = self.client.status()
        counts["merged"] = after.merged_impulse_count - before.merged_impulse_count
        counts["shed"] = after.shed_impulse_count - before.shed_impulse_count
        return counts

    def throughput(self, language, place, server, form, size, seconds):
        counts = self.run(language, server, form, size, seconds, DELAYS_S[language])
        total = counts["accepted"] + counts["late"] + counts["dropped"] + counts["rejected"]
        assert total == size * counts["steps"], counts
        bench.print_row(language, place, form, size, f"{total / counts['seconds'] / 1000:.1f}",
                        f"{1e6 * counts['cpu_s'] / total:.2f}", f"{1e6 * counts['daemon_cpu_s'] / total:.2f}",
                        counts["late"], counts["dropped"], f"{(counts['merged'] + counts['shed']) / total:.0%}")


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--seconds", type=float, default=3, help="of each run")
    parser.add_argument("--sizes", type=int, nargs="*", default=[1, 16, 64, 256], help="impulses a message")
    parser.add_argument("--languages", nargs="*", default=["C++", "Python", "Node"])
    options = parser.parse_args()
    python = bench.use(options.build, "client_sdk/examples/falls")
    # They need the paths of `use`.
    import carillon
    import meshes
    from falls import node_environment
    with bench.daemon("--listen", "127.0.0.1:0") as daemon, carillon.connect(daemon.server) as c, c.scene() as scene:
        places = {"socket": daemon.server, "TCP": daemon.listening[-1].split()[-1]}
        environment = {**node_environment(daemon.folder), "PYTHONPATH": ":".join(python)}
        model = c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL)
        for handle in range(1, OBJECT_COUNT + 1):
            scene.add(model, handle=handle, gain=0.01)
        clients = Clients(options.build, daemon, c, scene, environment)
        bench.print_head("client", "over", "form", "a message", "thousand a second", "client's CPU, us",
                         "daemon's CPU, us", "late", "dropped", "merged or left out")
        for language in options.languages:
            for place, server in places.items():
                for form in ("rows", "columns", *(("spread",) if language == "C++" else ())):
                    for size in options.sizes:
                        clients.throughput(language, place, server, form, size, options.seconds)


if __name__ == "__main__":
    main()
