#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The mode database beside a flat file with mmap, and loading into sounding objects.

A flat file neither checks what it holds nor survives a kill in the middle of a write; it is here as
what the disk and the memory give at best. Cold: the file was dropped from the system's cache.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
RUNS = 5


def drop_from_cache(folder):
    os.sync()
    for path in folder.iterdir():
        descriptor = os.open(path, os.O_RDONLY)
        os.posix_fadvise(descriptor, 0, 0, os.POSIX_FADV_DONTNEED)
        os.close(descriptor)


class Steps:
    def __init__(self, build, folder):
        self.program, self.folder = build / "tests/store_benchmark", folder

    def run(self, step, number):
        """Seconds, or None for a step that is not timed."""
        done = subprocess.run([self.program, self.folder, step, str(number)], check=True,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        return float(done.stdout) if done.stdout else None

    def median(self, step, number, cold=False):
        times = []
        for _ in range(RUNS):
            if cold:
                drop_from_cache(self.folder)
            times.append(self.run(step, number))
        return statistics.median(times)


def row(name, ours, peer):
    ratio = f"{ours / peer:6.1f}" if peer else "      "
    print(f"| {name:<28} | {ours:10.4f} | {f'{peer:10.4f}' if peer else ' ' * 10} | {ratio} |", flush=True)


def measure_store(build, folder, counts):
    steps = Steps(build, folder)
    print(f"\n## Store, median of {RUNS}, seconds\n")
    print("| step                         |   Carillon |  flat file |  ratio |")
    print("| ---------------------------- | ---------- | ---------- | ------ |")
    for megabytes in (10, 100):
        steps.run("make", megabytes)
        steps.run("flat_write", megabytes)
        row(f"write {megabytes} MB", steps.median("write", megabytes),
            steps.median("flat_write", megabytes))
        row(f"load {megabytes} MB, cold", steps.median("load", megabytes, cold=True),
            steps.median("flat_load", megabytes, cold=True))
        steps.run("load", megabytes)
        row(f"load {megabytes} MB, warm", steps.median("load", megabytes),
            steps.median("flat_load", megabytes))
    stored = 0
    for count in counts:
        steps.run("fill", count)
        stored = count
        row(f"list all of {stored}", steps.median("list", stored), None)
        row(f"open each of {stored}", steps.median("open", stored), None)


def resident_mb(pid):
    text = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return int(text.split("VmRSS:")[1].split()[0]) / 1024


def measure_objects(build, folder):
    """Through the daemon: from the call to the object that may be struck."""
    sys.path[:0] = [str(build / "client_sdk/python"), str(ROOT / "client_sdk/python"),
                    str(ROOT / "tests/integration")]
    os.environ["CARILLON_BIN_DIR"] = str(build / "bin")
    # They need the paths above.
    from carillon.v1 import material_pb2, scene_service_pb2
    from daemon import Daemon
    Steps(build, folder).run("make", 100)
    daemon = Daemon(folder)
    try:
        model = daemon.command("model", "import", folder / "100.model").stdout.strip()
        client = daemon.client()
        scene = client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        material = material_pb2.Material(preset="chime_aluminum", poisson_ratio=0.33)

        def add():
            begun = time.monotonic()
            added = client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
                scene=scene, objects=[scene_service_pb2.NewObject(modal_model=model, material=material)])).objects[0]
            return time.monotonic() - begun, added.name

        def remove(name):
            client.scenes.RemoveObject(scene_service_pb2.RemoveObjectRequest(name=name))

        remove(add()[1])
        times = []
        for _ in range(RUNS):
            seconds, name = add()
            times.append(seconds)
            remove(name)
        first, _ = add()
        one = resident_mb(daemon.process.pid)
        more = [add()[0] for _ in range(49)]
        many = resident_mb(daemon.process.pid)
    finally:
        daemon.stop()
    print("\n## A model of 100 MB into sounding objects\n")
    print(f"* into the first object, warm: {statistics.median(times):.3f} s (median of {RUNS})")
    print(f"* into 49 more: {statistics.median(more) * 1000:.1f} ms each")
    print(f"* memory of the daemon with one: {one:.0f} MB, with fifty: {many:.0f} MB")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, required=True, help="the release build's folder")
    parser.add_argument("--models", type=int, default=10_000, help="how many to list and open")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        measure_store(options.build, pathlib.Path(folder), (options.models // 10, options.models))
    with tempfile.TemporaryDirectory() as folder:
        measure_objects(options.build, pathlib.Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
