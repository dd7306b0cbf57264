# SPDX-License-Identifier: Apache-2.0
"""The least time that this machine's arithmetic and memory allow for each stage of a decomposition, and the time
that the stage takes, on one thread.

The work is counted, not measured: multiply-adds of the factorization, and passes over its factor, which is read once
forward and once backward for each block of sixteen vectors of the basis and of the modes. The machine's peaks are those
of OpenBLAS' matrix product and of reading an array larger than every cache, measured in the same run.
"""

import subprocess
import time

import numpy as np

import compare

BLOCK = 16
RUNS = 7


def best_seconds(work):
    times = []
    for _ in range(RUNS):
        start = time.thread_time()
        work()
        times.append(time.thread_time() - start)
    return min(times)


def operations_per_second(kind):
    """Multiply-adds a second of the product of two square matrices."""
    n = 1536
    a = np.random.default_rng(1).random((n, n)).astype(kind)
    b, out = a.T.copy(), np.empty_like(a)
    return n**3 / best_seconds(lambda: np.matmul(a, b, out=out))


def bytes_per_second():
    a = np.ones(1 << 27, np.float32)  # 512 MiB
    return a.nbytes / best_seconds(a.max)


def floors(times, mode_count, machine):
    """The least seconds of each stage, and what limits it."""
    double, single, memory = machine
    n, basis, p = times["unknowns"], times["basis_size"], mode_count
    passes = 2 * (basis + p) / BLOCK
    solve = {"memory": passes * 4 * times["factor_entries"] / memory,
             "arithmetic": (passes * BLOCK * times["factor_entries"] + n * (basis * basis + basis * p)) / single}
    return {"count": ("arithmetic", times["factor_multiply_adds"] / double),
            "factor": ("arithmetic", times["factor_multiply_adds"] / single),
            "solve": max(((seconds, limit) for limit, seconds in solve.items()))[::-1],
            "verify": ("arithmetic", n * p * p / double)}


def print_rows(name, times, mode_count, machine):
    for stage, (limit, least) in floors(times, mode_count, machine).items():
        taken = times[f"{stage}_s"]
        print(f"| {name} | {stage} | {taken:.3f} | {least:.3f} | {limit} | {100 * least / taken:.0f} % |", flush=True)


def measure_machine(environment):
    """The peaks, by a process of its own, so that the environment's choice of kernels holds."""
    code = ("import roofline as r, numpy as np; "
            "print(r.operations_per_second(np.float64), r.operations_per_second(np.float32), r.bytes_per_second())")
    done = subprocess.run(["/usr/bin/python3", "-c", code], cwd=compare.HERE, env=environment, check=True,
                          stdout=subprocess.PIPE, text=True)
    return [float(word) for word in done.stdout.split()]


def roofline(options, folder, environment):
    machine = measure_machine(environment)
    double, single, memory = machine
    print(f"One thread: {2 * double / 1e9:.0f} GFlop/s in double, {2 * single / 1e9:.0f} in float, "
          f"{memory / 1e9:.1f} GB/s read.\n")
    print("| body | stage | CPU s | least s | limit | share |\n" + "| --- " * 6 + "|", flush=True)
    for body in compare.BODIES:
        if options.only and body.name not in options.only:
            continue
        place = folder / body.name
        place.mkdir()
        compare.make_matrices(body, place, options.build, environment)
        times = compare.run([options.build / "tests/matrices_benchmark", "solve", place, compare.HIGH_HZ, 1],
                            environment, max(3, body.runs))
        count = np.fromfile(place / "eigenvalues").size
        print_rows(f"{body.name}, {times['unknowns']:.0f} unknowns, {count} modes", times, count, machine)
