# SPDX-License-Identifier: AGPL-3.0-or-later
"""Decomposes surfaces without and with --repair, and judges what came of it."""

import json
import pathlib
import subprocess
import tempfile
from collections import namedtuple

import ill_made_surfaces

# First natural frequencies of the sound bodies are the measure of all others: linear elements, so that a
# dense wrap is quick; they lock by several percent, and more on the sound bodies' coarser meshes.
OPTIONS = ["--material", "aluminum_6061", "--element", "linear", "--mass", "lumped", "--nodes", "4000"]
TOLERANCE = 0.06
TIME_LIMIT_S = 600

Verdict = namedtuple("Verdict", "outcome first_hz seconds warnings")


def decompose(program, content, form, options):
    """Outcome "model", a reason, or what must not be: "crash", "hang"."""
    with tempfile.TemporaryDirectory(prefix="carillon-surface-") as folder:
        mesh = pathlib.Path(folder) / f"surface.{form}"
        mesh.write_bytes(content)
        command = [program, mesh, "--out", pathlib.Path(folder) / "model", "--json", "--threads", "1",
                   *OPTIONS, *options]
        try:
            ended = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S,
                                   check=False)
        except subprocess.TimeoutExpired:
            return Verdict("hang", None, TIME_LIMIT_S, [])
    try:
        printed = json.loads(ended.stdout)
    except json.JSONDecodeError:
        return Verdict(f"crash ({ended.returncode})", None, 0, [])
    if "error" in printed:
        return Verdict(printed["error"]["reason"], None, 0, [printed["error"]["message"]])
    seconds = sum(phase["cpu_seconds"] for phase in printed["phases"])
    return Verdict("model", printed["modes"][0]["frequency_hz"], seconds, printed.get("warnings", []))


def sound_bodies_hz(program):
    bodies = {"bar": ill_made_surfaces.bar(), "ball": ill_made_surfaces.ball()}
    return {name: decompose(program, ill_made_surfaces.obj(part), "obj", []).first_hz
            for name, part in bodies.items()}


def fault(expected, verdict, sound_hz):
    """Why this is not what was expected, or None. A reason may be given by its beginning."""
    if expected in sound_hz or expected == "model":
        if verdict.outcome != "model":
            return f"expected a model: {' '.join(verdict.warnings)}"
        if expected in sound_hz and abs(verdict.first_hz / sound_hz[expected] - 1) > TOLERANCE:
            return f"first mode {verdict.first_hz:.1f} Hz, of the sound body {sound_hz[expected]:.1f}"
        return None
    if expected.startswith("MESH_") and verdict.outcome.startswith(expected):
        return None
    return f"expected {expected}"
