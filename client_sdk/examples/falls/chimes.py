# SPDX-License-Identifier: Apache-2.0
"""The example of the six wind chimes in a gust, which the program carillon-wind-chimes simulates."""

import math
import subprocess

import carillon
import falls

NOTES = ("D3", "E3", "G3", "A4", "B4", "D4")
CIRCLE_M, EXTENT_M, SECONDS = 0.062, 0.4, 8


def record(client, trace, folder, *, seconds, build):
    """Leaves the contact trace of the chimes, each in its place on the circle on which they hang."""
    subprocess.run([build / "bin/carillon-wind-chimes", "meshes", folder], check=True)
    models = [client.create_model(str(folder / f"{note}.obj"), "chime_aluminum", label=note) for note in NOTES]
    play(trace, [model.name for model in models], seconds=seconds, build=build)
    recorded = carillon.Trace.read(trace)
    for number, chime in enumerate(recorded.objects):
        angle = 2 * math.pi * number / len(NOTES)
        at = (CIRCLE_M * math.cos(angle), CIRCLE_M * math.sin(angle), 0)
        chime.pose.CopyFrom(carillon.contacts.to_pose((at, falls.about((0, 0, 1), 0))))
    recorded.write(trace)


def play(trace, models, *arguments, seconds, build):
    words = [build / "bin/carillon-wind-chimes", "play", "--offline", "--trace", trace, "--seconds", seconds or SECONDS,
             *arguments]
    subprocess.run([*map(str, words), *models], check=True, stdout=subprocess.DEVNULL)


def poses(folder, *, seconds, build):
    """The steps of the same simulation, with the poses of all bodies of `scene`."""
    trace = folder / "poses.contacts"
    play(trace, ["modalModels/unused"] * len(NOTES), "--picture", seconds=seconds, build=build)
    steps = carillon.Trace.read(trace).steps
    trace.unlink()
    return steps


def scene():
    """What is seen: the tubes, the clapper and the sail."""
    tubes = [{"name": note, "mesh": f"{note}.obj", "shape": {}, "material": "chime_aluminum"} for note in NOTES]
    clapper = {"name": "clapper", "shape": {"ball": {"radius_m": 0.03}}, "material": "wood"}
    sail = {"name": "sail", "shape": {"boxes": [{"sides_m": [0.09, 0.001, 0.09]}]}, "material": "wood"}
    return {"bodies": [*tubes, clapper, sail], "extent_m": EXTENT_M, "look_at_m": (0, 0, -0.45),
            "camera_m": (0.35, -1.3, -0.25)}
