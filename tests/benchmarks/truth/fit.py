# SPDX-License-Identifier: Apache-2.0
"""Young's modulus and Poisson's ratio of a body, from the frequencies that it rings at."""

import dataclasses

import numpy
from scipy import optimize

# Rings and modes farther apart than this are no pair, at the beginning and when the material is fitted.
FAR, FITTED = 0.03, 0.01


@dataclasses.dataclass
class Fit:
    young_scale: float  # what Young's modulus must be multiplied by
    poisson_ratio: float
    error: float  # r.m.s. of the relative errors of the pairs
    pairs: list  # of (ring, mode), both Hz, the mode with the fitted material


def match(rings_hz, modes_hz, limit):
    """Pairs of indices of rings and modes, each used once, with the least sum of distances in the logarithm."""
    distance = numpy.abs(numpy.log(numpy.asarray(rings_hz)[:, None] / numpy.asarray(modes_hz)[None, :]))
    pairs = zip(*optimize.linear_sum_assignment(numpy.minimum(distance, limit)))
    return [(i, j) for i, j in pairs if distance[i, j] < limit]


class Material:
    """Frequencies of all modes over Poisson's ratio: a parabola through three probes for each mode. Modes are told
    apart by their order, so that all probes must lie on one side of a crossing."""

    def __init__(self, modes_of, probes):
        count = min(len(modes_of(nu)) for nu in probes)
        logarithms = [numpy.log(modes_of(nu)[:count]) for nu in probes]
        self.curves = numpy.polyfit(probes, logarithms, 2)

    def logarithms(self, nu):
        return self.curves[0] * nu**2 + self.curves[1] * nu + self.curves[2]


def fit_material(rings_hz, modes_of, probes):
    """The Fit of the rings. `modes_of(nu)` gives the modes' frequencies at one modulus; frequencies grow with the
    root of the modulus. First the modulus alone is fitted, with the middle probe and the nearest pairs, then both.
    Rings that no mode is near, of a support or of the room, are left out."""
    cache = {nu: modes_of(nu) for nu in probes}
    material = Material(cache.get, probes)
    rings = numpy.log(rings_hz)
    shift, nu = 0.0, probes[1]  # half the logarithm of the modulus
    for limit in (FAR, FAR, FAR, FITTED, FITTED):
        pairs = match(rings_hz, numpy.exp(material.logarithms(nu) + shift), limit)
        i, j = (numpy.array(side) for side in zip(*pairs))

        def errors(unknowns, i=i, j=j):
            return material.logarithms(unknowns[1])[j] + unknowns[0] - rings[i]

        shift, nu = optimize.least_squares(errors, (shift, nu), loss="soft_l1", f_scale=0.001).x
    modes_hz = numpy.exp(material.logarithms(nu) + shift)
    pairs = [(float(rings_hz[a]), float(modes_hz[b])) for a, b in match(rings_hz, modes_hz, FITTED)]
    error = numpy.sqrt(numpy.mean([(mode / ring - 1)**2 for ring, mode in pairs]))
    return Fit(float(numpy.exp(2 * shift)), float(nu), float(error), pairs)
