#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How fast sound comes in step: environments that are performed together, each with one impact a step and the poses of
all its bodies, by the package for Python over a Unix socket. The CPU of the daemon and of this client is told apart.
"""

import argparse
import os
import pathlib
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
CASES = ((1, 5, 60, 0.02), (64, 5, 60, 0.02), (1024, 1, 20, 0.002))  # environments, bodies, modes of each, step, s
COLUMNS = ("environments", "bodies", "modes", "step, ms", "times real time", "a step, us", "an environment's step, us",
           "daemon's CPU", "client's CPU")


def cpu_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(carillon, numpy, client, daemon, model, case, seconds):
    environments, bodies, modes, step = case
    every = numpy.repeat(numpy.arange(environments), bodies)
    handles = numpy.tile(numpy.arange(1, bodies + 1), environments)
    own = numpy.arange(environments)
    with client.perform(step=step, environments=environments, microphones=[carillon.Omni(at=(0, 0, 1.5))]) as sound:
        for handle in range(1, bodies + 1):
            sound.add(model, handle=handle)

        def perform(k):
            poses = carillon.Poses(handles, numpy.column_stack([0.1 * handles, 0 * handles, 1e-4 * k + 0 * handles]),
                                   environments=every)
            blows = carillon.Impacts(1 + (own + k) % bodies, numpy.tile([0, 0.008, 0.01], (environments, 1)),
                                     numpy.tile([0, 0, -0.002], (environments, 1)), durations=1e-4, environments=own)
            return sound.step(impacts=blows, poses=poses)[0]

        for k in range(20):
            perform(k)
        pids = (daemon.process.pid, os.getpid())
        begun, before = time.perf_counter(), [cpu_s(pid) for pid in pids]
        count, loudest = 0, 0.0
        while time.perf_counter() - begun < seconds:
            loudest = max(loudest, perform(20 + count)[0].max())
            count += 1
        wall, used = time.perf_counter() - begun, [cpu_s(pid) - was for pid, was in zip(pids, before)]
    if loudest <= 0:
        raise SystemExit("nothing was heard")
    cells = (environments, bodies, modes, 1000 * step, f"{count * step / wall:.2f}", f"{1e6 * wall / count:.0f}",
             f"{1e6 * wall / count / environments:.1f}", *(f"{share / wall:.2f}" for share in used))
    print(f"| {' | '.join(map(str, cells))} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--seconds", type=float, default=5, help="of each case")
    parser.add_argument("--cases", type=int, nargs="+", default=range(len(CASES)))
    options = parser.parse_args()
    build = options.build.resolve()
    sys.path[:0] = [str(build / "client_sdk/python"), str(ROOT / "client_sdk/python"),
                    str(ROOT / "tests/integration")]
    os.environ.update(CARILLON_BIN_DIR=str(build / "bin"), CARILLON_BUILD_DIR=str(build))
    # They need the paths above.
    import numpy
    import carillon
    import meshes
    from daemon import Daemon
    with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
        daemon = Daemon(folder)
        try:
            with carillon.connect(daemon.server) as client:
                print(f"| {' | '.join(COLUMNS)} |\n|{' --- |' * len(COLUMNS)}")
                for case in (CASES[i] for i in options.cases):
                    model = client.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL, settings={"keep_mode_count": case[2]},
                                                without_transfer=True)
                    measure(carillon, numpy, client, daemon, model, case, options.seconds)
        finally:
            daemon.stop()


if __name__ == "__main__":
    main()
