#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""scipy_peer.py default|symmetric FOLDER COUNT SHIFT TOLERANCE: eigsh, as its documentation has it, or with
SuperLU told that the matrix is symmetric."""

import json
import pathlib
import sys
import time

import scipy.sparse.linalg

import solutions


def solve(kind, K, M, count, shift, tolerance):
    options = {}
    if kind == "symmetric":
        factor = scipy.sparse.linalg.splu(
            (K - shift * M).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0,
            options={"SymmetricMode": True})
        options["OPinv"] = scipy.sparse.linalg.LinearOperator(K.shape, factor.solve)
    return scipy.sparse.linalg.eigsh(K, count, M, sigma=shift, tol=tolerance, **options)


def main():
    kind, folder, count, shift, tolerance = sys.argv[1:]
    folder = pathlib.Path(folder)
    K, M = solutions.read_symmetric(folder / "K"), solutions.read_symmetric(folder / "M")
    cpu, wall = time.process_time(), time.perf_counter()
    eigenvalues, shapes = solve(kind, K, M, int(count), float(shift), float(tolerance))
    print(json.dumps({"cpu_seconds": time.process_time() - cpu,
                      "seconds": time.perf_counter() - wall}))
    solutions.write_modes(folder, eigenvalues, shapes)


if __name__ == "__main__":
    main()
