#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the pictures of ../benchmarks.md from its figures into this folder."""

import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = pathlib.Path(__file__).resolve().parent

# CPU seconds of one thread: Carillon, SLEPc + MUMPS.
SOLVERS = {"chime,\nlinear": (1.15, 5.08), "hollow\nbunny": (11.9, 111.7), "solid\nbunny": (12.9, 107.4),
           "chime,\nquadratic": (4.74, 27.0)}
# Nodes, CPU seconds.
GROWTH = {"tube": [(18816, 2.8), (60120, 9.6), (150048, 27.1), (300000, 60.3), (1099496, 569.7)],
          "solid": [(9108, 4.7), (19986, 13.1), (78949, 84.5), (313811, 881.3)]}
# Modes that one core renders in real time, relative to scsynth's Klank.
MIXER = {"Klank": 1, "Carillon, struck in\nevery block, AVX2": 13.3,
         "Carillon, struck in\nevery block, AVX-512": 21.4, "Carillon,\nringing freely": 70.6}


def save(name):
    plt.savefig(HERE / f"{name}.png", dpi=90, bbox_inches="tight")
    plt.close()


def solvers():
    _, axes = plt.subplots(figsize=(6.4, 3))
    for i, who in enumerate(("Carillon", "SLEPc + MUMPS")):
        places = [body + 0.4 * (i - 0.5) for body in range(len(SOLVERS))]
        bars = axes.bar(places, [row[i] for row in SOLVERS.values()], 0.36, label=who)
        axes.bar_label(bars, [f"{row[i]:g}" for row in SOLVERS.values()], fontsize=7)
    axes.set_xticks(range(len(SOLVERS)), SOLVERS)
    axes.set_yscale("log")
    axes.set_ylabel("CPU seconds")
    axes.legend(fontsize=8)
    save("solvers")


def growth():
    _, axes = plt.subplots(figsize=(6.4, 3))
    for body, rows in GROWTH.items():
        axes.loglog(*zip(*rows), "o-", label=body)
    axes.set_xlabel("nodes")
    axes.set_ylabel("CPU seconds")
    axes.grid(alpha=0.3, which="both")
    axes.legend()
    save("growth")


def mixer():
    _, axes = plt.subplots(figsize=(6.4, 2.2))
    bars = axes.barh(list(MIXER), list(MIXER.values()))
    axes.bar_label(bars, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("modes a core in real time, Klank = 1")
    save("mixer")


if __name__ == "__main__":
    for draw in (solvers, growth, mixer):
        draw()
