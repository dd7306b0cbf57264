#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The console in Chromium: how long from the command to a heard strike, from a click to the sound, how much CPU a
sounding scene takes and how many gaps it has, how soon a large model is seen, and how soon all is back after the daemon
was killed.

The daemon has the null device, so that the page plays. measure.js drives the browser.
"""

import contextlib
import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import bench  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
NAMES = ("first", "clicks", "scene", "large", "restart")
LARGE = (250, 400, 800)  # vertices along and around, modes


def large_model(file):
    """A spindle of 100,000 vertices whose 800 shapes are waves along and around it; no body, but as large as one."""
    along, around, modes = LARGE
    u, v = numpy.meshgrid(numpy.linspace(0, 1, along), numpy.arange(around) * 2 * numpy.pi / around, indexing="ij")
    radius = 0.02 + 0.05 * numpy.sin(numpy.pi * u)
    vertices = numpy.stack([0.3 * u, radius * numpy.cos(v), radius * numpy.sin(v)], axis=-1).reshape(-1, 3)
    place = numpy.arange(along * around).reshape(along, around)
    a, b = place[:-1], place[1:]
    c, d = numpy.roll(a, -1, 1), numpy.roll(b, -1, 1)
    ends = [numpy.stack([numpy.full(around - 2, end[0]), end[1:-1], end[2:]], -1)[:, order]
            for end, order in ((place[0], (0, 2, 1)), (place[-1], (0, 1, 2)))]
    triangles = numpy.concatenate([numpy.stack([a, c, b], -1).reshape(-1, 3), numpy.stack([b, c, d], -1).reshape(-1, 3),
                                   *ends])
    normal = numpy.stack([0 * v, numpy.cos(v), numpy.sin(v)], -1).reshape(-1, 3, 1).astype(numpy.float32)
    shapes = numpy.empty((along * around, 3, modes), numpy.float32)
    for mode in range(modes):
        wave = numpy.cos((1 + mode % 20) * numpy.pi * u) * numpy.cos((2 + mode // 20) * v)
        shapes[:, :, mode] = 30 * normal[:, :, 0] * wave.reshape(-1, 1)
    # From 300 Hz to 18 kHz in steel.
    omega = 2 * numpy.pi * numpy.geomspace(300, 18000, modes)
    numpy.savez(file, eigenvalues=omega ** 2 * 7850 / 2.1e11, vertices=vertices.astype(numpy.float32),
                triangles=triangles.astype(numpy.uint32), shapes=shapes, poisson_ratio=numpy.float64(0.3))


def as_stl(mesh):
    """An OBJ file's triangles as a binary STL file."""
    rows = [line.split() for line in mesh.decode().splitlines()]
    vertices = numpy.array([row[1:4] for row in rows if row and row[0] == "v"], numpy.float32)
    faces = numpy.array([[int(word.split("/")[0]) - 1 for word in row[1:4]] for row in rows if row and row[0] == "f"])
    facets = numpy.zeros(len(faces), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["corners"] = vertices[faces]
    return bytes(80) + len(faces).to_bytes(4, "little") + facets.tobytes()


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


@contextlib.contextmanager
def restarted(daemon):
    """Starts the daemon again once it has been killed."""

    def restart():
        if daemon.process.wait() == -signal.SIGKILL:
            daemon.start()

    thread = threading.Thread(target=restart)
    thread.start()
    yield
    thread.join()


class Browser:
    """measure.js, which runs `carillon console` and Chromium."""

    def __init__(self, build, daemon):
        self.daemon = daemon
        self.environment = {**os.environ, "NODE_PATH": os.environ["CARILLON_CONSOLE_MODULES"],
                            "CARILLON_SERVER": daemon.server, "PATH": f"{build}/bin:{os.environ['PATH']}"}

    def measure(self, what, **values):
        """Yields the lines of JSON that a measurement prints, as they come."""
        environment = {**self.environment, "CARILLON_DAEMON_PID": str(self.daemon.process.pid),
                       **{name: str(value) for name, value in values.items()}}
        with subprocess.Popen(["node", HERE / "measure.js", what], env=environment, stdout=subprocess.PIPE,
                              text=True) as run:
            for line in run.stdout:
                yield json.loads(line)

    def print_all(self, what, **values):
        for figures in self.measure(what, **values):
            print(what, json.dumps(figures), flush=True)


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--seconds", type=int, default=600, help="how long the scene sounds")
    parser.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, help="large needs 2 GB in /tmp")
    options = parser.parse_args()
    bench.use(options.build)
    import meshes  # needs the paths of `use`
    with bench.daemon() as daemon:
        bar, bowl, large = (daemon.folder / name for name in ("bar.obj", "bowl.stl", "large.npz"))
        bar.write_bytes(meshes.bar())
        bowl.write_bytes(as_stl(meshes.bowl()))
        browser = Browser(options.build, daemon)
        if "first" in options.only:
            browser.print_all("first", MESH=bowl)
        if "clicks" in options.only:
            browser.print_all("clicks", MESH=bar)
        if "scene" in options.only:
            with simulator(daemon.server, bar):
                browser.print_all("scene", SECONDS=options.seconds)
        if "large" in options.only:
            large_model(large)
            daemon.command("model", "import", "--label", "large", "--material", "structural_steel", large)
            browser.print_all("large")
        if "restart" in options.only:
            with restarted(daemon):
                browser.print_all("restart", MESH=bar)


if __name__ == "__main__":
    main()
