# SPDX-License-Identifier: Apache-2.0
"""Which modes of two meshes of one body are the same: those whose shapes agree on the surface."""

import numpy
from scipy import optimize, spatial

SAMPLES = 400
# Frequencies of one mode on two meshes differ by less than this, relatively, wherever an error is worth a look.
FURTHEST = 0.5
# Modes this close are a degenerate pair, whose shapes may turn into each other.
DEGENERATE = 2e-3
# Of a shape's squared norm, what the counterpart and its degenerate partner must have in common with it.
ALIKE = 0.8


def sampled(arrays, vertices):
    """The shapes at these vertices, of norm one: (3 times the vertices) by the modes."""
    shapes = arrays["shapes"][vertices].astype(float)
    shapes = shapes.reshape(-1, shapes.shape[-1])
    return shapes / numpy.linalg.norm(shapes, axis=0)


def pairs(ours, finer):
    """Indices of the modes of both models that are the same. A mode without a clear counterpart is in no pair."""
    chosen = numpy.random.default_rng(1).permutation(len(ours["vertices"]))[:SAMPLES]
    _, nearest = spatial.cKDTree(finer["vertices"]).query(ours["vertices"][chosen])
    alike = (sampled(ours, chosen).T @ sampled(finer, nearest))**2
    frequency, other = numpy.sqrt(ours["eigenvalues"]), numpy.sqrt(finer["eigenvalues"])
    alike[abs(numpy.log(frequency[:, None] / other[None, :])) > FURTHEST] = 0
    mine, theirs = optimize.linear_sum_assignment(alike, maximize=True)
    together = [alike[i, abs(other / other[j] - 1) < DEGENERATE].sum() for i, j in zip(mine, theirs)]
    clear = numpy.array(together) > ALIKE
    return mine[clear], theirs[clear]
