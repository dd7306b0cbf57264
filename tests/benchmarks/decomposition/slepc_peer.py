#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""slepc_peer.py FOLDER COUNT SHIFT TOLERANCE: Krylov-Schur, shift-invert, MUMPS' Cholesky factorization."""

import glob
import json
import pathlib
import sys
import time

import numpy

# Where Debian keeps the bindings, one folder for each kind of number.
sys.path[:0] = glob.glob("/usr/lib/*dir/*3.*/*-real/lib/python3/dist-packages")

import slepc4py  # noqa: E402  (after its path)

slepc4py.init([])

from petsc4py import PETSc  # noqa: E402  (after initialisation)
from slepc4py import SLEPc  # noqa: E402

import solutions  # noqa: E402


def to_petsc(matrix):
    rows = matrix.tocsr()
    result = PETSc.Mat().createAIJ(size=rows.shape, csr=(rows.indptr, rows.indices, rows.data))
    result.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    result.setOption(PETSc.Mat.Option.SPD, True)
    return result


def make_solver(K, M, count, shift, tolerance):
    solver = SLEPc.EPS().create()
    solver.setOperators(K, M)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    solver.setTarget(shift)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setDimensions(nev=count)
    solver.setTolerances(tol=tolerance)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    factorization = transform.getKSP()
    factorization.setType(PETSc.KSP.Type.PREONLY)
    factorization.getPC().setType(PETSc.PC.Type.CHOLESKY)
    factorization.getPC().setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
    return solver


def main():
    folder, count, shift, tolerance = sys.argv[1:]
    folder = pathlib.Path(folder)
    K = to_petsc(solutions.read_symmetric(folder / "K"))
    M = to_petsc(solutions.read_symmetric(folder / "M"))
    cpu, wall = time.process_time(), time.perf_counter()
    solver = make_solver(K, M, int(count), float(shift), float(tolerance))
    solver.solve()
    found = min(solver.getConverged(), int(count))
    vector = K.createVecRight()
    eigenvalues, shapes = [], []
    for i in range(found):
        eigenvalues.append(solver.getEigenpair(i, vector).real)
        shapes.append(vector.getArray().copy())
    print(json.dumps({"cpu_seconds": time.process_time() - cpu,
                      "seconds": time.perf_counter() - wall}))
    solutions.write_modes(folder, eigenvalues, numpy.array(shapes).T)


if __name__ == "__main__":
    main()
