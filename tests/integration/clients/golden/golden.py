# SPDX-License-Identifier: Apache-2.0
"""The golden scene in Python: writes its trace, renders it, and writes the samples.

Usage: golden.py SERVER MODEL TRACE SAMPLES
"""

import sys

import carillon

STEP_S = 1 / 64


def make_trace(model):
    """Two bars, one twice as large, the other turned over: struck by wood, resting, sliding, pausing and colliding
    in slow motion."""
    trace = carillon.Trace(STEP_S, simulator="golden", frame="object")
    trace.add(model, "chime_aluminum", radiation="paper_coupling", label="low", size=2)
    trace.add(model, "chime_aluminum", radiation="paper_coupling", label="high", gain=0.5,
              pose=((1, 0, 0.5), (0, 0, 1, 0)))
    trace.step(0, impacts=carillon.Impacts(1, [(0, 0.008, 0.02)], [(0, 0.125, -0.25)], striker="wood"))
    for i in range(1, 17):
        trace.step(i * STEP_S, contacts=carillon.Contacts(
            [1, 2], [(0.125, 0.016, 0), (0.0625, 0, 0.01)], [(0, 0, 0.0625), (0, i / 256, -0.03125)], partners=[0, 9],
            travel_speeds=[0, 0.5], roughness_depth=0.25, irregularity_length=0.001, normals=[(0, 0, 1), (0, 0, 0)]))
    trace.step(0.25, time_scale=0)
    trace.step(0.5, time_scale=0.5, impacts=carillon.Impacts(
        1, [(0.25, 0, 0.01)], [(0, 0.5, 0)], durations=0.0009765625, time_offsets=0.0078125, second_objects=2,
        second_points=[(0, 0, 0)]))
    return trace


def main():
    server, model, trace_file, samples_file = sys.argv[1:]
    with carillon.connect(server) as c:
        trace = make_trace(model)
        trace.write(trace_file)
        c.render(trace, tail_s=0.5, channel_count=2).samples.astype("<f4").tofile(samples_file)


if __name__ == "__main__":
    main()
