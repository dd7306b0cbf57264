# SPDX-License-Identifier: Apache-2.0
"""Carillon beside CalculiX on the same mesh: frequencies, consistent mass.

CalculiX integrates mass with the points of the stiffness: one in a C3D4, four in a C3D10, which is a degree too
low for the product of two shape functions. So Carillon's solver is given that mass matrix, and its own
exact one beside it to show what the difference makes.
"""

import subprocess
import time

import numpy
import scipy.sparse

import bench
import bodies
import compare
import solutions

MAX_DIFFERENCE = 1e-4

BODIES = [
    compare.Body("chime", lambda: bodies.tube(.505, 24, 80), "linear", "consistent", compare.ALUMINIUM),
    compare.Body("chime", lambda: bodies.tube(.505, 16, 50), "quadratic", "consistent", compare.ALUMINIUM),
    compare.Body("bunny", lambda: bodies.bunny(.08, .08 / 28), "linear", "consistent", compare.CERAMIC),
    compare.Body("bunny", lambda: bodies.bunny(.08, .08 / 21), "quadratic", "consistent", compare.CERAMIC),
]

NODES = {"linear": 4, "quadratic": 10}
EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]  # of nodes 5 to 10, with both programs
A, B = (5 + 3 * 5**.5) / 20, (5 - 5**.5) / 20
POINTS = {"linear": [[.25] * 4], "quadratic": numpy.full((4, 4), B) + (A - B) * numpy.eye(4)}


def read_mesh(folder, body):
    nodes = numpy.fromfile(folder / "nodes").reshape(-1, 3)
    return nodes, numpy.fromfile(folder / "elements", dtype=numpy.int32).reshape(-1, NODES[body.element])


def write_input(path, folder, body, count):
    nodes, elements = read_mesh(folder, body)
    young, poisson, density = body.material
    with open(path, "w", encoding="ascii") as file:
        file.write("*NODE, NSET=ALL\n")
        # CalculiX reads twenty characters of a number.
        for i, (x, y, z) in enumerate(nodes, 1):
            file.write(f"{i},{x:.13g},{y:.13g},{z:.13g}\n")
        file.write(f"*ELEMENT, TYPE=C3D{NODES[body.element]}, ELSET=BODY\n")
        for i, element in enumerate(elements + 1, 1):
            file.write(f"{i},{','.join(map(str, element))}\n")
        file.write(f"*MATERIAL, NAME=SOLID\n*ELASTIC\n{young},{poisson}\n*DENSITY\n{density}\n"
                   "*SOLID SECTION, ELSET=BODY, MATERIAL=SOLID\n"
                   f"*STEP\n*FREQUENCY\n{count}\n*END STEP\n")


def shape_functions(element, barycentric):
    corners = numpy.asarray(barycentric)
    if element == "linear":
        return corners
    edges = [4 * corners[i] * corners[j] for i, j in EDGES]
    return numpy.concatenate([corners * (2 * corners - 1), edges])


def write_their_mass(folder, body):
    """In place of M: the mass matrix by CalculiX's integration."""
    nodes, elements = read_mesh(folder, body)
    corners = nodes[elements[:, :4]]
    volumes = numpy.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    at_points = [shape_functions(body.element, point) for point in POINTS[body.element]]
    unit = sum(numpy.outer(n, n) for n in at_points) / len(at_points)
    values = body.material[2] * volumes[:, None, None] * unit
    rows = numpy.repeat(elements, elements.shape[1], axis=1).ravel()
    columns = numpy.tile(elements, (1, elements.shape[1])).ravel()
    mass = scipy.sparse.coo_matrix((values.ravel(), (rows, columns)), shape=(len(nodes),) * 2).tocsc()
    lower = scipy.sparse.tril(scipy.sparse.kron(mass, numpy.eye(3))).tocsc()
    lower.sort_indices()
    lower.indptr.astype(numpy.int32).tofile(folder / "M.start")
    lower.indices.astype(numpy.int32).tofile(folder / "M.row")
    lower.data.tofile(folder / "M.value")


def read_frequencies(path):
    """Hz, from the table "EIGENVALUE OUTPUT": number, eigenvalue, rad/s, Hz, imaginary part."""
    frequencies = []
    for line in path.read_text().splitlines():
        words = line.split()
        if len(words) == 5 and words[0].isdigit():
            frequencies.append(float(words[3]))
        elif frequencies and words:
            break
    return numpy.array(frequencies)


def solve(folder, options, environment):
    """Carillon's frequencies in Hz, and seconds."""
    times = compare.run([options.build / "tests/matrices_benchmark", "solve", folder, compare.HIGH_HZ, 1],
                        environment)
    K, M = solutions.read_symmetric(folder / "K"), solutions.read_symmetric(folder / "M")
    checked = solutions.check(folder, K, M, compare.LOW_HZ, compare.HIGH_HZ)
    return checked.frequencies_hz, times["seconds"]


def difference(ours, theirs):
    count = min(len(ours), len(theirs))
    return abs(ours[:count] / theirs[:count] - 1).max()


def compare_on(body, folder, options, environment):
    compare.make_matrices(body, folder, options.build, environment)
    exact, _ = solve(folder, options, environment)
    write_their_mass(folder, body)
    ours, our_seconds = solve(folder, options, environment)
    write_input(folder / "body.inp", folder, body, len(ours) + 6)
    before = time.perf_counter()
    subprocess.run(["ccx", "-i", "body"], cwd=folder, env=environment, check=True,
                   stdout=subprocess.DEVNULL)
    seconds = time.perf_counter() - before
    theirs = read_frequencies(folder / "body.dat")[6:]
    complete = len(theirs) == len(ours)
    worst = difference(ours, theirs)
    verdict = "" if complete and worst <= MAX_DIFFERENCE else " (too large)"
    bench.print_row(f"{body.name}, {body.element}", len(read_mesh(folder, body)[0]), len(ours), f"{ours[0]:.3f}",
                    f"{theirs[0]:.3f}", f"{worst:.1e}{verdict}", f"{difference(exact, theirs):.1e}",
                    f"{our_seconds:.2f}", f"{seconds:.2f}")


def compare_frequencies(options, folder, environment):
    bench.print_head("body", "nodes", "modes", "first, Carillon Hz", "first, CalculiX Hz",
                     "largest difference of any", "with exact mass", "Carillon s", "CalculiX s")
    for number, body in enumerate(BODIES):
        slow = body is BODIES[-1] and not options.full
        if slow or (options.only and body.name not in options.only):
            continue
        place = folder / str(number)
        place.mkdir()
        compare_on(body, place, options, environment)
