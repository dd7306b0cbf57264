# SPDX-License-Identifier: Apache-2.0
"""The example of the six wind chimes in a gust, which the program carillon-wind-chimes simulates."""

import math
import subprocess

import carillon
import falls

NOTES = ("D3", "E3", "G3", "A4", "B4", "D4")
ENGINES = ("bullet", "ode")
CIRCLE_M, EXTENT_M, SECONDS = 0.062, 0.4, 8


def record(client, engine, trace, folder, *, seconds, build):
    """Leaves the contact trace of the chimes, each in its place on the circle on which they hang."""
    program = build / "bin/carillon-wind-chimes"
    subprocess.run([program, "meshes", folder], check=True)
    models = [client.create_model(str(folder / f"{note}.obj"), "chime_aluminum", label=note) for note in NOTES]
    words = [program, "play", "--offline", "--engine", engine, "--trace", trace, "--seconds", str(seconds or SECONDS)]
    subprocess.run([*words, *(model.name for model in models)], check=True, stdout=subprocess.DEVNULL)
    recorded = carillon.Trace.read(trace)
    for number, chime in enumerate(recorded.objects):
        angle = 2 * math.pi * number / len(NOTES)
        at = (CIRCLE_M * math.cos(angle), CIRCLE_M * math.sin(angle), 0)
        chime.pose.CopyFrom(carillon.contacts.to_pose((at, falls.about((0, 0, 1), 0))))
    recorded.write(trace)
