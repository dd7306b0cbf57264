# SPDX-License-Identifier: Apache-2.0
"""The share of strangers' closed or nearly closed surfaces that end in a model with `--repair`.

The surfaces are all files of some Debian packages with models that carillon-precompute reads. Whether a surface is
closed or nearly so is decided here, by what assimp makes of the file, without any of Carillon's code: after vertices
in the same place are merged and triangles without area are left out,
  - it has at least 4 triangles, and all its coordinates are finite,
  - at most 5 % of its edges belong to one triangle only,
  - it is no flat sheet: it extends by more than 1e-4 of its length from the plane that fits it best.
"""

import collections
import json
import pathlib
import subprocess

import bench
import measured
import numpy

PACKAGES = ["assimp-testmodels", "openscad-testing-data", "glmark2-data"]
SUFFIXES = {".obj", ".ply", ".stl", ".off", ".glb", ".gltf"}
MATERIAL = "structural_steel"
LEAST_TRIANGLES, MOST_BOUNDARY, LEAST_THICKNESS = 4, .05, 1e-4
MOST_SECONDS, MOST_GIB, LEAST_SHARE = 300, 8, .95
# Words of an error's message that name what would help, where the error has no list of remedies.
REMEDIES = ("--repair", "--wall", "--accuracy", "--budget", "--unit", "--size", "--band", "--nodes", "--keep",
            "--format")
RECORD = numpy.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def model_files():
    files = []
    for package in PACKAGES:
        listed = subprocess.run(["dpkg", "-L", package], stdout=subprocess.PIPE, text=True, check=True).stdout
        paths = [pathlib.Path(line) for line in listed.splitlines()]
        files += [path for path in paths if path.suffix.lower() in SUFFIXES and path.is_file()]
    return sorted(set(files))


def read_triangles(path, folder):
    """Corners of the file's triangles, N by 3 by 3, or None where assimp reads none, or points or lines beside them:
    it writes these into an STL file as records of other lengths."""
    binary = folder / "triangles.stl"
    binary.unlink(missing_ok=True)
    try:
        subprocess.run(["assimp", "export", path, binary, "-fstlb", "-tri", "-ptv"], stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, timeout=120, check=False)
    except subprocess.TimeoutExpired:
        return None
    if not binary.is_file() or binary.stat().st_size < 84:
        return None
    content = binary.read_bytes()
    if len(content) != 84 + RECORD.itemsize * int.from_bytes(content[80:84], "little"):
        return None
    return numpy.frombuffer(content[84:], RECORD)["corners"].astype(float)


def why_not(corners):
    """Why a surface is not closed or nearly closed; empty where it is."""
    if corners is None or len(corners) == 0:
        return "assimp reads no triangles, or not only triangles"
    if not numpy.isfinite(corners).all():
        return "coordinates that are not finite"
    points, vertex = numpy.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    triangles = vertex.reshape(-1, 3)
    sides = corners[:, 1:] - corners[:, :1]
    triangles = triangles[numpy.linalg.norm(numpy.cross(sides[:, 0], sides[:, 1]), axis=1) > 0]
    if len(triangles) < LEAST_TRIANGLES:
        return "too few triangles"
    edges = numpy.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    uses = numpy.unique(edges, axis=0, return_counts=True)[1]
    if (uses == 1).mean() > MOST_BOUNDARY:
        return "open"
    centred = points - points.mean(axis=0)
    along = centred @ numpy.linalg.svd(centred, full_matrices=False)[2].T
    extent = numpy.ptp(along, axis=0)
    return "" if extent.min() > LEAST_THICKNESS * extent.max() else "a flat sheet"


def decide(path, folder, options, environment):
    """What is recorded about one file."""
    corners = read_triangles(path, folder)
    record = {"file": str(path), "left_out": why_not(corners)}
    if record["left_out"]:
        return record
    run = measured.precompute(path, ["--repair", "--material", MATERIAL], options, environment, MOST_SECONDS)
    error = run.report.get("error", {})
    message = error.get("message", "")
    remedy = bool(error.get("remedies")) or any(word in message for word in REMEDIES)
    return {**record, "triangles": len(corners), "verdict": run.verdict, "message": message, "remedy": remedy,
            "cpu_seconds": run.cpu_seconds, "wall_seconds": run.wall_seconds, "peak_gib": run.peak_gib,
            "nodes": run.report.get("nodes", 0), "modes": len(run.report.get("modes", []))}


def load(path):
    if path is None or not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def summarize(records):
    left_out = collections.Counter(r["left_out"] for r in records if r["left_out"])
    held = [r for r in records if not r["left_out"]]
    print(f"\n{len(records)} files; left out: " + ", ".join(f"{n} {why}" for why, n in left_out.most_common()))
    if not held:
        return
    models = sum(r["verdict"] == "model" for r in held)
    share = models / len(held)
    print(f"\n{models} of {len(held)} closed or nearly closed surfaces end in a model: {100 * share:.1f} %"
          + ("" if share >= LEAST_SHARE else f" (goal: {100 * LEAST_SHARE:g} %)"))
    print()
    bench.print_head("verdict", "files", "with a remedy named")
    for verdict, count in collections.Counter(r["verdict"] for r in held).most_common():
        remedies = sum(r["remedy"] for r in held if r["verdict"] == verdict)
        bench.print_row(verdict, count, "" if verdict == "model" else remedies)
    for name, unit, most in (("cpu_seconds", "CPU s", None), ("wall_seconds", "s", MOST_SECONDS),
                             ("peak_gib", "GiB", MOST_GIB)):
        worst = max(held, key=lambda r: r[name])
        over = "" if most is None else f"; {sum(r[name] > most for r in held)} over {most}"
        print(f"\nMost {unit}: {worst[name]:.2f}, {worst['file']}{over}")


def packages(options, folder, environment):
    """Every file in turn. With --results FILE each outcome is added to the file at once, and what it has is not
    computed again."""
    records = load(options.results)
    known = {r["file"] for r in records}
    bench.print_head("file", "triangles", "verdict", "nodes", "modes", "CPU s", "wall s", "peak GiB")
    for path in model_files():
        if str(path) in known or (options.only and path.name not in options.only):
            continue
        record = decide(path, folder, options, environment)
        records.append(record)
        if options.results:
            with open(options.results, "a", encoding="utf-8") as file:
                file.write(json.dumps(record) + "\n")
        if not record["left_out"]:
            bench.print_row(path.name, *(record[key] for key in ("triangles", "verdict", "nodes", "modes")),
                            f"{record['cpu_seconds']:.1f}", f"{record['wall_seconds']:.1f}",
                            f"{record['peak_gib']:.2f}")
    summarize(records)
