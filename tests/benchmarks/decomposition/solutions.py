# SPDX-License-Identifier: Apache-2.0
"""Matrices and modes as the programs of this benchmark hand them on, and one check for everybody's modes."""

import dataclasses
import math

import numpy
import scipy.sparse


def read_lower(path):
    start = numpy.fromfile(f"{path}.start", dtype=numpy.int32)
    row = numpy.fromfile(f"{path}.row", dtype=numpy.int32)
    value = numpy.fromfile(f"{path}.value")
    return scipy.sparse.csc_matrix((value, row, start), shape=(len(start) - 1, len(start) - 1))


def read_symmetric(path):
    lower = read_lower(path)
    return (lower + scipy.sparse.tril(lower, -1).T).tocsc()


def write_modes(folder, eigenvalues, shapes):
    """`shapes`: a column a mode."""
    numpy.asarray(eigenvalues, dtype=float).tofile(folder / "eigenvalues")
    numpy.asarray(shapes, dtype=float).T.tofile(folder / "shapes")


@dataclasses.dataclass
class Checked:
    """The modes of one program between two frequencies."""
    frequencies_hz: numpy.ndarray
    shapes: numpy.ndarray
    max_residual: float
    max_orthogonality_error: float


def check(folder, K, M, low_hz, high_hz):
    """Reads modes and measures |K x - Lambda M x| / |Lambda M x| with Lambda the Rayleigh quotient of x,
    and the largest |x_i^T M x_j - delta_ij|, in double precision whatever the program used."""
    eigenvalues = numpy.fromfile(folder / "eigenvalues")
    shapes = numpy.fromfile(folder / "shapes").reshape(len(eigenvalues), -1).T
    hertz = numpy.sqrt(numpy.maximum(eigenvalues, 0)) / (2 * math.pi)
    kept = numpy.flatnonzero((hertz >= low_hz) & (hertz <= high_hz))
    kept = kept[numpy.argsort(hertz[kept])]
    x = numpy.ascontiguousarray(shapes[:, kept])
    mass = M @ x
    x_norms = numpy.sqrt(numpy.einsum("ij,ij->j", x, mass))
    x, mass = x / x_norms, mass / x_norms
    elastic = K @ x
    quotient = numpy.einsum("ij,ij->j", x, elastic)
    residual = numpy.linalg.norm(elastic - mass * quotient, axis=0) / numpy.linalg.norm(
        mass * quotient, axis=0)
    gram = x.T @ mass - numpy.eye(len(kept))
    return Checked(hertz[kept], x, residual.max(initial=0), numpy.abs(gram).max(initial=0))
