# SPDX-License-Identifier: Apache-2.0
"""The modes of a free elastic sphere in closed form (Lamb 1882; Eringen and Suhubi, Elastodynamics II, 8.14)."""

import numpy
import scipy.optimize
from scipy.special import spherical_jn as bessel

STEP = .01
MOST_DEGREE = 16


def torsional(degree, eta):
    return (degree - 1) * bessel(degree, eta) - eta * bessel(degree + 1, eta)


def spheroidal(degree, eta, poisson):
    """Radial and tangential stress of the potentials of compression and of shear: their determinant."""
    xi = eta * numpy.sqrt((1 - 2 * poisson) / (2 * (1 - poisson)))
    squares = degree * (degree - 1) - eta**2 / 2
    radial = squares * bessel(degree, xi) + 2 * xi * bessel(degree + 1, xi)
    if degree == 0:
        return radial
    radial_shear = degree * (degree + 1) * torsional(degree, eta)
    tangential = (degree - 1) * bessel(degree, xi) - xi * bessel(degree + 1, xi)
    tangential_shear = (degree**2 - 1 - eta**2 / 2) * bessel(degree, eta) + eta * bessel(degree + 1, eta)
    return radial * tangential_shear - radial_shear * tangential


def roots(function, most):
    at = numpy.arange(.5, most, STEP)
    signs = numpy.sign(function(at))
    return [scipy.optimize.brentq(function, at[i], at[i + 1]) for i in numpy.flatnonzero(signs[1:] != signs[:-1])]


def etas(poisson, count):
    """The `count` lowest modes as omega R / c_t, each as often as it occurs."""
    most = 6.
    while True:
        found = []
        for degree in range(MOST_DEGREE):
            found += roots(lambda eta, n=degree: spheroidal(n, eta, poisson), most) * (2 * degree + 1)
            if degree > 0:
                found += roots(lambda eta, n=degree: torsional(n, eta), most) * (2 * degree + 1)
        if len(found) >= count:
            return numpy.sort(found)[:count]
        most *= 1.3
