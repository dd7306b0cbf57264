#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The console in Chromium: how long from a click to the sound, and how much CPU a sounding scene takes and how many
gaps it has.

The daemon has the null device, so that the page plays. measure.js drives the browser.
"""

import contextlib
import os
import pathlib
import subprocess
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import bench  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
NAMES = ("clicks", "scene")


@contextlib.contextmanager
def simulator(server, mesh):
    """Strikes three bars, ten times a second in all."""
    import carillon
    done, began = threading.Event(), threading.Event()

    def simulate():
        with carillon.connect(server) as client, client.scene() as scene:
            bar = client.create_model(mesh, material="structural_steel")
            bars = [scene.add(bar) for _ in range(3)]
            with scene.stream(step=0.1, delay=0.2) as stream:
                step, start = 0, time.monotonic()
                while not done.wait(max(0, start + step * 0.1 - time.monotonic())):
                    stream.step(step * 0.1, impacts=carillon.Impacts(bars[step % 3], [[0, 0, 0]], [[0, 0, 0.02]]))
                    began.set()
                    step += 1

    thread = threading.Thread(target=simulate)
    thread.start()
    began.wait(120)
    yield
    done.set()
    thread.join()


def print_figures(build, daemon, what, **values):
    """Runs measure.js, which runs `carillon console` and Chromium."""
    environment = {**os.environ, "NODE_PATH": os.environ["CARILLON_CONSOLE_MODULES"], "CARILLON_SERVER": daemon.server,
                   "CARILLON_DAEMON_PID": str(daemon.process.pid), "PATH": f"{build}/bin:{os.environ['PATH']}",
                   **{name: str(value) for name, value in values.items()}}
    done = subprocess.run(["node", HERE / "measure.js", what], env=environment, stdout=subprocess.PIPE, text=True,
                          check=True)
    print(what, done.stdout, end="", flush=True)


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--seconds", type=int, default=600, help="how long the scene sounds")
    parser.add_argument("--only", nargs="+", choices=NAMES, default=NAMES)
    options = parser.parse_args()
    bench.use(options.build)
    import meshes  # needs the paths of `use`
    with bench.daemon() as daemon:
        bar = daemon.folder / "bar.obj"
        bar.write_bytes(meshes.bar())
        if "clicks" in options.only:
            print_figures(options.build, daemon, "clicks", MESH=bar)
        if "scene" in options.only:
            with simulator(daemon.server, bar):
                print_figures(options.build, daemon, "scene", SECONDS=options.seconds)


if __name__ == "__main__":
    main()
