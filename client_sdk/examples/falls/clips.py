#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes clips for learning: random falls of ten bodies in five materials, simulated by MuJoCo, and their sound.

Leaves FOLDER/traces/N.contacts (and N.json, the scene), FOLDER/clips/N.wav, and FOLDER/clips/manifest.jsonl, which
tells what struck what, when, where and how hard. Falls and clips that are there already stay; the same seed gives the
same falls.
"""

import argparse
import concurrent.futures
import copy
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
DENSITIES_KG_PER_M3 = {"structural_steel": 7850, "soda_lime_glass": 2500, "porcelain": 2400, "oak": 750, "abs": 1050}
MOST_ATTEMPTS = 10
HEXAGON = [(math.cos(math.pi * i / 3), math.sin(math.pi * i / 3)) for i in range(6)]


def box(*sides):
    import falls
    return {"shape": {"boxes": [{"sides_m": sides}]}, "volume_m3": math.prod(sides), "extent_m": math.hypot(*sides),
            "inertia_per_kg": falls.box_inertia(1, sides)}


def ball(radius):
    return {"shape": {"ball": {"radius_m": radius}}, "volume_m3": 4 / 3 * math.pi * radius**3, "extent_m": 2 * radius,
            "inertia_per_kg": [0.4 * radius**2] * 3}


def hull(path, corners, faces, volume, inertia):
    """A convex body about its centre of mass, whose surface goes into a file."""
    import scene_makers
    scene_makers.write_obj(path, corners, faces)
    return {"shape": {"hull": {"corners_m": corners}}, "mesh": path.name, "volume_m3": volume,
            "extent_m": 2 * max(math.hypot(*corner) for corner in corners), "inertia_per_kg": inertia}


def prism(name, radius, height, folder):
    """A hexagonal prism along z."""
    corners = [(radius * x, radius * y, z) for z in (-height / 2, height / 2) for x, y in HEXAGON]
    faces = [(0, i + 1, i) for i in range(1, 5)] + [(6, i + 6, i + 7) for i in range(1, 5)]
    for i in range(6):
        j = (i + 1) % 6
        faces += [(i, j, j + 6), (i, j + 6, i + 6)]
    along = 5 / 12 * radius**2
    across = along / 2 + height**2 / 12
    volume = 1.5 * math.sqrt(3) * radius**2 * height
    return hull(folder / f"{name}.obj", corners, faces, volume, [across, across, along])


def octahedron(radius, folder):
    corners = [(radius, 0, 0), (0, radius, 0), (0, 0, radius), (-radius, 0, 0), (0, -radius, 0), (0, 0, -radius)]
    faces = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    return hull(folder / "octahedron.obj", corners, faces, 4 / 3 * radius**3, [radius**2 / 5] * 3)


def tetrahedron(half, folder):
    """Four corners of a cube whose sides are twice `half`."""
    corners = [(half, half, half), (half, -half, -half), (-half, half, -half), (-half, -half, half)]
    faces = [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]
    return hull(folder / "tetrahedron.obj", corners, faces, 8 / 3 * half**3, [0.4 * half**2] * 3)


def hollow(kind, inradius, wall):
    """A body whose inside is one of the same shape. A compact solid of a hand's size is silent: its lowest mode is
    beyond hearing."""
    inside = 1 - wall / inradius
    moment = (1 - inside**5) / (1 - inside**3)
    return {**kind, "wall_m": wall, "volume_m3": kind["volume_m3"] * (1 - inside**3),
            "inertia_per_kg": [moment * each for each in kind["inertia_per_kg"]]}


def bodies(folder):
    """The ten, by name. Writes the surfaces of those that are no box and no ball into the folder."""
    return {"cube": hollow(box(0.08, 0.08, 0.08), 0.04, 0.005), "brick": hollow(box(0.12, 0.06, 0.06), 0.03, 0.005),
            "plank": box(0.24, 0.06, 0.012), "rod": box(0.20, 0.016, 0.016), "tile": box(0.12, 0.12, 0.008),
            "ball": hollow(ball(0.045), 0.045, 0.004),
            "octahedron": hollow(octahedron(0.07, folder), 0.07 / math.sqrt(3), 0.005),
            "tetrahedron": tetrahedron(0.07, folder),
            "disc": prism("disc", 0.07, 0.01, folder), "pencil": prism("pencil", 0.01, 0.16, folder)}


def as_body(name, kind, material):
    mass = DENSITIES_KG_PER_M3[material] * kind["volume_m3"]
    made = {"name": f"{material} {name}", "mass_kg": mass, "material": material, "max_frequency_hz": 16000,
            "inertia_kg_m2": [mass * moment for moment in kind["inertia_per_kg"]]}
    made.update({key: kind[key] for key in ("shape", "mesh", "wall_m") if key in kind})
    return made


def turn(rng):
    """A random orientation."""
    w, x, y, z = (rng.gauss(0, 1) for _ in range(4))
    length = math.hypot(w, x, y, z)
    return [w / length, x / length, y / length, z / length]


def fall(models, number, options):
    """Some random bodies above each other, that drop on the floor."""
    rng = random.Random(f"{options.seed} {number}")
    scene = {"friction": rng.uniform(0.3, 0.7), "restitution": rng.uniform(0, 0.5),
             "bodies": [{"name": "floor", "shape": {"plane": {}}}]}
    height = rng.uniform(0.05, 0.5)
    for _ in range(options.bodies):
        chosen = copy.deepcopy(rng.choice(models))
        reach = chosen.pop("extent_m") / 2
        height += reach
        chosen.update(position_m=[rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03), height], orientation=turn(rng),
                      velocity_m_per_s=[rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(-1, 0)],
                      angular_velocity_rad_per_s=[rng.uniform(-5, 5) for _ in range(3)])
        height += reach + rng.uniform(0, 0.1)
        scene["bodies"].append(chosen)
    return scene


def simulate(models, traces, number, options):
    """Whether the fall was not there yet."""
    import falls
    trace = traces / f"{number:05}.contacts"
    if trace.exists():
        return False
    part = traces / f"{number:05}.part"
    for attempt in range(MOST_ATTEMPTS):
        try:
            falls.record("mujoco", fall(models, f"{number} {attempt}", options), part, rate=1000,
                         seconds=options.seconds, build=options.build)
        except subprocess.CalledProcessError:
            continue  # MuJoCo warns of an unstable simulation about once in a hundred falls
        part.rename(trace)
        return True
    raise RuntimeError(f"{MOST_ATTEMPTS} falls of number {number} were unstable")


def create_models(client, folder):
    """All bodies in all materials, with their models."""
    import falls
    kinds = bodies(folder)
    made = []
    for material in DENSITIES_KG_PER_M3:
        scene = {"bodies": [as_body(name, kind, material) for name, kind in kinds.items()]}
        for body, kind in zip(falls.create_models(client, scene, folder)["bodies"], kinds.values()):
            made.append({**body, "extent_m": kind["extent_m"]})
    return made


def said(what, count, begin):
    seconds = time.monotonic() - begin
    print(f"{count} {what} in {seconds:.1f} s ({3600 * count / max(seconds, 1e-3):.0f} an hour)", flush=True)


def make(daemon, folder, options):
    import carillon
    traces = folder / "traces"
    traces.mkdir(exist_ok=True)
    begin = time.monotonic()
    with carillon.connect(daemon.server) as client:
        models = create_models(client, folder)
    said("models", len(models), begin)
    begin = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(options.workers) as pool:
        made = sum(pool.map(lambda n: simulate(models, traces, n, options), range(options.count)))
    said("falls", made, begin)
    words = ["render", traces, "--out", folder / "clips", "--tail", options.tail, "--workers", options.workers]
    done = daemon.command(*words, *(["--stems"] if options.stems else []), check=False)
    print(done.stdout + done.stderr, end="")
    return done.returncode


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="clips")
    parser.add_argument("--bodies", type=int, default=3, help="bodies in each fall")
    parser.add_argument("--seconds", type=float, default=1.5, help="simulated time of each fall")
    parser.add_argument("--tail", type=float, default=0.5, help="time to render after the last contact, s")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--stems", action="store_true", help="write the sound of each body alone, too")
    parser.add_argument("--workers", type=int, default=min(os.cpu_count() or 1, 8))
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--out", type=pathlib.Path, help="a folder; BUILD/examples/clips unless named")
    options = parser.parse_args()
    options.build = options.build.resolve()
    sys.path[:0] = [str(options.build / "client_sdk/python"), str(ROOT / "client_sdk/examples/falls"),
                    str(ROOT / "client_sdk/python"), str(ROOT / "tests/integration")]
    os.environ.update(CARILLON_BIN_DIR=str(options.build / "bin"), CARILLON_BUILD_DIR=str(options.build))
    from daemon import Daemon  # needs the paths above
    folder = (options.out or options.build / "examples/clips").resolve()
    (folder / "models").mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="carillon-") as name:
        # The models stay; the socket's path must be short.
        pathlib.Path(name, "data").symlink_to(folder / "models")
        daemon = Daemon(name)
        try:
            return make(daemon, folder, options)
        finally:
            daemon.stop()


if __name__ == "__main__":
    sys.exit(main())
